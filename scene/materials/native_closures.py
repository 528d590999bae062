"""Which materials keep their closures in real time: those that can all be lit as they are."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups.node_mathematics import MARK
from .. import contents
from .closure_walk import Surfaces
from .inserted import is_idle
from .shader_nodes import ADD, MIX, makes_closure, row_of
from .wet_trees import OPENED

SUNLIGHT = "uw_sunlight"
"""On the one node of a tree that knows the sunlight there."""
_JOINING = {MIX, ADD, "ShaderNodeGroup"}


def native_materials(
    materials: Iterable[bpy.types.Material], surfaces: Surfaces
) -> set[bpy.types.Material]:
    """Return the materials whose closures can all be lit as they are.

    Of those that share a group of shaders all are, or none: it has the colours of one way.
    """
    groups = {m: groups_of_shaders(m.node_tree) for m in materials if m.is_editable}
    native = {
        m
        for m, inner in groups.items()
        if surfaces.native is not None
        and (surfaces.fluorescent is None or m.name not in surfaces.fluorescing)
        and all(_can_be_native(tree, node) for tree in {m.node_tree, *inner} for node in tree.nodes)
        and not any(OPENED in group and not has_sunlight(group) for group in inner)
    }
    while True:
        others = set().union(*(inner for m, inner in groups.items() if m not in native))
        fallen = {m for m in native if groups[m] & others}
        if not fallen:
            return native
        native -= fallen


def groups_of_shaders(tree: bpy.types.ShaderNodeTree) -> set[bpy.types.NodeTree]:
    """Return the user's own groups in a tree that closures come from."""
    return {
        group
        for group in contents.inner_groups([tree])
        if MARK not in group and any(map(makes_closure, group.nodes))
    }


def has_sunlight(group: bpy.types.NodeTree) -> bool:
    """Whether wet materials use a group whose closures are kept."""
    return any(SUNLIGHT in node for node in group.nodes)


def _can_be_native(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node) -> bool:
    if MARK in node:
        return True
    if node.bl_idname == "ShaderNodeShaderToRGB":
        return False
    if not any(output.type == "SHADER" for output in node.outputs):
        return True
    row = row_of(node)
    if row is None:
        return node.bl_idname in _JOINING
    if row.coat and not is_idle(tree, node, "Coat Weight"):
        # What layers filter has no colour of its own to be seen by the channels.
        tint = node.inputs["Coat Tint"]
        if tint.is_linked or any(part != 1.0 for part in tint.default_value[:3]):
            return False
    return not row.hides and not row.may_bend(tree, node)
