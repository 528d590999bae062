"""Plain exponential fog, the usual way to make water: what the water's cost is compared with."""

from __future__ import annotations

import math

import bpy

_DENSITY = (0.3, 0.1, 0.05)  # 1/m
_GREEN = _DENSITY[1]
_COLOUR = (0.02, 0.1, 0.2)


def add_fog(material: bpy.types.Material) -> None:
    """Fog in RGB: the lit colour of the user's shader (Shader to RGB), dimmed, plus a colour."""
    lit = _lit(material)
    if lit is None:
        return
    tree, output = material.node_tree, lit.to_socket
    colour = tree.nodes.new("ShaderNodeShaderToRGB")
    tree.links.new(lit.from_socket, colour.inputs[0])
    factors = _exponential(tree, _DENSITY)
    kept = _vector(tree, "MULTIPLY", colour.outputs[0], factors)
    gone = _vector(tree, "SUBTRACT", (1.0, 1.0, 1.0), factors)
    total = _vector(tree, "MULTIPLY_ADD", gone, _COLOUR, kept)
    tree.links.new(_emission(tree, total), output)


def add_kept_fog(material: bpy.types.Material) -> None:
    """Fog of one density that keeps the user's closures: mixed with an emission (Mix Shader)."""
    lit = _lit(material)
    if lit is None:
        return
    tree, output, closure = material.node_tree, lit.to_socket, lit.from_socket
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(_exponential(tree, (_GREEN, _GREEN, _GREEN)), mix.inputs[0])
    tree.links.new(_emission(tree, _COLOUR), mix.inputs[1])
    tree.links.new(closure, mix.inputs[2])
    tree.links.new(mix.outputs[0], output)


def _lit(material: bpy.types.Material) -> bpy.types.NodeLink | None:
    output = material.node_tree.get_output_node("EEVEE")
    if output is None or not output.inputs["Surface"].is_linked:
        return None
    return output.inputs["Surface"].links[0]


def _exponential(
    tree: bpy.types.NodeTree, density: tuple[float, float, float]
) -> bpy.types.NodeSocket:
    distance = tree.nodes.new("ShaderNodeCameraData").outputs["View Distance"]
    exponent = _vector(tree, "MULTIPLY", distance, tuple(-value for value in density))
    return _vector(tree, "POWER", (math.e,) * 3, exponent)


def _vector(
    tree: bpy.types.NodeTree, operation: str, *operands: bpy.types.NodeSocket | tuple[float, ...]
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for value, socket in zip(operands, node.inputs, strict=False):
        if isinstance(value, tuple):
            socket.default_value = value
        else:
            tree.links.new(value, socket)
    return node.outputs[0]


def _emission(
    tree: bpy.types.NodeTree, colour: bpy.types.NodeSocket | tuple[float, float, float]
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeEmission")
    if isinstance(colour, tuple):
        node.inputs["Color"].default_value = (*colour, 1.0)
    else:
        tree.links.new(colour, node.inputs["Color"])
    return node.outputs[0]
