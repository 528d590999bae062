"""Objects and materials that come into a scene that has its water of EEVEE already."""

from __future__ import annotations

import bpy

from .. import contents, marks
from ..materials import bare_surfaces, fluorescence, material_kinds, realtime_materials, wet_trees
from ..readers.closed_bodies import closed_materials
from . import giving_back, refracted_materials, scene_water, wet_materials


def wet(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Send one more material through the groups that a scene has got."""
    groups = marks.collection_of(scene) or {}
    own = material_kinds.kinds([material])
    closed = closed_materials(scene) if own.translucent or own.filters else ()
    surfaces = wet_materials.surfaces_of(
        groups, closed=closed, fluorescent=fluorescence.of([material])
    )
    realtime_materials.insert([material], surfaces)
    refracted_materials.move(material, groups.get(wet_materials.DISPLACEMENT))


def is_dry(item: bpy.types.Object) -> bool:
    """Whether an object came, or got a material, after the water of its scene."""
    return bare_surfaces.is_bare(item) or any(
        wet_trees.is_dry(material) for material in contents.materials_of(item)
    )


def take_in(scene: bpy.types.Scene) -> list[str]:
    """Let what has come into a scene since its water get wet; other nodes stay.

    Returns what could not be treated, one line each.
    """
    plain, notes = bare_surfaces.dress(scene, marks.part(scene, wet_materials.PLAIN))
    collection = marks.collection_of(scene)
    if plain is not None and collection is not None:
        collection[wet_materials.PLAIN] = plain
    materials, _ = scene_water.own_materials(scene, routed=False)
    for material in [m for m in materials if wet_trees.is_dry(m) or wet_trees.is_rewired(m)]:
        if wet_trees.has_remains(material):
            notes += giving_back.dry_but(set(bpy.data.materials) - {material})
        wet(scene, material)
    return notes
