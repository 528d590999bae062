"""Radiance of the water between the camera and what it sees: the closed form.

Directions, depth and shapes are those of `uw_spectral.transfer.radiance_field`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ...uw_spectral.errors import InputError
from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.path_integral import attenuated_path
from ...uw_spectral.transfer.sun_beam import half_angle2
from ...uw_spectral.water.phase import BandPhase, Mixture
from .aureole_lobes import Aureole, solve_aureole
from .light_field import LightField
from .path_field import PathField
from .paths import Scattering, end_of_path


class LobeSpread(Protocol):
    """The sun at a camera, spread by scattering at small angles."""

    def spread(self, p: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return p*, given the phase function p at s2 = sin²(angle / 2)."""
        ...


@dataclass(frozen=True, eq=False)
class ClosedForm(PathField):
    """Elastic light for a camera in water; make it with :func:`solve_closed_form`."""

    field: LightField
    phase: Scattering
    aureole: LobeSpread  #: Of the sun at the depth of the camera.
    sun: Sequence[Operand]

    def astype(self, dtype: DTypeLike) -> ClosedForm:
        """Return the coefficients of :func:`solve_closed_form` in another precision."""
        assert isinstance(self.phase, Mixture)
        assert isinstance(self.aureole, Aureole)
        return dataclasses.replace(
            self,
            field=self.field.astype(dtype),
            phase=dataclasses.replace(self.phase, weights=np.asarray(self.phase.weights, dtype)),
            aureole=self.aureole.astype(dtype),
            sun=tuple(np.asarray(self.sun, dtype)),
        )

    def path(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance, shape (..., n), of the water between depth y_o and distance P, both in m.

        In units of E per steradian, never negative. ``w`` is a unit vector away from the camera, z
        up; the path ends at the surface or the floor.
        """
        f = self.field
        w_y = -w[2]
        P, y_e = end_of_path(y_o, w, P, f.y_f, m)
        cpP = f.cp * P
        sun, down, up = self._source(w, m)
        return m.maximum(
            sun * attenuated_path(
                -f.ks * y_o, -f.ks * y_e - cpP, (f.cp + f.ks * w_y) * P, P, m
            )
            + down * attenuated_path(
                -f.k * y_o, -f.k * y_e - cpP, (f.cp + f.k * w_y) * P, P, m
            )
            + up * attenuated_path(
                -f.k * (f.y_f - y_o), -f.k * (f.y_f - y_e) - cpP, (f.cp - f.k * w_y) * P, P, m
            ),
            0.0,
        )  # fmt: skip

    def floor_radiance(self, m: Mathematics = NUMPY) -> Operand:
        """Radiance of the Lambertian floor."""
        return self.field.floor_radiance(m)

    def _source(self, w: Sequence[Operand], m: Mathematics) -> tuple[Operand, Operand, Operand]:
        """Strength m1, m2, m3 of the three exponentials of depth along w."""
        f = self.field
        w_y = -w[2]
        s2 = half_angle2(w, self.sun, m)
        cosine = 1.0 - 2.0 * s2
        spread = self.aureole.spread(self.phase.per_steradian(s2, m), s2, m)
        diffuse = f.bp / (4.0 * math.pi)
        tilt = 3.0 * f.gp * w_y
        sideways = 3.0 * f.gp * f.Fx * (cosine + w_y * f.mu_s)
        return (
            f.b * spread * f.E / f.mu_s + diffuse * (f.A - tilt * f.B + sideways),
            diffuse * f.C1 * (1.0 - tilt * f.h),
            diffuse * f.C2 * (1.0 + tilt * f.h),
        )


def solve_closed_form(
    field: LightField, phase: BandPhase, y_o: float, sun: ArrayLike
) -> ClosedForm:
    """Prepare the closed form for a camera at a depth, m, which sets how far the sun is spread.

    ``phase`` is the one that the field was solved with, ``sun`` the unit direction of sunlight in
    the water, z up.

    Raises
    ------
    InputError
        If the camera is not between surface and floor.
    """
    if not 0 <= y_o <= field.y_f:
        raise InputError(
            f"the camera is at depth {y_o:g} m, but the water reaches from 0 to {field.y_f:g} m; "
            "move the camera or the floor"
        )
    direction = tuple(np.asarray(sun, dtype=np.float64))
    return ClosedForm(field, phase, solve_aureole(field.b, phase, y_o, field.mu_s), direction)
