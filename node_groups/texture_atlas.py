"""Look-ups in an image, wherever the coordinates jump: linear ones, and of single texels.

An ordinary image texture filters more where coordinates jump from pixel to pixel, and so
draws lines where slices change. Single texels do not: a linear look-up mixes four. (An environment
texture does not either, but its angles cost a shader half as much again, and five times the time
to compile it; the hardware's own filter has eight bits.)
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from .node_mathematics import MARK, NODES, Graph, NodeValue, new_group

_NAME = ".UW Look-Up"
_PLACE = "Column", "Row"
_SIZE = "Columns", "Rows"


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
    *,
    tiled: bool = False,
) -> NodeValue:
    """Look up a place of an image, in texels from the middle of its first.

    Parameters
    ----------
    h, v : NodeValue or float
        Column and row.
    columns, rows : NodeValue or float
        Size of the image.
    tiled : bool
        Whether the image begins anew beyond its outermost texels; it is what they are else.
    """
    place, size = (h, v), (columns, rows)
    whole = tuple(not isinstance(x, NodeValue) and float(x).is_integer() for x in place)
    if graph.slim:
        return _mixed(graph, image, place, size, whole, tiled=tiled)
    # One node each, of a group that is built once: Blender takes its time for each node of a tree.
    inner = tuple(None if isinstance(count, NodeValue) else float(count) for count in size)
    group = graph.kept(
        (_NAME, image, *whole, *inner, tiled), lambda: _group(image, inner, whole, tiled=tiled)
    )
    node = graph.inner_node("ShaderNodeGroup", node_tree=group)
    for value, socket in zip((*place, *size), node.inputs, strict=True):
        graph.assign(value, socket)
    return graph.term(node.outputs[0])


def _group(
    image: bpy.types.Image,
    size: Sequence[float | None],
    whole: Sequence[bool],
    *,
    tiled: bool,
) -> bpy.types.ShaderNodeTree:
    """Build the group of look-ups in an image, of a size that may be known."""
    tree = new_group(_NAME)
    graph = Graph(tree)
    for name in (*_PLACE, *_SIZE):
        tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    h, v, *given = (graph.term(socket) for socket in graph.node("NodeGroupInput").outputs[:4])
    known = [one if two is None else two for one, two in zip(given, size, strict=True)]
    found = _mixed(graph, image, (h, v), known, whole, tiled=tiled)
    graph.assign(found, graph.node("NodeGroupOutput").inputs[0])
    return tree


def _mixed(
    graph: Graph,
    image: bpy.types.Image,
    place: Sequence[NodeValue | float],
    size: Sequence[NodeValue | float],
    whole: Sequence[bool],
    *,
    tiled: bool,
) -> NodeValue:
    """Mix the texels about a place."""
    (h, *beside), (v, *above) = map(_split, place, size, whole)

    def along(row: NodeValue | float) -> NodeValue:
        one = _single(graph, image, h, row, tiled=tiled)
        for fraction, column in beside:
            one = one + (_single(graph, image, column, row, tiled=tiled) - one) * fraction
        return one

    found = along(v)
    for fraction, row in above:
        found = found + (along(row) - found) * fraction
    return found


def _split(
    place: NodeValue | float, count: NodeValue | float, whole: bool
) -> tuple[NodeValue | float, *tuple[tuple[NodeValue | float, NodeValue | float], ...]]:
    """Return where the texel below a place is, 0 to 1, and how much of which is mixed to it."""
    per_texel = 1.0 / count
    if whole:
        return (place * per_texel + 0.5 * per_texel,)
    low = NODES.floor(place)
    first = low * per_texel + 0.5 * per_texel
    return first, (place - low, first + per_texel)


def closest(
    graph: Graph,
    image: bpy.types.Image,
    column: NodeValue | float,
    row: NodeValue | float,
) -> NodeValue:
    """Return a single texel of an image of fixed size, with all its digits."""
    width, height = image.size
    return _single(graph, image, (column + 0.5) / width, (row + 0.5) / height, tiled=False)


def _single(
    graph: Graph,
    image: bpy.types.Image,
    x: NodeValue | float,
    y: NodeValue | float,
    *,
    tiled: bool,
) -> NodeValue:
    """Return the texel of an image at a place of its width and height."""
    where = graph.vector(x, y, 0.0)
    texture = graph.inner_node("ShaderNodeTexImage", image=image, interpolation="Closest")
    texture.extension = "REPEAT" if tiled else "EXTEND"
    take_as_given(texture)
    graph.assign(where, texture.inputs["Vector"])
    return graph.term(texture.outputs["Color"])


def take_as_given(texture: bpy.types.Node) -> None:
    """Let a look-up take its coordinates as they are.

    A texture's mapping multiplies them with a matrix, which costs a shader instructions and
    constants; one that was set, to what it was, is left out.
    """
    texture.texture_mapping.scale = (1.0, 1.0, 1.0)
