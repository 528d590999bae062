"""Materials, worlds, lamps and images that are made here, and what a view layer tells them."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from .node_mathematics import Graph, NodeValue
from .texture_atlas import number_image


def new_material(name: str) -> tuple[bpy.types.Material, Graph, bpy.types.Node]:
    """Add a material; return it, the graph of its nodes and its output."""
    material = bpy.data.materials.new(name)
    graph = _emptied(material.node_tree)
    return material, graph, graph.node("ShaderNodeOutputMaterial")


def new_world(name: str) -> tuple[bpy.types.World, Graph, bpy.types.Node]:
    """Add a world; return it, the graph of its nodes and its output."""
    world = bpy.data.worlds.new(name)
    graph = _emptied(world.node_tree)
    return world, graph, graph.node("ShaderNodeOutputWorld")


def new_emission(light: bpy.types.Light, name: str) -> tuple[Graph, bpy.types.Node]:
    """Let a lamp emit what the view layer holds; return the graph of its nodes and its Emission."""
    graph = _emptied(light.node_tree)
    colour = of_view_layer(graph, name).outputs["Color"]
    emission = graph.node("ShaderNodeEmission", {"Color": colour})
    graph.node("ShaderNodeOutputLight", {"Surface": emission.outputs[0]})
    return graph, emission


def write_pixels(
    image: bpy.types.Image, pixels: NDArray[np.float32], *, fresh: bool = False
) -> bpy.types.Image:
    """Put texels, shape (rows, columns, 4), into an image, the lowest row first.

    One of their size takes the place of an image of another, wherever it is used; or any, fresh.
    Returns the one that holds them.
    """
    rows, columns = pixels.shape[:2]
    if fresh or tuple(image.size) != (columns, rows):
        name, old = image.name, image
        image = number_image(name, columns, rows)
        old.user_remap(image)
        bpy.data.images.remove(old)
        image.name = name
    image.pixels.foreach_set(np.ravel(pixels))
    image.update()
    return image


def of_view_layer(graph: Graph, name: str) -> bpy.types.Node:
    """Add a node that reads a property of the view layer."""
    return graph.node("ShaderNodeAttribute", attribute_type="VIEW_LAYER", attribute_name=name)


def vector_of_view_layer(graph: Graph, name: str) -> NodeValue:
    """Return three bands that the view layer holds."""
    return graph.term(of_view_layer(graph, name).outputs["Vector"])


def _emptied(tree: bpy.types.ShaderNodeTree) -> Graph:
    tree.nodes.clear()
    return Graph(tree)
