"""Sand: a mesh of its height that is dense where the camera looks, and ripples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .shapes import Shape, grid_triangles

Array = NDArray[np.float64]


def smooth_step(low: float, high: float, x: ArrayLike) -> Array:
    """Rise from 0 at `low` to 1 at `high`, level at both."""
    t = np.clip((np.asarray(x, float) - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def stations(
    ends: tuple[float, float], middle: float, fine: float, spacing: float, growth: float
) -> Array:
    """Coordinates from end to end: `spacing` within `fine` of `middle`, coarser outwards."""

    def outwards(length: float) -> list[float]:
        steps = [0.0]
        while steps[-1] < length:
            steps.append(steps[-1] + spacing + growth * max(steps[-1] - fine, 0.0))
        scale = length / steps[-1]
        return [s * scale for s in steps]

    low = [middle - s for s in outwards(middle - ends[0])]
    high = [middle + s for s in outwards(ends[1] - middle)]
    return np.array(low[:0:-1] + high)


def ripples(across: Array, length: float, high: float) -> Array:
    """Sharp crests and wide troughs, `length` apart in the coordinate `across`, m."""
    return high * (0.5 + 0.5 * np.cos(2 * np.pi * across / length)) ** 1.5


def sand_mesh(height: Callable[[Array, Array], Array], x: Array, y: Array) -> Shape:
    """Mesh of the sand over a grid, with the attribute "uv" in metres."""
    gx, gy = np.meshgrid(x, y)
    vertices = np.stack([gx, gy, height(gx, gy)], axis=-1).reshape(-1, 3)
    return Shape(vertices, grid_triangles(len(y), len(x)), {"uv": vertices[:, :2].copy()})
