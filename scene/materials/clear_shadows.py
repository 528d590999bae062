"""Lets sunlight straight through what is clear, for Cycles under a water surface.

A lamp's shadow ray stops at glass, and the light that glass bends finds no sun through the surface:
panes would throw shadows as black as slates. Against water glass bends light so little that what
it lets through straight is nearly right; what it gathers like a lens is left out. What is rough
is lit by lamps itself.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

import bpy

from .inserted import add_node, own_trees, repeat, trees_but, value_curves
from .shader_nodes import ShaderNode, row_of

_OURS, _MIX = "uw_clear", "mix"
_SHARP = 0.005  # roughness below which Cycles draws a mirror
_HALF = 0.5  # power: what tints by face does it twice


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Mix what lets shadow rays through into the clear shaders of materials."""
    for tree in own_trees(materials):
        for node, row in [(n, row_of(n)) for n in tree.nodes]:
            if row is not None and _is_open(node) and row.may_bend(tree, node):
                _let_through(tree, node, row)


def remove(kept: Collection[bpy.types.Material]) -> None:
    """Undo :func:`insert`, but for some materials and groups in them."""
    for tree in trees_but(kept):
        for node in [n for n in tree.nodes if n.get(_OURS) == _MIX]:
            for arriving in node.inputs[1].links:
                for link in list(node.outputs[0].links):
                    tree.links.new(arriving.from_socket, link.to_socket).is_muted = link.is_muted
        for node in [n for n in tree.nodes if _OURS in n]:
            tree.nodes.remove(node)


def _is_open(node: bpy.types.Node) -> bool:
    """Whether nothing lets shadow rays through a shader that is used."""
    if node.mute or not node.outputs or not node.outputs[0].is_linked:
        return False
    return not any(link.to_node.get(_OURS) == _MIX for link in node.outputs[0].links)


def _let_through(tree: bpy.types.NodeTree, node: bpy.types.Node, row: ShaderNode) -> None:
    colour = node.inputs[row.colour]
    weights = [node.inputs[name] for name in (row.clear, row.mirrors) if isinstance(name, str)]
    if any(value_curves(tree, socket) for socket in (colour, *weights)):
        return
    shadow = _node(tree, node, "ShaderNodeLightPath").outputs["Is Shadow Ray"]
    sharp = _math(tree, node, "LESS_THAN")
    _same(tree, node.inputs["Roughness"], sharp.inputs[0])
    sharp.inputs[1].default_value = _SHARP
    shadow = _times(tree, node, shadow, sharp.outputs[0])
    through = _node(tree, node, "ShaderNodeBsdfTransparent")
    _same(tree, colour, through.inputs["Color"])
    if row.by_face:
        tint = _node(tree, node, "ShaderNodeGamma")
        tint.inputs["Gamma"].default_value = _HALF
        _same(tree, colour, tint.inputs["Color"])
        tree.links.new(tint.outputs[0], through.inputs["Color"])
    if isinstance(row.clear, str):
        shadow = _times(tree, node, shadow, node.inputs[row.clear])
    if isinstance(row.mirrors, str):
        bare = _math(tree, node, "SUBTRACT")
        bare.inputs[0].default_value = 1.0
        _same(tree, node.inputs[row.mirrors], bare.inputs[1])
        shadow = _times(tree, node, shadow, bare.outputs[0])
    mix = _node(tree, node, "ShaderNodeMixShader", _MIX)
    for link in list(node.outputs[0].links):
        tree.links.new(mix.outputs[0], link.to_socket).is_muted = link.is_muted
    for source, target in zip(
        (shadow, node.outputs[0], through.outputs[0]), mix.inputs, strict=True
    ):
        tree.links.new(source, target)


def _times(
    tree: bpy.types.NodeTree,
    node: bpy.types.Node,
    one: bpy.types.NodeSocket,
    other: bpy.types.NodeSocket,
) -> bpy.types.NodeSocket:
    product = _math(tree, node, "MULTIPLY")
    tree.links.new(one, product.inputs[0])
    _same(tree, other, product.inputs[1])
    return product.outputs[0]


def _math(tree: bpy.types.NodeTree, node: bpy.types.Node, operation: str) -> bpy.types.Node:
    made = _node(tree, node, "ShaderNodeMath")
    made.operation = operation
    return made


def _node(
    tree: bpy.types.NodeTree, near: bpy.types.Node, kind: str, role: str = "part"
) -> bpy.types.Node:
    node = add_node(tree, kind, near, 200.0)
    node[_OURS] = role
    return node


def _same(
    tree: bpy.types.NodeTree, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket
) -> None:
    """Give an input what another gets, or let it follow an output."""
    if source.is_output:
        tree.links.new(source, target)
    else:
        repeat(tree, source, target)
