"""Lets EEVEE, which takes sheens and hair for matte, throw back as much as they do."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups import uplift
from .inserted import has_inserted, new_node, own_trees, put_before, repeat
from .shader_nodes import row_of


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put the groups before the colours of such nodes."""
    for tree in own_trees(materials):
        for node, row in [(n, row_of(n)) for n in tree.nodes]:
            if row is None or row.matte is None:
                continue
            colour = node.inputs[row.colour]
            if has_inserted(colour) or not colour.enabled:
                continue
            group = put_before(tree, colour, new_node(tree, row.matte))
            if uplift.ROUGHNESS in group.inputs:
                repeat(tree, node.inputs["Roughness"], group.inputs[uplift.ROUGHNESS])
