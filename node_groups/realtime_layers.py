"""Layers of a picture as EEVEE writes them: outputs of the shaders beside their colour.

Each is a number, of which three are the channels of the sensor or three bands: an output for
colours would cut what is below zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..uw_spectral.mathematics import Operand
from .node_mathematics import NODES, Graph, NodeValue

LIGHT = ("I", "J", "D", "B_single", "B_multiple", "B_lamps", "F", "T", "E", "reflectance")
"""What three bands have each their own of."""
POINT = ("albedo", "caustics", "shadow")
"""What is the same for all bands; albedo is a colour."""
_SHARES = ("I", "J", "D", "B_single", "B_multiple", "B_lamps", "F", "albedo", "reflectance")
_NUMBERS = ("caustics", "shadow")
_LEAST_COVERED = 1e-4


def output_names(layer: str) -> tuple[str, ...]:
    """Names of the outputs of a layer.

    Examples
    --------
    >>> output_names("D"), output_names("shadow")
    (('uw_D_0', 'uw_D_1', 'uw_D_2'), ('uw_shadow',))
    """
    if layer in _NUMBERS:
        return (f"uw_{layer}",)
    return tuple(f"uw_{layer}_{channel}" for channel in range(3))


def write(
    graph: Graph,
    layers: Iterable[str],
    values: Mapping[str, Operand],
    coverage: Operand = 1.0,
) -> None:
    """Bring values to the outputs of a shader.

    Parameters
    ----------
    graph : Graph
        Of the shader, or of a group in it.
    layers : iterable of str
        Those that are wanted; what has no value is 0.
    values : mapping of str to NodeValue
    coverage : NodeValue or float
        Share of the pixel that the surface fills, with which light and colours are multiplied.
        EEVEE draws the surface in that share of the samples.
    """
    for layer in layers:
        value = values.get(layer, 0.0)
        if layer in _SHARES and isinstance(value, NodeValue):
            value = value / NODES.maximum(coverage, _LEAST_COVERED)
        several = isinstance(value, NodeValue) and value.size > 1
        parts = graph.components(value) if several else [value] * 3
        for name, part in zip(output_names(layer), parts, strict=False):
            output = graph.node("ShaderNodeOutputAOV", aov_name=name)
            graph.assign(part, output.inputs["Value"])
