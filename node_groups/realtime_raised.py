"""Where a view ray meets the moving surface, if that has heights."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import bpy

from ..uw_spectral.surface.raised_waves import surface_ahead
from .loops import iterated
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue, new_group
from .realtime_values import WAVES_HIGHEST
from .realtime_waves import WaveImages, numbers_of, raised_at

_HEIGHT_NAME, _CROSSING_NAME = "UW Surface Height", "UW Surface Crossing"
_X, _Y, _HEIGHT = "X", "Y", "Height"
_START, _DIRECTION, _FOUND, _DISTANCE = "Start", "Direction", "Found", "Distance"


def crossing(
    graph: Graph,
    values: bpy.types.ShaderNodeTree,
    images: WaveImages,
    start: Sequence[NodeValue],
    w: Sequence[NodeValue],
    *,
    in_air: bool,
    first: float = 0.0,
) -> tuple[NodeValue, NodeValue]:
    """Whether a ray from ``start`` along ``w`` meets the surface, 0 or 1, and at what distance, m.

    ``in_air`` is whether it begins in the air; it looks from the distance ``first`` on, m.
    """
    group = _build_crossing(values, images, in_air=in_air, first=first)
    node = graph.node("ShaderNodeGroup", node_tree=group)
    graph.assign(graph.vector(*start), node.inputs[_START])
    graph.assign(graph.vector(*w), node.inputs[_DIRECTION])
    return graph.term(node.outputs[_FOUND]), graph.term(node.outputs[_DISTANCE])


def _build_crossing(
    values: bpy.types.ShaderNodeTree, images: WaveImages, *, in_air: bool, first: float
) -> bpy.types.ShaderNodeTree:
    tree = new_group(_CROSSING_NAME)
    graph = Graph(tree, PART_SIZE)
    for name in (_START, _DIRECTION):
        tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketVector")
    for name in (_FOUND, _DISTANCE):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketFloat")
    given = graph.node("NodeGroupInput").outputs
    start, w = (graph.components(graph.term(given[name])) for name in (_START, _DIRECTION))
    height = _build_height(values, images)

    def elevation(x: NodeValue, y: NodeValue) -> NodeValue:
        node = graph.node("ShaderNodeGroup", node_tree=height)
        graph.assign(x, node.inputs[_X])
        graph.assign(y, node.inputs[_Y])
        return graph.term(node.outputs[_HEIGHT])

    highest = graph.term(graph.shared(values)[WAVES_HIGHEST])
    side = 1.0 if in_air else -1.0
    iterate = functools.partial(iterated, graph)
    found, distance = surface_ahead(start, w, elevation, highest, side, first, NODES, iterate)
    end = graph.node("NodeGroupOutput").inputs
    graph.assign(found, end[_FOUND])
    graph.assign(distance, end[_DISTANCE])
    return tree


def _build_height(values: bpy.types.ShaderNodeTree, images: WaveImages) -> bpy.types.ShaderNodeTree:
    tree = new_group(_HEIGHT_NAME)
    graph = Graph(tree)
    for name in (_X, _Y):
        tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket(_HEIGHT, in_out="OUTPUT", socket_type="NodeSocketFloat")
    given = graph.node("NodeGroupInput").outputs
    x, y = (graph.term(given[name]) for name in (_X, _Y))
    surface = raised_at(graph, numbers_of(graph, values), images, x, y)
    graph.assign(graph.components(surface)[2], graph.node("NodeGroupOutput").inputs[_HEIGHT])
    return tree
