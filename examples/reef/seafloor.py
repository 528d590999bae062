"""The sand: slope, dunes and ripples."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parts.detail import Detail
from ..parts.noise import fractal_noise, generator, gradient_noise
from ..parts.sand import ripples, sand_mesh, smooth_step, stations
from ..parts.shapes import Shape

Array = NDArray[np.float64]

FLOOR_DEPTH = 7.0
"""Depth of the flat floor that the mesh meets at its rim, m."""
HALF_WIDTH = 36.0
_CENTER = np.array([0.0, 10.0])
_RIPPLE_LENGTH = 0.24
_RIPPLE_HEIGHT = 0.036


def height(x: ArrayLike, y: ArrayLike, seed: int) -> Array:
    """Height z of the sand in metres, for arrays of one shape."""
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    rng = generator(seed, "seafloor")
    dunes = fractal_noise(flat / 4.5, rng, 3).reshape(x.shape)
    bend = gradient_noise(flat / 1.6, rng).reshape(x.shape)
    fork = gradient_noise(flat / 0.55, rng).reshape(x.shape)
    patch = gradient_noise(flat / 2.3, rng).reshape(x.shape)

    slope = -6.12 - 0.03 * y
    # Crests lie across the way into the picture and swing with the noise.
    across = 0.93 * y + 0.28 * x + 0.42 * bend + 0.07 * fork
    # Ripples the mesh cannot hold any more end before they alias.
    crests = ripples(across, _RIPPLE_LENGTH, _RIPPLE_HEIGHT) * np.clip(0.8 + 0.9 * patch, 0.25, 1)
    crests *= 1 - smooth_step(7.0, 11.0, np.abs(y - 3))
    crests *= 1 - smooth_step(5.0, 9.0, np.abs(x))
    edge = np.maximum(np.abs(x - _CENTER[0]), np.abs(y - _CENTER[1]))
    rim = smooth_step(20.0, HALF_WIDTH - 4, edge)
    return (slope + 0.22 * dunes + crests) * (1 - rim) - FLOOR_DEPTH * rim


def seafloor(seed: int, detail: Detail) -> Shape:
    """Mesh of the sand, 72 m wide, with the attribute "uv" in metres."""
    f = detail.floor_spacing
    (west, east), (south, north) = ((c - HALF_WIDTH, c + HALF_WIDTH) for c in _CENTER)
    x = stations((west, east), 0.0, 2.5, 0.055 * f, 0.08)
    y = stations((south, north), 4.0, 3.0, 0.030 * f, 0.045)
    return sand_mesh(partial(height, seed=seed), x, y)
