"""Materials of clouds for Cycles: matter besides the water, where its density is."""

from __future__ import annotations

import bpy
import numpy as np

from ..uw_spectral.clouds.gaussian_blob import GaussianBlob
from . import attributes, water_volume
from .node_mathematics import NODES, Graph, NodeValue
from .water_volume import ScatteringLobe

NAME = "UW Cloud"


def build(
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

    material = water_volume.build(lobes, attributes.cloud(index), density)
    material.name = NAME
    return material
