"""Materials of the water and of clouds in it for Cycles: absorption and scattering per band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import bpy
import numpy as np

from ..uw_spectral.clouds.gaussian_blob import GaussianBlob
from ..uw_spectral.mathematics import Operand
from . import attributes
from .data_blocks import new_material, of_view_layer, vector_of_view_layer
from .node_mathematics import NODES, Graph, NodeValue

NAME, CLOUD_NAME = "UW Water", "UW Cloud"


@dataclass(frozen=True)
class ScatteringLobe:
    """One phase function that Cycles knows."""

    phase: Literal["HENYEY_GREENSTEIN", "DRAINE", "FOURNIER_FORAND", "RAYLEIGH"]
    anisotropy: float = 0.0  #: Mean cosine, Henyey-Greenstein; asymmetry, Draine.
    alpha: float = 0.5  #: Weight of cos² beside 1, Draine only.
    index: float = 1.10  #: Relative index of the particles, Fournier-Forand only.
    backscatter: float = 0.0183  #: bb/b, Fournier-Forand only.
    by_band: bool = False  #: Anisotropy and alpha differ by band: attributes of the pass.


def build(
    lobes: tuple[ScatteringLobe, ...],
    layer: int | str = 0,
    density: Callable[[Graph], NodeValue] | None = None,
) -> bpy.types.Material:
    """Build the material of a layer of the water, which scatters with some lobes.

    The layer is a number, or :func:`.attributes.cloud`; ``density`` makes the nodes of what the
    coefficients are multiplied with.
    """
    material, graph, output = new_material(NAME)
    fraction, total = density(graph) if density is not None else 1.0, None
    for index, lobe in enumerate(lobes):
        node = volume_coefficients(graph)
        node.phase = lobe.phase
        b = vector_of_view_layer(graph, attributes.scattering(layer, index))
        inputs: dict[str, Operand] = {
            "Scatter Coefficients": fraction * b,
            "Anisotropy": lobe.anisotropy,
            "Alpha": lobe.alpha,
            "IOR": lobe.index,
            "Backscatter": lobe.backscatter,
        }
        if index == 0:
            a = vector_of_view_layer(graph, attributes.absorption(layer))
            inputs["Absorption Coefficients"] = fraction * a
        if lobe.by_band:
            # The mean over the bands of a pass, which share a phase function.
            asymmetry, alpha = (
                of_view_layer(graph, name(layer, index)).outputs["Factor"]
                for name in (attributes.asymmetry, attributes.alpha)
            )
            inputs |= {"Anisotropy": asymmetry, "Alpha": alpha}
        for name, value in inputs.items():
            graph.assign(value, _input(node, name))
        total = node.outputs[0] if total is None else graph.added(total, node.outputs[0])
    if total is not None:
        graph.assign(total, output.inputs["Volume"])
    return material


def build_cloud(
    lobes: tuple[ScatteringLobe, ...], index: int, outline: float | None
) -> bpy.types.Material:
    """Build the material of a blob, whose outline is a sphere in its object's own space.

    Without one that of an object with a grid of its own.
    """

    def density(graph: Graph) -> NodeValue:
        if outline is None:
            node = graph.node("ShaderNodeAttribute", attribute_name="density")
            found = NODES.maximum(graph.term(node.outputs["Factor"]), 0.0)
        else:
            blob = GaussianBlob.of_axes((0.0, 0.0, 0.0), outline * np.eye(3))
            own = graph.term(graph.node("ShaderNodeTexCoord").outputs["Object"])
            found = blob.density(graph.components(own), NODES)
        place = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Position"])
        return found * NODES.less(graph.components(place)[2], 0.0)  # in the water

    material = build(lobes, attributes.cloud(index), density)
    material.name = CLOUD_NAME
    return material


def volume_coefficients(graph: Graph) -> bpy.types.Node:
    """Add a volume that neither absorbs nor scatters nor emits, as Blender's own default does."""
    node = graph.node("ShaderNodeVolumeCoefficients")
    _input(node, "Weight").default_value = 1.0
    for name in ("Absorption", "Scatter", "Emission"):
        _input(node, f"{name} Coefficients").default_value = (0.0, 0.0, 0.0)
    return node


def _input(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket:
    """Return an input by name, also one that the node's phase function leaves unused."""
    return next(socket for socket in node.inputs if socket.name == name)
