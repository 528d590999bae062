"""Keeps the added floor clear of the seabed that a scene has of its own.

Renderers confuse two surfaces in one place: rays that leave the one are caught
by the other. The scene's own seabed is what is seen, so the added floor, which
closes the view beyond its border, makes way for it downwards.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ..rendered import in_rendered_collections, rendered_layer

_NEAR = 0.2  # m from the floor's depth within which level ground is taken for the floor
_APART = 0.01  # m between the two
_LEVEL = 0.9  # cosine of the steepest ground


def clear_depth(scene: bpy.types.Scene, floor_depth: float) -> float:
    """Depth in m of an added floor that is covered by the scene's seabed at the same depth.

    Objects are seen as they were last evaluated; instances of collections count, others do not.
    """
    depth = floor_depth
    for item, place in _meshes(rendered_layer(scene)):
        corners = np.array(item.bound_box) @ place[2, :3] + place[2, 3] + floor_depth
        if corners.min() <= _NEAR and corners.max() >= -_NEAR:
            ground = _ground(item.data, place) + floor_depth
            ground = ground[np.abs(ground).max(axis=1) <= _NEAR]
            lowest = float(ground.min(initial=_APART))
            depth = max(depth, floor_depth + (_APART - lowest))
    return depth


def _meshes(layer: bpy.types.ViewLayer) -> Iterator[tuple[bpy.types.Object, NDArray[np.float64]]]:
    """Evaluated objects with meshes of the scene's own, and their places."""
    depsgraph = layer.depsgraph

    # Objects that were just deleted are None here; the graph's own list would crash Blender.
    def visit(
        items: Iterable[bpy.types.Object], around: Matrix
    ) -> Iterator[tuple[bpy.types.Object, NDArray[np.float64]]]:
        for item in items:
            if item is None or MARK in item or item.hide_render:
                continue
            shown = item if depsgraph is None else item.evaluated_get(depsgraph)
            place = around @ shown.matrix_world
            if isinstance(shown.data, bpy.types.Mesh):
                yield shown, np.array(place, dtype=np.float64)
            group = item.instance_collection
            if group is not None:
                yield from visit(
                    group.all_objects, place @ Matrix.Translation(-group.instance_offset)
                )

    shown = in_rendered_collections(layer)
    return visit((item for item in layer.objects if item is None or item in shown), Matrix())


def _ground(mesh: bpy.types.Mesh, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heights of the corners of level triangles that can be seen from above, shape (m, 3)."""
    vertices = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    triangles = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    edges = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.vertices.foreach_get("co", vertices.ravel())
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    mesh.loops.foreach_get("edge_index", edges)
    corners = (vertices @ place[:3, :3].T + place[:3, 3])[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upward = across[:, 2] * np.sign(np.linalg.det(place[:3, :3]))
    if np.all(np.bincount(edges) == 2):  # closed: what faces down is an underside
        upward = np.maximum(upward, 0.0)
    level = np.abs(upward) > _LEVEL * np.linalg.norm(across, axis=1)
    return corners[level, :, 2]
