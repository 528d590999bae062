"""Group nodes put before the inputs of the user's own nodes, and taken out again.

The first input of such a node is the home of what the user's input has: its value, its link and
its animation. Taking the node out leaves the tree as it was.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

import bpy
import numpy as np

from ...node_groups import uplift
from ...node_groups.node_mathematics import MARK
from .. import contents
from ..animation import curves

INSERTED = "uw_inserted"
"""Mark of such a node, by which it is known even if its group was deleted."""


def is_inserted(node: bpy.types.Node) -> bool:
    """Whether a node has been put before an input."""
    return node.bl_idname == "ShaderNodeGroup" and uplift.is_uplift(node.node_tree)


def has_inserted(socket: bpy.types.NodeSocket, but: Collection[str] = ()) -> bool:
    """Whether a node has been put before an input already, not of the kinds ``but``."""
    return own_input(socket, but) != socket


def own_input(socket: bpy.types.NodeSocket, but: Collection[str] = ()) -> bpy.types.NodeSocket:
    """Return where the user's own value of an input is: in a node before it, if one is there.

    Nodes of the kinds ``but`` count as the user's.
    """
    for link in socket.links:
        if is_inserted(link.from_node) and link.from_node.node_tree[uplift.KIND] not in but:
            return own_input(link.from_node.inputs[0], but)
    return socket


def add_node(
    tree: bpy.types.NodeTree,
    kind: str,
    near: bpy.types.Node | None = None,
    across: float = -200.0,
    up: float = 0.0,
) -> bpy.types.Node:
    """Add a node to a tree, beside one of the user's; what is selected and active stays so."""
    active = tree.nodes.active
    node = tree.nodes.new(kind)
    tree.nodes.active = active
    node.select, node.hide = False, True
    if near is not None:
        node.location = (near.location.x + across, near.location.y + up)
    return node


def repeat(
    tree: bpy.types.NodeTree, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket
) -> None:
    """Give an input the value and the links of another."""
    target.default_value = source.default_value
    for link in source.links:
        tree.links.new(link.from_socket, target).is_muted = link.is_muted


def new_node(tree: bpy.types.NodeTree, kind: str) -> bpy.types.Node:
    """Make a group node of a kind of :mod:`.uplift`."""
    node = add_node(tree, "ShaderNodeGroup")
    node.node_tree, node[INSERTED] = uplift.group(kind), True
    return node


def put_before(
    tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, node: bpy.types.Node
) -> bpy.types.Node:
    """Lead what an input gets through a node."""
    node.select = False
    node.hide = True
    node.location = (socket.node.location.x - 200.0, socket.node.location.y)
    home = node.inputs[0]
    _copy_value(socket, home)
    move_curves(tree, socket, home)
    if socket.is_linked:
        link = socket.links[0]
        tree.links.new(link.from_socket, home).is_muted = link.is_muted
    tree.links.new(node.outputs[0], socket)
    return node


def take_out(tree: bpy.types.NodeTree, node: bpy.types.Node) -> None:
    """Undo :func:`put_before`, and remove the node."""
    home = node.inputs[0]
    source = home.links[0] if home.is_linked else None
    for target in [link.to_socket for link in node.outputs[0].links]:
        if target.type == home.type or {target.type, home.type} == {"RGBA", "VECTOR"}:
            # Else the user has led it elsewhere.
            _copy_value(home, target)
            move_curves(tree, home, target)
        tree.links.remove(target.links[0])
        if source is not None:
            tree.links.new(source.from_socket, target).is_muted = source.is_muted
    tree.nodes.remove(node)


def own_trees(materials: Iterable[bpy.types.Material]) -> set[bpy.types.NodeTree]:
    """Trees of materials and the groups in them that nodes may be put into."""
    trees = {m.node_tree for m in materials if m.is_editable and m.node_tree is not None}
    found = trees | contents.inner_groups(trees)
    return {tree for tree in found if tree.is_editable and MARK not in tree}


def trees_but(kept: Collection[bpy.types.Material]) -> set[bpy.types.NodeTree]:
    """Shader trees of the file, but those of some materials and the groups in them."""
    trees = {m.node_tree for m in bpy.data.materials if m.node_tree and m not in kept}
    trees |= {t for t in bpy.data.node_groups if t.bl_idname == "ShaderNodeTree"}
    return trees - contents.inner_groups(m.node_tree for m in kept)


def value_curves(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> list[bpy.types.FCurve]:
    """Animation curves and drivers of a socket's value."""
    return list(curves(tree, f"{socket.path_from_id()}.default_value"))


def is_idle(tree: bpy.types.NodeTree, node: bpy.types.Node, weight: str) -> bool:
    """Whether the input of this name is there and holds 0 for good."""
    socket = node.inputs.get(weight)
    if socket is None or socket.is_linked or value_curves(tree, socket):
        return False
    return float(socket.default_value) == 0.0


def move_curves(
    tree: bpy.types.NodeTree, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket
) -> None:
    """Let the animation of one input move another one instead."""
    for curve in value_curves(tree, source):
        curve.data_path = f"{target.path_from_id()}.default_value"


def _copy_value(source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
    if target.type == "VALUE":
        target.default_value = source.default_value
        return
    for channel, number in enumerate(np.array(source.default_value)[:3].tolist()):
        target.default_value[channel] = number
