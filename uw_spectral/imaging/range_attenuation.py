"""How wideband attenuation changes with range: the curve that the field fits, and least squares.

A channel sees a sum over wavelengths whose weakly attenuated part outlives the rest, so that its
attenuation coefficient falls with range: β(z) = a e^{bz} + c e^{dz} (Akkaynak & Treibitz 2019,
Eq. 11).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]

FEWEST = 4
"""Ranges that a curve is fitted to at least."""
_STEPS = 200
_SETTLED = 1e-13  # relative fall of the squared error that counts as none
_SLIGHT = 1e-6  # of a parameter, for slopes
_STIFFEST = 1e12
LOGARITHMS = (-30.0, 10.0)
"""Of coefficients in 1/m."""
_FASTEST = 20.0  # rate, per longest range


@dataclass(frozen=True)
class RangeAttenuation:
    """Attenuation coefficient β(z) = a e^{bz} + c e^{dz} of a channel.

    D. Akkaynak & T. Treibitz, CVPR 2019, Eq. 11.
    """

    #: 1/m, positive.
    a: float
    #: 1/m.
    b: float
    c: float
    d: float

    def at(self, z: ArrayLike) -> Array:
        """Attenuation coefficient over ranges z in m, 1/m."""
        z = np.asarray(z, dtype=np.float64)
        return self.a * np.exp(self.b * z) + self.c * np.exp(self.d * z)

    def transmittance(self, z: ArrayLike) -> Array:
        """Share e^{-β(z) z} that is left after ranges z in m; 0 after infinite ones."""
        z = np.asarray(z, dtype=np.float64)
        near = np.where(np.isfinite(z), z, 0.0)
        return np.where(np.isfinite(z), np.exp(-self.at(near) * near), 0.0)


def fit_range_attenuation(z: ArrayLike, beta: ArrayLike) -> RangeAttenuation:
    """Fit the curve to coefficients, 1/m, at four ranges or more, m, by the relative error.

    Raises
    ------
    InputError
        If there are too few of them, or a coefficient is not positive.
    """
    z, beta = np.asarray(z, np.float64), np.asarray(beta, np.float64)
    if z.ndim != 1 or z.shape != beta.shape or len(z) < FEWEST:
        raise InputError(f"attenuation over range: give {FEWEST} points at least, got {z.size}")
    if not (np.isfinite(beta).all() and (beta > 0).all() and (z > 0).all()):
        raise InputError("attenuation over range: ranges and coefficients must be positive")

    longest = float(z.max())

    def curve(p: Array) -> RangeAttenuation:
        # Logarithms keep a and c positive; rates count in the longest range.
        a, c = np.exp(np.clip(p[[0, 2]], *LOGARITHMS)).tolist()
        b, d = (np.clip(p[[1, 3]], -_FASTEST, _FASTEST) / longest).tolist()
        return RangeAttenuation(a, b, c, d)

    def error(p: Array) -> Array:
        return curve(p).at(z) / beta - 1.0

    change = max(abs(beta[0] - beta[-1]), 0.02 * beta[0])
    level = max(beta[0] - change, beta[-1] / 2)
    start = np.array([math.log(change), -2.0, math.log(level), 0.0])
    return curve(least_squares(error, start))


def least_squares(
    error: Callable[[Array], Array],
    start: Array,
    step: float = _SLIGHT,
    tolerance: float = _SETTLED,
) -> Array:
    """Return the parameters of the least sum of squared errors near a start.

    The method of Levenberg and Marquardt with Marquardt's scaling; slopes are differences.

    ``error`` takes parameters (p,) to errors (m,). Slopes are taken over the part ``step`` of a
    parameter; steps end once the squared error falls by less than ``tolerance`` of it.

    D. W. Marquardt, J. Soc. Ind. Appl. Math. 11, 431 (1963).
    """
    p, damping = start.astype(np.float64), 1e-3
    left = error(p)
    for _ in range(_STEPS):
        steps = step * np.maximum(np.abs(p), 0.01)
        slopes = np.stack(
            [(error(p + h * e) - left) / h for h, e in zip(steps, np.eye(len(p)), strict=True)],
            axis=1,
        )
        normal, downhill = slopes.T @ slopes, -slopes.T @ left
        scale = np.maximum(np.diag(normal), np.finfo(np.float64).tiny)
        gained, tried, then = 0.0, p, left
        while damping < _STIFFEST:
            tried = p + np.linalg.lstsq(normal + damping * np.diag(scale), downhill, rcond=None)[0]
            then = error(tried)
            gained = float(left @ left - then @ then)
            if gained > 0:
                break
            damping *= 4.0
        if not gained > tolerance * float(left @ left):
            return tried if gained > 0 else p
        p, left, damping = tried, then, damping / 8.0
    return p
