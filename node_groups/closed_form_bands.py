"""Bands of a render by the closed form: one group for every three, summed for the sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from . import closed_form_group
from .closed_form_group import (
    ABSORPTION,
    ASYMMETRY,
    COLOR,
    COVERAGE,
    EMISSION,
    FLOOR_DEPTH,
    FLOOR_REFLECTANCE,
    INDEX,
    LIT,
    NORMAL,
    OPEN_WATER,
    SCATTERING,
    SECOND_MOMENT,
    SKY_RADIANCE,
    SUN_DIRECTION,
    SUN_IRRADIANCE,
    SURFACE,
)
from .data_blocks import new_world
from .node_mathematics import NODES, Graph, NodeValue, new_group

NAME = "UW Closed Form of Bands"
BACKGROUND_NAME = "UW Closed Form Ahead"
_RGB = ("R", "G", "B")
_REFLECTANCE, _EMITTED, _SENSOR = "Reflectance", "Emitted", "Sensor"
# Names as the materials' insertion knows them.
_INPUTS = {
    LIT: "NodeSocketColor",
    COLOR: "NodeSocketColor",
    EMISSION: "NodeSocketColor",
    COVERAGE: "NodeSocketFloat",
    NORMAL: "NodeSocketVector",
}


@dataclass(frozen=True, eq=False)
class BandNumbers:
    """What the nodes hold, of a multiple of three bands.

    Parameters
    ----------
    bands : mapping of str to array, shape (n,)
        By the name of the input of :mod:`.closed_form_group`.
    single : mapping of str to float or three floats
        The same for all bands.
    reflectance, emission : array, shape (n, 3)
        What a colour of 1 in red, green or blue stands for in the bands.
    sensor : array, shape (3, n)
        What the picture sees per unit radiance.
    """

    bands: dict[str, NDArray[np.float64]]
    single: dict[str, float | Sequence[float]]
    reflectance: NDArray[np.float64]
    emission: NDArray[np.float64]
    sensor: NDArray[np.float64]

    @property
    def triples(self) -> int:
        """Groups of three bands."""
        return self.sensor.shape[1] // 3


def build(group: bpy.types.ShaderNodeTree, triples: int) -> bpy.types.ShaderNodeTree:
    """Build what takes the place of a material's shader: it emits what the sensor sees."""
    tree = new_group(NAME)
    for name, kind in _INPUTS.items():
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type=kind)
        if name == COVERAGE:
            socket.default_value = 1.0
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    graph = Graph(tree)
    given = {s.name: graph.term(s) for s in graph.node("NodeGroupInput").outputs if s.name}
    lit = graph.components(NODES.maximum(given[LIT] - given[EMISSION], 0.0))
    base, glow = (graph.components(given[name]) for name in (COLOR, EMISSION))

    def colours(triple: int) -> dict[str, NodeValue]:
        emitted = _in_bands(graph, _EMITTED, triple, glow)
        return {
            LIT: _in_bands(graph, _REFLECTANCE, triple, lit) + emitted,
            COLOR: _in_bands(graph, _REFLECTANCE, triple, base),
            EMISSION: emitted,
            COVERAGE: given[COVERAGE],
            NORMAL: given[NORMAL],
        }

    found = [_triple(graph, group, t, SURFACE, colours(t)) for t in range(triples)]
    emission = graph.node("ShaderNodeEmission")
    graph.assign(_seen(graph, found), emission.inputs["Color"])
    tree.links.new(emission.outputs[0], graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_background(group: bpy.types.ShaderNodeTree, triples: int) -> bpy.types.ShaderNodeTree:
    """Build the open water with its surface and its floor, as the sensor sees it."""
    tree = new_group(BACKGROUND_NAME)
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    graph = Graph(tree)
    found = [_triple(graph, group, t, OPEN_WATER, {}) for t in range(triples)]
    graph.assign(_seen(graph, found), graph.node("NodeGroupOutput").inputs[0])
    return tree


def build_world(background: bpy.types.ShaderNodeTree) -> bpy.types.World:
    """Build a world that shows the open water to the camera and lights nothing."""
    world, graph, output = new_world(BACKGROUND_NAME)
    ahead = graph.node("ShaderNodeGroup", node_tree=background)
    shown = graph.node("ShaderNodeBackground")
    seen = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    for source, socket in (
        (ahead.outputs[0], shown.inputs["Color"]),
        (seen, shown.inputs["Strength"]),
        (shown.outputs[0], output.inputs["Surface"]),
    ):
        graph.tree.links.new(source, socket)
    world.probe_resolution = "128"
    return world


def write(tree: bpy.types.ShaderNodeTree, numbers: BandNumbers) -> None:
    """Give the nodes of either tree other values; nothing is built."""
    for triple in range(numbers.triples):
        here = slice(3 * triple, 3 * triple + 3)
        inputs = tree.nodes[_name(NAME, triple)].inputs
        bands = {name: values[here] for name, values in numbers.bands.items()}
        for name, values in (numbers.single | bands).items():
            _give(inputs[name], values)
        rows = [(_SENSOR, numbers.sensor[:, here])]
        if _name(f"{_EMITTED} R", triple) in tree.nodes:
            rows.append((_REFLECTANCE, numbers.reflectance[here].T))
            rows.append((_EMITTED, numbers.emission[here].T))
        for quantity, values in rows:
            for channel, row in zip(_RGB, values, strict=True):
                for socket, value in zip(
                    tree.nodes[_name(f"{quantity} {channel}", triple)].inputs, row, strict=True
                ):
                    socket.default_value = float(value)


def triples_of(tree: bpy.types.ShaderNodeTree) -> int:
    """Groups of three bands in a tree."""
    return sum(node.name.startswith(f"{NAME} ") for node in tree.nodes)


def numbers_of(
    bands: dict[str, NDArray[np.float64]],
    *,
    sun: Sequence[float],
    floor_depth: float,
    index: float,
    reflectance: NDArray[np.float64],
    emission: NDArray[np.float64],
    sensor: NDArray[np.float64],
    count: int,
) -> BandNumbers:
    """Return the numbers of n bands; the last one fills up the last three, unseen.

    Parameters
    ----------
    bands : mapping of str to array, shape (n,)
        Of :data:`BANDS`.
    sun : three floats
        Direction that sunlight travels to in the water.
    floor_depth, index : float
    reflectance, emission, sensor
        As of :class:`BandNumbers`.
    count : int
        Bands of the nodes, at least n.
    """
    known = sensor.shape[1]
    places = np.minimum(np.arange(-(-count // 3) * 3), known - 1)
    seen = np.arange(len(places)) < known
    return BandNumbers(
        {name: bands[name][places] for name in BANDS},
        {
            SUN_DIRECTION: tuple(sun),
            FLOOR_DEPTH: min(floor_depth, closed_form_group.DEEP),
            INDEX: index,
        },
        reflectance[places],
        emission[places],
        sensor[:, places] * seen,
    )


BANDS = (
    ABSORPTION, SCATTERING, ASYMMETRY, SECOND_MOMENT, SUN_IRRADIANCE, SKY_RADIANCE,
    FLOOR_REFLECTANCE,
)  # fmt: skip
"""Inputs of the group that differ from band to band."""


def _name(quantity: str, triple: int) -> str:
    return f"{quantity} {triple}"


def _row(graph: Graph, quantity: str, channel: str, triple: int) -> NodeValue:
    node = graph.node("ShaderNodeCombineXYZ")
    node.name = _name(f"{quantity} {channel}", triple)
    return graph.term(node.outputs[0])


def _in_bands(graph: Graph, quantity: str, triple: int, colour: Sequence[NodeValue]) -> NodeValue:
    """Three bands of what a colour stands for."""
    name = _name(f"{quantity} R", triple)
    if name in graph.tree.nodes:
        rows = [
            graph.term(graph.tree.nodes[_name(f"{quantity} {c}", triple)].outputs[0]) for c in _RGB
        ]
    else:
        rows = [_row(graph, quantity, channel, triple) for channel in _RGB]
    red, green, blue = (part * row for part, row in zip(colour, rows, strict=True))
    return red + green + blue


def _triple(
    graph: Graph,
    group: bpy.types.ShaderNodeTree,
    triple: int,
    output: str,
    given: dict[str, NodeValue],
) -> list[NodeValue]:
    """Red, green and blue of three bands."""
    node = graph.node("ShaderNodeGroup", node_tree=group)
    node.name = _name(NAME, triple)
    for name, value in given.items():
        graph.assign(value, node.inputs[name])
    light = graph.term(node.outputs[output])
    return [light.dot(_row(graph, _SENSOR, channel, triple)) for channel in _RGB]


def _seen(graph: Graph, found: Sequence[Sequence[NodeValue]]) -> NodeValue:
    channels = [sum(parts[1:], start=parts[0]) for parts in zip(*found, strict=True)]
    return graph.vector(*channels)


def _give(socket: bpy.types.NodeSocket, values: float | Sequence[float] | NDArray) -> None:
    if socket.type == "VALUE":
        socket.default_value = float(np.asarray(values))
    else:
        row = [float(x) for x in np.asarray(values)]
        socket.default_value = row + [1.0] * (len(socket.default_value) - len(row))
