"""The direct sun in water of one layer, and its light that is scattered once, in bands.

Directions, depth and shapes are those of :mod:`..uw_spectral.transfer.radiance_field`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.transfer.path_integral import attenuated_path
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.transfer.sun_beam import half_angle2
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase
from .closed_form.closed_form import ClosedForm
from .closed_form.paths import Scattering, end_of_path

_LOWEST_SUN = 0.01  # cosine of a flatter one, which exists only without refraction: without light
_DEEPEST = 1e6  # m: a floor that shader nodes take for none


@dataclass(frozen=True, eq=False)
class SunBeam:
    """The direct sun of n bands."""

    #: Scattering, extinction, and extinction without the forward peak of the phase function, 1/m.
    b: Operand
    c: Operand
    cp: Operand
    E: Operand  #: Downwelling (horizontal) irradiance just below the surface.
    #: Cosine of the in-water zenith angle; depth of the floor, m.
    mu_s: Operand
    y_f: Operand
    phase: Scattering
    sun: Sequence[Operand]  #: Unit direction the sunlight travels to in the water.
    #: Phase function towards the camera, 1/sr, where it is known; it holds along one ray.
    p: Operand = None

    def source(self, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Sunlight scattered once against w, per metre, before any attenuation."""
        p = self.p
        if p is None:
            p = self.phase.per_steradian(half_angle2(w, self.sun, m), m)
        return self.b * p * self.E / self.mu_s

    def boundary(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Distance from depth y along w to the surface or the floor, m."""
        return distance_in_water(y, -w[2], self.y_f, m)

    def single_scattering(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
        *,
        without_peak: bool = False,
    ) -> Operand:
        """Radiance of sunlight scattered once between depth y_o and distance P, unshadowed.

        ``without_peak`` counts light that only the forward peak has scattered as
        unscattered, before and after.
        """
        P, y_e = end_of_path(y_o, w, P, self.y_f, m)
        c = self.cp if without_peak else self.c
        cs = c / self.mu_s
        return self.source(w, m) * attenuated_path(
            -cs * y_o, -cs * y_e - c * P, (c + cs * -w[2]) * P, P, m
        )  # fmt: skip

    def single_scattering_at(
        self, y: Operand, w: Sequence[Operand], v: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Integrand of :meth:`single_scattering` at depth y and distance v, per metre."""
        return self.source(w, m) * m.exp(-self.c * (y / self.mu_s + v))


def closed_beam(water: ClosedForm) -> SunBeam:
    """Return the direct sun of water in closed form."""
    f = water.field
    return SunBeam(f.b, f.c, f.cp, f.E, f.mu_s, f.y_f, water.phase, water.sun)


def sun_beam(column: WaterColumn, phase: BandPhase) -> SunBeam:
    """Return the direct sun of a column of one layer; :meth:`.mixed_above` makes one of several.

    The forward peak χ2 of the phase function, on the same bands, is left out of ``cp``. Raises
    InputError if the column has layers.
    """
    column.require_one_layer("the beam of the sun knows")
    a, b = column.absorption, column.scattering
    return SunBeam(
        b,
        a + b,
        a + b * (1.0 - phase.chi2),
        column.sun_irradiance,
        max(float(column.sun_cosine), _LOWEST_SUN),
        min(float(column.floor_depth), _DEEPEST),
        phase,
        column.sun_direction.tolist(),
    )
