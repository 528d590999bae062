"""Materials of a scene in the water of Cycles: their colours are those of the bands."""

from __future__ import annotations

import bpy

from ...node_groups import uplift
from ...uw_spectral.transfer.water_column import WaterColumn
from ..materials import (
    band_colors,
    bare_colours,
    bare_surfaces,
    clear_shadows,
    refractive_indices,
    wet_colours,
)
from . import scene_water


def insert(scene: bpy.types.Scene, column: WaterColumn, *, indices_in_water: bool) -> list[str]:
    """Route the colours of materials through the bands; refractive indices are against the water.

    Returns what could not be treated, one line each.
    """
    _, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=True)
    notes += bare
    bare_colours.insert(materials)
    if column.reflects:
        clear_shadows.insert(materials)
    wet_colours.insert(materials)
    uplift.set_wet_grains(column.refractive_index)
    notes += band_colors.insert(materials)
    if indices_in_water:
        refractive_indices.insert(materials)
        uplift.set_water_index(column.refractive_index)
    return notes
