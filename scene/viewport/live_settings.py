"""The settings of live scenes, with the picture of their world if that lights the water."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...settings.scene_settings import REALTIME, SceneSettings
from ...uw_spectral.errors import InputError
from .. import stored_settings
from ..engines import world_picture
from ..session import SESSION, STALE

SKY = "sky"
_CHANGED = (
    "the world has changed since it was drawn for the water, which cannot be done during a render: "
    "Refresh Water, and render worlds that are animated as a job (Render Reference, Render)"
)


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
