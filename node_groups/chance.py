"""Numbers by chance in shaders: others for each sample of a pixel, the same in every pass."""

from __future__ import annotations

from collections.abc import Sequence

from ..uw_spectral.mathematics import Operand
from .node_mathematics import Graph, NodeValue


def chance(graph: Graph, place: Sequence[Operand]) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Return three numbers, even from 0 to 1, of a place or direction.

    Samples of a pixel lie beside each other, and so do not share them.
    """
    noise = graph.node("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
    graph.assign(graph.vector(*place), noise.inputs["Vector"])
    return graph.components(graph.term(noise.outputs["Color"]))
