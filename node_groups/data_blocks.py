"""Materials, worlds and groups whose nodes are made here, and what a view layer tells them."""

from __future__ import annotations

import bpy

from .node_mathematics import Graph, NodeValue


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


def of_view_layer(graph: Graph, name: str) -> bpy.types.Node:
    """Add a node that reads a property of the view layer."""
    return graph.node("ShaderNodeAttribute", attribute_type="VIEW_LAYER", attribute_name=name)


def vector_of_view_layer(graph: Graph, name: str) -> NodeValue:
    """Return three bands that the view layer holds."""
    return graph.term(of_view_layer(graph, name).outputs["Vector"])


def _emptied(tree: bpy.types.ShaderNodeTree) -> Graph:
    tree.nodes.clear()
    return Graph(tree)
