"""World of the real-time mode: open water with its floor or surface behind."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..uw_spectral.clouds.veiled_pixel import veiled
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.pixel_parts import SurfaceAbove
from ..uw_spectral.transfer.radiance_field import distance_in_water
from . import lamp_images, realtime_clouds, realtime_lamps, realtime_layers
from .data_blocks import new_world
from .group_sockets import COLOUR, OpenGroup
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_raised import crossing
from .realtime_rays import camera_place, view_direction
from .realtime_refraction import AirShape
from .realtime_surface import shaft
from .realtime_values import FLOOR_DEPTH, FRAME, IN_AIR, SHAFT_END
from .realtime_water import PixelWater, in_group, pixel_layers
from .realtime_waves import FOAM, SLOPE, RaisedShape, images_in, slope_ahead
from .shape import Shape, Sources

NAME = "UW Background"


def build(shape: Shape, sources: Sources) -> bpy.types.ShaderNodeTree:
    """Build the group; output ``Color`` is what the channels see."""
    group = OpenGroup(NAME, outputs={"Color": COLOUR}, **realtime_clouds.options(shape, sources))
    graph = group.graph
    water = PixelWater(graph, shape, sources)
    w, eye = view_direction(graph), camera_place(graph, water.values.of(*FRAME))
    y_o = NODES.maximum(-eye[2], 0.0)
    if RaisedShape in shape:
        y_o = _depth_below(graph, sources, eye, w, y_o, above=AirShape in shape)
        eye = (*eye[:2], -y_o)
    ahead = {}
    waves = images_in(sources.parts)
    if waves is not None:
        ahead = slope_ahead(graph, sources.values, waves, eye, w)
    P = distance_in_water(y_o, -w[2], water.values[FLOOR_DEPTH], NODES)
    found = {}
    occlusion = water.occlusion()
    if occlusion is not None:
        found = occlusion.on_path(eye, w, P)
    ray, y_e = water.along(w), NODES.maximum(y_o - w[2] * P, 0.0)
    path_occlusion = water.path_occlusion(found, ray.falling_off(y_e, w), P)
    floating = {}
    if realtime_clouds.CloudShape in shape:
        clouds = realtime_clouds.build(shape, sources, ahead=True)
        rate = ray.falling_off(y_e, w)[1]
        floating = in_group(graph, clouds, {realtime_clouds.RATE: rate})
        path_occlusion = realtime_clouds.shadowed(path_occlusion, floating)
    end = [e + along * P for e, along in zip(eye, w, strict=True)]
    surface = SurfaceAbove(
        water.sky, water.index, water.ripples(ahead.get(SLOPE)),
        water.picture(end), water.window(end, w), water.foam(ahead.get(FOAM)),
    )  # fmt: skip
    pixel = ray.open_water(y_o, w, surface, path_occlusion)
    lamps = lamp_images.images_in(sources.parts)
    if lamps is not None:
        path = realtime_lamps.build_path(
            lamps, shape.of(realtime_lamps.LampShape).components, ahead=True, rays=sources.rays,
            clouds=realtime_clouds.for_lamps(sources, shape),
        )  # fmt: skip
        lit = in_group(graph, path, {FLOOR_DEPTH: water.values[FLOOR_DEPTH]})
        pixel = replace(pixel, lamps=lit[realtime_lamps.LIGHT])
    if "B_single" in shape.layers:
        single = ray.single_scattering(y_o, y_e, w, P) * path_occlusion.single
        pixel = replace(pixel, single_scattering=single)
    if floating:
        pixel = veiled(pixel, realtime_clouds.veil_of(floating), ray, y_o, w)
    seen: Operand = water.seen(pixel.total)
    if shape.shafts:
        # The volume has shadows of its own.
        drawn = shaft(ray, y_o, w, water.values[SHAFT_END]) * path_occlusion.single
        seen = seen - NODES.maximum(drawn, 0.0)
    realtime_layers.write(graph, shape.layers, pixel_layers(pixel))
    return group.finished({"Color": seen})


def _depth_below(
    graph: Graph,
    sources: Sources,
    eye: tuple[NodeValue, NodeValue, NodeValue],
    w: tuple[NodeValue, NodeValue, NodeValue],
    y_o: NodeValue,
    *,
    above: bool,
) -> NodeValue:
    """Depth of the eye below where its ray up meets waves with heights; else below the mean."""
    waves = images_in(sources.parts)
    assert waves is not None, "only waves have heights"
    found, away = crossing(graph, sources.values, waves, eye, w, in_air=False)
    risen = found * NODES.less(0.0, w[2])
    if above:
        # Rays from the air begin at the surface.
        risen = risen * (1.0 - graph.term(graph.shared(sources.values)[IN_AIR]))
    return NODES.select(risen, NODES.maximum(away * w[2], 0.0), y_o)


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
