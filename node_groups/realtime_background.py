"""World of the real-time mode: open water with its floor or surface behind."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.pixel_parts import UNOCCLUDED, SurfaceAbove
from . import realtime_layers
from .data_blocks import new_world
from .group_sockets import COLOUR, OpenGroup
from .node_mathematics import NODES
from .pixel_term import Pixel, terms_of
from .realtime_values import SHAFT_END
from .realtime_water import PixelWater, options, pixel_layers
from .shape import Shape, Sources

NAME = "UW Background"


def build(shape: Shape, sources: Sources) -> bpy.types.ShaderNodeTree:
    """Build the group; output ``Color`` is what the channels see."""
    group = OpenGroup(NAME, outputs={"Color": COLOUR}, **options(shape, sources))
    graph = group.graph
    at = Pixel.of_open_water(PixelWater(graph, shape, sources))
    water, ray, w, y_o, terms = at.water, at.ray, at.w, at.y_o, terms_of(at)
    path_occlusion = terms.on_path(UNOCCLUDED)
    above = SurfaceAbove(water.sky, water.index)
    surface = terms.combined(lambda found, term: term.above(found), above)
    pixel = ray.open_water(y_o, w, surface, path_occlusion)
    pixel = terms.combined(lambda found, term: term.lit(found), pixel)
    if "B_single" in shape.layers:
        single = ray.single_scattering(y_o, at.y, w, at.P) * path_occlusion.single
        pixel = replace(pixel, single_scattering=single)
    pixel = terms.combined(lambda found, term: term.veiled(found, 0.0), pixel)
    seen: Operand = terms.seen(pixel.total)
    if shape.shafts:
        # The volume has shadows of its own.
        drawn = at.shaft(water.values[SHAFT_END]) * path_occlusion.single
        seen = seen - NODES.maximum(drawn, 0.0)
    realtime_layers.write(graph, shape.layers, pixel_layers(pixel))
    return group.finished({"Color": seen})


def build_world(group: bpy.types.ShaderNodeTree) -> bpy.types.World:
    """Build a world that shows the group to the camera and lights nothing."""
    world, graph, output = new_world(NAME)
    node = graph.node("ShaderNodeGroup", node_tree=group)
    seen = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    inputs = {"Color": node.outputs[0], "Strength": seen}
    graph.assign(graph.node("ShaderNodeBackground", inputs).outputs[0], output.inputs["Surface"])
    # EEVEE draws a map of the world for its light, of which there is none.
    world.probe_resolution = "128"
    return world
