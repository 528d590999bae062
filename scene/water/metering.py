"""Exposure by what a camera sees, for jobs and for the viewport alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...quality.metering import picture_stops, stops_from_above
from ...quality.picture import Optics
from ...settings.render_plan import RenderPlan
from ...settings.scene_settings import BY_PICTURE
from ...uw_spectral.errors import InputError
from ...uw_spectral.lamps.lamp_surface import lamplight as irradiance_seen
from ..readers import cameras
from ..readers.dark_lamps import objects_of
from ..readers.lamps import plan_lamps
from ..readers.view_tracing import trace_from_above, trace_view

_RAYS = (12, 8)
_LAYERS, _STEP = 4, 1e-3  # of the water's own objects that a ray passes; m behind each
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


def lamplight(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    plan: RenderPlan,
    seen: Sequence[tuple[float, ...]] | None = None,
) -> NDArray[np.float64] | None:
    """Return the irradiance of lamps that a camera exposes by; None without lamps or camera.

    What it sees is looked for unless it is given, see :func:`seen_places`.
    """
    lamps = plan_lamps(scene, plan).lamps
    if not lamps or camera is None:
        return None
    place = tuple(camera.matrix_world.translation)
    water = plan.lamp_water(max(-place[2], 0.0))
    seen = seen_places(scene, camera) if seen is None else seen
    return irradiance_seen(lamps, water, place, seen)


def lit_places(
    scene: bpy.types.Scene, camera: bpy.types.Object | None
) -> Sequence[tuple[float, ...]]:
    """Return places on the objects that a camera sees, if lamps may light them."""
    return seen_places(scene, camera) if camera is not None and objects_of(scene) else ()


def seen_places(scene: bpy.types.Scene, camera: bpy.types.Object) -> list[tuple[float, ...]]:
    """Return places on the objects that a camera sees, by a few rays."""
    depsgraph, found = bpy.context.evaluated_depsgraph_get(), []
    for origin, direction in cameras.camera_rays(scene, camera, *_RAYS):
        start = origin
        for _ in range(_LAYERS):
            hit, place, _, _, item, _ = scene.ray_cast(depsgraph, start, direction)
            if not hit:
                break
            if MARK not in item:
                found.append(tuple(place))
                break
            start = place + direction * _STEP
    return found
