"""Lamplight that a camera exposes by."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...settings.render_plan import RenderPlan
from ...uw_spectral.lamps.lamp_surface import lamplight as irradiance_seen
from . import cameras
from .dark_lamps import objects_of
from .lamps import plan_lamps

_RAYS = (12, 8)
_LAYERS, _STEP = 4, 1e-3  # of the water's own objects that a ray passes; m behind each


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
