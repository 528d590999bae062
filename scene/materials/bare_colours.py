"""Colours that are linked straight into a surface get the Emission that Blender takes them for.

So do surfaces that get nothing, which Blender draws black.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import bpy

from ...node_groups.node_mathematics import MARK
from .inserted import add_node, own_trees, trees_but
from .shader_nodes import ADD, MIX

_OURS = "uw_emits"


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put an Emission node between such colours and what takes shaders."""
    for tree in own_trees(materials):
        for socket in list(bare(tree)):
            link = socket.links[0]
            source, muted = link.from_socket, link.is_muted
            node = _node(tree, "ShaderNodeEmission", socket.node)
            tree.links.new(source, node.inputs["Color"])
            tree.links.new(node.outputs[0], socket).is_muted = muted


def blacken(materials: Iterable[bpy.types.Material]) -> None:
    """Give EEVEE's surfaces that get nothing a shader that emits nothing."""
    for tree in [m.node_tree for m in materials if m.is_editable and MARK not in m]:
        output = tree.get_output_node("EEVEE") or _node(tree, "ShaderNodeOutputMaterial")
        if not any(output.inputs[name].is_linked for name in ("Surface", "Volume")):
            black = _node(tree, "ShaderNodeEmission", output)
            black.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
            black.inputs["Strength"].default_value = 0.0
            tree.links.new(black.outputs[0], output.inputs["Surface"])


def _node(
    tree: bpy.types.NodeTree, kind: str, before: bpy.types.Node | None = None
) -> bpy.types.Node:
    node = add_node(tree, kind, before)
    node[_OURS] = True
    return node


def remove(kept: Collection[bpy.types.Material]) -> None:
    """Undo :func:`insert`, but for some materials and groups in them."""
    for tree in trees_but(kept):
        for node in [n for n in tree.nodes if _OURS in n]:
            source = next((k.from_socket for k in node.inputs[0].links), None)
            for link in [k for output in node.outputs for k in output.links if source]:
                tree.links.new(source, link.to_socket).is_muted = link.is_muted
            tree.nodes.remove(node)


def bare(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeSocket]:
    """Yield the inputs for shaders that get a colour or a number."""
    for node in tree.nodes:
        surface = {"Surface"} if node.bl_idname == "ShaderNodeOutputMaterial" else set()
        if not surface and node.bl_idname not in (MIX, ADD):
            continue
        for socket in node.inputs:
            if socket.type != "SHADER" or (surface and socket.name not in surface):
                continue
            if any(link.is_valid and link.from_socket.type != "SHADER" for link in socket.links):
                yield socket
