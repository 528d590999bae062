"""Node trees whose nodes lie in parts: no links go round in circles."""

from __future__ import annotations

import bpy
from underwater_spectral.node_groups.node_mathematics import Graph, new_group


def _doubled():
    """Return a group of one input and one output."""
    tree = new_group("Doubled")
    tree.interface.new_socket("x", in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket("y", in_out="OUTPUT", socket_type="NodeSocketFloat")
    graph = Graph(tree)
    x = graph.term(graph.node("NodeGroupInput").outputs["x"])
    graph.assign(x + x, graph.node("NodeGroupOutput").inputs["y"])
    return tree


def _reads(node):
    """Nodes that a node has its inputs from."""
    return [link.from_node for socket in node.inputs for link in socket.links]


def test_a_group_between_nodes_of_parts_makes_no_circle():
    tree = bpy.data.node_groups.new("Parts", "ShaderNodeTree")
    tree.interface.new_socket("x", in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket("y", in_out="OUTPUT", socket_type="NodeSocketFloat")
    graph = Graph(tree, part_size=64)
    value = graph.term(graph.node("NodeGroupInput").outputs["x"])
    for _ in range(3):
        # Before and after the group there are few nodes: they would fit into one part.
        group = graph.node("ShaderNodeGroup", node_tree=_doubled())
        graph.assign(value * 3.0, group.inputs[0])
        value = graph.term(group.outputs[0]) + 1.0
    graph.assign(value, graph.node("NodeGroupOutput").inputs["y"])
    assert all(link.is_valid for link in tree.links)
    for node in tree.nodes:
        seen, front = set(), _reads(node)
        while front:
            other = front.pop()
            assert other != node, f"{node.name} reads what it makes"
            if other.name not in seen:
                seen.add(other.name)
                front += _reads(other)
