"""Exposure by what a camera sees, for jobs and for the viewport alike."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...quality.metering import picture_stops, stops_from_above
from ...quality.picture import Optics
from ...settings.render_plan import RenderPlan
from ...settings.scene_settings import BY_PICTURE
from ...uw_spectral.errors import InputError
from ..readers.lamps import plan_lamps
from ..readers.view_tracing import trace_from_above, trace_view

_GRID = (32, 18)
_SKYWARD = 8


def metered(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    depth: float,
    lit: NDArray[np.float64] | None,
) -> float | None:
    """Return the stops that the picture asks for at the current frame; the camera's depth is in m.

    None if the settings expose otherwise or nothing is lit: the exposure is then that of the light
    at the camera. ``lit``, shape (n,), is the irradiance of lamps before it.
    """
    chosen = plan.settings
    if chosen.exposure != BY_PICTURE:
        return None
    # The rays need neither waves, whose light is the same on average, nor changed wavelengths.
    column = plan.column
    if column.surface == "waves":
        column = replace(column, surface="flat")
    view = replace(plan.viewpoint(depth, 0.0, lit), column=column)
    lamps = plan_lamps(scene, plan).lamps
    water = plan.lamp_water(depth) if lamps else None
    optics = Optics(view)
    try:
        if camera.matrix_world.translation.z >= 0:
            above = trace_from_above(
                scene, camera, column, view.field, grid=_GRID, skyward=_SKYWARD
            )
            stops = stops_from_above(
                optics, above.direction, above.relative_index, above.seen, lamps, water
            )
        else:
            seen = trace_view(
                scene, camera, column, view.field,
                rays=_GRID[0] * _GRID[1], grid=_GRID, skyward=_SKYWARD,
            )  # fmt: skip
            stops = picture_stops(optics, seen, lamps, water)
    except InputError:
        return None
    return stops + chosen.exposure_compensation
