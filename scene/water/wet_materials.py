"""Materials of a scene in the water of EEVEE: sent through its groups, moved and hidden by them."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import bpy

from ...node_groups import realtime_highlights, realtime_surface, uplift
from ...node_groups.realtime_fluorescence import FluorescenceShape
from ...node_groups.shape import Sources
from .. import contents, marks
from ..materials import bare_surfaces, realtime_materials
from ..materials.closure_walk import Surfaces
from ..materials.surface_description import write_reflectance
from ..readers.closed_bodies import closed_materials
from . import refracted_materials, scene_water
from .frame_water import FLOOR, RealtimeWater

PLAIN, DISPLACEMENT = "uw_plain", "uw_apparent"
"""Parts of the water: the material of what has none, and what moves vertices."""
_FILTER, _HIGHLIGHT = "uw_filter", "uw_highlight "
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

    The water ends at the depth ``bottom``, m. Returns what :func:`.new_materials.wet` asks for, to
    be kept as parts of the water, and what could not be treated, one line each.
    """
    shape, values = water.shape, sources.values
    plain, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=False)
    materials += [] if floor is None else [floor]
    groups: dict[str, bpy.types.ID | None] = {
        marks.SURFACE: realtime_surface.build(shape, sources),
        marks.NATIVE: None,
        marks.FLUORESCENT: None,
        _FILTER: uplift.build_filter(values, shape),
        PLAIN: plain,
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
    surfaces = surfaces_of(groups, floor=measured, closed=closed, fluorescent=fluorescing)
    notes += [*bare, *realtime_materials.insert(materials, surfaces)]
    moved, more = refracted_materials.insert(scene, water, sources, materials, floor, bottom)
    groups[DISPLACEMENT] = moved
    notes += more
    return {name: group for name, group in groups.items() if group is not None}, notes


def surfaces_of(
    groups: Mapping[str, bpy.types.ID | None],
    *,
    floor: bpy.types.Material | None = None,
    closed: Collection[bpy.types.Material] = (),
    fluorescent: Collection[str] = (),
) -> Surfaces:
    """Return the groups of a water that materials are sent through."""
    kinds = {kind: groups.get(_HIGHLIGHT + kind) for kind in realtime_highlights.NUMBERS}
    return Surfaces(
        groups.get(marks.SURFACE), groups.get(_FILTER), groups.get(marks.NATIVE), floor, closed,
        {kind: group for kind, group in kinds.items() if group is not None},
        groups.get(marks.FLUORESCENT), fluorescent,
    )  # fmt: skip


def write_reflectances(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Give materials the channels of their measured reflectances."""
    known = {m.name: m for m in contents.materials(scene) if m.is_editable}
    known[FLOOR] = marks.part(scene, marks.FLOOR)
    for place, (name, reflectance) in enumerate(water.inputs.reflectances.items()):
        if known.get(name) is not None:
            measured = water.channels.project(reflectance)
            write_reflectance(known[name], _FIRST_MEASURED + place, measured)
