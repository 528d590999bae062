"""World of the real-time mode: open water with its floor or surface behind."""

from __future__ import annotations

import dataclasses
import functools

import bpy

from ..uw_spectral.transfer.pixel_layers import pixel_layers
from ..uw_spectral.transfer.radiance_field import Ripples, distance_in_water, mirrored_ray
from . import realtime_lamps, realtime_layers
from .data_blocks import new_world
from .node_mathematics import NODES, Graph, NodeValue, new_group
from .realtime_rays import camera_depth, camera_place, view_direction
from .realtime_triples import (
    DRAWN,
    MIRRORED_TOWARDS,
    SEEN,
    TOWARDS,
    TableImages,
    Triples,
    Values,
    build_triple,
    looked_up_ahead,
    phase_inputs,
    phase_towards,
)
from .realtime_values import CAMERA_DEPTH, GLITTER, GLITTER_WIDTH, Shape
from .realtime_waves import SLOPE, WaveImages, slope_ahead

NAME = "UW Background of Bands"
TRIPLE_NAME = "UW Background of Three Bands"


def build(
    values: bpy.types.ShaderNodeTree,
    shape: Shape,
    images: WaveImages | None,
    tables: TableImages,
) -> bpy.types.ShaderNodeTree:
    """Build the group; output ``Color`` is what the sensor sees."""
    inputs = {SLOPE: "NodeSocketVector"} if shape.waves else {}
    if shape.solved:
        inputs |= dict.fromkeys(looked_up_ahead(shape), "NodeSocketVector")
        inputs |= dict.fromkeys(phase_inputs(TOWARDS, shape), "NodeSocketFloat")
    if shape.solved and shape.flat:
        inputs |= dict.fromkeys(phase_inputs(MIRRORED_TOWARDS, shape), "NodeSocketFloat")
    ahead = None
    if tables.lamps is not None:
        ahead = realtime_lamps.build_path(
            shape.components, tables.lamps, ahead=True, rays=tables.rays
        )
    picture = functools.partial(_picture, ahead=ahead)
    triple = build_triple(TRIPLE_NAME, shape, inputs, picture, tables.rays)
    tree = new_group(NAME)
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    graph = Graph(tree, rays=tables.rays)
    given, triples = {}, Triples(graph, values, shape, tables)
    if images is not None:
        given = slope_ahead(graph, values, images.slopes, view_direction(graph))
    if tables.light is not None:
        w, slopes = view_direction(graph), None
        if images is not None:
            slopes = graph.components(given[SLOPE])[:2]
        light = triples.tables
        mirrored = mirrored_ray(w, NODES, slopes)[1] if shape.flat else None
        given |= light.to_boundary(camera_depth(graph), w, mirrored)
        given |= phase_towards(TOWARDS, shape, w, light.sun)
        if mirrored is not None:
            given |= phase_towards(MIRRORED_TOWARDS, shape, mirrored, light.sun)
    if shape.shade:
        w = view_direction(graph)
        P = distance_in_water(camera_depth(graph), -w[2], triples.number("y_f"), NODES)
        given |= triples.shade.on_path(camera_place(graph), w, P)
    total = triples.sum(triple, given)
    graph.assign(total[SEEN], graph.node("NodeGroupOutput").inputs[0])
    realtime_layers.write(graph, shape.layers, total)
    return tree


def _picture(
    graph: Graph, values: Values, *, ahead: bpy.types.ShaderNodeTree | None
) -> dict[str, NodeValue]:
    w, solved = view_direction(graph), values.shape.solved
    here = solved or values.shape.above
    y_o = camera_depth(graph) if here else NODES.maximum(values[CAMERA_DEPTH], 0.0)
    ripples = None
    if values.shape.waves:
        slopes = graph.components(values[SLOPE])[:2]
        ripples = Ripples(slopes, values[GLITTER_WIDTH], values[GLITTER], values.sun_in_air)
    water = values.solved_background(y_o, w) if solved else values.water
    pixel = water.open_water(y_o, w, NODES, ripples)
    if ahead is not None:
        pixel = dataclasses.replace(pixel, lamps=values.of_group(ahead))
    found = {SEEN: values.seen(pixel)}
    if values.shape.layers:
        found |= values.layers(pixel_layers(pixel))
    if values.shape.shafts:
        found[DRAWN] = values.sensor(values.shaft(y_o, w, None))
    return found


def build_world(group: bpy.types.ShaderNodeTree) -> bpy.types.World:
    """Build a world that shows the group to the camera and lights nothing."""
    world, graph, output = new_world(NAME)
    node = graph.node("ShaderNodeGroup", node_tree=group)
    background = graph.node("ShaderNodeBackground")
    graph.tree.links.new(node.outputs[0], background.inputs["Color"])
    seen = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    graph.tree.links.new(seen, background.inputs["Strength"])
    graph.tree.links.new(background.outputs[0], output.inputs["Surface"])
    # EEVEE draws a map of the world for its light, of which there is none.
    world.probe_resolution = "128"
    return world
