"""Look-ups in an image, wherever the coordinates jump: linear ones, and of single texels.

An ordinary image texture filters more where coordinates jump from pixel to pixel, and so
draws lines where slices change. An environment texture in equirectangular projection never
does: it is asked for the direction that is mapped to a place.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy

from .node_mathematics import MARK, Graph, NodeValue

_OFF_MIDDLE = 1e-7  # the arctangent of 0/1 is not a number in some drivers


def number_image(name: str, columns: int, rows: int) -> bpy.types.Image:
    """Make an image of numbers for look-ups, which leaves with the water."""
    image = bpy.data.images.new(name, columns, rows, alpha=True, float_buffer=True, is_data=True)
    image.alpha_mode = "CHANNEL_PACKED"
    image[MARK] = True
    return image


def texel(
    graph: Graph,
    image: bpy.types.Image,
    h: NodeValue | float,
    v: NodeValue | float,
    columns: NodeValue | float,
    rows: NodeValue | float,
) -> NodeValue:
    """Look up a place of an image, in texels from the middle of its first.

    Parameters
    ----------
    h, v : NodeValue or float
        Column and row.
    columns, rows : NodeValue or float
        Size of the image.
    """
    around = (h + 0.5) * (-2.0 * math.pi / columns) + math.pi
    up = (v + 0.5) * (math.pi / rows) - math.pi / 2
    where = graph.vector(
        _of(graph, "COSINE", math.cos, around),
        _of(graph, "SINE", math.sin, around) + _OFF_MIDDLE,
        _of(graph, "TANGENT", math.tan, up),
    )
    texture = graph.inner_node("ShaderNodeTexEnvironment", image=image)
    texture.projection, texture.interpolation = "EQUIRECTANGULAR", "Linear"
    take_as_given(texture)
    graph.assign(where, texture.inputs["Vector"])
    return graph.term(texture.outputs["Color"])


def take_as_given(texture: bpy.types.ShaderNodeTexImage | bpy.types.ShaderNodeTexEnvironment) -> None:
    """Let a look-up take its coordinates as they are.

    A texture's mapping multiplies them with a matrix, which shaders of loops pay for each time;
    one that was set to what it was is left out.
    """
    texture.texture_mapping.scale = (1.0, 1.0, 1.0)


def _of(
    graph: Graph, name: str, function: Callable[[float], float], x: NodeValue | float
) -> NodeValue | float:
    """Return a function of a term, or of a number at once."""
    return graph.operation(name, (x,)) if isinstance(x, NodeValue) else function(x)


def closest(
    graph: Graph,
    image: bpy.types.Image,
    column: NodeValue | float,
    row: NodeValue | float,
) -> NodeValue:
    """Return a single texel of an image of fixed size, with all its digits."""
    width, height = image.size
    where = graph.vector((column + 0.5) / width, (row + 0.5) / height, 0.0)
    texture = graph.inner_node("ShaderNodeTexImage", image=image, interpolation="Closest")
    take_as_given(texture)
    graph.assign(where, texture.inputs["Vector"])
    return graph.term(texture.outputs["Color"])
