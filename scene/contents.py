"""What a scene holds: its objects, those instanced there included, and their materials."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy

_SOCKETS = {"OBJECT", "COLLECTION", "MATERIAL"}


def objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects of a scene and those that it instances, each once.

    Instanced are collections, and what geometry nodes and particle systems name.
    """
    found: dict[bpy.types.Object, None] = {}

    def visit(items: Iterable[bpy.types.Object]) -> None:
        for item in items:
            if item in found:
                continue
            found[item] = None
            for named in _instanced(item):
                if isinstance(named, bpy.types.Object):
                    visit([named])
                elif isinstance(named, bpy.types.Collection):
                    visit(named.all_objects)

    visit(scene.objects)
    return list(found)


def materials(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """Materials of the objects of a scene, those that geometry nodes set too, in stable order."""
    found = {m.name_full: m for item in objects(scene) for m in materials_of(item)}
    return [found[name] for name in sorted(found)]


def materials_of(item: bpy.types.Object) -> list[bpy.types.Material]:
    """Materials of an object, and those that its geometry nodes set."""
    named = [slot.material for slot in item.material_slots]
    named += [block for block in _named(item) if isinstance(block, bpy.types.Material)]
    return [m for m in named if m is not None and m.node_tree is not None]


def _instanced(item: bpy.types.Object) -> Iterator[bpy.types.ID]:
    """Yield the collections and objects that an object may show, and others that it names."""
    systems = [system.settings for system in item.particle_systems]
    named = [item.instance_collection]
    named += [block for s in systems for block in (s.instance_object, s.instance_collection)]
    yield from (block for block in named if block is not None)
    yield from _named(item)


def _named(item: bpy.types.Object) -> Iterator[bpy.types.ID]:
    """Yield the data-blocks that an object's geometry nodes name."""
    seen: set[bpy.types.NodeTree] = set()
    for modifier in item.modifiers:
        if modifier.type == "NODES" and modifier.node_group is not None:
            inputs = modifier.properties.inputs
            for socket in modifier.node_group.interface.items_tree:
                given = getattr(inputs, getattr(socket, "identifier", ""), None)
                if isinstance(value := getattr(given, "value", None), bpy.types.ID):
                    yield value
            yield from _named_in(modifier.node_group, seen)


def _named_in(tree: bpy.types.NodeTree, seen: set[bpy.types.NodeTree]) -> Iterator[bpy.types.ID]:
    if tree in seen:
        return
    seen.add(tree)
    for node in tree.nodes:
        sockets = (socket for socket in node.inputs if socket.type in _SOCKETS)
        # Nodes that are nothing but a data-block have it as a property.
        blocks = [getattr(node, kind.lower(), None) for kind in _SOCKETS]
        for block in (*(socket.default_value for socket in sockets), *blocks):
            if isinstance(block, bpy.types.ID):
                yield block
        group = getattr(node, "node_tree", None)
        if group is not None:
            yield from _named_in(group, seen)


def inner_groups(trees: Iterable[bpy.types.NodeTree | None]) -> set[bpy.types.NodeTree]:
    """Node groups inside trees, at any depth."""
    found: set[bpy.types.NodeTree] = set()

    def visit(tree: bpy.types.NodeTree | None) -> None:
        for node in tree.nodes if tree is not None else ():
            group = node.node_tree if node.bl_idname == "ShaderNodeGroup" else None
            if group is not None and group not in found:
                found.add(group)
                visit(group)

    for tree in trees:
        visit(tree)
    return found
