"""How much of the light from above a point gets, read from EEVEE's own shadows.

Two lamps are as wide as that light; one casts shadows. A white surface tells
them from the white sun by their colours, which are so faint that on the
scene's own materials they are not seen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from .node_mathematics import NODES, Graph, NodeValue

OPENNESS = "Openness"
SUNLIT = "Sunlit"

# Fainter ones would drown in the rounding of single precision beside the sun.
_FAINT = 1.0 / 2048.0
_DARKEST = 1e-3 * _FAINT
_GRAZING = 1e-3  # cosine to the sun
_SHADOW = 0.1  # m; the lamp's width blurs a shadow by twice its distance
_COLOURS = ((0.0, _FAINT, 0.0), (0.0, 0.0, _FAINT))


def lamps() -> list[bpy.types.Light]:
    """Make the two lamps, the one with shadows first."""
    made = []
    for colour, shadow in zip(_COLOURS, (True, False), strict=True):
        lamp = bpy.data.lights.new("UW Light from Above", "SUN")
        lamp.color, lamp.energy = colour, 1.0
        lamp.use_shadow, lamp.shadow_maximum_resolution = shadow, _SHADOW
        lamp.specular_factor = lamp.transmission_factor = lamp.volume_factor = 0.0
        made.append(lamp)
    return made


def openness(graph: Graph, normal: NodeValue) -> NodeValue:
    """Share of the lamps' light that reaches the shaded point; 1 where they do not shine."""
    sun, shadowed, everything = graph.components(light_on_white(graph, normal))
    lost = (everything - shadowed) / NODES.maximum(everything - sun, _DARKEST)
    return 1.0 - NODES.clamp(lost, 0.0, 1.0)


def sun_visibility(graph: Graph, normal: NodeValue, sun: Sequence[NodeValue]) -> NodeValue:
    """Share of the direct sun that reaches the shaded point; 0 where it faces away.

    Other lamps shine in other colours than red, or not at all beside the sun.
    """
    lit = graph.components(light_on_white(graph, normal))[0]
    nx, ny, nz = graph.components(normal)
    cosine = -(nx * sun[0] + ny * sun[1] + nz * sun[2])
    return NODES.clamp(math.pi * lit / NODES.maximum(cosine, _GRAZING), 0.0, 1.0)


def light_on_white(graph: Graph, normal: NodeValue) -> NodeValue:
    """Light of every lamp on a white surface, as EEVEE has it there."""
    white = graph.node("ShaderNodeBsdfDiffuse")
    white.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    graph.assign(normal, white.inputs["Normal"])
    lit = graph.node("ShaderNodeShaderToRGB")
    graph.tree.links.new(white.outputs[0], lit.inputs[0])
    return graph.term(lit.outputs["Color"])
