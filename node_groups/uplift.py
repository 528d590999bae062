"""Node groups that stand before the inputs of a user's shaders.

They turn an RGB colour into the values of the pass's bands, or of channels, and refractive indices
against air into those against water.

Reflectance and emission differ only in the basis, which the pass supplies.
The sum over red, green and blue is linear, hence textures, mixes and ramps
before it keep their meaning.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection

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
from .node_mathematics import MARK, NODES, Graph, new_group
from .realtime_rays import drawn_place

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
_IN_WATER = {
    INDEX: index_in_water,
    OPAQUE_INDEX: opaque_index_in_water,
    LENGTH: length_in_water,
}
IN_WATER = frozenset(_IN_WATER)
"""Kinds of numbers that are others in water."""
READ = frozenset({SHEEN, HAIR, WET})
"""Of groups before colours that go on through another one."""
_WATER = "Water"


def _basis_group(name: str, basis: tuple[str, str, str]) -> bpy.types.ShaderNodeTree:
    tree = _group(name, COLOR_INPUT)
    graph = Graph(tree)
    given = graph.term(graph.node("NodeGroupInput").outputs[0])
    if basis == attributes.REFLECTANCE_BASIS:
        # Cycles takes what is negative for black, but light may be: before channels become bands.
        given = NODES.maximum(given, 0.0)
    rgb = graph.components(given)
    red, green, blue = (vector_of_view_layer(graph, attribute) for attribute in basis)
    total = red * rgb[0] + green * rgb[1] + blue * rgb[2]
    graph.assign(total, graph.node("NodeGroupOutput").inputs[0])
    return tree


def _group(name: str, *inputs: str) -> bpy.types.ShaderNodeTree:
    """Return an empty group of vectors, with an output ``Bands``."""
    tree = new_group(name)
    for label in inputs:
        tree.interface.new_socket(label, in_out="INPUT", socket_type="NodeSocketVector")
    tree.interface.new_socket("Bands", in_out="OUTPUT", socket_type="NodeSocketVector")
    return tree


def build_reflectance() -> bpy.types.ShaderNodeTree:
    """Build the group RGB reflectance → reflectance of the three bands."""
    return _basis_group(REFLECTANCE, attributes.REFLECTANCE_BASIS)


def build_emission() -> bpy.types.ShaderNodeTree:
    """Build the group RGB emission → radiance of the three bands."""
    return _basis_group(EMISSION, attributes.EMISSION_BASIS)


def build_measured() -> bpy.types.ShaderNodeTree:
    """Build the group that puts a measured reflectance in the place of a colour.

    The colour input is kept, unused, so that the colour's own link has a home
    until the water is removed.
    """
    tree = _group(MEASURED, COLOR_INPUT, MEASURED_INPUT)
    graph = Graph(tree)
    measured = graph.node("NodeGroupInput").outputs[MEASURED_INPUT]
    tree.links.new(measured, graph.node("NodeGroupOutput").inputs[0])
    return tree


def _sunlit(name: str, *, measured: bool) -> bpy.types.ShaderNodeTree:
    """Build the group of a colour of a closure that the white sun lights.

    The closure is mixed in with the fraction, which the colour is divided by.
    """
    tree = _group(name, COLOR_INPUT, *((MEASURED_INPUT,) if measured else COLUMNS))
    tree.interface.new_socket(FRACTION, in_out="INPUT", socket_type="NodeSocketFloat")
    graph = Graph(tree)
    given = {s.name: graph.term(s) for s in graph.node("NodeGroupInput").outputs if s.name}
    if measured:
        total = given[MEASURED_INPUT]
    else:
        red, green, blue = (given[column] for column in COLUMNS)
        rgb = graph.components(NODES.maximum(given[COLOR_INPUT], 0.0))
        total = red * rgb[0] + green * rgb[1] + blue * rgb[2]
    total = total / NODES.maximum(given[FRACTION], _LEAST)
    graph.assign(total, graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_sunlit() -> bpy.types.ShaderNodeTree:
    """Build the group colour → colour of a closure in the sunlight under water."""
    return _sunlit(SUNLIT, measured=False)


def build_sunlit_measured() -> bpy.types.ShaderNodeTree:
    """Build the same where the column of a measured reflectance replaces the colour."""
    return _sunlit(SUNLIT_MEASURED, measured=True)


def build_dark() -> bpy.types.ShaderNodeTree:
    """Build the group that leaves nothing of a colour, which keeps its home there."""
    tree = _group(DARK, COLOR_INPUT)
    Graph(tree).node("NodeGroupOutput")
    return tree


def _in_water(name: str, formula: Callable[..., Operand]) -> bpy.types.ShaderNodeTree:
    """Build the group of a number of a material that is another one in water."""
    tree = new_group(name)
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Value", in_out=way, socket_type="NodeSocketFloat")
    graph = Graph(tree)
    given = graph.term(graph.node("NodeGroupInput").outputs[0])
    water = graph.node("ShaderNodeValue")
    water.name, water.outputs[0].default_value = _WATER, 1.0
    z = drawn_place(graph)[2]
    found = formula(given, graph.term(water.outputs[0]), z, NODES)
    graph.assign(found, graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_sheen() -> bpy.types.ShaderNodeTree:
    """Build the group colour of a sheen → what it throws towards the camera of uniform light.

    EEVEE takes a sheen for matte.
    """
    tree = _group(SHEEN, COLOR_INPUT)
    tree.interface.new_socket(ROUGHNESS, in_out="INPUT", socket_type="NodeSocketFloat")
    graph = Graph(tree)
    colour, roughness = (graph.term(s) for s in graph.node("NodeGroupInput").outputs if s.name)
    geometry = graph.node("ShaderNodeNewGeometry").outputs
    normal, back = (graph.components(graph.term(geometry[x])) for x in ("Normal", "Incoming"))
    albedo = sheen_albedo(roughness, NODES.absolute(dot(normal, back)), NODES)
    graph.assign(colour * albedo, graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_hair() -> bpy.types.ShaderNodeTree:
    """Build the group colour of hair → what a matte object throws back like it."""
    tree = _group(HAIR, COLOR_INPUT)
    graph = Graph(tree)
    colour = graph.components(graph.term(graph.node("NodeGroupInput").outputs[0]))
    matte = graph.vector(*(hair_albedo(part, NODES) for part in colour))
    graph.assign(matte, graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_wet() -> bpy.types.ShaderNodeTree:
    """Build the group colour of a porous object when dry → where it lies."""
    tree = _group(WET, COLOR_INPUT)
    graph = Graph(tree)
    colour = graph.components(graph.term(graph.node("NodeGroupInput").outputs[0]))
    water = graph.node("ShaderNodeValue")
    water.name, water.outputs[0].default_value = _WATER, mean_cosine_of_grains(GRAIN_INDEX)
    g, z = graph.term(water.outputs[0]), drawn_place(graph)[2]
    wet = graph.vector(*(wet_reflectance_TwomeyEtAl1986(part, g, z, NODES) for part in colour))
    graph.assign(wet, graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_thin() -> bpy.types.ShaderNodeTree:
    """Build the group any thickness → that of a sheet."""
    tree = new_group(THIN)
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Value", in_out=way, socket_type="NodeSocketFloat")
    graph = Graph(tree)
    value = graph.node("ShaderNodeValue").outputs[0]
    value.default_value = _THICKNESS
    tree.links.new(value, graph.node("NodeGroupOutput").inputs[0])
    return tree


def set_water_index(index: float) -> None:
    """Tell the groups of indices that of the water against air."""
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


_BUILDERS = {
    **{kind: functools.partial(_in_water, kind, rule) for kind, rule in _IN_WATER.items()},
    SHEEN: build_sheen,
    HAIR: build_hair,
    THIN: build_thin,
    WET: build_wet,
    SUNLIT: build_sunlit,
    SUNLIT_MEASURED: build_sunlit_measured,
    DARK: build_dark,
    REFLECTANCE: build_reflectance,
    EMISSION: build_emission,
    MEASURED: build_measured,
}


def group(kind: str) -> bpy.types.ShaderNodeTree:
    """Return the group of a kind, building it on first use."""
    for existing in bpy.data.node_groups:
        if existing.get(KIND) == kind and existing.is_editable:
            return existing
    built = _BUILDERS[kind]()
    built[MARK], built[KIND] = True, kind
    return built


def is_uplift(tree: bpy.types.NodeTree | None) -> bool:
    """Whether a node tree is a group of :func:`group`."""
    return tree is not None and KIND in tree
