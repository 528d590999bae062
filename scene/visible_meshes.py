"""The meshes of a scene as the viewport shows them, instances included."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Vertices (v, 3), triangles (t, 3) of them, and the material's place by triangle (t,)."""

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    slots: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class VisibleMesh:
    """A mesh in its place; ``key`` tells which ones share their arrays."""

    key: int
    arrays: MeshArrays
    place: Matrix
    materials: list[bpy.types.Material | None]


def visible_meshes(
    depsgraph: bpy.types.Depsgraph, leave_out: Collection[bpy.types.Object] = ()
) -> Iterator[VisibleMesh]:
    """Yield every mesh with triangles that is visible.

    Parameters
    ----------
    depsgraph : Depsgraph
        An evaluated scene.
    leave_out : collection of Object
        Not these.
    """
    meshes: dict[int, MeshArrays] = {}
    left_out = set(leave_out)
    for found in depsgraph.object_instances:
        item = found.object
        owner = (found.parent or item) if found.is_instance else item
        hidden = not (found.is_instance or found.show_self)
        if not isinstance(item.data, bpy.types.Mesh) or hidden or owner.original in left_out:
            continue
        key = item.data.as_pointer()
        if key not in meshes:
            meshes[key] = _arrays(item.data)
        if len(meshes[key].triangles):
            materials = [slot.material for slot in item.material_slots]
            yield VisibleMesh(key, meshes[key], found.matrix_world.copy(), materials)


def _arrays(mesh: bpy.types.Mesh) -> MeshArrays:
    found = mesh.loop_triangles
    vertices = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    triangles = np.empty((len(found), 3), dtype=np.int32)
    mesh.vertices.foreach_get("co", vertices.ravel())
    found.foreach_get("vertices", triangles.ravel())
    slots = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    polygons = np.empty(len(found), dtype=np.int32)
    found.foreach_get("polygon_index", polygons)
    return MeshArrays(vertices, triangles, slots[polygons])
