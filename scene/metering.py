"""Exposure by what a camera sees, for jobs and for the viewport alike."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..quality.metering import picture_stops
from ..quality.picture import Optics
from ..uw_spectral.errors import InputError
from ..uw_spectral.transfer.light_cone import light_cone
from .render_plan import RenderPlan
from .scene_requirements import trace_view
from .settings import BY_PICTURE, SOLVED

_GRID = (32, 18)
_SKYWARD = 8


def metered(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    depth: float,
    lit: NDArray[np.float64] | None,
) -> float | None:
    """Return the stops that the picture asks for at the current frame.

    None if the settings expose otherwise, the camera is not under water, or nothing is lit: the
    exposure is then that of the light at the camera.

    Parameters
    ----------
    scene : Scene
    camera : Object
    plan : RenderPlan
    depth : float
        Of the camera, m.
    lit : array, shape (n,), optional
        Irradiance of lamps before the camera.
    """
    chosen = plan.settings
    if chosen.exposure != BY_PICTURE or camera.matrix_world.translation.z >= 0:
        return None
    # The rays need neither waves, whose light is the same on average, nor changed wavelengths.
    column = plan.column
    if column.surface == "waves":
        column = replace(column, surface="flat")
    view = replace(plan.viewpoint(depth, 0.0, lit), column=column)
    cone = light_cone(view.field, depth, column.sun_direction)
    seen = trace_view(
        scene, camera, column, cone, rays=_GRID[0] * _GRID[1], grid=_GRID, skyward=_SKYWARD
    )
    lamps = plan.lamps(scene).lamps
    water = plan.lamp_water(depth) if lamps else None
    optics = Optics(view, solved=chosen.field == SOLVED)
    try:
        return picture_stops(optics, seen, lamps, water) + chosen.exposure_compensation
    except InputError:
        return None
