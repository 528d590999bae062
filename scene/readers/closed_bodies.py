"""Which materials are those of closed bodies, whose inside light gets into and out of."""

from __future__ import annotations

import bpy
import numpy as np

from ..materials import material_kinds
from ..rendered import rendered_layer
from .visible_meshes import visible_instances


def closed_materials(scene: bpy.types.Scene) -> set[bpy.types.Material]:
    """Return the materials of a scene that light crosses and that are on closed meshes only."""
    layer = rendered_layer(scene)
    layer.update()
    asked: dict[bpy.types.Material, bool] = {}
    closed: dict[int, bool] = {}
    known: set[tuple[bpy.types.Object, int]] = set()
    for found in visible_instances(layer.depsgraph):
        mesh = found.object.data
        if mesh is None or (key := (found.object.original, mesh.as_pointer())) in known:
            continue
        known.add(key)
        materials = {s.material.original for s in found.object.material_slots if s.material}
        for material in materials - asked.keys():
            kinds = material_kinds.kinds([material])
            asked[material] = kinds.translucent or kinds.filters
        through = [material for material in materials if asked[material]]
        if not through:
            continue
        if key[1] not in closed:
            closed[key[1]] = isinstance(mesh, bpy.types.Mesh) and is_closed(mesh)
        for material in through:
            asked[material] = asked[material] and closed[key[1]]
    return {material for material, is_so in asked.items() if is_so}


def is_closed(mesh: bpy.types.Mesh) -> bool:
    """Whether each edge of a mesh is that of two faces."""
    edges = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", edges)
    counts = np.bincount(edges, minlength=len(mesh.edges))
    return len(counts) > 0 and bool(np.all(counts == 2))
