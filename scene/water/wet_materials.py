"""Materials of a scene in the water of EEVEE: sent through its groups, moved and hidden by them."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import bpy

from ...node_groups import (
    realtime_filter,
    realtime_highlights,
    realtime_surface,
)
from ...node_groups.realtime_fluorescence import FluorescenceShape
from ...node_groups.shape import Sources
from .. import contents, marks
from ..materials import (
    bare_surfaces,
    fluorescence,
    realtime_materials,
    wet_trees,
)
from ..readers.closed_bodies import closed_materials
from . import giving_back, refracted_materials, scene_water
from .frame_water import FLOOR, RealtimeWater

_PLAIN, _FILTER, _HIGHLIGHT = "uw_plain", "uw_filter", "uw_highlight "
_DISPLACEMENT = "uw_apparent"
# Columns of red, green and blue come before those of measured reflectances.
_FIRST_MEASURED = 3


def add(
    scene: bpy.types.Scene,
    water: RealtimeWater,
    sources: Sources,
    floor: bpy.types.Material | None,
    bottom: float,
) -> tuple[dict[str, bpy.types.ID], list[str]]:
    """Send the materials of a scene, and that of an added floor, through groups of a water.

    The water ends at the depth ``bottom``, m. Returns what :func:`wet` asks for, to be kept as
    parts of the water, and what could not be treated, one line each.
    """
    shape, values = water.shape, sources.values
    plain, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=False)
    materials += [] if floor is None else [floor]
    groups: dict[str, bpy.types.ID | None] = {
        marks.SURFACE: realtime_surface.build(shape, sources),
        marks.NATIVE: None,
        marks.FLUORESCENT: None,
        _FILTER: realtime_filter.build(values, shape),
        _PLAIN: plain,
    }
    if water.has_native_closures:
        groups[marks.NATIVE] = realtime_surface.build(shape, sources, keeps=True)
    if FluorescenceShape in shape:
        own = shape.of(FluorescenceShape)
        groups[marks.FLUORESCENT] = realtime_surface.build(shape, sources, own=own)
    for kind in shape.highlights:
        groups[_HIGHLIGHT + kind] = realtime_highlights.build(kind, values, shape)
    closed = closed_materials(scene) if shape.translucent or shape.filters else ()
    measured = floor if FLOOR in water.inputs.reflectances else None
    fluorescing = shape.of(FluorescenceShape).materials
    surfaces = _surfaces(groups, floor=measured, closed=closed, fluorescing=fluorescing)
    notes += [*bare, *realtime_materials.insert(materials, surfaces)]
    moved, more = refracted_materials.insert(scene, water, sources, materials, floor, bottom)
    groups[_DISPLACEMENT] = moved
    notes += more
    return {name: group for name, group in groups.items() if group is not None}, notes


def _surfaces(
    groups: Mapping[str, bpy.types.ID | None],
    *,
    floor: bpy.types.Material | None = None,
    closed: Collection[bpy.types.Material] = (),
    fluorescing: Collection[str] = (),
) -> realtime_materials.Surfaces:
    kinds = {kind: groups.get(_HIGHLIGHT + kind) for kind in realtime_highlights.NUMBERS}
    return realtime_materials.Surfaces(
        groups.get(marks.SURFACE), groups.get(_FILTER), groups.get(marks.NATIVE), floor, closed,
        {kind: group for kind, group in kinds.items() if group is not None},
        groups.get(marks.FLUORESCENT), fluorescing,
    )  # fmt: skip


def wet(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Send one more material through the groups that a scene has got."""
    groups = marks.collection_of(scene) or {}
    own = realtime_materials.kinds([material])
    closed = closed_materials(scene) if own.translucent or own.filters else ()
    surfaces = _surfaces(groups, closed=closed, fluorescing=fluorescence.of([material]))
    realtime_materials.insert([material], surfaces)
    refracted_materials.move(material, groups.get(_DISPLACEMENT))


def is_dry(item: bpy.types.Object) -> bool:
    """Whether an object came, or got a material, after the water of its scene."""
    return bare_surfaces.is_bare(item) or any(
        wet_trees.is_dry(material) for material in contents.materials_of(item)
    )


def take_in(scene: bpy.types.Scene) -> list[str]:
    """Let what has come into a scene since its water get wet; other nodes stay.

    Returns what could not be treated, one line each.
    """
    plain, notes = bare_surfaces.dress(scene, marks.part(scene, _PLAIN))
    collection = marks.collection_of(scene)
    if plain is not None and collection is not None:
        collection[_PLAIN] = plain
    materials, _ = scene_water.own_materials(scene, routed=False)
    for material in [m for m in materials if wet_trees.is_dry(m) or wet_trees.is_rewired(m)]:
        if wet_trees.has_remains(material):
            notes += giving_back.dry_but(set(bpy.data.materials) - {material})
        wet(scene, material)
    return notes


def write_reflectances(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Give materials the channels of their measured reflectances."""
    known = {m.name: m for m in contents.materials(scene) if m.is_editable}
    known[FLOOR] = marks.part(scene, marks.FLOOR)
    for place, (name, reflectance) in enumerate(water.inputs.reflectances.items()):
        if known.get(name) is not None:
            measured = water.channels.project(reflectance)
            realtime_materials.write_reflectance(known[name], _FIRST_MEASURED + place, measured)
