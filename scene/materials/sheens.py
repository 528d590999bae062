"""Lets EEVEE, which takes a sheen for matte, throw back what it throws back of uniform light."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups import uplift
from ...node_groups.node_mathematics import MARK
from .. import contents
from .inserted import has_inserted, new_node, put_before

_SHEEN = "ShaderNodeBsdfSheen"


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put the group before the colours of sheens."""
    trees = {m.node_tree for m in materials if m.is_editable and m.node_tree is not None}
    for tree in trees | contents.inner_groups(trees):
        if not tree.is_editable or MARK in tree:
            continue
        for node in [n for n in tree.nodes if n.bl_idname == _SHEEN]:
            colour, roughness = node.inputs["Color"], node.inputs["Roughness"]
            if has_inserted(colour):
                continue
            group = put_before(tree, colour, new_node(tree, uplift.SHEEN))
            target = group.inputs[uplift.ROUGHNESS]
            target.default_value = roughness.default_value
            for link in roughness.links:
                tree.links.new(link.from_socket, target).is_muted = link.is_muted
