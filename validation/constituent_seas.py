"""Waters of constituents: colours, Kd, inelastic light, against what others published."""

from __future__ import annotations

import itertools
import math
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import reduction, srgb_encode
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.spectra.sensor import parse_sensor
from ..uw_spectral.spectra.spectrum import Spectrum
from ..uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.diffuse_attenuation import Kd490_Morel2007, Kd_Lee2013
from ..uw_spectral.water.inelastic_processes import PROCESSES, inelastic_processes
from ..uw_spectral.water.kd_inversion import invert_Kd, water_of_chlorophyll
from ..uw_spectral.water.optical_properties import JERLOV_TYPES, Water
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import FournierForand, parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from .closed_form.closed_form import ClosedForm, solve_closed_form
from .closed_form.light_field import LightField, light_field_of
from .inelastic_light import InelasticLight, solve_inelastic
from .kd import Kd_Lee2005, jerlov_chlorophyll
from .monte_carlo import simulate

SUN_ZENITH = 30.0


VISIBLE = Bands.uniform(80, 380, 780)


EXCITATION = Bands.uniform(100, 300, 800)


DEPTH = 5.0


LEVEL = (1.0, 0.0, 0.0)


# Figure 2 of the paper: chlorophyll along its rows, detritus and CDOM (1/m) down its columns.
CHLOROPHYLL, DETRITUS_CDOM = (0.0, 0.01, 0.1, 1.0), ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1))


Kd_WAVELENGTHS = np.arange(400.0, 701.0, 25.0)


