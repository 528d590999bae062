"""Clouds in Cycles: volumes in the water, which add to it; and those that EEVEE does not draw."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes, water_volume
from ...settings.render_plan import RenderPlan
from ...settings.scene_settings import BOUNDED
from ...uw_spectral.clouds.gaussian_blob import REACH
from ...uw_spectral.clouds.matter import BUBBLES
from ...uw_spectral.imaging.layers import parse_layers
from .. import contents, marks
from ..materials import bare_surfaces
from ..readers.clouds import BLOB, BUBBLES_IN_CYCLES, GRID, SceneClouds, clouds_of, is_grid, outline
from ..stored_clouds import stored_cloud
from . import scene_water
from .cycles_phase import CyclesPhase, cycles_phase
from .water_body import mesh_object

NAME = "UW Cloud"
_LAYERS = (
    "layers J, D, F and T of Cycles take clouds for part of the objects behind them: their "
    "extinction is the water's alone; layers of EEVEE have that of clouds too"
)


def add_clouds(scene: bpy.types.Scene, plan: RenderPlan) -> list[str]:
    """Add the clouds of a scene to its water; they follow their objects, and leave with it.

    Returns what could not be treated, one line each.
    """
    found = clouds_of(scene, plan.bands.centres)
    for index, (item, phase) in enumerate(zip(found.objects, _phases(found, plan), strict=True)):
        made = _box(item) if item.type == BLOB else _copy(item)
        size = outline(item) if item.type == BLOB else None
        material = water_volume.build_cloud(phase.lobes, index, size)
        made.data.materials.clear()
        made.data.materials.append(material)
        if item.type == GRID:
            # What geometry nodes make has a material of its own, or none.
            bare_surfaces.give_material(made, material)
        scene_water.link(scene, made)
        made[marks.CLOUD] = index
        if item.type == GRID:
            marks.hide(item)
    bubbles = any(stored_cloud(item).constituent == BUBBLES for item in found.objects)
    return [
        *found.notes,
        *([f"clouds: {BUBBLES_IN_CYCLES}"] if bubbles else []),
        *([_LAYERS] if found.objects and parse_layers(plan.settings.layers) else []),
    ]


def values(scene: bpy.types.Scene, plan: RenderPlan) -> dict[str, NDArray[np.float64]]:
    """Return what differs by band of the clouds of the current frame, by attribute."""
    found, out = clouds_of(scene, plan.bands.centres), {}
    for index, (cloud, phase) in enumerate(zip(found.clouds, _phases(found, plan), strict=True)):
        layer, matter = attributes.cloud(index), cloud.matter
        out |= phase.values(layer, matter.absorption, matter.scattering)
    return out


def clear(item: bpy.types.Object) -> str:
    """Keep EEVEE from drawing a volume object by itself while there is water.

    Returns what to say if it could not be done.
    """
    if not item.is_editable:
        return f"cloud {item.name!r} is linked and drawn twice by EEVEE; make it local"
    if bare_surfaces.MODIFIER not in item.modifiers:
        material = bpy.data.materials.new(NAME)
        material.node_tree.nodes.clear()
        material[marks.MARK] = True
        bare_surfaces.give_material(item, material)
    return ""


def leave_out(scene: bpy.types.Scene) -> list[str]:
    """Keep EEVEE from drawing volume objects that are no clouds and that it has a material for.

    Those that have one of their own are left out with it. Returns which, one line each.
    """
    notes, depsgraph = [], bpy.context.evaluated_depsgraph_get()
    for item in contents.objects(scene):
        if item.type != GRID or marks.MARK in item or is_grid(item) or not item.is_editable:
            continue
        geometry = item.evaluated_get(depsgraph).evaluated_geometry()
        if geometry.volume is not None and not any(geometry.volume.materials):
            clear(item)
            notes.append(f"volume {item.name!r} has no material and is left out by EEVEE")
    return notes


def _phases(found: SceneClouds, plan: RenderPlan) -> list[CyclesPhase]:
    bounded = plan.settings.forward_peak == BOUNDED
    n = len(plan.bands)
    return [
        cycles_phase(x.matter.phase.for_bands(np.ones(n)), bounded=bounded) for x in found.clouds
    ]


def _box(item: bpy.types.Object) -> bpy.types.Object:
    half = 0.5 * REACH * outline(item)
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    made = mesh_object(NAME, corners, faces)
    made.constraints.new("COPY_TRANSFORMS").target = item
    return made


def _copy(item: bpy.types.Object) -> bpy.types.Object:
    made = item.copy()
    made.data = item.data.copy()
    made.name = NAME
    return made
