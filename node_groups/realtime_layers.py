"""Layers of a picture as EEVEE writes them: outputs of the shaders beside their colour.

EEVEE cuts what is below zero in them, so light that may be is left to be subtracted; and every
output takes its time to compile.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..uw_spectral.mathematics import Operand
from .node_mathematics import NODES, Graph, NodeValue

LIGHT = ("I", "J", "D", "B_water", "B_single", "B_lamps", "F", "E", "reflectance")
"""What three bands have each their own of."""
COLOURS = ("albedo",)
NUMBERS = ("caustics", "shadow")
"""What is the same for all bands; the numbers share an output."""
_TOGETHER = "numbers"
_PREFIX = "uw_"
_UNWEIGHTED = ("E", *NUMBERS)
_LEAST_COVERED = 1e-4


def output_names(layers: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return the outputs that layers need, and what each holds."""
    wanted = list(layers)
    found = {f"{_PREFIX}{name}": (name,) for name in wanted if name not in NUMBERS}
    numbers = tuple(name for name in NUMBERS if name in wanted)
    return {**found, f"{_PREFIX}{_TOGETHER}": numbers} if numbers else found


def write(
    graph: Graph, layers: Iterable[str], values: Mapping[str, Operand], coverage: Operand = 1.0
) -> None:
    """Bring those values that are wanted to the outputs of a shader; what has no value is 0.

    Light and colours are multiplied with the ``coverage``, the fraction of the pixel that the
    surface fills: EEVEE draws the surface in that fraction of the samples.
    """
    for output, held in output_names(layers).items():
        found = [values.get(name, 0.0) for name in held]
        value = found[0]
        if held[0] in NUMBERS:
            value = graph.vector(*[*found, 0.0, 0.0][:3])
        elif held[0] not in _UNWEIGHTED and isinstance(value, NodeValue):
            value = value / NODES.maximum(coverage, _LEAST_COVERED)
        graph.assign(value, graph.node("ShaderNodeOutputAOV", aov_name=output).inputs["Color"])
