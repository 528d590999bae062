"""Keeps the real-time water of a scene up to date with its settings, camera and frame."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...settings.render_plan import RenderPlan, forget_files, plan_of, quiet
from ...settings.scene_settings import BY_PICTURE, REALTIME, SceneSettings
from ...settings.water_settings import NO_FLOOR
from ...uw_spectral.errors import InputError
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import colour_space, contents, scripts, sources, stored_settings
from ..engines.eevee_settings import ENGINE
from ..materials import fluorescence, own_water, realtime_materials, wet_colours, wet_trees
from ..readers import cameras, clouds, enclosed_places, lamps, missing_data, unusable_places
from ..session import PROBLEM, SESSION, has_strays
from ..water import (
    continued_seabed,
    frame_water,
    giving_back,
    metering,
    moving_surface,
    realtime,
    scene_water,
)
from ..water.eevee_water import Eye, eevee_water
from ..water.occlusion import Cache
from ..water.water_body import WaterExtent, extent_around, reach_of, water_extent
from . import saved_settings
from .preview_depths import camera_depth, preview_depth

_FEW_BANDS = 8  # while settings change


_SHOWN, _STALE = "shown", "stale"
_STOPS, _KINDS, _ROAM, _BUILD = "stops", "kinds", "roam", "build"


@dataclass(frozen=True, eq=False)
class _Known:
    """What an update in haste takes from the last one.

    The occlusion, if there is any, its bands, and what :func:`_places` was then; what serves for
    the next; and the places that the camera sees in the light of lamps.
    """

    table: OcclusionTable | None
    bands: Bands
    places: int
    cache: Cache
    lit: Sequence[tuple[float, ...]]

    def on(self, bands: Bands) -> OcclusionTable | None:
        """Return the occlusion on other bands."""
        return self.table and self.table.on(self.bands.centres, bands.centres)


@dataclass
class _State:
    """What lives from one update to the next; what is lost is computed again.

    ``busy`` while water is being updated; ``known`` is what is known of each scene, by the number
    that it has in this session.
    """

    busy: bool = False
    known: dict[int, _Known] = field(default_factory=dict)


_state = _State()


def add(scene: bpy.types.Scene) -> list[str]:
    """Put live water with the scene's stored settings into a scene.

    Parameters
    ----------
    scene : Scene
        The scene; its z = 0 is the mean water surface.

    Returns
    -------
    list of str
        What could not be treated, one line each.

    Raises
    ------
    InputError
        If the scene has water already, or the settings cannot be used.
    """
    # A script that has just placed the camera has not updated its matrix yet.
    for layer in scene.view_layers:
        layer.update()
    colour_space.require_rec709()
    chosen = _settings(scene)
    depth = preview_depth(scene, chosen)
    water = _water(scene, chosen, depth)
    extent = water_extent(scene, water.column, depth)
    notes = [*missing_data.missing_notes(scene, (scene.frame_current,)), *scripts.notes()]
    notes += _fill(scene, chosen, water, extent)
    known = _state.known[scene.session_uid]
    notes += continued_seabed.notes(plan_of(chosen), known.cache.looked)
    camera = cameras.camera_of(scene)
    notes += enclosed_places.notes(scene, camera, known.table, known.cache.looked)
    notes += known.cache.notes
    notes += [*unusable_places.notes(), *cameras.clip_notes(camera)]
    if camera is not None:
        notes += moving_surface.limits(camera, chosen, eevee=True, live=True)
    realtime.keep_images(scene)
    session: dict[str, Any] = {_SHOWN: _key(scene, chosen, depth), PROBLEM: ""}
    session[_ROAM] = _roam(extent, water.column)
    session[_KINDS], session[_BUILD] = _kinds(scene), sources.source_digest()
    scene[SESSION] = session
    saved_settings.apply(scene, water)
    return notes


def standing_notes(scene: bpy.types.Scene) -> list[str]:
    """Return what to know of live water for as long as it is there, a line each."""
    known, session = _state.known.get(scene.session_uid), scene.get(SESSION)
    built = () if session is None else sources.notes(session.get(_BUILD))
    return [*built, *(() if known is None else known.cache.notes)]


def _fill(
    scene: bpy.types.Scene,
    chosen: SceneSettings,
    water: frame_water.RealtimeWater,
    extent: WaterExtent,
) -> list[str]:
    """Put water into a scene, and hide the scene's own if that is wanted."""
    notes = realtime.add_realtime(scene, water, extent)
    if chosen.hide_own_water:
        own_water.hide(scene)
    return notes


