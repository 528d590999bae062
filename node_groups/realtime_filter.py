"""Node group colour of what is clear → fraction of each channel that it lets through.

Channels are sums over bands: what a colour takes of one depends on the light behind, for which that
of level open water at the camera stands.
"""

from __future__ import annotations

import bpy

from . import uplift
from .node_mathematics import Graph, new_group
from .realtime_values import FILTERS, Shape, Values

NAME = "UW Filter"


def build(values: bpy.types.ShaderNodeTree, shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group; it is one of those that stand before the user's inputs."""
    tree = new_group(NAME)
    tree[uplift.KIND] = uplift.FILTER
    for label, way in ((uplift.COLOR_INPUT, "INPUT"), ("Fraction", "OUTPUT")):
        tree.interface.new_socket(label, in_out=way, socket_type="NodeSocketVector")
    graph = Graph(tree)
    rgb = graph.components(graph.term(graph.node("NodeGroupInput").outputs[0]))
    red, green, blue = Values(graph, values, shape).of(*FILTERS)
    total = red * rgb[0] + green * rgb[1] + blue * rgb[2]
    graph.assign(total, graph.node("NodeGroupOutput").inputs[0])
    return tree
