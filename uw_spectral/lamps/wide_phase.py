"""Scattering without what turns light by less than a few degrees, for harmonics to resolve.

Within an angle θ0 the phase function is replaced by a function G ∝ e^{-(θ/θ0)²} that keeps the mean
of 1 - cos of it, so that light spreads alike; what is over goes straight on (delta scaling). Beyond
it is what it was. It stays positive, and so does the light that is computed with it.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from ..water.phase import BandPhase, PhaseFunction, quadrature

Array = NDArray[np.float64]

RESOLVED = 0.125
"""Angle θ0 in rad that harmonics up to the degree 32 resolve."""


def wide_moments(phase: BandPhase, count: int, angle: float) -> Array:
    """Legendre moments of what is scattered, shape (count + 1, n), from degree 0 on.

    Parameters
    ----------
    phase : BandPhase
    count : int
    angle : float
        θ0, rad.

    Returns
    -------
    array
        That of degree 0 is the share of the scattering that is left.

    Examples
    --------
    >>> from ..water.phase import parse_phase
    >>> phase = parse_phase("fournier-forand:1.10,0.0183").for_bands([0.2])
    >>> found, whole = wide_moments(phase, 8, 0.125), phase.moments(1)
    >>> round(float(found[0, 0]), 2), bool(np.isclose(found[0] - found[1], 1.0 - whole[0]).all())
    (0.53, True)
    """
    each = [_wide_moments(part, count, angle) for part in phase.components]
    return np.stack(each, axis=-1) @ np.asarray(phase.weights)


@functools.lru_cache(maxsize=32)
def _wide_moments(phase: PhaseFunction, count: int, angle: float) -> Array:
    theta, solid_angle = quadrature(phase.kinks)
    around = np.exp(-((theta / angle) ** 2)) * solid_angle
    peak = around * phase.per_steradian(np.sin(theta / 2.0) ** 2)
    turned = 2.0 * np.sin(theta / 2.0) ** 2
    change = around * ((peak @ turned) / (around @ turned)) - peak
    cosine = np.cos(theta)
    found = np.concatenate([[1.0], phase.moments(count)])
    before, legendre = cosine, np.ones_like(cosine)  # of the degrees -1 and 0
    for degree in range(count + 1):
        found[degree] += change @ legendre
        following = ((2 * degree + 1) * cosine * legendre - degree * before) / (degree + 1)
        before, legendre = legendre, following
    return found
