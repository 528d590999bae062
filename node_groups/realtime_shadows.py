"""How much of the sun a point gets, read from EEVEE's own shadows on a white surface."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..uw_spectral.mathematics import dot
from .node_mathematics import NODES, Graph, NodeValue

_GRAZING = 1e-3  # cosine to the sun


def sun_visibility(
    graph: Graph, normal: NodeValue, sun: Sequence[NodeValue], gain: NodeValue
) -> NodeValue:
    """Fraction of the direct sun that reaches the shaded point; 0 where it faces away.

    Other lamps shine in other colours than red, or not at all beside the sun.
    """
    lit = graph.components(light_on_white(graph, normal))[0]
    cosine = -dot(graph.components(normal), sun)
    return NODES.clamp(math.pi * lit * gain / NODES.maximum(cosine, _GRAZING), 0.0, 1.0)


def light_on_white(graph: Graph, normal: NodeValue) -> NodeValue:
    """Light of every lamp on a white surface, as EEVEE has it there."""
    white = graph.node("ShaderNodeBsdfDiffuse", {"Color": 1.0, "Normal": normal})
    lit = graph.node("ShaderNodeShaderToRGB", {0: white.outputs[0]})
    return graph.term(lit.outputs["Color"])
