"""Node groups that stand before the inputs of a user's shaders.

They turn an RGB colour into the values of the pass's bands, or of channels, and refractive indices
against air into those against water.

Reflectance and emission differ only in the basis, which the pass supplies. The sum over red, green
and blue is linear, hence textures, mixes and ramps before it keep their meaning.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterable

import bpy
import numpy as np

from ..uw_spectral.mathematics import Operand, dot
from ..uw_spectral.surface.refraction import index_in_water, length_in_water, opaque_index_in_water
from ..uw_spectral.surface.wet_reflectance import (
    GRAIN_INDEX,
    mean_cosine_of_grains,
    wet_reflectance_TwomeyEtAl1986,
)
from ..uw_spectral.transfer.closures import hair_albedo, sheen_albedo
from . import attributes
from .data_blocks import vector_of_view_layer
from .group_sockets import FLOAT, VECTOR, OpenGroup
from .node_mathematics import MARK, NODES, Graph, NodeValue
from .realtime_rays import drawn_place
from .realtime_values import FILTERS, Values
from .shape import Shape

REFLECTANCE = "UW Reflectance of Bands"
EMISSION = "UW Emission of Bands"
MEASURED = "UW Measured Reflectance"
SUNLIT = "UW Sunlit Colour"
SUNLIT_MEASURED = "UW Sunlit Measured Colour"
DARK = "UW No Colour"
INDEX = "UW Index in Water"
OPAQUE_INDEX = "UW Opaque Index in Water"
LENGTH = "UW Thickness in Water"
SHEEN = "UW Sheen"
FILTER = "UW Filter"
HAIR = "UW Hair"
THIN = "UW Thin"
WET = "UW Wet"

KIND = "uw_uplift"
"""On a group: which of them it is."""
COLOR_INPUT = "Color"
MEASURED_INPUT = "Measured"
ROUGHNESS = "Roughness"
COLUMNS = ("Red", "Green", "Blue")
"""Inputs and outputs: what channels see of sunlight on a colour."""
FRACTION = "Fraction"
"""Input and output: the part of that with which whole closures are mixed in."""
_LEAST = 1e-5
_THICKNESS = 0.03  # m; a sheet of less shades itself from behind, by the texels of shadows
_IN_WATER = {INDEX: index_in_water, OPAQUE_INDEX: opaque_index_in_water, LENGTH: length_in_water}
IN_WATER = frozenset(_IN_WATER)
"""Kinds of numbers that are others in water."""
READ = frozenset({SHEEN, HAIR, WET})
"""Of groups before colours that go on through another one."""
_WATER, _BANDS, _VALUE = "Water", "Bands", "Value"


def _of_bands(name: str, basis: tuple[str, str, str]) -> bpy.types.ShaderNodeTree:
    """Build the group RGB → what the three bands have of it by a basis of the pass."""
    group = OpenGroup(name, {COLOR_INPUT: VECTOR})
    given = group.given[COLOR_INPUT]
    if basis == attributes.REFLECTANCE_BASIS:
        # Cycles takes what is negative for black, but light may be: before channels become bands.
        given = NODES.maximum(given, 0.0)
    columns = (vector_of_view_layer(group.graph, attribute) for attribute in basis)
    return group.finished({_BANDS: _weighed(columns, given)})


def _weighed(columns: Iterable[NodeValue], colour: NodeValue) -> Operand:
    """Return the sum of a colour's channels times their columns."""
    red, green, blue = columns
    rgb = colour.graph.components(colour)
    return red * rgb[0] + green * rgb[1] + blue * rgb[2]