CASE1 = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Chlorophyll of the case 1 waters, mg/m³."""


MEASURED = np.array([412.0, 443.0, 490.0, 510.0, 555.0, 620.0, 670.0])
"""Wavelengths at which radiometers measure Kd, nm."""


SUNS = (0.0, 30.0, 50.0, 60.0, 70.0)


STREAMS = 16


_KD_STEPS = 8


@dataclass(frozen=True)
class Scene:
    """Deep bio-optical water under a clear sky, seen from a depth."""

    elastic: ClosedForm
    inelastic: InelasticLight

    def radiance(self, depth: float) -> tuple[np.ndarray, np.ndarray]:
        """Elastic and inelastic radiance of the water looking level, per nm."""
        return (
            self.elastic.radiance(np.array([depth]), LEVEL),
            self.inelastic.radiance(np.array([depth]), LEVEL),
        )


def particle_scattering_Gordon1983(chlorophyll: float, wavelengths: ArrayLike) -> np.ndarray:
    """Scattering of particles, 0.30 C^0.62 (550/λ), 1/m, as Gutierrez et al. (2008) print it.

    D. Gutierrez, F. J. Serón, A. Muñoz & O. Anson, Computer Graphics Forum 27(2), 547 (2008);
    H. R. Gordon & A. Morel, Lecture Notes 4, Springer (1983); the factor ranges from 0.12 to
    0.45 in nature.
    """
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    return 0.30 * chlorophyll**0.62 * 550.0 / nm


def column(
    bands: Bands, a: np.ndarray, b: np.ndarray, sun_zenith: float = SUN_ZENITH
) -> WaterColumn:
    """Deep water, flat surface, clear sky, the sun at a zenith angle in air, degrees."""
    sky = parse_illuminant("clear-sky", sun_zenith)
    transmitted = 1 - float(fresnel_reflectance(math.cos(math.radians(sun_zenith))))
    return WaterColumn(
        bands=bands,
        absorption=a,
        scattering=b,
        sun_irradiance=sky.direct_in(bands) * transmitted,
        sun_cosine=float(in_water_cosine(sun_zenith)),
        sun_direction=sun_travel_direction(sun_zenith, 90.0),
        sky_radiance=sky.diffuse_in(bands) / math.pi,
        floor_depth=math.inf,
        floor_reflectance=np.zeros(len(bands)),
        surface="flat",
        refractive_index=REFRACTIVE_INDEX,
    )


def light_field(bands: Bands, a: np.ndarray, b: np.ndarray, phase: BandPhase) -> LightField:
    """Light field of :func:`column`."""
    return light_field_of(column(bands, a, b), phase)


def scene(
    constituents: Constituents,
    depth: float = DEPTH,
    switched_on: tuple[str, ...] = PROCESSES,
) -> Scene:
    """Solve elastic and inelastic light of a water."""
    fields = []
    for bands in (EXCITATION, VISIBLE):
        nm = bands.centres
        phase = constituents.phase(nm)
        fields.append(
            light_field(bands, constituents.absorption(nm), constituents.scattering(nm), phase)
        )
    processes = inelastic_processes(constituents, EXCITATION, VISIBLE, switched_on)
    sun = sun_travel_direction(SUN_ZENITH, 90.0)
    return Scene(
        solve_closed_form(fields[1], phase, depth, sun),
        solve_inelastic(processes, fields[0], EXCITATION, fields[1], VISIBLE),
    )


def colour(radiance: np.ndarray, depth_white: np.ndarray) -> np.ndarray:
    """Return the sRGB of a radiance, scaled so that its brightest channel is 0.8.

    The eye is balanced for daylight, so the water keeps its colour.
    """
    to_rgb = reduction(
        parse_sensor("cie1931"), VISIBLE, parse_illuminant("clear-sky", SUN_ZENITH), depth_white
    )
    rgb = np.maximum(to_rgb.apply(radiance), 0.0)
    return srgb_encode(0.8 * rgb / rgb.max(axis=-1, keepdims=True))


def luminous_fractions(constituents: Constituents, depth: float = DEPTH) -> dict[str, float]:
    """Fraction of each process in the radiance, and of all in its luminance, looking level."""
    solved = {name: scene(constituents, depth, (name,)) for name in PROCESSES}
    extra = {name: each.inelastic.radiance(depth, LEVEL) for name, each in solved.items()}
    extra["all"] = sum(extra.values())
    total = next(iter(solved.values())).elastic.radiance(depth, LEVEL) + extra["all"]
    observer = parse_sensor("cie1931").sensitivity.at_or_zero(VISIBLE.centres)[:, 1]
    fractions = {
        name: float((light @ VISIBLE.widths) / (total @ VISIBLE.widths))
        for name, light in extra.items()
    }
    return fractions | {"all, luminance": float((extra["all"] @ observer) / (total @ observer))}


def kd_round_trip(photons: int = 0) -> dict[str, dict[str, np.ndarray]]:
    """Kd and a over published values, per Jerlov type, 400 to 700 nm.

    Keys: ``Lee 2005``, ``Lee 2013``, ``closed form`` and, if ``photons`` per band are given,
    ``Monte Carlo`` from the published a and b; ``a by inversion`` and ``b by
    inversion`` from the published Kd; ``case 1``: Kd of the case 1 water with
    the chlorophyll of the type, I to III; ``fitted``: Kd of
    :func:`fitted_constituents`. Kd is from the surface to 10 % of the light.
    """
    nm = Kd_WAVELENGTHS
    bands = Bands.at_wavelengths(nm)
    found: dict[str, dict[str, np.ndarray]] = {}
    for name in JERLOV_TYPES:
        water = Water.jerlov(name)
        a, b, Kd = water.a(nm), water.b(nm), water.Kd(nm)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DataWarning)
            phase = parse_phase("mixture").for_bands(b, molecular_scattering(nm))
        # The bb/b with which the types are drawn, and not that of the inversion's case 1 water.
        ratio = FournierForand().backscatter
        inverted = invert_Kd(Spectrum(nm, Kd, f"Kd of {name}"), SUN_ZENITH, ratio).water

        def three(
            prefix: str, a: np.ndarray, b: np.ndarray, phase: BandPhase, Kd: np.ndarray = Kd
        ) -> dict[str, np.ndarray]:
            water = column(bands, a, b)
            ratios = {
                "Lee 2005": Kd_Lee2005(a, phase.backscatter_ratio * b, SUN_ZENITH) / Kd,
                "Lee 2013": Kd_Lee2013(
                    a, phase.backscatter_ratio * b, phase.weights[0] * b / 2, SUN_ZENITH
                )
                / Kd,
                "closed form": kd_closed_form(light_field_of(water, phase), Kd) / Kd,
            }
            if photons:
                ratios["Monte Carlo"] = kd_monte_carlo(water, phase, Kd, photons) / Kd
            return {f"{prefix}{key}": value for key, value in ratios.items()}

        found[name] = three("", a, b, phase)
        found[name] |= {"a by inversion": inverted.a(nm) / a, "b by inversion": inverted.b(nm) / b}
        made_of = {"fitted, ": fitted_constituents(Kd)}
        if "C" not in name:
            made_of = {"case 1, ": Constituents.case1(jerlov_chlorophyll(name))} | made_of
        for prefix, sea in made_of.items():
            found[name] |= three(prefix, sea.absorption(nm), sea.scattering(nm), sea.phase(nm))
    return found


def fitted_constituents(Kd: np.ndarray) -> Constituents:
    """Chlorophyll, CDOM and minerals whose Kd by Lee et al. (2013) comes closest to this one."""
    from scipy.optimize import least_squares

    def made_of(amounts: np.ndarray) -> Constituents:
        chlorophyll, cdom, minerals = np.exp(amounts)
        return Constituents(chlorophyll, cdom=cdom, minerals=minerals)

    def off(amounts: np.ndarray) -> np.ndarray:
        sea, nm = made_of(amounts), Kd_WAVELENGTHS
        molecular = 0.5 * sea.scatterings(nm)["water"]
        found = Kd_Lee2013(sea.absorption(nm), sea.backscattering(nm), molecular, SUN_ZENITH)
        return np.log(found / Kd)

    bounds = np.log([[1e-3, 1e-4, 1e-4], [99.0, 20.0, 100.0]])
    return made_of(least_squares(off, np.log([0.5, 0.05, 0.05]), bounds=bounds).x)


def kd_monte_carlo(
    water: WaterColumn, phase: BandPhase, Kd: np.ndarray, photons: int
) -> np.ndarray:
    """Kd of the Monte Carlo between the surface and the depth where e^(-Kd y) is 10 %."""
    y = math.log(10) / Kd
    depths = np.unique(y)
    result = simulate(water, phase, [0.0, *depths], photons=photons * len(Kd))
    Ed, band = result.total.Ed.mean, np.arange(len(Kd))
    return np.log(Ed[0] / Ed[1 + np.searchsorted(depths, y), band]) / y


def kd_closed_form(field: LightField, Kd: np.ndarray) -> np.ndarray:
    """Kd of a light field between the surface and the depth where e^(-Kd y) is 10 %."""
    y = math.log(10) / Kd
    return np.log(field.Ed(0.0) / field.Ed(y)) / y


def kd_solved(sea: Constituents | Water, wavelengths: np.ndarray, sun_zenith: float) -> np.ndarray:
    """Kd of deep water by discrete ordinates, from the surface to the depth of 10 % light."""
    bands = Bands.at_wavelengths(wavelengths)
    nm = bands.centres
    if isinstance(sea, Water):
        a, b = sea.a(nm), sea.b(nm)
        phase = sea.phase_model.for_bands(b, molecular_scattering(nm))
    else:
        a, b, phase = sea.absorption(nm), sea.scattering(nm), sea.phase(nm)
    water = column(bands, a, b, sun_zenith)
    field = water.solved_field(phase, STREAMS, modes=1)
    Kd, band = water.absorption, np.arange(len(bands))
    for _ in range(_KD_STEPS):
        y = math.log(10) / Kd
        Ed = np.stack([field.Ed(depth) for depth in y.tolist()])[band, band]
        Kd = np.log(field.Ed(0.0) / Ed) / y
    return Kd


def Lee2005_over_solved() -> np.ndarray:
    """Kd by Lee et al. (2005) over the solved one, shape (suns, waters, wavelengths).

    Suns of their simulations; case 1 waters.
    """
    nm = MEASURED
    return np.array([
        [Kd_Lee2005(sea.absorption(nm), sea.backscattering(nm), zenith) / kd_solved(sea, nm, zenith)
         for sea in map(Constituents.case1, CASE1)]
        for zenith in (10.0, 30.0, 60.0)
    ])  # fmt: skip


@dataclass(frozen=True)
class Case1Row:
    """Kd(490) and b(550) of a case 1 water, 1/m: published, as ours was, and as it is."""

    chlorophyll: float
    published: float
    merged: float
    before: float
    by_lee: float
    solved: float
    measured: float
    scattering_before: float
    scattering: float


def case1_rows() -> list[Case1Row]:
    """Compare case 1 waters with Morel et al. (2007) and with what they were in version 0.1.0.

    ``published`` and ``merged`` are the two regressions of the paper; ``before`` and ``by_lee``
    are by Lee et al. (2005) and (2013) with the sun at 30°, ``solved`` by discrete ordinates
    with the sun at 45°, ``measured`` likewise of ``chl:C`` with the sun of its inversion, 30°.
    """
    rows = []
    nm = np.array([490.0, 550.0])
    for C in CASE1:
        sea = Constituents.case1(C)
        parts = sea.absorptions(nm)
        old_cdom = 0.2 * (0.00635 + 0.06 * C**0.65) * np.exp(-0.014 * (nm - 440.0))
        old_a = sum(parts.values()) - parts["cdom"] + old_cdom
        old_b, molecular = particle_scattering_Gordon1983(C, nm), molecular_scattering(nm)
        old_bb = 0.5 * molecular + sea.organic_backscatter * old_b
        by_lee = Kd_Lee2013(sea.absorption(nm), sea.backscattering(nm), 0.5 * molecular, SUN_ZENITH)
        rows.append(
            Case1Row(
                C,
                float(Kd490_Morel2007(C)),
                0.0166 + 0.0773 * C**0.6715,
                Kd_Lee2005(old_a, old_bb, SUN_ZENITH)[0],
                by_lee[0],
                kd_solved(sea, nm, 45.0)[0],
                kd_solved(water_of_chlorophyll(C), nm, SUN_ZENITH)[0],
                old_b[1],
                sea.scatterings(nm)["phytoplankton"][1],
            )
        )
    return rows


def inversion_round_trip() -> dict[float, dict[str, np.ndarray]]:
    """Invert Kd of light fields solved for case 1 waters, per sun zenith in degrees.

    Keys: ``a``, absorption found over that of the water, shape (waters, wavelengths); ``blind``,
    the same with bb/b 0.0183 and the sun taken at 30°, as in version 0.1.0; ``b``.
    """
    found = {}
    for zenith in SUNS:
        ratios: dict[str, list[np.ndarray]] = {"a": [], "blind": [], "b": []}
        for C in CASE1:
            sea = Constituents.case1(C)
            a, b = sea.absorption(MEASURED), sea.scattering(MEASURED)
            Kd = Spectrum(MEASURED, kd_solved(sea, MEASURED, zenith), f"Kd of case 1, {C:g} mg/m³")
            water = invert_Kd(Kd, zenith).water
            ratios["a"].append(water.a(MEASURED) / a)
            ratios["b"].append(water.b(MEASURED) / b)
            ratios["blind"].append(invert_Kd(Kd, None, 0.0183).water.a(MEASURED) / a)
        found[zenith] = {key: np.array(values) for key, values in ratios.items()}
    return found


def constituents_of_figure2() -> list[Constituents]:
    """Return the twelve waters that the paper prints, row by row."""
    return [
        Constituents(C, cdom=a_y, detritus=a_d)
        for (a_d, a_y), C in itertools.product(DETRITUS_CDOM, CHLOROPHYLL)
    ]


def water_colour(constituents: Constituents, switched_on: tuple[str, ...] = ()) -> np.ndarray:
    """Return the sRGB of the water seen level from 5 m."""
    solved = scene(constituents, DEPTH, switched_on)
    elastic, extra = solved.radiance(DEPTH)
    return colour(elastic + extra, solved.elastic.field.Ed(DEPTH))
