"""What to know of live water, and what keeps its scene from being rendered."""

from __future__ import annotations

import bpy

from ...settings.render_plan import plan_of
from ...settings.water_settings import NO_FLOOR
from .. import sources, stored_settings
from ..engines.eevee_settings import ENGINE
from ..readers import cameras, unknown_colours, unusable_places
from ..session import BUILD, PROBLEM, SESSION
from ..terms import limits
from ..water import realtime, scene_water
from ..water.frame_water import RealtimeWater
from .live_water import KNOWN, settings_of
from .preview_depths import camera_depth


def standing_notes(scene: bpy.types.Scene) -> list[str]:
    """Return what to know of live water for as long as it is there, a line each."""
    known, session = KNOWN.get(scene.session_uid), scene.get(SESSION)
    built = () if session is None else sources.notes(session.get(BUILD))
    return [*built, *(() if known is None else unknown_colours.notes(known.cache.looked))]


def standing_limits(scene: bpy.types.Scene, water: RealtimeWater) -> list[str]:
    """Return what of a scene that has got live water is not drawn as it is, a line each."""
    cache, camera = KNOWN[scene.session_uid].cache, cameras.camera_of(scene)
    return [
        *limits.of_eevee(scene, camera, plan_of(settings_of(scene)), cache, water),
        *unusable_places.notes(),
        *cameras.clip_notes(camera),
    ]


def problem(scene: bpy.types.Scene) -> str:
    """Say what keeps a scene from being rendered, empty if nothing does."""
    session = scene.get(SESSION)
    if session is not None:
        lost = realtime.lost_parts(scene) or scene_water.lost_parts(scene)
        if lost:
            return (
                f"The water lacks {', '.join(lost)}. Press Refresh Water to build it anew, or "
                "Remove Water to have the scene back."
            )
        if session[PROBLEM]:
            return session[PROBLEM]
    if session is not None and scene.render.engine != ENGINE:
        return (
            f"The render engine is {_engine_name(scene)}, and this water is drawn by EEVEE: "
            "Blender's own Render would be wrong. Press Render Reference or Render in this panel, "
            "or switch back to EEVEE."
        )
    depth = camera_depth(scene)
    floor = getattr(scene, stored_settings.PROPERTY).floor_depth
    if depth is None:
        why = cameras.why_no_camera(scene)
        return f"The scene {why}. Add one below z = 0, the water surface."
    if floor != NO_FLOOR and depth >= floor:
        return f"The camera, at {depth:.3g} m, is below the floor at {floor:.3g} m."
    return ""


def _engine_name(scene: bpy.types.Scene) -> str:
    known = scene.render.bl_rna.properties["engine"].enum_items
    name = scene.render.engine
    return known[name].name if name in known else name.capitalize()
