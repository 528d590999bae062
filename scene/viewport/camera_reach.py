"""How far a camera may go before live water is widened."""

from __future__ import annotations

import math

import bpy

from ...uw_spectral.transfer.water_column import WaterColumn
from ..readers import cameras
from ..water.water_body import WaterExtent, extent_around, reach_of


def reach(extent: WaterExtent, column: WaterColumn) -> float:
    """Distance from the origin in m that a camera may have before the water is widened."""
    around_camera = extent_around(reach_of([]), column, 0.0).half_width
    return extent.half_width - around_camera / 2.0


def from_the_middle(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None) -> float:
    """Distance of the camera from the origin, m."""
    camera = cameras.camera_of(scene)
    if camera is not None and depsgraph is not None:
        camera = camera.evaluated_get(depsgraph)
    return 0.0 if camera is None else math.hypot(*camera.matrix_world.translation.xy)
