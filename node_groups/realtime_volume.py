"""Material of the shafts of light: single scattering of the sun, with its shadows.

EEVEE multiplies the scattering coefficient with the sun's shadows. So the coefficient holds the
radiance that the channels see, made small by ``shaft scale``, and the lamp's volume factor makes it
large again: the volume adds light and hardly dims what is behind it. Its phase function is a
Henyey-Greenstein one, which takes most of the contrast between directions out of the coefficient
(froxels hold few bits); the water's own phase function over that one is part of the coefficient.
"""

from __future__ import annotations

import bpy

from ..uw_spectral.mathematics import dot
from ..uw_spectral.surface.wave_patterns import sunlight_factor
from ..uw_spectral.water.phase_functions import henyey_greenstein
from .data_blocks import new_material
from .node_mathematics import NODES
from .realtime_rays import depth_here, view_direction, view_distance
from .realtime_values import SHAFT_END, SHAFT_SCALE
from .realtime_water import PixelWater
from .realtime_waves import CAUSTIC_STRENGTH, caustics_here, images_in
from .shape import Shape, Sources

NAME = "UW Shafts"
ANISOTROPY = 0.8


def build(shape: Shape, sources: Sources) -> bpy.types.Material:
    """Build the material.

    Where a channel's sum over the bands is negative, which no coefficient can be, the volume draws
    nothing and the surfaces keep that light, without shadows.
    """
    material, graph, output = new_material(NAME)
    water = PixelWater(graph, shape, sources)
    w, v, y = view_direction(graph), view_distance(graph), depth_here(graph)
    per_metre = water.along(w).single_scattering_at(y, v)
    inside = NODES.less(v, water.values[SHAFT_END])
    phase = henyey_greenstein(ANISOTROPY, 0.5 - 0.5 * -dot(w, water.sun), NODES)
    strength = water.values[SHAFT_SCALE] * inside / phase
    waves = images_in(sources.parts)
    if waves is not None:
        # The unscattered sun carries the whole pattern, whatever the channel.
        pattern = caustics_here(graph, sources.values, waves.caustics)
        strength = strength * sunlight_factor(pattern, water.values[CAUSTIC_STRENGTH], NODES)
    drawn = NODES.maximum(per_metre * strength, 0.0)
    inputs = {"Color": drawn, "Density": 1.0, "Anisotropy": ANISOTROPY}
    graph.assign(graph.node("ShaderNodeVolumeScatter", inputs).outputs[0], output.inputs["Volume"])
    return material
