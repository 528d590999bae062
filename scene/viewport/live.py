"""Keeps the real-time water of a scene up to date with its settings, camera and frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from ...settings.render_plan import plan_of
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.errors import InputError
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import colour_space, scripts, sources
from ..materials import own_water
from ..readers import cameras, missing_data
from ..session import BUILD, KINDS, PROBLEM, SESSION
from ..water import new_materials, realtime, scene_water
from ..water.frame_water import RealtimeWater
from ..water.water_body import WaterExtent, extent_around, reach_of, water_extent
from . import problems, saved_settings
from .changes import has_new_kinds, is_stale, key, kinds
from .live_water import KNOWN, SKY, live_water, may_draw, settings_of
from .preview_depths import preview_depth

_SHOWN = "shown"
_ROAM = "roam"  # how far from the middle the camera may be


@dataclass
class _State:
    """What lives from one update to the next."""

    busy: bool = False  #: Water is being updated.


_state = _State()


def add(scene: bpy.types.Scene) -> list[str]:
    """Put live water with the scene's stored settings into a scene.

    Its z = 0 is the mean water surface. Returns what could not be treated, one line each.
    InputError if the scene has water already, or the settings cannot be used.
    """
    # A script that has just placed the camera has not updated its matrix yet.
    for layer in scene.view_layers:
        layer.update()
    colour_space.require_rec709()
    chosen = settings_of(scene)
    depth = preview_depth(scene, chosen)
    water = live_water(scene, chosen, depth)
    notes = [*missing_data.missing_notes(scene, (scene.frame_current,)), *scripts.notes()]
    filled, held = _fill(scene, chosen, water, depth)
    notes += filled
    notes += problems.standing_limits(scene, water)
    notes += filter(None, [plan_of(chosen).sky_note])
    realtime.keep_images(scene)
    now = {_SHOWN: key(scene, chosen, depth), PROBLEM: "", KINDS: kinds(scene)}
    scene[SESSION] = held | now | {SKY: chosen.sky_picture}
    saved_settings.apply(scene, water)
    return notes


def remove(scene: bpy.types.Scene) -> list[str]:
    """Take live water out; the scene is as it was before :func:`add`.

    Returns what could not be given back, one line each.
    """
    notes = scene_water.remove(scene)
    KNOWN.pop(scene.session_uid, None)
    if SESSION in scene:
        notes += saved_settings.restore(scene)
        del scene[SESSION]
    return notes


def update(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph | None = None,
    *,
    may_rebuild: bool = True,
    hasty: bool = False,
) -> bool:
    """Bring the water of a scene to its present settings; do nothing without water.

    Settings that cannot be used leave the water as it was; :func:`.problem` then says why.

    In a handler, animated values are read in its ``depsgraph``. Nodes are not built anew while
    Blender evaluates or renders, unless it ``may_rebuild``. In haste few bands will do, and the
    occlusion between objects may stay as it is; :func:`.is_stale` says then that there is more to
    come. False if the water needs other nodes and could not get them.
    """
    session = scene.get(SESSION)
    if session is None or not scene.is_editable or realtime.lost_parts(scene):
        return True
    if _state.busy:
        return True
    seen = scene if depsgraph is None else scene.evaluated_get(depsgraph)
    # Looking around evaluates the scene, which asks for an update of its own.
    _state.busy = True
    try:
        chosen = settings_of(seen, draws=may_draw(depsgraph, hasty=hasty))
        depth = preview_depth(scene, chosen, depsgraph)
        now = key(scene, chosen, depth)
        if may_rebuild:
            new_materials.take_in(scene)
        outgrown = may_rebuild and (
            _from_the_middle(scene, depsgraph) > session.get(_ROAM, math.inf)
            or has_new_kinds(scene)
        )
        same = session[_SHOWN] == now and not outgrown
        if same and (hasty or not is_stale(scene)):
            return True
        water = live_water(scene, chosen, depth, hasty=hasty)
        if outgrown or not realtime.fits(scene, water):
            if not may_rebuild:
                return False
            _, held = _fill(scene, chosen, water, depth, again=True)
            session.update(held)
        else:
            realtime.set_values(scene, water)
        if not hasty:
            realtime.keep_images(scene)
        if water.shafts is not None:
            saved_settings.use_shafts(scene, water)
        saved_settings.show(scene)
        session[_SHOWN], session[PROBLEM] = now, ""
        if may_rebuild:
            session[KINDS] = kinds(scene)
    except InputError as error:
        session[PROBLEM] = str(error)
    finally:
        _state.busy = False
    return True


def _fill(
    scene: bpy.types.Scene,
    chosen: SceneSettings,
    water: RealtimeWater,
    depth: float,
    *,
    again: bool = False,
) -> tuple[list[str], dict[str, object]]:
    """Put water into a scene, ``again`` in place of what it has; hide its own if that is wanted.

    Returns what could not be treated, one line each, and what the session holds of it.
    """
    # It evaluates the scene: while that is dry, its objects would seem to have come.
    extent = water_extent(scene, water.column, depth)
    if again:
        scene_water.remove(scene)
    notes = realtime.add_realtime(scene, water, extent)
    if chosen.hide_own_water:
        own_water.hide(scene)
    return notes, {_ROAM: _reach(extent, water.column), BUILD: sources.source_digest()}


def _reach(extent: WaterExtent, column: WaterColumn) -> float:
    """Distance from the origin in m that a camera may have before the water is widened."""
    around_camera = extent_around(reach_of([]), column, 0.0).half_width
    return extent.half_width - around_camera / 2.0


def _from_the_middle(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None) -> float:
    """Distance of the camera from the origin, m."""
    camera = cameras.camera_of(scene)
    if camera is not None and depsgraph is not None:
        camera = camera.evaluated_get(depsgraph)
    return 0.0 if camera is None else math.hypot(*camera.matrix_world.translation.xy)
