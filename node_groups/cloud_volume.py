"""Materials of clouds for Cycles: matter besides the water, where its density is."""

from __future__ import annotations

import bpy
import numpy as np

from ..uw_spectral.clouds.gaussian_blob import GaussianBlob
from . import attributes, water_volume
from .node_mathematics import NODES, Graph, NodeValue
from .water_volume import ScatteringLobe

NAME = "UW Cloud"


def build_blob(lobes: tuple[ScatteringLobe, ...], index: int, outline: float) -> bpy.types.Material:
    """Build the material of a blob, whose outline is a sphere in its object's own space."""
    blob = GaussianBlob.of_axes((0.0, 0.0, 0.0), outline * np.eye(3))

    def density(graph: Graph) -> NodeValue:
        place = graph.components(graph.term(graph.node("ShaderNodeTexCoord").outputs["Object"]))
        return blob.density(place, NODES) * _wet(graph)

    return _named(water_volume.build(lobes, attributes.cloud(index), density))


def build_grid(lobes: tuple[ScatteringLobe, ...], index: int) -> bpy.types.Material:
    """Build the material of an object with a grid of its own."""

    def density(graph: Graph) -> NodeValue:
        node = graph.node("ShaderNodeAttribute", attribute_name="density")
        return NODES.maximum(graph.term(node.outputs["Factor"]), 0.0) * _wet(graph)

    return _named(water_volume.build(lobes, attributes.cloud(index), density))


def _named(material: bpy.types.Material) -> bpy.types.Material:
    material.name = NAME
    return material


def _wet(graph: Graph) -> NodeValue:
    """Whether a place is in the water."""
    place = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Position"])
    return NODES.less(graph.components(place)[2], 0.0)
