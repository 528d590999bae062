"""The cameras."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import ArrayLike


def camera(name: str, location: ArrayLike, target: ArrayLike, lens: float) -> bpy.types.Object:
    """Add a camera at `location` that looks at `target`; `lens` in mm on a 36 mm sensor."""
    data = bpy.data.cameras.new(name)
    data.lens = lens
    data.sensor_width = 36.0
    data.clip_start, data.clip_end = 0.01, 200.0
    item = bpy.data.objects.new(name, data)
    aim(item, location, target)
    bpy.context.scene.collection.objects.link(item)
    return item


def aim(item: bpy.types.Object, location: ArrayLike, target: ArrayLike) -> None:
    """Put a camera at `location` and let it look at `target`."""
    location, target = np.asarray(location, float), np.asarray(target, float)
    backward = location - target
    backward /= np.linalg.norm(backward)
    # A camera that looks straight up still needs a right-hand side.
    up = np.array([0, 0, 1.0]) if abs(backward[2]) < 0.98 else np.array([0, 1.0, 0])
    right = np.cross(up, backward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(backward, right), backward], axis=1)
    matrix[:3, 3] = location
    item.matrix_world = Matrix(matrix.tolist())
