"""Node groups with clean sockets, for people who build shaders of their own.

They hold the formulas and the numbers of the real-time groups, three bands at a time; red, green
and blue stand for :data:`WAVELENGTHS`.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..node_groups import group_sockets, realtime_values, realtime_waves
from ..node_groups.group_sockets import FLOAT, VECTOR, OpenGroup, Socket
from ..node_groups.node_mathematics import NODES
from ..node_groups.realtime_values import Numbers
from ..node_groups.realtime_waves import WaveImages
from ..node_groups.shape import Shape
from ..uw_spectral.surface.wave_patterns import interp, sunlight_factor
from ..uw_spectral.transfer.path_integral import transmittance

WAVELENGTHS = (600.0, 540.0, 450.0)
"""In nm; the centres of the bands that stand for red, green and blue."""
DISTANCE, EXTINCTION = "Distance", "Extinction"
TRANSMITTANCE = "Transmittance"
KIND, COLOUR, STRENGTH, SUNLIGHT = "Type", "Colour", "Strength", "Sunlight"


_SOCKETS = {
    DISTANCE: Socket(FLOAT, "Length of the way through the water, m", 1.0, 0.0),
    EXTINCTION: Socket(VECTOR, "Absorption and scattering together, 1/m", (0.4, 0.1, 0.08), 0.0),
    KIND: Socket(FLOAT, "0 to 9: Jerlov I, IA, IB, II, III, 1C, 3C, 5C, 7C, 9C", 2.0, 0.0),
    STRENGTH: Socket(FLOAT, "Contrast; 1 as the surface makes it, 0 none", 1.0, 0.0),
    TRANSMITTANCE: Socket(VECTOR, "Fraction of the light that arrives unscattered"),
    COLOUR: Socket(group_sockets.COLOUR, "Linear colour of the open water"),
    SUNLIGHT: Socket(FLOAT, "Factor on the sunlight at the shaded point"),
}


def build_transmittance(name: str) -> bpy.types.ShaderNodeTree:
    """Build the group of the light that passes water of a given extinction."""
    asset = _group(
        name, (DISTANCE, EXTINCTION), (TRANSMITTANCE,),
        "Fraction of light that arrives unscattered after a way through water",
    )  # fmt: skip
    passed = transmittance(asset.given[EXTINCTION], asset.given[DISTANCE], NODES)
    return asset.finished({TRANSMITTANCE: passed})


def build_jerlov_colour(name: str, colours: Sequence[Sequence[float]]) -> bpy.types.ShaderNodeTree:
    """Build the group of the open water's colour by Jerlov type, linear Rec.709 of each type."""
    asset = _group(
        name, (KIND,), (COLOUR,),
        "Colour of open water at 5 m, looking level, developed for daylight; types in between mix",
    )  # fmt: skip
    channels = zip(*colours, strict=True)
    mixed = [interp(asset.given[KIND], list(map(float, row)), NODES) for row in channels]
    return asset.finished({COLOUR: asset.graph.vector(*mixed)})


def build_caustics(
    name: str, shape: Shape, numbers: Numbers, images: WaveImages
) -> bpy.types.ShaderNodeTree:
    """Build the group of the sunlight that waves focus on objects, at one moment."""
    asset = _group(
        name, (STRENGTH,), (SUNLIGHT,),
        "Sunlight under waves at the shaded point, relative to a flat surface at z = 0",
    )  # fmt: skip
    values = _values(name, shape, numbers)
    pattern = realtime_waves.caustics_here(asset.graph, values, images.caustics)
    return asset.finished({SUNLIGHT: sunlight_factor(pattern, asset.given[STRENGTH], NODES)})


def _group(name: str, inputs: Sequence[str], outputs: Sequence[str], text: str) -> OpenGroup:
    given, results = ({n: _SOCKETS[n] for n in names} for names in (inputs, outputs))
    return OpenGroup(name, given, results, text)


def _values(name: str, shape: Shape, numbers: Numbers) -> bpy.types.ShaderNodeTree:
    tree = realtime_values.build(shape)
    tree.name = f"{name} Values"
    realtime_values.write(tree, numbers)
    return tree
