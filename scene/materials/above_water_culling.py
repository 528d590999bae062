"""Hides what lies above the water from eyes that cannot see it there, in EEVEE's materials."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups.node_mathematics import Graph
from .inserted import own_trees
from .shader_nodes import row_of

_BEFORE = "uw_transparent_shadow"


def insert(materials: Iterable[bpy.types.Material], group: bpy.types.ShaderNodeTree) -> None:
    """Make wet materials clear where a group of :mod:`.realtime_culling` says so.

    The nodes leave with the others of the water. What lets no light through throws its shadow as a
    whole: else the group is worked out for every texel of every shadow, at five times the cost.
    """
    for material in materials:
        tree = material.node_tree
        output = None if tree is None else tree.get_output_node("EEVEE")
        if tree is None or output is None or not material.is_editable:
            continue
        socket = output.inputs["Surface"]
        if not socket.is_linked:
            continue
        if material.use_transparent_shadow and not _is_clear(material):
            material[_BEFORE], material.use_transparent_shadow = True, False
        graph, shown = Graph(tree), socket.links[0].from_socket
        hidden = graph.node("ShaderNodeGroup", node_tree=group)
        clear = graph.node("ShaderNodeBsdfTransparent", {"Color": 1.0})
        tree.links.new(graph.mixed(hidden.outputs[0], shown, clear.outputs[0]), socket)


def give_back(kept: Iterable[bpy.types.Material]) -> None:
    """Give materials their transparent shadows back, but for those that stay wet."""
    held = set(kept)
    for material in [m for m in bpy.data.materials if _BEFORE in m and m not in held]:
        del material[_BEFORE]
        material.use_transparent_shadow = True


def _is_clear(material: bpy.types.Material) -> bool:
    """Whether a material may let light straight through."""
    nodes = ((tree, node) for tree in own_trees([material]) for node in tree.nodes)
    rows = ((row_of(at[1]), at) for at in nodes)
    return any(row is not None and row.may_let_through(*at) for row, at in rows)
