"""How much of the light from above a point gets, read from EEVEE's own shadows.

Two lamps are as wide as that light; one casts shadows. A white surface tells
them from the white sun by their colours, which are so faint that on the
scene's own materials they are not seen.
"""

from __future__ import annotations

import bpy

from .node_mathematics import NODES, Graph, NodeValue

OPENNESS = "Openness"

# Fainter ones would drown in the rounding of single precision beside the sun.
_FAINT = 1.0 / 2048.0
_DARKEST = 1e-3 * _FAINT
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
    white = graph.node("ShaderNodeBsdfDiffuse")
    white.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    graph.assign(normal, white.inputs["Normal"])
    lit = graph.node("ShaderNodeShaderToRGB")
    graph.tree.links.new(white.outputs[0], lit.inputs[0])
    sun, shadowed, everything = graph.components(graph.term(lit.outputs["Color"]))
    lost = (everything - shadowed) / NODES.maximum(everything - sun, _DARKEST)
    return 1.0 - NODES.clamp(lost, 0.0, 1.0)
