"""Surfaces of objects as numbers, as renders show them."""

from __future__ import annotations

import bpy
import numpy as np

from ...datasets.set_files import Shape


def mesh_shape(scene: bpy.types.Scene, name: str) -> Shape | None:
    """Return the surface of an object in its own axes, its scale applied; None if it has none."""
    found = scene.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get())
    try:
        mesh = found.to_mesh()
    except RuntimeError:  # Blender's word for an object without geometry
        return None
    try:
        mesh.calc_loop_triangles()
        vertices = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
        mesh.vertices.foreach_get("co", vertices)
        triangles = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
    finally:
        found.to_mesh_clear()
    if not triangles.size:
        return None
    scale = np.array(found.matrix_world.decompose()[2])
    return Shape(vertices.reshape(-1, 3) * scale, triangles.reshape(-1, 3))
