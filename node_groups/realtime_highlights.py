"""Node groups of what closures that EEVEE lacks throw back of the sun.

Colours of a matte closure in their place, see :mod:`.highlights`.
"""

from __future__ import annotations

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.highlights import stretched_highlight, toon_highlight
from .group_sockets import FLOAT, VECTOR, OpenGroup
from .node_mathematics import NODES
from .realtime_air import AirShape
from .realtime_values import DRAWN_SUN, SUN, Values
from .shape import Shape

STRETCHED, TOON = "UW Stretched Highlight", "UW Toon"
NORMAL, TANGENT = "Normal", "Tangent"
NUMBERS = {STRETCHED: ("Roughness", "Anisotropy", "Rotation"), TOON: ("Size", "Smooth")}
"""Inputs of a kind that are those of the shader node."""


def build(kind: str, values: bpy.types.ShaderNodeTree, shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group of a kind."""
    vectors = (NORMAL, TANGENT) if kind == STRETCHED else (NORMAL,)
    inputs: dict[str, str] = dict.fromkeys(vectors, VECTOR) | dict.fromkeys(NUMBERS[kind], FLOAT)
    group = OpenGroup(kind, inputs)
    graph, given = group.graph, group.given
    n = graph.components(given[NORMAL])
    sun = Values(graph, values, shape).of(*(DRAWN_SUN if AirShape in shape else SUN))
    to_sun = [-part for part in sun]
    numbers = [given[name] for name in NUMBERS[kind]]
    found: Operand
    if kind == TOON:
        found = toon_highlight(n, to_sun, *numbers, m=NODES)
    else:
        incoming = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
        to_eye = graph.components(graph.term(incoming))
        tangent = graph.components(given[TANGENT])
        found = stretched_highlight(n, tangent, to_eye, to_sun, *numbers, m=NODES)
    return group.finished({"Colour": found})
