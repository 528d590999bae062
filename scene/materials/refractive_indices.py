"""Takes the refractive indices of a scene's own materials against water, where they lie in it.

Blender's are against air: glass of 1.5 mirrors a twelfth of that in water, and bends light less.
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups import uplift
from ...node_groups.node_mathematics import MARK
from .. import contents
from ..stored_materials import is_filled_with_air
from .inserted import has_inserted, is_idle, new_node, put_before

_KINDS = {
    "IOR": uplift.INDEX,
    "Coat IOR": uplift.INDEX,
    "Subsurface IOR": uplift.INDEX,
    "Thin Film IOR": uplift.INDEX,
    # Thickness counts in wavelengths, which are shorter in water.
    "Thin Film Thickness": uplift.LENGTH,
}
_WEIGHTS = {
    "Coat IOR": "Coat Weight",
    "Subsurface IOR": "Subsurface Weight",
    "Thin Film IOR": "Thin Film Thickness",
    "Thin Film Thickness": "Thin Film Thickness",
}
_FRESNEL = "ShaderNodeFresnel"


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put the groups before the indices of materials, but for what is filled with air.

    :func:`.uplift.set_water_index` tells them the water's.
    """
    wet = [m for m in materials if m.is_editable and m.node_tree is not None]
    apart = {m.node_tree for m in wet if is_filled_with_air(m)}
    apart |= contents.inner_groups(apart)
    trees = {m.node_tree for m in wet}
    for tree in (trees | contents.inner_groups(trees)) - apart:
        if tree.is_editable and MARK not in tree:
            _insert_into_tree(tree)


def _insert_into_tree(tree: bpy.types.NodeTree) -> None:
    for node in list(tree.nodes):
        shades = any(output.type == "SHADER" for output in node.outputs)
        if MARK in node or not (shades or node.bl_idname == _FRESNEL):
            continue
        if node.bl_idname == "ShaderNodeGroup":
            continue
        for socket in list(node.inputs):
            kind = _KINDS.get(socket.name)
            if kind is None or socket.type != "VALUE" or has_inserted(socket):
                continue
            if not is_idle(tree, node, _WEIGHTS.get(socket.name, "")):
                put_before(tree, socket, new_node(tree, kind))
