"""Reef rock: bommies with ledges, and loose stones."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .noise import fractal_noise, generator, gradient_noise
from .shapes import Shape, icosphere


def bommie(seed: int, part: str, level: int, size: ArrayLike) -> Shape:
    """Craggy coral rock with ledges and a broad top, centred on the origin.

    ``part`` names the random stream, so every bommie differs; ``level`` is the subdivision,
    20·4^level triangles; ``size`` half axes, m, shape (3,).
    """
    rng = generator(seed, part)
    sphere = icosphere(level)
    size = np.asarray(size, float)
    # A sphere pressed towards a box has steep flanks and a broad top.
    u = sphere.vertices
    u = u / (np.abs(u) ** 3.2).sum(axis=1, keepdims=True) ** (1 / 3.2)
    points = u * size
    lumps = fractal_noise(points / 0.95, rng, 3)
    ledges = gradient_noise(points * (0.6, 0.6, 2.8), rng)
    points = points * (1 + 0.50 * lumps[:, None])
    points[:, :2] *= 1 + 0.42 * ledges[:, None]
    # Ridged noise: heads of old coral with clefts between them, down to knobs.
    heads = 0.30 - np.abs(gradient_noise(points / 0.45, rng))
    knobs = 0.30 - np.abs(gradient_noise(points / 0.17, rng))
    rough = fractal_noise(points / 0.09, rng, 2)
    normal = sphere.vertices
    points += normal * (0.30 * heads + 0.13 * knobs + 0.022 * rough)[:, None]
    return Shape(points, sphere.triangles)


def stone(seed: int, part: str, level: int) -> Shape:
    """Loose stone about 1 m across; scale it down."""
    rng = generator(seed, part)
    sphere = icosphere(level)
    points = sphere.vertices * (0.5, 0.4, 0.3)
    points = points * (1 + 0.7 * fractal_noise(points / 0.5, rng, 3)[:, None])
    return Shape(points, sphere.triangles)
