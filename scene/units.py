"""The unit of length: one of Blender's units is one metre of water."""

from __future__ import annotations

import math

import bpy


def note(scene: bpy.types.Scene) -> str:
    """Return what to know about a scene whose unit is not the metre; empty if it is.

    Depths and coefficients stay those of one metre per unit, as Blender's own
    volumes have it, so a scene that is built in another unit has to be scaled.
    """
    units = scene.unit_settings
    if units.system == "NONE" or math.isclose(units.scale_length, 1.0, rel_tol=1e-6):
        return ""
    return (
        f"the scene's unit scale is {units.scale_length:.4g}, but the water takes each Blender "
        "unit as 1 m; scale the scene, or set Unit Scale to 1"
    )
