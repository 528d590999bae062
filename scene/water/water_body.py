"""Size and shape of the water body around a scene."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...uw_spectral.transfer.water_column import WaterColumn
from ..readers.unusable_places import WITH_PLACES, usable, vertices_of
from ..readers.visible_meshes import visible_instances

_SOLID = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD", "VOLUME"}
_FAR = 12.0
_LARGEST = 5000.0
_SMALLEST = 50.0
# Where the edges of level faces meet, in half widths. Straight up from a camera in the middle of a
# square of two triangles, Cycles would meet both that share an edge, and find too many faces.
_ASIDE = 0.1234, 0.3217
_RINGS, _SECTORS, _FIRST_RING = 96, 72, 0.05


@dataclass(frozen=True)
class WaterExtent:
    """Size of the box of water, m."""

    half_width: float  #: Beyond the distance from which light can still arrive.
    bottom: float  #: Depth of its lower face.


@dataclass(frozen=True)
class SceneReach:
    """How far the objects of a scene and its cameras reach out, and down, in m."""

    radius: float
    lowest: float

    def and_of(self, other: SceneReach) -> SceneReach:
        """Return the reach of both."""
        return SceneReach(max(self.radius, other.radius), max(self.lowest, other.lowest))


def water_extent(scene: bpy.types.Scene, column: WaterColumn, camera_depth: float) -> WaterExtent:
    """Choose the size of the water from its clearest band, the scene's size and its camera."""
    reach = scene_reach(scene)
    if scene.camera is not None:
        reach = reach.and_of(reach_of([scene.camera.matrix_world.translation]))
    return extent_around(reach, column, camera_depth)


def scene_reach(scene: bpy.types.Scene) -> SceneReach:
    """Return how far what renders show of a scene reaches at its current frame.

    Instances count; the water of the scene does not.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    own = [item for item in scene.objects if MARK in item]
    corners: list[NDArray[np.floating]] = [np.empty((0, 3))]
    for found in visible_instances(depsgraph, own):
        if found.object.type in _SOLID:
            place, box = np.array(found.matrix_world), np.array(found.object.bound_box)
            seen = box @ place[:3, :3].T + place[:3, 3]
            if not usable(seen.ravel()) and isinstance(found.object.data, WITH_PLACES):
                seen = vertices_of(found.object.data) @ place[:3, :3].T + place[:3, 3]
            corners.append(seen)
    places = np.concatenate(corners)
    return reach_of(places[usable(places)])


def reach_of(places: Iterable[Sequence[float]]) -> SceneReach:
    """Return how far places reach; the first three numbers of each count, m."""
    found = np.array([tuple(place)[:3] for place in places], dtype=np.float64).reshape(-1, 3)
    radius = np.hypot(found[:, 0], found[:, 1]).max(initial=0.0)
    return SceneReach(float(radius), float(-found[:, 2].min(initial=0.0)))


def extent_around(reach_of_surfaces: SceneReach, column: WaterColumn, depth: float) -> WaterExtent:
    """Choose the size of the water around objects, for a camera at a depth in m."""
    decay = float(column.decay.min())
    reach = float(np.clip(_FAR / max(decay, _FAR / _LARGEST), _SMALLEST, _LARGEST))
    if math.isfinite(column.floor_depth):
        bottom = column.floor_depth + 1.0
    else:
        bottom = max(depth, reach_of_surfaces.lowest) + reach
    return WaterExtent(reach_of_surfaces.radius + reach, bottom)


def box(name: str, extent: WaterExtent, top: float) -> bpy.types.Object:
    """Make the box of water, from its bottom up to the depth ``top``."""
    w, bottom = extent.half_width, -extent.bottom
    level = ((-w, -w), (w, -w), (w, w), (-w, w), (_ASIDE[0] * w, _ASIDE[1] * w))
    corners = [(x, y, z) for z in (bottom, -top) for x, y in level]
    faces: list[tuple[int, ...]] = []
    for i, j in ((i, (i + 1) % 4) for i in range(4)):
        faces += [(j, i, 4), (i + 5, j + 5, 9), (i, j, j + 5, i + 5)]
    return mesh_object(name, corners, faces)


def floor_plane(extent: WaterExtent, material: bpy.types.Material) -> bpy.types.Object:
    """Make a floor at z = 0, of rings that widen outwards; it is wider than the water."""
    # A floor wider than the water closes the view below the horizon. As one face of kilometres
    # EEVEE draws it 2 % too far: the depth of a face is interpolated from its corners.
    rings = np.geomspace(_FIRST_RING, 2.0 * extent.half_width, _RINGS)
    places, faces = level_rings(rings, _SECTORS)
    floor = mesh_object(material.name, places.tolist(), faces)
    floor.data.materials.append(material)
    return floor


def level_rings(
    radius: NDArray[np.float64], count: int
) -> tuple[NDArray[np.float64], list[tuple[int, ...]]]:
    """Corners, shape (v, 3), and faces of rings around the origin, a ``count`` of each."""
    turns = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    around = np.stack([np.cos(turns), np.sin(turns), np.zeros(count)], axis=1)
    places = np.concatenate([np.zeros((1, 3)), (radius[:, None, None] * around).reshape(-1, 3)])
    first = np.arange(count)
    after = (first + 1) % count
    start = 1 + count * np.arange(len(radius) - 1)[:, None]
    out = start + count
    quads = np.stack([start + first, out + first, out + after, start + after], axis=-1)
    middle = np.stack([np.zeros(count, int), 1 + first, 1 + after], axis=-1)
    return places, [tuple(x) for x in (*middle.tolist(), *quads.reshape(-1, 4).tolist())]


def plane(name: str, half_width: float, height: float = 0.0) -> bpy.types.Object:
    """Make a horizontal square around the origin, facing up."""
    w = half_width
    corners = [(-w, -w, height), (w, -w, height), (w, w, height), (-w, w, height)]
    return mesh_object(name, corners, [(0, 1, 2, 3)])


def mesh_object(
    name: str, corners: Sequence[Sequence[float]], faces: Sequence[tuple[int, ...]]
) -> bpy.types.Object:
    """Make an object of a new mesh."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    return bpy.data.objects.new(name, mesh)
