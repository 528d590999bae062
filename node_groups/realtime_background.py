"""World of the real-time mode: open water with its floor or surface behind."""

from __future__ import annotations

import bpy
from nodebpy import shader as s

from ..uw_spectral.transfer.radiance_field import Ripples
from .node_mathematics import NODES, Graph, NodeValue, new_group
from .realtime_rays import shaft, view_direction
from .realtime_values import (
    CAMERA_DEPTH,
    GLITTER,
    GLITTER_WIDTH,
    Shape,
    Values,
    build_triple,
    sum_of_triples,
)
from .realtime_waves import SLOPE, WaveImages, slope_ahead

NAME = "UW Background of Bands"
TRIPLE_NAME = "UW Background of Three Bands"


def build(
    values: bpy.types.ShaderNodeTree, shape: Shape, images: WaveImages | None
) -> bpy.types.ShaderNodeTree:
    """Build the group; output ``Color`` is what the sensor sees."""
    inputs = {SLOPE: "NodeSocketVector"} if shape.waves else {}
    triple = build_triple(TRIPLE_NAME, shape, inputs, _picture)
    tree = new_group(NAME)
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    graph = Graph(tree)
    given = {}
    if images is not None:
        given = slope_ahead(graph, values, images.slopes, view_direction(graph))
    colour = sum_of_triples(graph, values, triple, shape, given)
    graph.assign(colour, graph.node("NodeGroupOutput").inputs[0])
    return tree


def _picture(graph: Graph, values: Values) -> tuple[NodeValue, ...]:
    w, y_o = view_direction(graph), NODES.maximum(values[CAMERA_DEPTH], 0.0)
    ripples = None
    if values.shape.waves:
        slopes = graph.components(values[SLOPE])[:2]
        ripples = Ripples(slopes, values[GLITTER_WIDTH], values[GLITTER])
    seen = values.seen(values.water.open_water(y_o, w, NODES, ripples))
    if values.shape.shafts:
        return seen, values.sensor(shaft(values, y_o, w, None))
    return (seen,)


def build_world(group: bpy.types.ShaderNodeTree) -> bpy.types.World:
    """Build a world that shows the group to the camera and lights nothing."""
    with s.world(NAME) as world:
        node = world.tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        background = s.Background(strength=s.LightPath().o.is_camera_ray)
        world.tree.links.new(node.outputs[0], background.node.inputs["Color"])
        background >> s.WorldOutput()
    # EEVEE draws a map of the world for its light, of which there is none.
    world.world.probe_resolution = "128"
    return world.world
