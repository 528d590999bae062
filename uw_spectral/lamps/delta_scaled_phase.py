"""Scattering without what turns light by less than a few degrees, for harmonics to resolve.

For light in the water, within an angle θ0 the phase function is replaced by a function
G ∝ e^{-(θ/θ0)²} that keeps the mean of 1 - cos of it, so that light spreads alike; what is over
goes straight on (delta scaling). Beyond it is what it was. It stays positive, and so does the light
that is computed with it. For patches, which other formulas give the rest, the fraction e^{-(θ/θ0)²}
of it is left out.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from ..water.phase import BandPhase, PhaseFunction, quadrature

Array = NDArray[np.float64]

DEGREES = 32
"""Highest degree of harmonics, of directions and of profiles."""
RESOLVED = 0.125
"""Angle θ0 in rad that these resolve."""
BEYOND = 0.5
"""Angle in rad, as which patches tell light that goes nearly straight on from the rest."""


def wide_moments(phase: BandPhase, count: int, angle: float) -> Array:
    """Legendre moments of what is scattered, shape (count + 1, n), from degree 0 on.

    ``angle`` is θ0, rad; that of degree 0 is the fraction of the scattering that is left.
    """
    return _mixed(phase, [_wide_moments(part, count, angle) for part in phase.components])


def moments_beyond(phase: BandPhase, count: int, angle: float) -> Array:
    """Legendre moments of scattering by more than about an angle, as of :func:`wide_moments`.

    Examples
    --------
    >>> from ..water.phase_functions import parse_phase
    >>> moments_beyond(parse_phase("hg:0.9").for_bands([0.2]), 1, 0.5).round(2).ravel()
    array([0.26, 0.18])
    """
    each = []
    for part in phase.components:
        theta, around = _peak(part, angle)
        each.append(_moments(part, count) - _legendre_sums(theta, around, count))
    return _mixed(phase, each)


def _mixed(phase: BandPhase, each: list[Array]) -> Array:
    return np.asarray(np.stack(each, axis=-1) @ np.asarray(phase.weights))


@functools.lru_cache(maxsize=32)
def _wide_moments(phase: PhaseFunction, count: int, angle: float) -> Array:
    theta, peak = _peak(phase, angle)
    around = np.exp(-((theta / angle) ** 2)) * quadrature(phase.kinks)[1]
    turned = 2.0 * np.sin(theta / 2.0) ** 2
    change = around * ((peak @ turned) / (around @ turned)) - peak
    return _moments(phase, count) + _legendre_sums(theta, change, count)


def _peak(phase: PhaseFunction, angle: float) -> tuple[Array, Array]:
    """Angles of a quadrature, and what is scattered there, its fraction e^{-(θ/θ0)²}."""
    theta, solid_angle = quadrature(phase.kinks)
    peak = np.exp(-((theta / angle) ** 2)) * solid_angle
    return theta, peak * phase.per_steradian(np.sin(theta / 2.0) ** 2)


def _moments(phase: PhaseFunction, count: int) -> Array:
    return np.concatenate([[1.0], phase.moments(count)])


def _legendre_sums(theta: Array, values: Array, count: int) -> Array:
    """Sums of values times the Legendre polynomials up to a degree."""
    cosine, found = np.cos(theta), np.empty(count + 1)
    before, legendre = cosine, np.ones_like(cosine)  # of the degrees -1 and 0
    for degree in range(count + 1):
        found[degree] = values @ legendre
        following = ((2 * degree + 1) * cosine * legendre - degree * before) / (degree + 1)
        before, legendre = legendre, following
    return found
