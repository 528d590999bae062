"""Hides what lies above the water from eyes that cannot see it there, in EEVEE's materials."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups.node_mathematics import Graph


def insert(materials: Iterable[bpy.types.Material], group: bpy.types.ShaderNodeTree) -> None:
    """Make wet materials clear where a group of :mod:`.realtime_hiding` says so.

    The nodes leave with the others of the water.
    """
    for material in materials:
        tree = material.node_tree
        output = None if tree is None else tree.get_output_node("EEVEE")
        if tree is None or output is None or not material.is_editable:
            continue
        socket = output.inputs["Surface"]
        if not socket.is_linked:
            continue
        graph, shown = Graph(tree), socket.links[0].from_socket
        hidden = graph.node("ShaderNodeGroup", node_tree=group)
        clear, mix = graph.node("ShaderNodeBsdfTransparent"), graph.node("ShaderNodeMixShader")
        clear.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        for source, target in zip(
            (hidden.outputs[0], shown, clear.outputs[0]), mix.inputs, strict=True
        ):
            tree.links.new(source, target)
        tree.links.new(mix.outputs[0], socket)
