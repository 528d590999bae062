"""What real-time water has put into shader trees of the user's: kept in step, and taken out again.

While water is there, the user renames, deletes, copies and rewires nodes. So nothing is found by
its name: nodes of the user's that the water needs again carry a mark of their own, and what is
not there any more is passed over.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator, Mapping

import bpy

from ...node_groups.node_mathematics import MARK
from .. import contents
from .inserted import INSERTED, own_input, trees_but

MUTED = "uw_muted"
"""On the node that lights a material: whether its own shader was muted."""
MUTED_VOLUME = "uw_muted_volume"
"""On a material output: its volume is muted while there is water."""
HOLDER = "uw_holder"
"""On the node that the material's own shader goes into: the number of the input."""
THICKNESS_MODE = "uw_thickness_mode"
"""On a material: what the user has chosen."""
OPENED = "uw_opened"
"""On a group of the user's: identifiers of the outputs that it was given."""
SOURCE = "uw_source"
"""On a constant: number of the user's node, and identifier of the input, that it repeats."""
_NUMBER = "uw_number"  # on a node of the user's, for SOURCE
_LINKS = "uw_links"  # on a material
_SHADER = "uw_shader"  # on a node of the user's: identifier of the output that was the shader


def keep_shader(shader: bpy.types.NodeSocket) -> None:
    """Remember which output of the user's a material had for its shader."""
    shader.node[_SHADER] = shader.identifier


def repeat(
    tree: bpy.types.NodeTree, constant: bpy.types.Node, source: bpy.types.NodeSocket
) -> None:
    """Let a constant have the value of an input, now and at each :func:`refresh`."""
    node = source.node
    if _NUMBER not in node:
        node[_NUMBER] = 1 + max((n.get(_NUMBER, 0) for n in tree.nodes), default=0)
    constant[SOURCE] = [str(node[_NUMBER]), source.identifier]
    _copy(source, constant)


def refresh() -> None:
    """Repeat the user's constants, which may have been edited or animated."""
    for tree in _trees():
        constants = [node for node in tree.nodes if SOURCE in node]
        # Copies of a node have its number too, and come after it.
        known = {str(n[_NUMBER]): n for n in reversed(tree.nodes) if constants and _NUMBER in n}
        for constant in constants:
            number, identifier = constant[SOURCE]
            inputs = known[number].inputs if number in known else ()
            for source in (i for i in inputs if i.identifier == identifier):
                _copy(source, constant)


