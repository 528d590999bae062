"""Light that has changed its wavelength: its field and its radiance in closed form.

The elastic light field drives the processes: the source in each emission band is a
sum of exponentials of depth, and so are the irradiances and the path radiance that
follow. The per-pixel formulas are plain arithmetic over a :class:`.Mathematics`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..uw_spectral.errors import InputError
from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.surface.refraction import fresnel_reflectance
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.inelastic_processes import InelasticProcess, energy_matrix
from ..uw_spectral.water.phase import BandPhase
from .closed_form.light_field import (
    DEEPEST_FLOOR,
    LightField,
    TwoStreamWater,
    light_field_of,
    solve_light_field,
)
from .closed_form.path_field import PathField
from .closed_form.paths import end_of_path

_RESONANCE = 1e-3
_SHORT = 3e-4  # optical length below which a path counts as one of this length
# Of the fit to few exponentials: depths, candidate rates, the fraction of the largest value below
# which light counts less and less.
_FIT_DEPTHS, _FIT_RATES, _FAINT, _FIT_CONDITION = 48, 12, 1e-4, 1e-6


@dataclass(frozen=True, eq=False)
class DepthExponential:
    """One exponential of depth in every emission band: its rate and what it carries.

    ``emission`` is emitted power per volume, ``E0`` and ``F`` the diffuse light
    that follows from it. It falls from the surface, or rises to the floor.
    """

    rate: Operand
    rising: bool
    emission: Operand
    E0: Operand
    F: Operand

    def exponent(self, y: Operand, y_f: Operand) -> Operand:
        """Exponent at depth y over a floor at y_f."""
        return -self.rate * (y_f - y) if self.rising else -self.rate * y


@dataclass(frozen=True, eq=False)
class InelasticLight(PathField):
    """Light of changed wavelength in the emission bands; make it with :func:`solve_inelastic`.

    It adds to the elastic light of the same bands. The methods take what those
    of :class:`.LightField` and :class:`.ClosedForm` take.
    """

    field: LightField
    terms: tuple[DepthExponential, ...]

    def source(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Power emitted per volume at depth y, per nm, in all directions together."""
        return self._sum("emission", y, m)

    def E0(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Scalar irradiance at depth y."""
        return self._sum("E0", y, m)

    def F(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Net downward flux at depth y."""
        return self._sum("F", y, m)

    def Ed(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Downwelling irradiance at depth y."""
        return self.E0(y, m) / 4.0 + self.F(y, m) / 2.0

    def Eu(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Upwelling irradiance at depth y."""
        return self.E0(y, m) / 4.0 - self.F(y, m) / 2.0

    def surface_irradiance(self, y: Operand, up: Operand, m: Mathematics = NUMPY) -> Operand:
        """Irradiance on a patch whose normal has the upward component ``up``."""
        return m.maximum(self.E0(y, m) / 4.0 + up * self.F(y, m) / 2.0, 0.0)

    def floor_radiance(self, m: Mathematics = NUMPY) -> Operand:
        """Radiance that the Lambertian floor adds."""
        return m.maximum(self.field.r / math.pi * self.Ed(self.field.y_f, m), 0.0)

    def path(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance that the water adds between depth y_o and distance P along w.

        Emitted on the path, and emitted elsewhere and scattered into it; see
        :meth:`.ClosedForm.path` for the arguments.
        """
        f = self.field
        w_y = -w[2]
        P, y_e = end_of_path(y_o, w, P, f.y_f, m)
        tilt = 3.0 * f.gp * w_y
        total = 0.0
        for t in self.terms:
            falls = -t.rate if t.rising else t.rate
            strength = (t.emission + f.bp * (t.E0 - tilt * t.F)) / (4.0 * math.pi)
            total = total + strength * _attenuated_path(
                t.exponent(y_o, f.y_f),
                t.exponent(y_e, f.y_f) - f.cp * P,
                (f.cp + falls * w_y) * P,
                P,
                m,
            )
        return m.maximum(total, 0.0)

    def single_scattering(
        self, y_o: Operand, w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """No sunlight is among it."""
        del y_o, w, P, m
        return 0.0

    def _sum(self, name: str, y: Operand, m: Mathematics) -> Operand:
        total = 0.0
        for t in self.terms:
            total = total + getattr(t, name) * m.exp(t.exponent(y, self.field.y_f))
        return total


def excitation_fields(column: WaterColumn, phase: BandPhase) -> tuple[LightField, ...]:
    """Return light fields that add up to the elastic light of a column.

    Below a reflecting surface skylight keeps within Snell's cone. Two-stream
    theory takes it for light from all sides, which dies away too fast where
    absorption outweighs scattering, as in the ultraviolet that excites CDOM;
    here it is a second beam, of its mean cosine.
    """
    if not (column.reflects and column.sky_radiance.any()):
        return (light_field_of(column, phase),)
    sunlight = dataclasses.replace(column, sky_radiance=np.zeros(len(column.bands)))
    field = light_field_of(sunlight, phase)
    n = column.refractive_index
    skylight = solve_light_field(
        TwoStreamWater(column.absorption, column.scattering, phase.chi1, phase.chi2),
        column.sky_irradiance,
        _skylight_cosine(n),
        R=field.R,
        r=column.floor_reflectance,
        y_f=column.floor_depth,
    )
    return (field, skylight)


def _skylight_cosine(n: float) -> float:
    """Mean cosine Ed/E0 of a uniform sky just below a flat surface."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    in_air = (nodes + 1) / 2
    entering = weights * in_air * (1 - fresnel_reflectance(in_air, n))
    in_water = np.sqrt(1 - (1 - in_air**2) / n**2)
    return float(entering.sum() / (entering / in_water).sum())


def solve_inelastic(
    processes: Sequence[InelasticProcess],
    excitation_field: LightField | Sequence[LightField],
    excitation: Bands,
    emission_field: LightField,
    emission: Bands,
) -> InelasticLight:
    """Solve the light of changed wavelength, once per water; without processes there is none.

    ``excitation_field`` is the elastic light of the excitation bands, irradiances per nm; several
    add up, see :func:`excitation_fields`. ``emission_field`` is that of the emission bands, in the
    same water column. Raises InputError if shapes or columns do not agree.

    Notes
    -----
    An emission s e^{-qy} adds to the diffusion equations of
    :mod:`.light_field`, dF/dy = s e^{-qy} - a E0 and F = -(dE0/dy)/ct, the
    particular solution E0 = ct s/(k² - q²) e^{-qy}, F = q/ct E0. Two
    homogeneous solutions meet the boundaries, at which no light enters.
    Neglected: the small anisotropy of Raman scattering, light that changes its
    wavelength twice, and what the events take from the excitation.
    """
    matrix = energy_matrix(processes, excitation, emission)
    shape = matrix.shape
    f = emission_field
    exciting = [excitation_field] if isinstance(excitation_field, LightField) else excitation_field
    if np.shape(f.k) != shape[1:] or any(
        x.y_f != f.y_f or np.shape(x.k) != shape[:1] for x in exciting
    ):
        raise InputError("inelastic light: the two light fields are not of one water column")
    ct = f.k / f.h
    terms: list[DepthExponential] = []

    def drive(rates: Operand, strengths: Operand, rising: bool) -> None:
        for rate, strength, row in zip(rates, strengths, matrix, strict=True):
            if not (strength and row.any()):
                continue
            detuning = f.k**2 - rate**2
            away = np.maximum(np.abs(detuning), _RESONANCE * rate**2)
            E0 = ct * strength * row / np.where(detuning > 0, away, -away)
            F = (-rate if rising else rate) / ct * E0
            terms.append(DepthExponential(float(rate), rising, strength * row, E0, F))

    drive(exciting[0].k, sum(x.C1 for x in exciting), rising=False)
    drive(exciting[0].k, sum(x.C2 for x in exciting), rising=True)
    for x in exciting:
        drive(x.ks, x.A + x.E / x.mu_s, rising=False)

    def boundary(y: float) -> tuple[Operand, Operand]:
        decays = [(t, math.exp(t.exponent(y, f.y_f))) for t in terms]
        return (
            sum((t.E0 * decay for t, decay in decays), np.zeros(shape[1])),
            sum((t.F * decay for t, decay in decays), np.zeros(shape[1])),
        )

    # (1-R)E0/4 + (1+R)F/2 = 0 at the surface, (1-r)E0/4 - (1+r)F/2 = 0 at the floor.
    def balance(E0: Operand, F: Operand, fraction: Operand, sign: float) -> Operand:
        return (1 - fraction) * E0 / 4 + sign * (1 + fraction) * F / 2

    top, low = -balance(*boundary(0.0), f.R, 1.0), -balance(*boundary(f.y_f), f.r, -1.0)
    across = np.exp(-f.k * f.y_f)
    top_along, top_against = balance(1.0, f.h, f.R, 1.0), balance(1.0, -f.h, f.R, 1.0)
    low_along, low_against = balance(1.0, -f.h, f.r, -1.0), balance(1.0, f.h, f.r, -1.0)
    if f.y_f >= DEEPEST_FLOOR:
        low = np.zeros(shape[1])
    determinant = top_along * low_along - top_against * low_against * across**2
    C1 = (top * low_along - low * top_against * across) / determinant
    C2 = (low * top_along - top * low_against * across) / determinant
    nothing = np.zeros(shape[1])
    terms.append(DepthExponential(f.k, False, nothing, C1, f.h * C1))
    terms.append(DepthExponential(f.k, True, nothing, C2, -f.h * C2))
    return InelasticLight(f, tuple(terms))


def _attenuated_path(
    near: Operand, far: Operand, qP: Operand, P: Operand, m: Mathematics
) -> Operand:
    """Return :func:`.attenuated_path` to 3e-4 in single precision, in a third of the nodes."""
    x = m.maximum(m.absolute(qP), _SHORT)
    return P * m.exp(m.maximum(near, far)) * ((1.0 - m.exp(-x)) / x)
