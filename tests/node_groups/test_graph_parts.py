"""Node trees whose nodes lie in parts: no links go round in circles."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.node_groups.loops import summed
from underwater_spectral.node_groups.node_mathematics import NODES, Graph, new_group


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


def _sums(use):
    """Make a tree of small parts with a sum over a repeat zone; ``use`` gets what it is made of."""
    tree = bpy.data.node_groups.new("Parts", "ShaderNodeTree")
    tree.interface.new_socket("x", in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket("y", in_out="OUTPUT", socket_type="NodeSocketFloat")
    graph = Graph(tree, part_size=4)
    x = graph.term(graph.node("NodeGroupInput").outputs["x"])
    before, inside = x * 3.0 + 1.0, []

    def terms(index):
        inside.append(NODES.exp(before * 2.0))
        return [inside[0] * index + x]

    (total,) = summed(graph, 5, terms)
    graph.assign(use(total, [before, inside[0]]), graph.node("NodeGroupOutput").inputs["y"])
    return tree


def test_parts_do_not_reach_out_of_a_repeat_zone():
    # What is made again after the zone, twice the value before, is another node than in it.
    tree = _sums(lambda total, made: total + made[0] * 2.0)
    trees = [tree, *(node.node_tree for node in tree.nodes if node.bl_idname == "ShaderNodeGroup")]
    assert len(trees) > 3
    assert all(link.is_valid for each in trees for link in each.links)


def test_what_a_repeat_zone_made_is_refused_outside():
    with pytest.raises(RuntimeError, match="repeat zone"):
        _sums(lambda total, made: total + made[1])
