"""Where objects would be seen if nothing hid them, by a ray through each pixel's centre."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...datasets.axes import Array
from ...datasets.camera import PinholeCamera
from .ray_casting import Meshes, PlacedMesh

_FARTHEST = 1e4  # m


def silhouettes(
    scene: bpy.types.Scene, names: Sequence[str], camera: PinholeCamera, camera_to_world: Array
) -> Mapping[str, NDArray[np.bool_]]:
    """Return the silhouettes of objects, by name, shape (height, width), at the current frame."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    rays = camera.rays() * (1.0, -1.0, -1.0) @ camera_to_world[:3, :3].T
    eye, found = camera_to_world[:3, 3], {}
    others = set(scene.objects)
    for name in names:
        item = scene.objects[name]
        mask = np.zeros(rays.shape[:2], dtype=bool)
        for instance in Meshes(depsgraph, others - {item}).instances:
            left, top, right, bottom = _box(instance, camera, camera_to_world)
            part = rays[top:bottom, left:right]
            start = Vector(eye)
            hits = [
                instance.cast(start, Vector(ray), _FARTHEST) is not None
                for ray in part.reshape(-1, 3)
            ]
            mask[top:bottom, left:right] |= np.array(hits, dtype=bool).reshape(part.shape[:2])
        found[name] = mask
    return found


def _box(item: PlacedMesh, camera: PinholeCamera, pose: Array) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of the pixels that may see an instance; all if it is around."""
    corners = np.array(
        [[(item.low, item.high)[i][axis] for axis, i in enumerate(n)] for n in np.ndindex(2, 2, 2)]
    )
    local = (corners - pose[:3, 3]) @ pose[:3, :3] * (1.0, -1.0, -1.0)
    if (local[:, 2] <= 0).all():
        return 0, 0, 0, 0
    if (local[:, 2] <= 0).any():
        return 0, 0, camera.width, camera.height
    at = camera.project(local)
    low = np.clip(np.floor(at.min(axis=0)), 0, (camera.width, camera.height)).astype(int)
    high = np.clip(np.ceil(at.max(axis=0)), 0, (camera.width, camera.height)).astype(int)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])
