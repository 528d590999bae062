"""World: radiance of the sky above the horizon, black below it."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..uw_spectral.transfer.sky import UNIFORM, Sky
from . import attributes
from .data_blocks import new_world, of_view_layer, vector_of_view_layer
from .node_mathematics import NODES, Graph
from .realtime_sky import DrawnSky

NAME = "UW Sky"
_SUN = "sun"
_PICTURE = "picture"


def build(kind: str = UNIFORM, gain_in_water: float = 1.0) -> bpy.types.World:
    """Build the world of a kind of sky, one of :data:`.sky.SKIES`.

    Its radiance holds the gain for those in the water, which cameras and objects in the air do not
    see; what the surface mirrors up loses it there.
    """
    world, graph, output = new_world(NAME)
    geometry = graph.node("ShaderNodeNewGeometry")
    x, y, z = graph.components(graph.term(geometry.outputs["Incoming"]))
    radiance = graph.term(of_view_layer(graph, attributes.SKY_RADIANCE).outputs["Color"])
    strength = NODES.less(z, 0.0)
    if gain_in_water != 1.0:
        path = graph.node("ShaderNodeLightPath").outputs
        through = graph.term(path["Transmission Depth"])
        gained = NODES.less(0.5, NODES.maximum(through, graph.term(path["Is Singular Ray"])))
        strength = strength * NODES.select(gained, 1.0, 1.0 / gain_in_water)
    if kind != UNIFORM:
        sun = graph.node("ShaderNodeCombineXYZ", name=_SUN, label=_SUN)
        towards_sun = graph.components(graph.term(sun.outputs[0]))
        radiance = Sky(radiance, kind, towards_sun).radiance((-x, -y, -z), NODES)
    background = graph.node("ShaderNodeBackground", {"Color": radiance, "Strength": strength})
    graph.assign(background.outputs[0], output.inputs["Surface"])
    return world


def show(world: bpy.types.World, image: bpy.types.Image) -> None:
    """Let a world show the sky in an image, in place of the sky that it was built with."""
    graph = Graph(world.node_tree)
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    geometry = graph.node("ShaderNodeNewGeometry")
    x, y, z = graph.components(graph.term(geometry.outputs["Incoming"]))
    seen = DrawnSky(graph=graph, image=image).radiance((-x, -y, -z))
    parts = zip(graph.components(seen), attributes.SKY_BASIS, strict=True)
    red, green, blue = (part * vector_of_view_layer(graph, name) for part, name in parts)
    graph.assign(red + green + blue, background.inputs["Color"])
    world[_PICTURE] = image


def image_of(world: bpy.types.World) -> bpy.types.Image:
    """Return the image that a world shows the sky of."""
    return world[_PICTURE]


def turn(world: bpy.types.World, sun: Iterable[float]) -> None:
    """Let the sunlight of a world travel along a direction in air; nothing if it has none."""
    node = world.node_tree.nodes.get(_SUN)
    if node is not None:
        for socket, component in zip(node.inputs, sun, strict=True):
            socket.default_value = component
