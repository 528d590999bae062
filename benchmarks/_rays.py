"""Rays of pictures that are computed without Blender."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..datasets.camera import PinholeCamera


def view_rays(width: int, height: int, field: float, elevation: float) -> NDArray[np.float64]:
    """Unit directions of pixels, shape (height, width, 3), of a camera that looks along y, z up.

    ``field`` is the width of its view and ``elevation`` how far it looks up, in rad.
    """
    c, s = math.cos(elevation), math.sin(elevation)
    camera = PinholeCamera.from_field_of_view(width, height, math.degrees(field))
    return camera.rays() @ np.array([[1.0, 0.0, 0.0], [0.0, s, -c], [0.0, c, s]])


def sphere_distance(
    origin: NDArray[np.float64], direction: NDArray[np.float64], centre: NDArray[np.float64],
    radius: float | NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    """Where rays meet a sphere from outside, m; infinite where they do not."""
    offset = origin - centre
    along = np.sum(offset * direction, axis=-1)
    inside = along**2 - np.sum(offset * offset, axis=-1) + radius**2
    distance = -along - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside > 0) & (distance > 1e-6), distance, np.inf)
