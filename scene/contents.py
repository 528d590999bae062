"""What a scene holds: its objects, those instanced there included, and their materials."""

from __future__ import annotations

from collections.abc import Iterable

import bpy


def objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects of a scene and of the collections that it instances, each once."""
    found: dict[bpy.types.Object, None] = {}

    def visit(items: Iterable[bpy.types.Object]) -> None:
        for item in items:
            if item not in found:
                found[item] = None
                if item.instance_collection is not None:
                    visit(item.instance_collection.all_objects)

    visit(scene.objects)
    return list(found)


def materials(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """Materials of the objects of a scene, in stable order."""
    found = {
        slot.material.name_full: slot.material
        for item in objects(scene)
        for slot in item.material_slots
        if slot.material is not None and slot.material.node_tree is not None
    }
    return [found[name] for name in sorted(found)]


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
