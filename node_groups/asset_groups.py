"""Node groups with clean sockets, for people who build shaders of their own.

They hold the formulas and the numbers of the real-time groups, three bands at a time; red, green
and blue stand for :data:`WAVELENGTHS`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import bpy

from ..uw_spectral.surface.wave_patterns import interp, sunlight_factor
from ..uw_spectral.transfer.pixel import transmittance
from . import realtime_values, realtime_waves
from .node_mathematics import NODES, Graph, NodeValue, new_group
from .realtime_triples import Values
from .realtime_values import Numbers, Shape
from .realtime_waves import WaveImages

WAVELENGTHS = (600.0, 540.0, 450.0)
"""In nm; the centres of the bands that stand for red, green and blue."""
DISTANCE, EXTINCTION = "Distance", "Extinction"
DEPTH, DIRECTION = "Camera Depth", "Direction"
TRANSMITTANCE, PATH_RADIANCE = "Transmittance", "Path Radiance"
KIND, COLOUR, STRENGTH, SUNLIGHT = "Type", "Colour", "Strength", "Sunlight"


@dataclass(frozen=True)
class Socket:
    """An input or output: its type, words with the unit, its value and its smallest one."""

    kind: str
    text: str
    value: float | tuple[float, ...] | None = None
    least: float | None = None


_SOCKETS = {
    DISTANCE: Socket("Float", "Length of the way through the water, m", 1.0, 0.0),
    EXTINCTION: Socket("Vector", "Absorption and scattering together, 1/m", (0.4, 0.1, 0.08), 0.0),
    DEPTH: Socket("Float", "Depth of the camera under the surface, m", 5.0, 0.0),
    DIRECTION: Socket("Vector", "Unit vector away from the camera, z up", (0.0, 1.0, 0.0)),
    KIND: Socket("Float", "0 to 9: Jerlov I, IA, IB, II, III, 1C, 3C, 5C, 7C, 9C", 2.0, 0.0),
    STRENGTH: Socket("Float", "Contrast; 1 as the surface makes it, 0 none", 1.0, 0.0),
    TRANSMITTANCE: Socket("Vector", "Share of the light that arrives unscattered"),
    PATH_RADIANCE: Socket(
        "Vector",
        "Light that the water scatters into the view, per steradian, relative to the sun's "
        "irradiance",
    ),
    COLOUR: Socket("Color", "Linear colour of the open water"),
    SUNLIGHT: Socket("Float", "Factor on the sunlight at the shaded point"),
}


class _Asset:
    """A group under construction: its graph and the terms of its inputs."""

    def __init__(self, name: str, inputs: Sequence[str], outputs: Sequence[str], text: str) -> None:
        self.tree = new_group(name)
        self.tree.description = text
        for direction, names in (("INPUT", inputs), ("OUTPUT", outputs)):
            for socket_name in names:
                about = _SOCKETS[socket_name]
                socket = self.tree.interface.new_socket(
                    socket_name, in_out=direction, socket_type=f"NodeSocket{about.kind}"
                )
                socket.description = about.text
                if about.value is not None:
                    socket.default_value = about.value
                if about.least is not None:
                    socket.min_value = about.least
        self.graph = Graph(self.tree)
        sockets = self.graph.node("NodeGroupInput").outputs
        self.given = {s.name: self.graph.term(s) for s in sockets if s.name}

    def finished(self, results: Mapping[str, NodeValue]) -> bpy.types.ShaderNodeTree:
        """Link the results, and spread the nodes."""
        end = self.graph.node("NodeGroupOutput")
        for name, value in results.items():
            self.graph.assign(value, end.inputs[name])
        return self.tree


def build_transmittance(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group of the light that passes water of a given extinction."""
    asset = _Asset(
        name, (DISTANCE, EXTINCTION), (TRANSMITTANCE,),
        "Share of light that arrives unscattered after a way through water",
    )  # fmt: skip
    passed = transmittance(asset.given[EXTINCTION], asset.given[DISTANCE], NODES)
    return asset.finished({TRANSMITTANCE: passed})


def build_water(name: str, text: str, shape: Shape, numbers: Numbers) -> bpy.types.ShaderNodeTree:
    """Build the group of what a way through one water does to light.

    Parameters
    ----------
    name, text : str
    shape : Shape
        Of three bands, in closed form.
    numbers : Numbers
        Of :func:`.realtime_water`.
    """
    asset = _Asset(name, (DISTANCE, DEPTH, DIRECTION), (TRANSMITTANCE, PATH_RADIANCE), text)
    graph, given = asset.graph, asset.given
    water = Values(graph, _numbers(graph, name, shape, numbers), shape).elastic
    P = given[DISTANCE]
    w = graph.components(given[DIRECTION])
    return asset.finished(
        {
            TRANSMITTANCE: transmittance(water.c, P, NODES),
            PATH_RADIANCE: water.path(given[DEPTH], w, P, NODES),
        }
    )


def build_jerlov_colour(name: str, colours: Sequence[Sequence[float]]) -> bpy.types.ShaderNodeTree:
    """Build the group of the open water's colour by Jerlov type, linear Rec.709 of each type."""
    asset = _Asset(
        name, (KIND,), (COLOUR,),
        "Colour of open water at 5 m, looking level, developed for daylight; types in between mix",
    )  # fmt: skip
    channels = zip(*colours, strict=True)
    mixed = [interp(asset.given[KIND], list(map(float, row)), NODES) for row in channels]
    return asset.finished({COLOUR: asset.graph.vector(*mixed)})


def build_caustics(
    name: str, shape: Shape, numbers: Numbers, images: WaveImages
) -> bpy.types.ShaderNodeTree:
    """Build the group of the sunlight that waves focus on things, at one moment."""
    asset = _Asset(
        name, (STRENGTH,), (SUNLIGHT,),
        "Sunlight under waves at the shaded point, relative to a flat surface at z = 0",
    )  # fmt: skip
    values = _values(name, shape, numbers)
    found = realtime_waves.caustics_here(asset.graph, values, images.caustics)
    pattern = found[realtime_waves.PATTERN]
    return asset.finished({SUNLIGHT: sunlight_factor(pattern, asset.given[STRENGTH], NODES)})


def _values(name: str, shape: Shape, numbers: Numbers) -> bpy.types.ShaderNodeTree:
    tree = realtime_values.build(shape)
    tree.name = f"{name} Values"
    realtime_values.write(tree, numbers)
    return tree


def _numbers(graph: Graph, name: str, shape: Shape, numbers: Numbers) -> dict[str, NodeValue]:
    """Return the terms of the numbers of a shape of three bands."""
    outputs = graph.shared(_values(name, shape, numbers))
    found = {n: graph.term(outputs[n]) for n in realtime_values.single_names(shape)}
    bands = realtime_values.band_names(shape)
    return found | {n: graph.term(outputs[f"{n} 0"]) for n in bands}
