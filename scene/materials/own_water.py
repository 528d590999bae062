"""Water that a scene has of its own, which the water of a render would be drawn with twice."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np
from mathutils import Vector

from .. import contents, marks
from ..rendered import ever_rendered
from .shader_nodes import REFRACTS, SHADER_NODES

_WIDE, _FLAT, _NEAR = 10.0, 0.2, 1.5  # m; height over width; m from z = 0
_CLEAR = 0.3  # transmission from which a surface is clear


def notes(scene: bpy.types.Scene) -> Iterator[str]:
    """Name sea surfaces and bodies of water among a scene's meshes, a sentence each.

    A surface is wide, nearly level, at z = 0, and refracts; a body has a volume, and the camera is
    in it.
    """
    camera = scene.camera
    known: dict[bpy.types.Material, tuple[bool, bool]] = {}
    for item in ever_rendered(scene):
        if item.type != "MESH" or marks.MARK in item:
            continue
        materials = contents.materials_of(item)
        known |= {m: (_is_clear(m), _is_filled(m)) for m in materials if m not in known}
        clear, filled = (any(known[m][i] for m in materials) for i in (0, 1))
        if not (clear or filled):
            continue
        box = np.array([item.matrix_world @ Vector(corner) for corner in item.bound_box])
        low, high = box.min(axis=0), box.max(axis=0)
        x, y, z = high - low
        level = min(x, y) >= _WIDE and z <= _FLAT * min(x, y)
        if level and low[2] <= _NEAR and high[2] >= -_NEAR and clear:
            yield (
                f"{item.name!r} looks like a water surface of the scene's own: the water has one, "
                "and both are drawn; hide it in renders"
            )
        elif camera is not None and filled:
            place = np.array(camera.matrix_world.translation)
            if ((place > low) & (place < high)).all():
                yield (
                    f"{item.name!r} has a volume, and the camera is in it: it darkens the water or "
                    "hides it; hide it in renders"
                )


def _is_clear(material: bpy.types.Material) -> bool:
    for node in material.node_tree.nodes:
        known = SHADER_NODES.get(node.bl_idname)
        weight = node.inputs.get("Transmission Weight")
        if known is not None and known.does == REFRACTS:
            return True
        if weight is not None and (weight.is_linked or weight.default_value >= _CLEAR):
            return True
    return False


def _is_filled(material: bpy.types.Material) -> bool:
    output = material.node_tree.get_output_node("ALL")
    return output is not None and output.inputs["Volume"].is_linked
