"""Lets EEVEE, which takes sheens and hair for matte, throw back as much as they do."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups import uplift
from .inserted import has_inserted, new_node, own_trees, put_before

_KINDS = {
    "ShaderNodeBsdfSheen": uplift.SHEEN,
    "ShaderNodeBsdfHair": uplift.HAIR,
    "ShaderNodeBsdfHairPrincipled": uplift.HAIR,
}


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put the groups before the colours of such nodes."""
    for tree in own_trees(materials):
        for node in [n for n in tree.nodes if n.bl_idname in _KINDS]:
            colour = node.inputs["Color"]
            if has_inserted(colour) or not colour.enabled:
                continue
            group = put_before(tree, colour, new_node(tree, _KINDS[node.bl_idname]))
            if uplift.ROUGHNESS not in group.inputs:
                continue
            roughness = node.inputs["Roughness"]
            target = group.inputs[uplift.ROUGHNESS]
            target.default_value = roughness.default_value
            for link in roughness.links:
                tree.links.new(link.from_socket, target).is_muted = link.is_muted
