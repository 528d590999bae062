"""Shadows of lamps on objects: EEVEE's own, of a lamp of one colour that stands for each.

It is so faint beside the sun that it is not seen on the scene's own materials, and a white surface
reads it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_surface import patch_past_lamp
from .lamp_images import NAME, LampImages
from .lamp_table import LampTable
from .loops import summed
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_rays import place_here
from .realtime_shadows import light_on_white

SUNLIT, CODE = "lamps beside the sun", "lamp code"
NUMBERS = (SUNLIT, CODE)
"""Names of the numbers that shadows are read with."""
CODES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Colours of the lamps that cast shadows; the first is the sun's where it shines."""
NO_SHADOW = (0.0, 0.0, 0.0)
"""In place of the colour of what stands for objects, and of lamps that cast no shadow."""
_DARKEST = 1e-12
_OF_SHADOWS = (
    "shadow_filter_radius", "shadow_maximum_resolution", "use_absolute_resolution",
    "use_shadow_jitter", "shadow_jitter_overblur",
)  # fmt: skip
# m; far beyond the reach of a lamp in water. From some 5 km on EEVEE draws no shadow.
_REACH_OF_SHADOWS = 200.0


def visibility(
    graph: Graph, numbers: bpy.types.NodeOutputs, images: LampImages, normal: NodeValue
) -> NodeValue:
    """Fraction of the lamps of each colour that the shaded point sees.

    A white surface shows the faint lamps; without objects in their way they would be as bright
    as their inverse squares of the distance.
    """
    sunlit, code = (graph.term(numbers[name]) for name in (SUNLIT, CODE))
    table, here, facing = LampTable.of(graph, images), place_here(graph), graph.components(normal)

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = table.lamp(index)
        lamp = Lamp(lamp.own_place, lamp.axis, 1.0, lamp.profile, 0.0)
        patch = patch_past_lamp(lamp, here, facing, NODES)
        bright = NODES.maximum(patch.cosine, 0.0) / (patch.r * patch.r)
        return (table.colour(index) * bright,)

    (expected,) = summed(graph, table.count - table.virtual, of_lamp)
    seen = light_on_white(graph, normal)
    sun = graph.components(seen)[0] * sunlit
    found = (seen - sun) * (math.pi / code) / NODES.maximum(expected, _DARKEST)
    return NODES.clamp(found, 0.0, 1.0)


def shadow_lamps(like: Sequence[bpy.types.Light]) -> list[bpy.types.Light]:
    """Make the lamps that cast the shadows of the user's; see :func:`write_shadow_lamp`."""
    made = []
    for one in like:
        light = bpy.data.lights.new(NAME, "POINT")
        light.specular_factor = light.transmission_factor = light.volume_factor = 0.0
        light.use_custom_distance, light.cutoff_distance = True, _REACH_OF_SHADOWS
        for name in _OF_SHADOWS:
            setattr(light, name, getattr(one, name))
        made.append(light)
    return made


def write_shadow_lamp(
    light: bpy.types.PointLight, lamp: Lamp, colour: Sequence[float], code: float
) -> None:
    """Give a lamp that casts shadows its colour, its faint intensity and its size."""
    light.color, light.energy = colour, 4.0 * math.pi * code
    light.shadow_soft_size = float(lamp.radius)
