"""Compositor group: band images times the sensor's weights → linear RGB."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from .node_mathematics import Graph, NodeValue

NAME = "UW Sensor"


def build(
    weights: NDArray[np.float64], passes: Sequence[tuple[int, ...]]
) -> bpy.types.CompositorNodeTree:
    """Build the group for a reduction, with inputs ``Pass 1`` … ``Pass m`` and an output ``Image``.

    The weights, shape (3, n), are linear RGB per unit radiance of each band; ``passes`` are the
    bands that the channels of each pass image carry.
    """
    tree = bpy.data.node_groups.new(NAME, "CompositorNodeTree")
    graph = Graph(tree)
    for number in range(1, len(passes) + 1):
        tree.interface.new_socket(f"Pass {number}", in_out="INPUT", socket_type="NodeSocketColor")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    images = graph.node("NodeGroupInput").outputs
    parts = []
    for indices, image in zip(passes, images, strict=False):
        rows = np.zeros((3, 3))
        rows[:, : len(indices)] = weights[:, list(indices)]
        vector = _bands_of(graph, image)
        parts.append([_weighed(graph, vector, row) for row in rows])
    joined = graph.node("CompositorNodeCombineColor")
    for channel, socket in zip(zip(*parts, strict=True), joined.inputs, strict=False):
        graph.assign(functools.reduce(operator.add, channel), socket)
    graph.node("NodeGroupOutput", {0: joined.outputs[0]})
    return tree


def _bands_of(graph: Graph, image: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    bands = graph.node("CompositorNodeSeparateColor", {0: image}).outputs[:3]
    return graph.node("ShaderNodeCombineXYZ", dict(enumerate(bands))).outputs[0]


def _weighed(graph: Graph, vector: bpy.types.NodeSocket, weights: NDArray[np.float64]) -> NodeValue:
    inputs = {0: vector, 1: weights.tolist()}
    node = graph.node("ShaderNodeVectorMath", inputs, operation="DOT_PRODUCT")
    return graph.term(node.outputs["Value"])
