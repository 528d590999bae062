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
from .inserted import has_inserted, is_idle, is_inserted, new_node, own_trees, put_before, take_out
from .shader_nodes import makes_closure, row_of

# By inputs: kinds of groups, and other inputs without which they have no effect.
_INDICES = {
    "IOR": (uplift.INDEX, ""),
    "Coat IOR": (uplift.OPAQUE_INDEX, "Coat Weight"),
    "Subsurface IOR": (uplift.OPAQUE_INDEX, "Subsurface Weight"),
    "Thin Film IOR": (uplift.INDEX, "Thin Film Thickness"),
    # Thickness counts in wavelengths, which are shorter in water.
    "Thin Film Thickness": (uplift.LENGTH, "Thin Film Thickness"),
}
_FRESNEL = "ShaderNodeFresnel"


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put the groups before the indices of materials, but for what is filled with air.

    :func:`.uplift.set_water_index` tells them the water's.
    """
    wet = list(materials)
    for tree in own_trees(wet) - own_trees(filter(is_filled_with_air, wet)):
        _insert_into_tree(tree)


def follow(material: bpy.types.Material) -> None:
    """Let the indices of a material in water follow whether it is filled with air."""
    trees = {material.node_tree} | contents.inner_groups([material.node_tree])
    if not any(MARK in node for tree in trees for node in tree.nodes):
        return  # dry
    insert([material])
    for tree in trees if is_filled_with_air(material) else ():
        for node in [
            n for n in tree.nodes if is_inserted(n) and n.node_tree[uplift.KIND] in uplift.IN_WATER
        ]:
            take_out(tree, node)


def _insert_into_tree(tree: bpy.types.NodeTree) -> None:
    for node in list(tree.nodes):
        if MARK in node or not (makes_closure(node) or node.bl_idname == _FRESNEL):
            continue
        for socket in list(node.inputs):
            if socket.name not in _INDICES or socket.type != "VALUE" or has_inserted(socket):
                continue
            kind, weight = _INDICES[socket.name]
            if not is_idle(tree, node, weight):
                put_before(tree, socket, new_node(tree, _opaque(kind, tree, node)))


def _opaque(kind: str, tree: bpy.types.NodeTree, node: bpy.types.Node) -> str:
    """Return the kind of a socket of a node that may let nothing through."""
    row = row_of(node)
    is_opaque = row is not None and row.coat and not row.may_be_clear(tree, node)
    return uplift.OPAQUE_INDEX if kind == uplift.INDEX and is_opaque else kind
