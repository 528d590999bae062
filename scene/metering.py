"""Exposure by what a camera sees, for jobs and for the viewport alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..quality.metering import picture_stops, stops_from_above
from ..quality.picture import Optics
from ..uw_spectral.errors import InputError
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.multiple_scattering import LampWater
from ..uw_spectral.surface.refraction import seen_from_air
from ..uw_spectral.transfer.light_cone import LightCone, light_cone
from . import cameras
from .render_plan import RenderPlan
from .scene_requirements import trace_rays, trace_view
from .settings import BY_PICTURE, SOLVED
from .waterline import PORT

_FARTHEST = 1000.0  # m, where a ray is let into the water that hardly goes down
_UNDER = 1e-3  # m, how far under the surface rays go on
_OBLIQUE = 0.1  # cosine to the camera's axis at which its glass ends
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

    None if the settings expose otherwise or nothing is lit: the exposure is then that of the
    light at the camera.

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
    if chosen.exposure != BY_PICTURE:
        return None
    # The rays need neither waves, whose light is the same on average, nor changed wavelengths.
    column = plan.column
    if column.surface == "waves":
        column = replace(column, surface="flat")
    view = replace(plan.viewpoint(depth, 0.0, lit), column=column)
    cone = light_cone(view.field, depth, column.sun_direction)
    lamps = plan.lamps(scene).lamps
    water = plan.lamp_water(depth) if lamps else None
    optics = Optics(view, solved=chosen.field == SOLVED)
    try:
        if camera.matrix_world.translation.z >= 0:
            stops = _from_above(scene, camera, optics, cone, lamps, water)
        else:
            seen = trace_view(
                scene, camera, column, cone, rays=_GRID[0] * _GRID[1], grid=_GRID, skyward=_SKYWARD
            )
            stops = picture_stops(optics, seen, lamps, water)
    except InputError:
        return None
    return stops + chosen.exposure_compensation


def _from_above(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    optics: Optics,
    cone: LightCone,
    lamps: Sequence[Lamp],
    water: LampWater | None,
) -> float:
    """Stops of a camera over the water, or with the waterline on its glass."""
    column = optics.view.column
    origin, direction = cameras.ray_arrays(scene, camera, *_GRID)
    forward = np.array(camera.matrix_world.to_quaternion() @ Vector((0.0, 0.0, -1.0)))
    glass = origin[:, 2] + PORT * direction[:, 2] / np.maximum(direction @ forward, _OBLIQUE)
    n = np.where((glass > 0) & column.reflects, column.refractive_index, 1.0)
    down = np.flatnonzero(direction[:, 2] < 0)
    seen = None
    if len(down):
        v = direction[down]
        to_water = np.minimum(-origin[down, 2] / v[:, 2], _FARTHEST)
        place = origin[down] + v * to_water[:, None]
        place[:, 2] = -_UNDER
        _, refracted, _ = seen_from_air(tuple(v.T), (0.0, 0.0, 1.0), n[down])
        towards = np.stack(np.broadcast_arrays(*refracted), axis=1)
        seen = trace_rays(scene, place, towards, column, cone, skyward=_SKYWARD)
    return stops_from_above(optics, direction, n, seen, lamps, water)
