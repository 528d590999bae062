"""Numbers by chance: in shaders of each sample of a pixel, in geometry nodes of each place."""

from __future__ import annotations

from collections.abc import Sequence

from ..uw_spectral.mathematics import Operand
from .node_mathematics import Graph, NodeValue


def chance(graph: Graph, place: Sequence[Operand]) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Return three numbers, even from 0 to 1, of a place or direction.

    Samples of a pixel lie beside each other, and so do not share them.
    """
    inputs = {"Vector": graph.vector(*place)}
    noise = graph.node("ShaderNodeTexWhiteNoise", inputs, noise_dimensions="3D")
    return graph.components(graph.term(noise.outputs["Color"]))


class PlaceChance:
    """Numbers of 0 to 1 of each place of geometry nodes, by a seed and a number of their own."""

    def __init__(self, graph: Graph, seed: NodeValue) -> None:
        self._graph, self._seed = graph, seed

    def number(self, number: int) -> NodeValue:
        """Return one."""
        return self._of("FLOAT", number)

    def vector(self, number: int) -> NodeValue:
        """Return three."""
        return self._of("FLOAT_VECTOR", number)

    def _of(self, kind: str, number: int) -> NodeValue:
        graph, inputs = self._graph, {0: self._seed, 1: 16, 2: number}
        own = graph.node("FunctionNodeIntegerMath", inputs, operation="MULTIPLY_ADD")
        node = graph.node("FunctionNodeRandomValue", data_type=kind)
        graph.assign(own.outputs[0], node.inputs["Seed"])
        return graph.term(next(s for s in node.outputs if s.enabled))
