"""Meshes of a surface with heights, for Cycles: rings around the camera, moved every frame."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.surface.raised_waves import FARTHEST, RaisedWaves
from .. import marks
from .water_body import WaterExtent, level_rings, mesh_object

_SINKS = "uw_sinks"
"""Mark of a mesh that follows the surface: how far it lies below it, m."""
_SECTORS, _RINGS, _FIRST, _FADED = 360, 340, 0.03, 1.5


def surface(name: str, half_width: float) -> bpy.types.Object:
    """Make a surface that faces up, and reaches so far from the middle in m."""
    places, faces = _fan(half_width)
    return _object(name, places, faces, 0.0)


def body(name: str, extent: WaterExtent, gap: float) -> bpy.types.Object:
    """Make a closed body of water whose upper face stays a gap, m, below such a surface."""
    top, faces = _fan(extent.half_width)
    rim = top[-_SECTORS:].copy()
    rim[:, 2] = -extent.bottom
    upper, lower = len(top) - _SECTORS, len(top)
    around = [
        (upper + j, upper + i, lower + i, lower + j)
        for i, j in ((i, (i + 1) % _SECTORS) for i in range(_SECTORS))
    ]
    bottom = tuple(range(lower + _SECTORS - 1, lower - 1, -1))
    return _object(name, np.concatenate([top, rim]), [*faces, *around, bottom], gap)


def follow(scene: bpy.types.Scene, waves: RaisedWaves, middle: Sequence[float]) -> None:
    """Bring the meshes in a scene's water to the heights of a moment, finest about a middle, m."""
    for item in marks.objects(scene):
        if _SINKS in item:
            item.location.x, item.location.y = middle[0], middle[1]
            _raise(item.data, waves, middle, item[_SINKS])


def _raise(mesh: bpy.types.Mesh, waves: RaisedWaves, middle: Sequence[float], sinks: float) -> None:
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    places = places.reshape(-1, 3)
    top = 1 + _SECTORS * _count(len(places))
    x, y = (places[:top, i].astype(np.float64) for i in range(2))
    # Beyond where rays look for heights the surface is level, as EEVEE has it.
    away = np.hypot(x, y) / FARTHEST
    fraction = np.clip((_FADED - away) / (_FADED - 1.0), 0.0, 1.0)
    places[:top, 2] = fraction * waves.elevation(x + middle[0], y + middle[1]) - sinks
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()


def _count(vertices: int) -> int:
    """Rings of a surface, or of the top of a body, that has so many vertices."""
    return min((vertices - 1) // _SECTORS, _RINGS + 1)


def _fan(half_width: float) -> tuple[NDArray[np.float32], list[tuple[int, ...]]]:
    """Corners and faces of rings around the origin, fine as far as there are heights."""
    rings = np.geomspace(_FIRST, _FADED * FARTHEST, _RINGS)
    rings = np.append(rings, max(half_width, 1.01 * rings[-1]))
    places, faces = level_rings(rings, _SECTORS)
    return places.astype(np.float32), faces


def _object(
    name: str, places: NDArray[np.float32], faces: list[tuple[int, ...]], sinks: float
) -> bpy.types.Object:
    item = mesh_object(name, places.tolist(), faces)
    item[_SINKS] = sinks
    return item
