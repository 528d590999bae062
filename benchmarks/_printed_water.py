"""Water by the Tables 1, 2 and 5 that Gutierrez et al. (2008) print, one element at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.closed_form.closed_form import solve_closed_form
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, reduction
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.spectra.sensor import standard_observer
from ..uw_spectral.surface.refraction import sun_travel_direction
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.inelastic_processes import inelastic_processes
from ..uw_spectral.water.phase import BandPhase, Isotropic, PetzoldAverage, PhaseFunction
from ..uw_spectral.water.pure_water import molecular_scattering
from ..validation.gutierrez import particle_scattering_Gordon1983, raman_coefficient_Gutierrez2008
from ..validation.inelastic_light import solve_inelastic
from . import gutierrez_figures as figures

Array = NDArray[np.float64]

WAVELENGTHS = (380.0, 440.0, 500.0, 550.0, 610.0, 670.0, 720.0, 780.0)
A_WATER = (0.00022, 0.000145, 0.000257, 0.000638, 0.00289, 0.0043, 0.01169, 0.0236)
"""Table 1, absorption of water in 1/cm."""
A_PHYTOPLANKTON = (0.025, 0.035, 0.02, 0.01, 0.007, 0.015, 0.001, 0.0001)
"""Table 1, m² per mg of chlorophyll."""
B_PARTICLES = (0.1125, 0.09, 0.0825, 0.075, 0.0685, 0.0635, 0.061, 0.059)
"""Table 2, scattering of detritus and minerals, 1/m."""
QUANTUM_YIELD = 0.1
"""Table 5, of phytoplankton."""
_MOLECULES = 16.06  # factor of Equation 9 on the scattering at 90°, put on the whole scattering
_MIDDLE = 0.4  # brightest channel of colours that are compared


@dataclass(frozen=True, eq=False)
class Model:
    """Absorption and scattering by part, and where each part scatters to."""

    absorptions: dict[str, Array]
    scatterings: dict[str, Array]
    phases: dict[str, PhaseFunction]

    def phase(self) -> BandPhase:
        """Mixture of the parts that scatter."""
        parts = {name: b for name, b in self.scatterings.items() if b.any()}
        weights = np.stack(list(parts.values()))
        chosen = tuple(self.phases[name] for name in parts)
        return BandPhase(chosen, weights / weights.sum(axis=0))

    def level_radiance(self) -> Array:
        """Elastic radiance of the deep water looking level, closed form, per nm."""
        a, b = (np.sum(list(x.values()), axis=0) for x in (self.absorptions, self.scatterings))
        phase = self.phase()
        field = figures.light_field(figures.VISIBLE, a, b, phase)
        sun = sun_travel_direction(figures.SUN_ZENITH, 90.0)
        solved = solve_closed_form(field, phase, figures.DEPTH, sun)
        return solved.radiance(np.array([figures.DEPTH]), figures.LEVEL)


Element = Callable[[Model, Constituents], Model]


def ours(water: Constituents) -> Model:
    """Model of the add-on, without inelastic light."""
    nm = figures.VISIBLE.centres
    return Model(water.absorptions(nm), water.scatterings(nm), water.phases)


def _table(values: tuple[float, ...]) -> Array:
    return np.interp(figures.VISIBLE.centres, WAVELENGTHS, values)


def _with(model: Model, field: str, **parts: object) -> Model:
    return dataclasses.replace(model, **{field: {**getattr(model, field), **parts}})


def _absorption_of_water(model: Model, _: Constituents) -> Model:
    return _with(model, "absorptions", water=100.0 * _table(A_WATER))


def _absorption_of_phytoplankton(model: Model, water: Constituents) -> Model:
    printed = water.chlorophyll * _table(A_PHYTOPLANKTON)
    return _with(model, "absorptions", phytoplankton=printed)


def _molecules(model: Model, _: Constituents) -> Model:
    nm = figures.VISIBLE.centres
    b = _MOLECULES * molecular_scattering(nm, "smith_baker_1981_sea")
    return _with(model, "scatterings", water=b)


def _phytoplankton(model: Model, water: Constituents) -> Model:
    b = particle_scattering_Gordon1983(water.chlorophyll, figures.VISIBLE.centres)
    return _with(model, "scatterings", phytoplankton=b)


def _isotropic(model: Model, _: Constituents) -> Model:
    return _with(model, "phases", phytoplankton=Isotropic())


def _particles(model: Model, water: Constituents) -> Model:
    if not water.detritus:
        return model
    model = _with(model, "scatterings", detritus=_table(B_PARTICLES))
    return _with(model, "phases", detritus=PetzoldAverage())


def _everything(model: Model, water: Constituents) -> Model:
    for element in list(ELEMENTS.values())[:-1]:
        model = element(model, water)
    return model


ELEMENTS: dict[str, Element] = {
    "Table 1: absorption by water (Smith & Baker)": _absorption_of_water,
    "Table 1: absorption by phytoplankton, C a\\*": _absorption_of_phytoplankton,
    "Eq. 9: molecules scatter 16.06 times": _molecules,
    "Eq. 11: b of phytoplankton, 0.30 C^0.62 550/λ": _phytoplankton,
    "phytoplankton scatters evenly (1/π, made 1/4π)": _isotropic,
    "Table 2: detritus and minerals scatter too": _particles,
    "all of these": _everything,
}
"""What is printed, each instead of ours."""


@dataclass(frozen=True)
class Change:
    """Open water with a printed element: luminance over ours, ΔE2000 of equally bright colours."""

    brightness: float
    delta_e: float


def compare(water: Constituents, element: Element) -> Change:
    """Level open water at 5 m with a printed element beside ours; colours equally bright."""
    model = ours(water)
    radiances = np.stack([model.level_radiance(), element(model, water).level_radiance()])
    light = parse_illuminant("clear-sky", figures.SUN_ZENITH)
    develop = reduction(standard_observer(), figures.VISIBLE, light)
    rgb = np.maximum(develop.apply(radiances), 0.0)
    rgb = _MIDDLE * rgb / rgb.max(axis=1, keepdims=True)
    observer = standard_observer().response_in(figures.VISIBLE)[1]
    brightness = radiances @ observer
    delta_e = delta_e_CIE2000_images(rgb[1], rgb[0])
    return Change(float(brightness[1] / brightness[0]), float(delta_e))


def gaining_bands(water: Constituents) -> float:
    """Share of bands in which phytoplankton of phase 1/π gives more light than is lost."""
    model = _everything(ours(water), water)
    a = np.sum(list(model.absorptions.values()), axis=0)
    return float(np.mean(3.0 * model.scatterings["phytoplankton"] > a))


def inelastic_shares(water: Constituents) -> dict[str, float]:
    """Share of light of changed wavelength in the luminance of level open water at 5 m."""
    bands, excitation = figures.VISIBLE, figures.EXCITATION
    fields = [
        figures.light_field(x, water.absorption(nm), water.scattering(nm), water.phase(nm))
        for x in (excitation, bands)
        for nm in (x.centres,)
    ]
    absorbing_raman = raman_coefficient_Gutierrez2008(excitation.centres)
    observer = standard_observer().response_in(bands)[1]
    elastic = float(observer @ ours(water).level_radiance())

    def share(name: str, *, printed: bool) -> float:
        quantum_yield = {"quantum_yield": QUANTUM_YIELD} if printed else {}
        found = inelastic_processes(water, excitation, bands, (name,), **quantum_yield)
        if printed and name == "raman":
            found = tuple(dataclasses.replace(p, coefficient=absorbing_raman) for p in found)
        light = solve_inelastic(found, fields[0], excitation, fields[1], bands)
        extra = float(observer @ light.radiance(figures.DEPTH, figures.LEVEL))
        return extra / (extra + elastic)

    return {
        f"{name}, {'printed' if printed else 'ours'}": share(name, printed=printed)
        for name in ("raman", "chlorophyll")
        for printed in (False, True)
    }
