"""Phase functions as tables: the inverse CDF to sample from, and values to look up."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.errors import InputError
from ...uw_spectral.water.phase import PhaseFunction

LOOKUP_CELLS = 4096
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_LOG_LINEAR_JOINT = 0.1  # rad; below it the grid is even in log s2, beyond it in the angle
_SMALLEST_LOG_S2 = -69.0  # 2e-15 rad
_NORMALISATION_TOLERANCE = 2e-3


def s2_grid(phases: Sequence[PhaseFunction]) -> NDArray[np.float64]:
    """Edges in s2 = sin²(angle/2), from 0 to 1, that resolve every peak and kink."""
    joint = 2 * math.log(math.sin(_LOG_LINEAR_JOINT / 2))
    near = np.exp(np.linspace(_SMALLEST_LOG_S2, joint, 640))
    far = np.sin(np.linspace(_LOG_LINEAR_JOINT, math.pi, 1500)[1:] / 2) ** 2
    kinks = np.sin(np.asarray([k for phase in phases for k in phase.kinks]) / 2) ** 2
    return np.unique(np.concatenate([[0.0], near, far, kinks, [1.0]]))


def cumulative(phase: PhaseFunction, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fraction of the light scattered below each edge of s2, from 0 to 1; dΩ = 4π d(s2).

    ``edges``, shape (m,), are made by :func:`s2_grid`. Raises InputError if the function is
    negative or does not integrate to 1.
    """
    logs = np.log(edges[1:])
    half, middle = np.diff(logs) / 2, (logs[1:] + logs[:-1]) / 2
    s2 = np.exp(middle[:, None] + half[:, None] * _NODES)
    density = 4 * math.pi * phase.per_steradian(s2) * s2
    inner = (density * _WEIGHTS).sum(axis=1) * half
    total = inner.sum()
    if not (np.all(np.isfinite(inner)) and np.all(inner >= 0)):
        raise InputError(f"Monte Carlo: {phase} is negative or not finite somewhere")
    if abs(total - 1) > _NORMALISATION_TOLERANCE:
        raise InputError(
            f"Monte Carlo: {phase} integrates to {total:.4f} over the sphere; normalise it to 1"
        )
    return np.concatenate([[0.0, 0.0], np.cumsum(inner)]) / total


def on_even_grid(phase: PhaseFunction) -> NDArray[np.float64]:
    """Phase function on an even grid of sin(angle/2), 1/sr; finite at 0."""
    half_sine = np.linspace(0, 1, LOOKUP_CELLS + 1)
    half_sine[0] = 0.25 / LOOKUP_CELLS
    return phase.per_steradian(half_sine**2)


@functools.lru_cache(maxsize=64)
def cone_average(phase: PhaseFunction, cone: float) -> NDArray[np.float64]:
    """Phase function averaged over a cone, 1/sr, on an even grid of sin(angle/2).

    ``cone`` is its half angle ε, rad; the shape (LOOKUP_CELLS + 1,). A radiance meter that sees a
    narrow cone has a finite variance also where the forward peak is infinite.

    Notes
    -----
    The circle of scattering angle θ lies within ε of the direction Θ over an
    azimuth of 2β, cos β = (cos ε - cos θ cos Θ)/(sin θ sin Θ), so that the mean
    is ∫ p 2β sin θ dθ over the solid angle of the cone.
    """
    centre = 2 * np.arcsin(np.linspace(0, 1, LOOKUP_CELLS + 1))
    near_end = (centre < 3 * cone) | (centre > math.pi - 3 * cone)
    values = np.empty_like(centre)
    # Away from the ends θ = Θ + ε sin t softens the square-root ends of β.
    nodes, weights = np.polynomial.legendre.leggauss(24)
    turn, smooth = nodes * math.pi / 2, centre[~near_end, None]
    width = cone * np.cos(turn) * weights * math.pi / 2
    values[~near_end] = _ring_sum(phase, smooth + cone * np.sin(turn), smooth, cone, width)
    for i in np.flatnonzero(near_end):
        low, high = max(centre[i] - cone, 1e-14), min(centre[i] + cone, math.pi)
        theta, width = _peak_nodes(low, high, abs(centre[i] - cone))
        values[i] = _ring_sum(phase, theta, centre[i], cone, width)
    values /= 4 * math.pi * math.sin(cone / 2) ** 2
    values.setflags(write=False)
    return values


def _ring_sum(
    phase: PhaseFunction, theta: NDArray, centre: NDArray | float, cone: float, width: NDArray
) -> NDArray[np.float64]:
    """Integrate p 2β sin θ over the last axis of θ."""
    across = np.maximum(np.sin(theta) * np.sin(centre), 1e-300)
    # cos ε - cos(θ - Θ) without cancellation, then β through its half angle.
    inside = np.sin((cone + theta - centre) / 2) * np.sin((cone - theta + centre) / 2)
    beta = 2 * np.arcsin(np.sqrt(np.clip(inside / across, 0.0, 1.0)))
    p = phase.per_steradian(np.maximum(np.sin(theta / 2) ** 2, 1e-30))
    return (p * 2 * beta * np.sin(theta) * width).sum(axis=-1)


def _peak_nodes(
    low: float, high: float, kink: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes between two angles: even in the logarithm, with β's kink at a panel edge."""
    kink = min(max(kink, low), high)
    edges = np.geomspace(low, high, 200)
    near = kink + (high - kink) * np.linspace(0, 1, 40) ** 2
    before = kink - (kink - low) * np.linspace(0, 1, 40) ** 2
    edges = np.unique(np.concatenate([edges, near, before]))
    half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    return (middle[:, None] + half[:, None] * _NODES).ravel(), np.outer(half, _WEIGHTS).ravel()
