"""Integral of an exponential along a path, stable in single precision."""

from __future__ import annotations

import math

from ..mathematics import NUMPY, Mathematics, Operand

_NEAR_ZERO = 0.25  # below it phi comes from its series
_STEP = math.exp(-_NEAR_ZERO)


def transmittance(c: Operand, P: Operand, m: Mathematics = NUMPY) -> Operand:
    """Share e^{-cP} of light that passes a distance P unscattered, at extinction c."""
    return m.exp(-c * P)


def phi(x: Operand, m: Mathematics = NUMPY) -> Operand:
    """Return ``(1 - e^{-x})/x`` for x ≥ 0, stable in single precision.

    The series serves up to 0.25 and the exact difference beyond; the two are
    added, not chosen: each is constant where the other is valid.
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

    ``near`` and ``far`` = near - q P are the exponents at the ends of the path of P metres; ``qP``
    may have either sign.

    The larger exponent is taken out, so that nothing overflows for q < 0.
    """
    return P * m.exp(m.maximum(near, far)) * phi(m.absolute(qP), m)
