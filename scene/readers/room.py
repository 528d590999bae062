"""Room for a camera in a scene: how far it is from objects, and whether it sees any."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import ArrayLike, NDArray

from ...datasets.axes import Array
from ...datasets.camera import PinholeCamera
from .ray_casting import Meshes, PlacedMesh

_FARTHEST = 1e3  # m: nothing is looked for beyond
_ACROSS = 24  # rays along the width of a picture
_STEP = 1e-6  # behind a hit, of the size of the box
_MOST_CROSSINGS = 200
# Along no plane or edge that a modeller would choose; most of them decide.
_GENERIC = tuple(
    Vector(w).normalized() for w in ((0.36, 0.48, 0.8), (-0.62, 0.71, 0.33), (0.17, -0.84, 0.51))
)
_UPWARDS = ((0, 0, 1), (0.7, 0, 0.7), (-0.7, 0, 0.7), (0, 0.7, 0.7), (0, -0.7, 0.7))


class Room:
    """What :class:`..datasets.pose_sets.RoomForPoses` asks of a scene, by casting rays.

    It can be asked until the depsgraph is evaluated again.
    """

    def __init__(self, depsgraph: bpy.types.Depsgraph) -> None:
        self._meshes = Meshes(depsgraph)
        surfaces = self._meshes.instances
        self._low = np.array([item.low for item in surfaces]).reshape(-1, 3)
        self._high = np.array([item.high for item in surfaces]).reshape(-1, 3)
        self._closed: dict[int, bool] = {}

    def clearance(self, point: ArrayLike) -> float:
        """Distance of a point from the nearest surface, m.

        It is negative inside of a closed mesh, and below an open one such as a seabed: where
        rays upwards all meet such from behind.
        """
        at = np.asarray(point, dtype=np.float64)
        apart = np.linalg.norm(np.maximum(np.maximum(self._low - at, at - self._high), 0.0), axis=1)
        place, best = Vector(at), np.inf
        for index in np.argsort(apart):
            if apart[index] >= best:
                break
            best = min(best, self._meshes.instances[index].distance(place))
        around = [self._meshes.instances[index] for index in np.flatnonzero(apart == 0.0)]
        inside = any(self._is_closed(item) and _encloses(item, place) for item in around)
        return -best if inside or self._is_below(at) else best

    def seen_fraction(self, camera_to_world: Array, camera: PinholeCamera) -> float:
        """Fraction of the picture in which something is seen, by a few hundred rays."""
        step = max(camera.width // _ACROSS, 1)
        rays = camera.rays()[step // 2 :: step, step // 2 :: step].reshape(-1, 3)
        turned = rays * (1.0, -1.0, -1.0) @ camera_to_world[:3, :3].T
        origin = np.broadcast_to(camera_to_world[:3, 3], turned.shape)
        clear = self._meshes.clear(origin, turned, np.full(len(turned), _FARTHEST))
        return 1.0 - float(clear.mean())

    def _is_closed(self, item: PlacedMesh) -> bool:
        key = id(item.mesh)
        if key not in self._closed:
            self._closed[key] = is_closed(item.mesh.triangles)
        return self._closed[key]

    def _is_below(self, point: Array) -> bool:
        """Whether the first open mesh above is seen from behind, wherever one looks."""
        rays = np.array(_UPWARDS, dtype=np.float64)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        origin, farthest = np.broadcast_to(point, rays.shape), np.full(len(rays), _FARTHEST)
        for start, direction, limit, near in self._meshes.near(origin, rays, farthest):
            behind = False
            for entry, item in near:
                if entry >= limit:
                    break
                if self._is_closed(item):
                    continue
                hit = item.cast(start, direction, limit)
                if hit is not None:
                    limit = hit[0]
                    behind = (item.turn.transposed() @ hit[1]).dot(direction) > 0
            if not behind:
                return False
        return True


def is_closed(triangles: NDArray[np.int32]) -> bool:
    """Whether every edge of a mesh is between two triangles."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    return bool((counts == 2).all())


def _encloses(item: PlacedMesh, point: Vector) -> bool:
    odd = sum(_crossings(item, point, direction) % 2 for direction in _GENERIC)
    return 2 * odd > len(_GENERIC)


def _crossings(item: PlacedMesh, point: Vector, direction: Vector) -> int:
    start, step = point.copy(), _STEP * float(np.linalg.norm(item.high - item.low))
    for count in range(_MOST_CROSSINGS):
        hit = item.cast(start, direction, _FARTHEST)
        if hit is None:
            return count
        start = start + direction * (hit[0] + step)
    return 0
