"""Look-ups in an image, wherever the coordinates jump: linear ones, and of single texels.

An ordinary image texture filters more where coordinates jump from pixel to pixel, and so
draws lines where slices change. Single texels do not: a linear look-up mixes four. (An environment
texture does not either, but its angles cost a shader half as much again, and five times the time
to compile it; the hardware's own filter has eight bits.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..uw_spectral.mathematics import Operand
from .group_sockets import COLOUR, FLOAT, OpenGroup
from .node_mathematics import MARK, NODES, Graph, NodeValue

_NAME = ".UW Look-Up"
_SIDES = "Column", "Row"
_OF_SIDE = "Below", "Fraction", "Above"


@dataclass(frozen=True, eq=False)
class Texel:
    """Four numbers of an image, of which nodes see three as a colour."""

    colour: NodeValue
    alpha: NodeValue

    def __add__(self, other: Texel) -> Texel:
        return Texel(self.colour + other.colour, self.alpha + other.alpha)

    def __sub__(self, other: Texel) -> Texel:
        return Texel(self.colour - other.colour, self.alpha - other.alpha)

    def __mul__(self, factor: NodeValue | float) -> Texel:
        return Texel(self.colour * factor, self.alpha * factor)


def number_image(name: str, columns: int, rows: int, *, half: bool = True) -> bpy.types.Image:
    """Make an image of numbers for look-ups, which leaves with the water.

    Numbers keep all their digits, or those of ``half`` floats where they are drawn.
    """
    image = bpy.data.images.new(name, columns, rows, alpha=True, float_buffer=True, is_data=True)
    image.alpha_mode, image.use_half_precision = "CHANNEL_PACKED", half
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
    whole_row: bool = False,
    alpha: bool = False,
) -> Operand:
    """Look up a place of an image, in texels from the middle of its first: column h and row v.

    A ``tiled`` image begins anew beyond its outermost texels; it is what they are else.
    ``whole_row`` is whether the row is a whole number, if only nodes know that. With ``alpha`` it
    is a :class:`Texel`, else its colour.
    """
    across, up = _split(h, columns), _split(v, rows, whole=whole_row)
    # In groups, rows that only nodes know leave lamplight on surfaces black in Cycles; why is open.
    if graph.slim or (whole_row and isinstance(v, NodeValue)):
        return _mixed(_Fetch(graph, image, tiled, alpha), across, up)
    # One node each, of a group that is built once: Blender takes its time for each node of a tree.
    kinds, options = (len(across), len(up)), (tiled, alpha)
    key = _NAME, image, *kinds, *options
    group = graph.kept(key, lambda: _group(image, kinds, options))
    node = graph.inner_node("ShaderNodeGroup", node_tree=group)
    for value, socket in zip((*across, *up), node.inputs, strict=True):
        graph.assign(value, socket)
    found = [graph.term(socket) for socket in node.outputs]
    return Texel(*found) if alpha else found[0]


def _group(
    image: bpy.types.Image, kinds: Sequence[int], options: tuple[bool, bool]
) -> bpy.types.ShaderNodeTree:
    """Build the group of look-ups in an image, for what :func:`_split` returns for both sides."""
    sides = zip(_SIDES, kinds, strict=True)
    names = [f"{side} {name}" for side, count in sides for name in _OF_SIDE[:count]]
    group = OpenGroup(_NAME, dict.fromkeys(names, FLOAT), {"Color": COLOUR})
    given, fetch = list(group.given.values()), _Fetch(group.graph, image, *options)
    found = _mixed(fetch, given[: kinds[0]], given[kinds[0] :])
    if isinstance(found, Texel):
        return group.finished({"Color": found.colour, "Alpha": found.alpha})
    return group.finished({"Color": found})


@dataclass(frozen=True, eq=False)
class _Fetch:
    """Fetches single texels of an image."""

    graph: Graph
    image: bpy.types.Image
    tiled: bool = False
    alpha: bool = False

    def at(self, x: NodeValue | float, y: NodeValue | float) -> Operand:
        """Return that at a place of its width and height."""
        graph = self.graph
        where = graph.vector(x, y, 0.0)
        texture = graph.inner_node("ShaderNodeTexImage", image=self.image, interpolation="Closest")
        texture.extension = "REPEAT" if self.tiled else "EXTEND"
        take_as_given(texture)
        graph.assign(where, texture.inputs["Vector"])
        colour, alpha = (texture.outputs[name] for name in ("Color", "Alpha"))
        return Texel(graph.term(colour), graph.term(alpha)) if self.alpha else graph.term(colour)


def _mixed(
    fetch: _Fetch, across: Sequence[NodeValue | float], up: Sequence[NodeValue | float]
) -> Operand:
    """Mix the texels about a place."""

    def along(row: NodeValue | float) -> Operand:
        one = fetch.at(across[0], row)
        return one if len(across) == 1 else (fetch.at(across[2], row) - one) * across[1] + one

    found = along(up[0])
    return found if len(up) == 1 else (along(up[2]) - found) * up[1] + found


def _split(
    place: NodeValue | float, count: NodeValue | float, *, whole: bool = False
) -> tuple[NodeValue | float, ...]:
    """Return where the texel below a place is, 0 to 1, how much is mixed of the next, and where.

    Without the latter two if the place is the middle of a texel.
    """
    per_texel = 1.0 / count
    if whole or (not isinstance(place, NodeValue) and float(place).is_integer()):
        return ((place + 0.5) * per_texel,)
    low = NODES.floor(place)
    first, second = (low * per_texel + along * per_texel for along in (0.5, 1.5))
    return first, place - low, second


def closest(
    graph: Graph, image: bpy.types.Image, column: NodeValue | float, row: NodeValue | float
) -> NodeValue:
    """Return a single texel of an image of fixed size, with all its digits."""
    width, height = image.size
    x, y = (place * (1.0 / n) + 0.5 / n for place, n in ((column, width), (row, height)))
    found: NodeValue = _Fetch(graph, image).at(x, y)
    return found


def take_as_given(texture: bpy.types.Node) -> None:
    """Let a look-up take its coordinates as they are.

    A texture's mapping multiplies them with a matrix, which costs a shader instructions and
    constants; one that was set, to what it was, is left out.
    """
    texture.texture_mapping.scale = (1.0, 1.0, 1.0)
