"""The settings and the water of live scenes as they are now, in the light of their own world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...settings.render_plan import RenderPlan, plan_of, quiet
from ...settings.scene_settings import BY_PICTURE, REALTIME, SceneSettings
from ...uw_spectral.errors import InputError
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from .. import stored_settings
from ..engines import world_picture
from ..readers import cameras
from ..session import SESSION, STALE
from ..terms.eevee_water import eevee_water
from ..terms.occlusion import OcclusionTerm
from ..terms.waves import with_waves
from ..water import metering
from ..water.frame_water import RealtimeWater
from ..water.occlusion import Cache
from ..water.term import Eye

SKY = "sky"
_CHANGED = (
    "the world has changed since it was drawn for the water, which cannot be done during a render: "
    "Refresh Water, and render worlds that are animated as a job (Render Reference, Render)"
)
_FEW_BANDS = 8  # while settings change
_STOPS = "stops"


@dataclass(frozen=True, eq=False)
class Known:
    """What an update in haste takes from the last one."""

    occlusion: OcclusionTable | None
    centres: NDArray[np.float64]  #: Of the bands of the occlusion, nm.
    places: int  #: What :func:`places_of` was then.
    cache: Cache  #: What serves for the next.
    lit: Sequence[tuple[float, ...]]  #: Places that the camera sees in the light of lamps.


KNOWN: dict[int, Known] = {}
"""Of each scene, by the number that it has in this session; what is lost is computed again."""


def settings_of(scene: bpy.types.Scene, *, draws: bool = True) -> SceneSettings:
    """Return the stored settings of a scene, in real time.

    A sky that is the scene's world is the one before, if nothing may be rendered now; then more is
    to come, as after haste. InputError if nothing will.
    """
    chosen = stored_settings.stored_settings(scene).in_mode(REALTIME)
    session = scene.original.get(SESSION)
    found = world_picture.drawn(scene, chosen) if draws else world_picture.known(scene, chosen)
    if found is None:
        if session is None or _is_rendering():
            raise InputError(_CHANGED)
        session[STALE] = True
        return replace(chosen, sky_picture=session.get(SKY, ""))
    if session is not None and session.get(SKY) != found.sky_picture:
        session[SKY] = found.sky_picture
    return found


def may_draw(depsgraph: bpy.types.Depsgraph | None, *, hasty: bool) -> bool:
    """Whether a world may be drawn now: in a window not while Blender evaluates or renders."""
    return _in_background() or (depsgraph is None and not hasty and not _is_rendering())


def _in_background() -> bool:
    return bpy.app.background


def _is_rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def live_water(
    scene: bpy.types.Scene, chosen: SceneSettings, depth: float, *, hasty: bool = False
) -> RealtimeWater:
    """Return the water of settings, for a camera at a depth, m; in haste a few bands will do."""
    plan = plan_of(chosen.with_at_most(_FEW_BANDS) if hasty else chosen)
    camera = cameras.camera_of(scene)
    last = KNOWN.get(scene.session_uid)
    known = last if hasty else None
    seen = metering.lit_places(scene, camera) if known is None else known.lit
    with quiet():
        lit = metering.lamplight(scene, camera, plan, seen)
        stops = _exposure(scene, plan, depth, lit, hasty=hasty)
        weights = plan.reduction(depth, lit, stops).weights
        cache = last.cache if last else Cache()
        occluded = known and known.occlusion
        if known and occluded:
            occluded = occluded.on(known.centres, plan.bands.centres)
        eye = Eye(camera, depth, lit_places=seen)
        water = eevee_water(plan, scene, eye, weights, cache, occluded, unchanged=known is not None)
        if SESSION in scene:
            # Something is always left to be done at rest: images are packed then.
            scene[SESSION][STALE] = hasty
        occlusion = water.term(OcclusionTerm)
        if known is None or (occlusion is not None and occluded is None):
            places = places_of(scene, bpy.context.evaluated_depsgraph_get()) if occlusion else 0
            table = occlusion and occlusion.table
            KNOWN[scene.session_uid] = Known(table, plan.bands.centres, places, cache, seen)
        return with_waves(scene, plan, water)


def _exposure(
    scene: bpy.types.Scene,
    plan: RenderPlan,
    depth: float,
    lit: NDArray[np.float64] | None,
    *,
    hasty: bool,
) -> float | None:
    """Stops by the picture, where the settings ask for it; in haste those of the last."""
    session = scene.get(SESSION)
    if hasty and session is not None and _STOPS in session:
        known = session[_STOPS]
        return known if plan.settings.exposure == BY_PICTURE else None
    camera = cameras.camera_of(scene)
    if camera is None:
        return None
    stops = metering.metered(scene, camera, plan, depth, lit)
    if session is not None:
        if stops is None:
            session.pop(_STOPS, None)
        else:
            session[_STOPS] = stops
    return stops


def places_of(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> int:
    """Return a number that changes where an object of the user's gets another place or shape."""
    places = []
    for item in scene.objects:
        if MARK in item:
            continue
        seen = item.evaluated_get(depsgraph)
        size = len(seen.data.vertices) if isinstance(seen.data, bpy.types.Mesh) else 0
        box = tuple(x for corner in (seen.bound_box or ()) for x in corner)
        matrix = tuple(x for row in seen.matrix_world for x in row)
        places.append((item.name, seen.hide_viewport, size, box, matrix))
    return hash(tuple(places))
