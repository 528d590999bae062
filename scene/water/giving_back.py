"""Gives back what no wet scene of the file holds any more, and deletes what waters have left.

What objects were is kept on the objects themselves, and all that was made carries a mark: so what
the user renames, replaces or deletes takes nothing else along.
"""

from __future__ import annotations

from collections.abc import Collection

import bpy

from ...node_groups.node_mathematics import MARK
from .. import contents, marks
from ..materials import (
    above_water_culling,
    band_colors,
    bare_colours,
    bare_surfaces,
    clear_shadows,
    inlined_shaders,
    wet_trees,
)
from ..session import has_strays
from . import refraction_displacement


def let_go() -> list[str]:
    """Give back, dry and delete what no wet scene holds; returns what could not be given back."""
    waters = marks.waters()
    lamps = {item for scene in waters for item in contents.objects(scene)}
    held = set(waters.values())
    for stray in strays():
        bpy.data.collections.remove(stray)
    for item in [o for o in bpy.data.objects if o.is_editable]:
        if MARK in item and not held.intersection(item.users_collection):
            lamps.discard(item)
            bpy.data.objects.remove(item)
        elif item not in lamps:
            marks.show_again(item)
    dark = {item.data for item in lamps if marks.HIDDEN in item}
    for light in [light for light in bpy.data.lights if light not in dark]:
        marks.light_again(light)
    lit, routed = {}, set()
    for scene, water in waters.items():
        materials = set(contents.materials(scene))
        if marks.SURFACE in water:
            for name in (marks.SURFACE, marks.NATIVE, marks.FLUORESCENT):
                if water.get(name) is not None:
                    lit[water[name]] = lit.get(water[name], set()) | materials
        else:
            routed |= materials
    bare_surfaces.undress({x for scene in waters for x in contents.objects(scene)})
    notes = dry_but(routed | wet_trees.behind(lit))
    refraction_displacement.unite(waters)
    return notes + _delete(bool(waters))


def dry_but(wet: Collection[bpy.types.Material]) -> list[str]:
    """Take water out of all materials but some, and the groups in these.

    Returns what could not be given back, one line each.
    """
    # Colours go home before the nodes that they are led through are taken away.
    band_colors.remove(wet)
    clear_shadows.remove(wet)
    notes = wet_trees.remove(wet)
    bare_colours.remove(wet)
    inlined_shaders.remove(wet)
    refraction_displacement.give_back(wet)
    above_water_culling.give_back(wet)
    return notes


def strays() -> list[bpy.types.Collection]:
    """Collections of waters that no scene holds, the scene being deleted or they being unlinked."""
    found = [c for c in bpy.data.collections if MARK in c and c.is_editable]
    waters = marks.waters().values() if found else ()
    held = {part for water in waters for part in (water, *water.children_recursive)}
    return [collection for collection in found if collection not in held]


def _delete(others: bool) -> list[str]:
    """Delete what is marked: what nobody uses, and without other waters in the file the rest."""
    data, notes = bpy.data, []
    kinds = (
        "meshes", "volumes", "lights", "materials", "worlds", "node_groups", "images", "textures",
    )  # fmt: skip

    def marked() -> list[bpy.types.ID]:
        return [b for k in kinds for b in getattr(data, k) if MARK in b and b.is_editable]

    while unused := [block for block in marked() if not block.users]:
        data.batch_remove(unused)
    rest = [] if others else marked()
    for block, users in data.user_map(subset=set(rest)).items() if rest else ():
        own = sorted(user.name for user in users if MARK not in user)
        if own:
            notes.append(
                f"{block.name!r} of the water, which {', '.join(map(repr, own))} used, went with it"
            )
    data.batch_remove(rest)
    return notes


def tidy() -> None:
    """Give back what water has hidden and changed for scenes that were deleted since."""
    if has_strays():
        let_go()