def _measured(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group that puts a measured reflectance in the place of a colour.

    The colour input is kept, so that the colour's own link has a home until the water is removed.
    """
    group = OpenGroup(name, {COLOR_INPUT: VECTOR, MEASURED_INPUT: VECTOR})
    return group.finished({_BANDS: group.given[MEASURED_INPUT]})


def _sunlit(name: str, *, measured: bool) -> bpy.types.ShaderNodeTree:
    """Build the group of a colour of a closure that the white sun lights, under water.

    The closure is mixed in with the fraction, which the colour is divided by. The column of a
    measured reflectance replaces a colour.
    """
    names = (COLOR_INPUT, *((MEASURED_INPUT,) if measured else COLUMNS))
    group = OpenGroup(name, dict.fromkeys(names, VECTOR) | {FRACTION: FLOAT})
    given = group.given
    if measured:
        total = given[MEASURED_INPUT]
    else:
        columns = (given[column] for column in COLUMNS)
        total = _weighed(columns, NODES.maximum(given[COLOR_INPUT], 0.0))
    return group.finished({_BANDS: total / NODES.maximum(given[FRACTION], _LEAST)})


def _dark(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group that leaves nothing of a colour, which keeps its home there."""
    return OpenGroup(name, {COLOR_INPUT: VECTOR}, {_BANDS: VECTOR}).finished({})


def _in_water(name: str, formula: Callable[..., Operand]) -> bpy.types.ShaderNodeTree:
    """Build the group of a number of a material that is another one in water."""
    group = OpenGroup(name, {_VALUE: FLOAT})
    water, z = _of_water(group.graph, 1.0), drawn_place(group.graph)[2]
    return group.finished({_VALUE: formula(group.given[_VALUE], water, z, NODES)})


def _of_water(graph: Graph, value: float) -> NodeValue:
    """Return a number that depends on the water."""
    water = graph.node("ShaderNodeValue", name=_WATER).outputs[0]
    water.default_value = value
    return graph.term(water)


def _sheen(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group colour of a sheen → what it throws towards the camera of uniform light.

    EEVEE takes a sheen for matte.
    """
    group = OpenGroup(name, {COLOR_INPUT: VECTOR, ROUGHNESS: FLOAT})
    graph, given = group.graph, group.given
    geometry = graph.node("ShaderNodeNewGeometry").outputs
    normal, back = (graph.components(graph.term(geometry[x])) for x in ("Normal", "Incoming"))
    albedo = sheen_albedo(given[ROUGHNESS], NODES.absolute(dot(normal, back)), NODES)
    return group.finished({_BANDS: given[COLOR_INPUT] * albedo})


def _hair(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group colour of hair → what a matte object throws back like it."""
    group = OpenGroup(name, {COLOR_INPUT: VECTOR})
    colour = group.graph.components(group.given[COLOR_INPUT])
    return group.finished({_BANDS: group.graph.vector(*(hair_albedo(x, NODES) for x in colour))})


def _wet(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group colour of a porous object when dry → where it lies."""
    group = OpenGroup(name, {COLOR_INPUT: VECTOR})
    graph = group.graph
    colour = graph.components(group.given[COLOR_INPUT])
    g, z = _of_water(graph, mean_cosine_of_grains(GRAIN_INDEX)), drawn_place(graph)[2]
    wet = (wet_reflectance_TwomeyEtAl1986(part, g, z, NODES) for part in colour)
    return group.finished({_BANDS: graph.vector(*wet)})


def _thin(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group any thickness → that of a sheet."""
    group = OpenGroup(name, {_VALUE: FLOAT})
    value = group.graph.node("ShaderNodeValue").outputs[0]
    value.default_value = _THICKNESS
    return group.finished({_VALUE: group.graph.term(value)})


def build_filter(values: bpy.types.ShaderNodeTree, shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group colour of what is clear → fraction of each channel that it lets through.

    Channels are sums over bands: what a colour takes of one depends on the light behind, for which
    that of level open water at the camera stands.
    """
    group = OpenGroup(FILTER, {COLOR_INPUT: VECTOR})
    group.tree[KIND] = FILTER
    columns = Values(group.graph, values, shape).of(*FILTERS)
    return group.finished({"Fraction": _weighed(columns, group.given[COLOR_INPUT])})


def set_water_index(index: float) -> None:
    """Tell the groups of indices, which a file's scenes share, that of the water against air."""
    _set_water(IN_WATER, index)


def set_wet_grains(index: float) -> None:
    """Tell the groups of porous objects the index of the water against air."""
    _set_water({WET}, mean_cosine_of_grains(max(GRAIN_INDEX / index, 1.0)))


def _set_water(kinds: Collection[str], value: float) -> None:
    for tree in bpy.data.node_groups:
        if tree.get(KIND) in kinds and tree.is_editable:
            socket = tree.nodes[_WATER].outputs[0]
            if socket.default_value != np.float32(value):
                socket.default_value = value


_BUILDERS: dict[str, Callable[[str], bpy.types.ShaderNodeTree]] = {
    **{kind: functools.partial(_in_water, formula=rule) for kind, rule in _IN_WATER.items()},
    SHEEN: _sheen,
    HAIR: _hair,
    THIN: _thin,
    WET: _wet,
    SUNLIT: functools.partial(_sunlit, measured=False),
    SUNLIT_MEASURED: functools.partial(_sunlit, measured=True),
    DARK: _dark,
    REFLECTANCE: functools.partial(_of_bands, basis=attributes.REFLECTANCE_BASIS),
    EMISSION: functools.partial(_of_bands, basis=attributes.EMISSION_BASIS),
    MEASURED: _measured,
}


def group(kind: str) -> bpy.types.ShaderNodeTree:
    """Return the group of a kind, building it on first use."""
    for existing in bpy.data.node_groups:
        if existing.get(KIND) == kind and existing.is_editable:
            return existing
    built = _BUILDERS[kind](kind)
    built[MARK], built[KIND] = True, kind
    return built


def is_uplift(tree: bpy.types.NodeTree | None) -> bool:
    """Whether a node tree is a group of :func:`group`."""
    return tree is not None and KIND in tree
