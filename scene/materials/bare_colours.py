"""Colours that are linked straight into a surface get the Emission that Blender takes them for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import bpy

from .inserted import own_trees, trees_but

_OURS = "uw_emits"
_JOINING = {"ShaderNodeMixShader", "ShaderNodeAddShader"}


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put an Emission node between such colours and what takes shaders."""
    for tree in own_trees(materials):
        for socket in list(bare(tree)):
            link = socket.links[0]
            active = tree.nodes.active
            node = tree.nodes.new("ShaderNodeEmission")
            tree.nodes.active = active
            node[_OURS], node.select, node.hide = True, False, True
            node.location = (socket.node.location.x - 200.0, socket.node.location.y)
            source, muted = link.from_socket, link.is_muted
            tree.links.new(source, node.inputs["Color"])
            tree.links.new(node.outputs[0], socket).is_muted = muted


def remove(kept: Collection[bpy.types.Material]) -> None:
    """Undo :func:`insert`, but for some materials and groups in them."""
    for tree in trees_but(kept):
        for node in [n for n in tree.nodes if _OURS in n]:
            source = node.inputs["Color"].links[0].from_socket
            for link in list(node.outputs[0].links):
                tree.links.new(source, link.to_socket).is_muted = link.is_muted
            tree.nodes.remove(node)


def bare(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeSocket]:
    """Yield the inputs for shaders that get a colour or a number."""
    for node in tree.nodes:
        surface = {"Surface"} if node.bl_idname == "ShaderNodeOutputMaterial" else set()
        if not surface and node.bl_idname not in _JOINING:
            continue
        for socket in node.inputs:
            if socket.type != "SHADER" or (surface and socket.name not in surface):
                continue
            if any(link.is_valid and link.from_socket.type != "SHADER" for link in socket.links):
                yield socket