def remove(scene: bpy.types.Scene) -> list[str]:
    """Take live water out; the scene is as it was before :func:`add`.

    Returns
    -------
    list of str
        What could not be given back, one line each.
    """
    notes = scene_water.remove(scene)
    _state.known.pop(scene.session_uid, None)
    if SESSION in scene:
        notes += saved_settings.restore(scene)
        del scene[SESSION]
    return notes


def take_out(scene: bpy.types.Scene) -> list[str]:
    """Take live water out for good: what the scene shares with others gets the water of these.

    Returns
    -------
    list of str
        What could not be given back, or be treated there, one line each.
    """
    others = [other for other in _wet_with(scene) if other != scene]
    return remove(scene) + [note for other in others for note in rebuild(other)]


def _wet_with(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """Scenes with live water that are the scene, or share materials with it."""
    own = set(contents.materials(scene))
    return [
        other
        for other in bpy.data.scenes
        if SESSION in other and (other == scene or not own.isdisjoint(contents.materials(other)))
    ]


def update(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph | None = None,
    *,
    may_rebuild: bool = True,
    hasty: bool = False,
) -> bool:
    """Bring the water of a scene to its present settings; do nothing without water.

    Settings that cannot be used leave the water as it was; :func:`problem` then says why.

    Parameters
    ----------
    scene : Scene
        The original scene.
    depsgraph : Depsgraph, optional
        Where animated values are read, in a handler.
    may_rebuild : bool
        Whether nodes may be built anew; not while Blender evaluates or renders.
    hasty : bool
        Whether few bands will do, and the occlusion between objects may stay as it is;
        :func:`is_stale` says then that there is more to come.

    Returns
    -------
    bool
        False if the water needs other nodes and could not get them.
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
        chosen = _settings(seen)
        depth = preview_depth(scene, chosen, depsgraph)
        key = _key(scene, chosen, depth)
        if may_rebuild:
            realtime.take_in(scene)
        outgrown = may_rebuild and _from_the_middle(scene, depsgraph) > session.get(_ROAM, math.inf)
        outgrown = outgrown or (may_rebuild and has_new_kinds(scene))
        same = session[_SHOWN] == key and not outgrown
        if same and (hasty or not is_stale(scene)):
            return True
        water = _water(scene, chosen, depth, hasty=hasty)
        if outgrown or not realtime.fits(scene, water):
            if not may_rebuild:
                return False
            # It evaluates the scene: while that is dry, its objects would seem to have come.
            extent = water_extent(scene, water.column, depth)
            scene_water.remove(scene)
            _fill(scene, chosen, water, extent)
            session[_ROAM], session[_BUILD] = _roam(extent, water.column), sources.source_digest()
        else:
            realtime.set_values(scene, water)
        if not hasty:
            realtime.keep_images(scene)
        if water.shafts is not None:
            saved_settings.use_shafts(scene, water)
        saved_settings.show(scene)
        session[_SHOWN], session[PROBLEM] = key, ""
        if may_rebuild:
            session[_KINDS] = _kinds(scene)
    except InputError as error:
        session[PROBLEM] = str(error)
    finally:
        _state.busy = False
    return True


def has_come(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether what has changed is not in the scene's water: an object is new, a shader another."""
    changed = [update.id.original for update in depsgraph.updates]
    shaders = bpy.types.Material, bpy.types.NodeTree
    edited = contents.materials(scene) if any(isinstance(x, shaders) for x in changed) else ()
    seen = [x for x in changed if isinstance(x, bpy.types.Material)]
    if any(map(wet_trees.is_rewired, seen)) or any(map(wet_trees.is_dry, edited)):
        return True
    return any(
        isinstance(item, bpy.types.Object)
        and MARK not in item
        and realtime.is_dry(item)
        and item.name in scene.objects
        for item in changed
    )


def has_new_kinds(scene: bpy.types.Scene) -> bool:
    """Whether objects mirror the water or emit light now that did not, or the other way round."""
    session = scene.get(SESSION)
    if session is None or _KINDS not in session:
        return False
    return session[_KINDS] != _kinds(scene)


def _kinds(scene: bpy.types.Scene) -> str:
    materials = list(contents.materials(scene))
    kinds = realtime_materials.kinds(materials), wet_colours.of(materials)
    glowing = [(name, one.fluorophore) for name, one in fluorescence.of(materials).items()]
    return repr((*kinds, glowing, getattr(scene, stored_settings.PROPERTY).hide_own_water))


def is_stale(scene: bpy.types.Scene) -> bool:
    """Whether the water was drawn in haste, or objects have moved since."""
    session = scene.get(SESSION)
    return session is not None and bool(session.get(_STALE, False))


def note_moves(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Take note that occlusion and grids, if there are any, are not what they were.

    Objects may have moved, and densities of volume objects may be others.
    """
    known = _state.known.get(scene.session_uid)
    if known is None:
        return
    if any(u.is_updated_geometry and clouds.is_grid(u.id.original) for u in depsgraph.updates):
        scene[SESSION][_STALE] = True
    if known.table is None:
        return
    moved = any(u.is_updated_geometry or u.is_updated_transform for u in depsgraph.updates)
    if moved and known.places != _places(scene, depsgraph):
        scene[SESSION][_STALE] = True


def _places(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> int:
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


def rebuild(scene: bpy.types.Scene) -> list[str]:
    """Build the water anew: new objects and materials get wet, files are read again."""
    forget_files()
    return remove(scene) + add(scene)


def tidy() -> None:
    """Give back what water has hidden and changed for scenes that were deleted since."""
    if has_strays():
        giving_back.let_go()


@contextlib.contextmanager
def suspended(scene: bpy.types.Scene) -> Iterator[None]:
    """Take live water out while the block runs; a render brings its own.

    Other scenes that share materials with the scene are dry meanwhile too.
    """
    wet = _wet_with(scene)
    for other in wet:
        remove(other)
    try:
        yield
    finally:
        for other in wet:
            add(other)


def refresh_materials() -> None:
    """Follow colours of the user's materials, which were edited or animated."""
    wet_trees.refresh()


def _roam(extent: WaterExtent, column: WaterColumn) -> float:
    """Distance from the origin in m that a camera may have before the water is widened."""
    around_camera = extent_around(reach_of([]), column, 0.0).half_width
    return extent.half_width - around_camera / 2.0


def _from_the_middle(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None) -> float:
    camera = cameras.camera_of(scene)
    if camera is not None and depsgraph is not None:
        camera = camera.evaluated_get(depsgraph)
    return 0.0 if camera is None else math.hypot(*camera.matrix_world.translation.xy)


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


def _key(scene: bpy.types.Scene, chosen: SceneSettings, depth: float) -> str:
    moving = chosen.surface == moving_surface.WAVES
    time = moving_surface.wave_time(scene, chosen) if moving else 0.0
    glowing = fluorescence.of(contents.materials(scene))
    return repr((chosen, depth, time, lamps.state(scene), clouds.state(scene), glowing))


def _settings(scene: bpy.types.Scene) -> SceneSettings:
    return stored_settings.stored_settings(scene).in_mode(REALTIME)


def _water(
    scene: bpy.types.Scene, chosen: SceneSettings, depth: float, *, hasty: bool = False
) -> frame_water.RealtimeWater:
    plan = plan_of(chosen.with_at_most(_FEW_BANDS) if hasty else chosen)
    camera = cameras.camera_of(scene)
    last = _state.known.get(scene.session_uid)
    known = last if hasty else None
    if known is not None:
        seen = known.lit
    else:
        seen = lamps.seen_places(scene, camera) if camera and lamps.objects_of(scene) else ()
    with quiet():
        lit = lamps.lamplight(scene, camera, plan, seen)
        stops = _exposure(scene, plan, depth, lit, hasty=hasty)
        weights = plan.reduction(depth, lit, stops).weights
        cache = last.cache if last else Cache()
        occluded = known and known.on(plan.bands)
        eye = Eye(camera, depth, lit_places=seen)
        water = eevee_water(plan, scene, eye, weights, cache, occluded, unchanged=known is not None)
        if SESSION in scene:
            # Something is always left to be done at rest: images are packed then.
            scene[SESSION][_STALE] = hasty
        if known is None or (water.inputs.occlusion is not None and occluded is None):
            has_occlusion = water.inputs.occlusion is not None
            places = _places(scene, bpy.context.evaluated_depsgraph_get()) if has_occlusion else 0
            _state.known[scene.session_uid] = _Known(
                water.inputs.occlusion, plan.bands, places, cache, seen
            )
        return moving_surface.with_waves(scene, plan, water)


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
