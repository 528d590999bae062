"""Shaders that zones, menus, bundles and inputs of groups hand on, as the nodes they come to.

Blender itself makes those nodes of them. They stand in a group behind the user's own, which stay.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

import bpy

from .. import contents
from .inserted import add_node, trees_but

_OURS = "uw_inlined"
_STANDS = (
    "material {!r} hands shaders through zones, menus, bundles or into groups, and is animated: "
    "real time draws it as it was when the water was added; lead its shader past them"
)
_MEASURING = "ShaderNodeShaderToRGB"
_PASSING = {"NodeReroute", "NodeGroupOutput"}


def insert(materials: Iterable[bpy.types.Material]) -> list[str]:
    """Put the groups before EEVEE's outputs of materials that need one.

    Returns notes on those that will not follow their animation.
    """
    notes = []
    for material in materials:
        tree = material.node_tree
        output = None if tree is None else tree.get_output_node("EEVEE")
        if tree is None or output is None or not material.is_editable or not _needed(tree):
            continue
        links = [link for link in output.inputs["Surface"].links if not link.is_muted]
        group = _inlined(material) if links and not any(_OURS in n for n in tree.nodes) else None
        if group is None:
            continue
        node = add_node(tree, "ShaderNodeGroup", output, 0.0, 100.0)
        node.node_tree, node[_OURS] = group, True
        tree.links.new(links[0].from_socket, node.inputs[0])
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        if any(x.animation_data is not None for x in (tree, *contents.inner_groups([tree]))):
            notes.append(_STANDS.format(material.name))
    return notes


def remove(kept: Collection[bpy.types.Material]) -> None:
    """Undo :func:`insert`, but for some materials."""
    groups = set()
    for tree, node in [(t, n) for t in trees_but(kept) for n in t.nodes if _OURS in n]:
        groups.add(node.node_tree)
        for arriving in [link for socket in node.inputs for link in socket.links]:
            for link in list(node.outputs[0].links):
                tree.links.new(arriving.from_socket, link.to_socket)
        tree.nodes.remove(node)
    for group in groups - {None}:
        if not group.users:  # copies of a material share it
            bpy.data.node_groups.remove(group)


def _needed(tree: bpy.types.ShaderNodeTree) -> bool:
    """Whether a shader goes through something else than groups' outputs and mixtures."""
    inner = contents.inner_groups([tree])
    return any(n.bl_idname == _MEASURING for group in inner for n in group.nodes) or any(
        socket.type == "SHADER" and socket.is_linked
        for each in (tree, *inner)
        for node in each.nodes
        if not node.bl_idname.startswith("ShaderNode") and node.bl_idname not in _PASSING
        for socket in (*node.inputs, *node.outputs)
    )


def _inlined(material: bpy.types.Material) -> bpy.types.ShaderNodeTree | None:
    """Return a group of the nodes that the shader of a material comes to."""
    made = material.inline_shader_nodes()
    group = made.node_tree.copy()
    output = group.get_output_node("EEVEE")
    links = () if output is None else output.inputs["Surface"].links
    if not links:
        bpy.data.node_groups.remove(group)
        return None
    group.name = f"UW {material.name} Inlined"
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Shader", in_out=way, socket_type="NodeSocketShader")
    end = group.nodes.new("NodeGroupOutput")
    group.links.new(links[0].from_socket, end.inputs[0])
    for node in [n for n in group.nodes if n.bl_idname.startswith("ShaderNodeOutput")]:
        group.nodes.remove(node)
    return group
