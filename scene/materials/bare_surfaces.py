"""Gives what has no material one while water is there.

EEVEE draws such objects with a material of its own that no water can be put into, and Cycles with
one whose refractive index is against air.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import bpy

from ...node_groups.group_sockets import GEOMETRY, OpenGroup
from ...node_groups.node_mathematics import MARK
from .. import contents
from ..rendered import rendered_layer

NAME = "UW Plain"
STANDS_IN = "uw_stands_in"
"""Property of the material: it goes when the water goes."""
_ADDED = "uw_slot"  # property of a data-block: its one slot is not its own
MODIFIER = "UW Material"
"""Name of the modifier that gives objects a material while water is there."""
_DATA = ("meshes", "curves", "metaballs", "hair_curves", "pointclouds", "volumes")
_KINDS = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD"}


def is_bare(item: bpy.types.Object) -> bool:
    """Whether an object has faces without a material that could be given one."""
    if item.type not in _KINDS or MARK in item:
        return False
    if not item.material_slots:
        return item.data.is_editable
    return any(_is_empty(slot, item) for slot in item.material_slots)


def dress(
    scene: bpy.types.Scene, material: bpy.types.Material | None = None
) -> tuple[bpy.types.Material | None, list[str]]:
    """Give the bare objects of a scene a material, that of its water or, if needed, a new one.

    Returns it, and what could not be treated, one line each.
    """
    notes = []
    for item in contents.objects(scene):
        if is_bare(item):
            material = material or _grey()
            if not item.material_slots:
                item.data.materials.append(material)
                item.data[_ADDED] = True
            for slot in item.material_slots:
                if _is_empty(slot, item):
                    slot.material = material
        elif item.type in _KINDS and not item.material_slots:
            notes.append(
                f"{item.name!r} has no material, is linked from another file and stays dry; give "
                "it a material there"
            )
    makers = [item for item in contents.objects(scene) if _may_make_bare(item)]
    if makers:
        layer = rendered_layer(scene)
        layer.update()
        instancing = _with_bare_instances(layer.depsgraph)
        for item in makers:
            geometry = item.evaluated_get(layer.depsgraph).evaluated_geometry()
            are_bare = [not any(part.materials) for part in _parts(geometry)]
            if are_bare and all(are_bare) and geometry.instances_pointcloud() is None:
                material = material or _grey()
                give_material(item, material)
            elif any(are_bare) or item in instancing:
                notes.append(
                    f"some of what geometry nodes of {item.name!r} make has no material and stays "
                    "dry; give it one there with Set Material"
                )
    return material, notes


def undress(kept: Collection[bpy.types.Object]) -> None:
    """Take the materials back that stand in, but for those of some objects."""
    held = {item.data for item in kept}
    for item in [o for o in bpy.data.objects if o not in kept and o.is_editable]:
        for modifier in [m for m in item.modifiers if _is_ours(m)]:
            item.modifiers.remove(modifier)
        for slot in item.material_slots:
            if slot.link == "OBJECT" and _stands_in(slot.material):
                slot.material = None
    for name in _DATA:
        for block in [b for b in getattr(bpy.data, name) if b not in held and b.is_editable]:
            for index, material in enumerate(block.materials):
                if _stands_in(material):
                    block.materials[index] = None
            if _ADDED in block:
                if list(block.materials) == [None]:
                    # Unlike pop, this shortens the lists of the objects too.
                    block.materials.clear()
                del block[_ADDED]


def _may_make_bare(item: bpy.types.Object) -> bool:
    return (
        item.type in _KINDS
        and MARK not in item
        and item.is_editable
        and item.override_library is None
        and MODIFIER not in item.modifiers
        and any(modifier.type == "NODES" for modifier in item.modifiers)
    )


def _parts(geometry: bpy.types.GeometrySet) -> Iterator[bpy.types.ID]:
    """Yield what of a geometry is seen; instances apart."""
    if geometry.mesh is not None and len(geometry.mesh.polygons):
        yield geometry.mesh
    if geometry.pointcloud is not None and len(geometry.pointcloud.points):
        yield geometry.pointcloud
    if geometry.curves is not None and len(geometry.curves.curves):
        yield geometry.curves


def _with_bare_instances(depsgraph: bpy.types.Depsgraph) -> set[bpy.types.Object]:
    """Objects whose geometry nodes instance what is no object and has no material."""
    return {
        one.parent.original
        for one in depsgraph.object_instances
        if one.is_instance
        and one.object.original == one.parent.original
        and not any(slot.material for slot in one.object.material_slots)
    }


def give_material(item: bpy.types.Object, material: bpy.types.Material) -> None:
    """Give what an object's modifiers make a material."""
    item.modifiers.new(MODIFIER, "NODES").node_group = setting(material)


def setting(material: bpy.types.Material) -> bpy.types.NodeTree:
    """Make geometry nodes that set a material."""
    ends = {"Geometry": GEOMETRY}
    group = OpenGroup(MODIFIER, ends, ends, kind="GeometryNodeTree")
    group.tree.is_modifier = True
    inputs = {"Material": material, **group.given}
    made = group.graph.node("GeometryNodeSetMaterial", inputs)
    return group.finished({"Geometry": made.outputs[0]})


def _grey() -> bpy.types.Material:
    """Make the material that Blender takes for none: a new one is just like it."""
    material = bpy.data.materials.new(NAME)
    material[STANDS_IN] = material[MARK] = True
    return material


def _is_empty(slot: bpy.types.MaterialSlot, item: bpy.types.Object) -> bool:
    owner = item if slot.link == "OBJECT" else item.data
    return slot.material is None and owner.is_editable


def _stands_in(material: bpy.types.Material | None) -> bool:
    return material is not None and STANDS_IN in material


def _is_ours(modifier: bpy.types.Modifier) -> bool:
    """Whether a modifier is of the water; the user may have renamed it, or deleted its group."""
    if modifier.type != "NODES":
        return False
    group = modifier.node_group
    return modifier.name == MODIFIER if group is None else MARK in group
