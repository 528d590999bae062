"""Radiance of the water between the camera and what it sees: the closed form.

Directions, depth and shapes are those of :mod:`.radiance_field`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..water.phase import BandPhase, Mixture
from .aureole import Aureole, solve_aureole
from .light_field import LightField
from .radiance_field import PathField

_NEAR_ZERO = 0.25  # below it phi comes from its series
_STEP = math.exp(-_NEAR_ZERO)


def phi(x: Operand, m: Mathematics = NUMPY) -> Operand:
    """Return ``(1 - e^{-x})/x`` for x ≥ 0, stable in single precision.

    The series serves up to 0.25 and the exact difference beyond; the two are
    added, not chosen: each is constant where the other is valid.

    Examples
    --------
    >>> phi(np.array([0.0, 1.0])).round(6)
    array([1.      , 0.632121])
    """
    small, large = m.minimum(x, _NEAR_ZERO), m.maximum(x, _NEAR_ZERO)
    series = 1.0 / 5040.0
    for term in (720.0, 120.0, 24.0, 6.0, 2.0, 1.0):
        series = 1.0 / term - small * series
    return (_NEAR_ZERO * series + (_STEP - m.exp(-large))) / large


def attenuated_path(
    near: Operand,
    far: Operand,
    qP: Operand,
    P: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Return ``e^near G(q, P)``, the integral of ``e^{near - q v}`` over the path.

    Parameters
    ----------
    near, far : float or array
        Exponents at the camera and at the end of the path, far = near - q P.
    qP : float or array
        q P; q may have either sign.
    P : float or array
        Length of the path, m.
    m : Mathematics
        Elementary functions.

    Notes
    -----
    The larger exponent is taken out, so that nothing overflows for q < 0.
    """
    return P * m.exp(m.maximum(near, far)) * phi(m.absolute(qP), m)


@dataclass(frozen=True, eq=False)
class ClosedForm(PathField):
    """Elastic light in closed form, for a camera in water; make it with :func:`solve_closed_form`.

    Attributes
    ----------
    field : LightField
        Light field of the n bands.
    phase : Mixture
        Phase function of the n bands.
    aureole : Aureole
        Spread of the sun at the depth of the camera.
    sun : sequence of 3
        Unit direction the sunlight travels to in the water.
    """

    field: LightField
    phase: Mixture
    aureole: Aureole
    sun: Sequence[Operand]

    def astype(self, dtype: DTypeLike) -> ClosedForm:
        """Return the coefficients in another floating-point precision."""
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
        """Radiance of the water between depth y_o and distance P.

        Parameters
        ----------
        y_o : float or array
            Depth of the camera, m.
        w : three floats or arrays
            Components of the unit view direction, away from the camera, z up.
        P : float or array
            Length of the path, m; ends at the surface or the floor.
        m : Mathematics
            Elementary functions.

        Returns
        -------
        array, shape (..., n)
            In units of E per steradian, never negative.
        """
        f = self.field
        w_y = -w[2]
        P, y_e = self._end_of_path(y_o, w, P, m)
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

    def single_scattering(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance of sunlight scattered once, unshadowed.

        Subtract it from :meth:`path` where shafts of light are drawn apart.
        """
        f = self.field
        w_y = -w[2]
        P, y_e = self._end_of_path(y_o, w, P, m)
        cs = f.c / f.mu_s
        return self._sun_source(w, m) * attenuated_path(
            -cs * y_o, -cs * y_e - f.c * P, (f.c + cs * w_y) * P, P, m
        )  # fmt: skip

    def single_scattering_at(
        self,
        y: Operand,
        w: Sequence[Operand],
        v: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Integrand of :meth:`single_scattering` at depth y and distance v, per metre."""
        f = self.field
        return self._sun_source(w, m) * m.exp(-f.c * (y / f.mu_s + v))

    def _sun_source(self, w: Sequence[Operand], m: Mathematics) -> Operand:
        """Sunlight scattered once towards the camera, per metre, before any attenuation."""
        f = self.field
        return f.b * self.phase.per_steradian(self._s2(w, m), m) * f.E / f.mu_s

    def _s2(self, w: Sequence[Operand], m: Mathematics) -> Operand:
        """Squared sine of half the angle by which sunlight turns to reach the camera."""
        x, y, z = (w[i] + self.sun[i] for i in range(3))
        return m.clamp((x * x + y * y + z * z) / 4.0, 1e-14, 1.0)

    def _source(self, w: Sequence[Operand], m: Mathematics) -> tuple[Operand, Operand, Operand]:
        """Strength m1, m2, m3 of the three exponentials of depth along w."""
        f = self.field
        w_y = -w[2]
        s2 = self._s2(w, m)
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
    """Prepare the closed form for a camera.

    Parameters
    ----------
    field : LightField
        Of the water.
    phase : BandPhase
        Its phase function, the one the field was solved with.
    y_o : float
        Depth of the camera, m: it sets how far the sun is spread.
    sun : array_like, shape (3,)
        Unit direction that sunlight travels to in the water, z up.

    Returns
    -------
    ClosedForm

    Raises
    ------
    InputError
        If the camera is not between surface and floor.

    Examples
    --------
    >>> from ..water.phase import parse_phase
    >>> from .light_field import solve_light_field
    >>> phase = parse_phase("hg:0.8").for_bands([0.1])
    >>> field = solve_light_field([0.05], [0.1], phase.chi1, phase.chi2, [1.0], 1.0, r=0.2, y_f=9)
    >>> water = solve_closed_form(field, phase, 5.0, (0, 0, -1))
    >>> water.path(5.0, (1.0, 0.0, 0.0), 2.0).round(4)
    array([0.0036])
    """
    if not 0 <= y_o <= field.y_f:
        raise InputError(
            f"the camera is at depth {y_o:g} m, but the water reaches from 0 to {field.y_f:g} m; "
            "move the camera or the floor"
        )
    direction = tuple(np.asarray(sun, dtype=np.float64))
    return ClosedForm(field, phase, solve_aureole(field.b, phase, y_o, field.mu_s), direction)