def own_shader(tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket | None:
    """Return the input that a material's own shader arrives at, whether it is wet or not."""
    output = contents.output_of(tree)
    if output is None:
        return None
    surface = output.inputs["Surface"]
    ours = list(_behind(surface))
    arriving = next(_arriving(ours), None)
    if arriving is not None:
        return arriving.to_socket
    return next((node.inputs[node[HOLDER]] for node in ours if HOLDER in node), surface)


def surface_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """Return the node that lights a material, if its output shows it."""
    output = tree.get_output_node("EEVEE")
    shown = () if output is None else _behind(output.inputs["Surface"])
    return next((node for node in shown if MUTED in node and node.node_tree is not None), None)


def is_dry(material: bpy.types.Material) -> bool:
    """Whether a material's own shader, or that it has none, is drawn without the water."""
    tree = material.node_tree
    if not material.is_editable or tree is None or surface_node(tree) is not None:
        return False
    shader = own_shader(tree)
    return shader is None or not shader.is_linked or MARK not in shader.links[0].from_node


def note_links(material: bpy.types.Material) -> None:
    """Remember how the user has linked the nodes of a wet material."""
    material[_LINKS] = _links(material.node_tree)


def is_rewired(material: bpy.types.Material) -> bool:
    """Whether the user has linked nodes of a wet material otherwise since."""
    return _LINKS in material and material[_LINKS] != _links(material.node_tree)


def _links(tree: bpy.types.NodeTree) -> str:
    groups = sorted(contents.inner_groups([tree]), key=lambda group: group.name)
    rows = []
    for node in (node for one in (tree, *groups) if MARK not in one for node in one.nodes):
        if MARK in node or INSERTED in node:
            continue
        for socket in node.inputs:
            for link in own_input(socket).links if socket.is_linked else ():
                source = link.from_node
                if MARK not in source:
                    ends = source.name, link.from_socket.identifier
                    rows.append((node.name, socket.identifier, *ends))
    return f"{zlib.crc32(repr(rows).encode()):08x}"


def has_remains(material: bpy.types.Material) -> bool:
    """Whether nodes of the water are left in a material that the user has rewired."""
    return MARK not in material and any(MARK in node for node in material.node_tree.nodes)


def behind(
    surfaces: Mapping[bpy.types.ShaderNodeTree, Collection[bpy.types.Material]],
) -> set[bpy.types.Material]:
    """Return the materials that are behind these groups, and those of the water's own."""
    found = set()
    for material in bpy.data.materials:
        tree = material.node_tree
        surface = None if tree is None else surface_node(tree)
        own = surface is None and MARK in material and tree is not None
        if own or (surface is not None and material in surfaces.get(surface.node_tree, ())):
            found.add(material)
    return found


def remove(wet: Collection[bpy.types.Material]) -> list[str]:
    """Take every inserted node out again, except from wet materials and the groups in them.

    Returns what could not be given back, one line each.
    """
    kept, notes = contents.inner_groups(m.node_tree for m in wet), []
    kept |= {material.node_tree for material in wet}
    for tree in [tree for tree in _trees() if tree not in kept]:
        notes += _clear(tree)
    for material in bpy.data.materials:
        if material not in wet and material.is_editable:
            material.pop(_LINKS, None)
        if THICKNESS_MODE in material and material not in wet:
            material.thickness_mode = material[THICKNESS_MODE]
            del material[THICKNESS_MODE]
    return notes


def _clear(tree: bpy.types.NodeTree) -> list[str]:
    ours = [node for node in tree.nodes if MARK in node or INSERTED in node]
    gone = any(n.bl_idname == "ShaderNodeGroup" and n.node_tree is None for n in ours)
    for node in [n for n in tree.nodes if MUTED_VOLUME in n]:
        for link in node.inputs["Volume"].links if "Volume" in node.inputs else ():
            link.is_muted = False
        del node[MUTED_VOLUME]
    if ours:
        _reconnect(tree)
    for node in ours:
        tree.nodes.remove(node)
    for node in tree.nodes:
        for mark in (_NUMBER, _SHADER):
            node.pop(mark, None)
    if OPENED in tree:
        for item in [i for i in tree.interface.items_tree if i.item_type == "SOCKET"]:
            if item.identifier in tree[OPENED]:
                tree.interface.remove(item)
        del tree[OPENED]
    if not gone:
        return []
    return [f"{tree.name!r}: a group of the water was deleted, and links through it are lost"]


def _reconnect(tree: bpy.types.NodeTree) -> None:
    """Lead the user's own shader to where that of the water goes."""
    leaving = [
        link
        for link in tree.links
        if link.to_socket.type == "SHADER" and MARK in link.from_node and MARK not in link.to_node
    ]
    targets = [(link.to_socket, link.is_muted) for link in leaving]
    ours = list(dict.fromkeys(n for target, _ in targets for n in _behind(target)))
    arriving = next(_arriving(ours), None)
    muted = any(node[MUTED] for node in ours if MUTED in node)
    if arriving is not None:
        source, muted = arriving.from_socket, muted or arriving.is_muted
    else:
        source = _kept_shader(tree)
    output = tree.get_output_node("EEVEE")
    if output is not None and not output.inputs["Surface"].is_linked:
        targets.append((output.inputs["Surface"], False))
    for target, cut in targets if source is not None else ():
        tree.links.new(source, target).is_muted = muted or cut


def _kept_shader(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket | None:
    for node in (n for n in tree.nodes if _SHADER in n):
        return next((o for o in node.outputs if o.identifier == node[_SHADER]), None)
    return None


def _behind(socket: bpy.types.NodeSocket) -> Iterator[bpy.types.Node]:
    """Yield the nodes of the water that an input gets its value from, the nearest first."""
    seen, waiting = set(), [socket]
    while waiting:
        for link in waiting.pop(0).links:
            node = link.from_node
            if MARK in node and node not in seen:
                seen.add(node)
                yield node
                waiting += node.inputs


def _arriving(ours: list[bpy.types.Node]) -> Iterator[bpy.types.NodeLink]:
    """Yield the links by which shaders of the user's get to nodes of the water."""
    for node in ours:
        for socket in node.inputs:
            for link in socket.links:
                if MARK not in link.from_node and link.from_socket.type == "SHADER":
                    yield link


def _copy(source: bpy.types.NodeSocket, constant: bpy.types.Node) -> None:
    if constant.bl_idname == "ShaderNodeValue":
        targets, values = [constant.outputs[0]], [source.default_value]
    else:
        targets, values = list(constant.inputs), list(source.default_value)[:3]
    for target, value in zip(targets, values, strict=True):
        if target.default_value != value:
            target.default_value = value


def _trees() -> Iterator[bpy.types.NodeTree]:
    """Every shader tree that is the user's to edit, where copies of nodes may be too."""
    shone = (*bpy.data.worlds, *bpy.data.lights)
    trees = {block.node_tree for block in shone if block.node_tree and MARK not in block}
    for tree in trees_but(()) | trees:
        if tree.is_editable and MARK not in tree:
            yield tree
