"""Plumes of bubbles for a scene: clouds below the foam of a frame, which thin out after it."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector

from ...settings.descriptions import sea_of
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.clouds.matter import BUBBLES
from ...uw_spectral.errors import InputError
from ...uw_spectral.surface.plumes import (
    LASTS,
    Patch,
    largest,
    patches,
    plume_air,
    plume_depth,
    plume_middle,
)
from ..readers import moving_surface
from ..stored_clouds import PROPERTY
from . import new_clouds

NAME = "Bubble Plume"
_RADIUS = 15.0  # m about the camera
_KEYS = 0.25  # s between keyframes
_BEFORE = 0.5  # s in which one comes up


def add_plumes(
    scene: bpy.types.Scene, settings: SceneSettings, count: int, *, keyed: bool = True
) -> list[bpy.types.Object]:
    """Add at most so many plumes below the foam that counts most before the camera at this frame.

    ``keyed`` is whether they come up before this frame, follow the waves and thin out after it, by
    keyframes; else they stay as they are. InputError if there is no camera, or no foam near it.
    """
    camera = scene.camera
    if camera is None:
        raise InputError("plumes of bubbles: the scene has no camera; add one")
    waves = moving_surface.heights(scene, settings)
    if waves is None or waves.foam is None:
        raise InputError(
            "plumes of bubbles: the water has no foam; switch on Waves, Waves with height and "
            "Whitecaps"
        )
    middle = camera.matrix_world.translation[:2]
    ahead = (camera.matrix_world.to_quaternion() @ Vector((0.0, 0.0, -1.0)))[:2]
    found = largest(patches(waves, middle, _RADIUS), count, middle, ahead)
    if not found:
        raise InputError(
            f"plumes of bubbles: no foam within {_RADIUS:g} m of the camera at this frame; take "
            "another frame, or more wind"
        )
    depth = plume_depth(sea_of(settings).significant_height())
    return [_plume(scene, settings, patch, depth, keyed=keyed) for patch in found]


def _plume(
    scene: bpy.types.Scene, settings: SceneSettings, patch: Patch, depth: float, *, keyed: bool
) -> bpy.types.Object:
    item = new_clouds.add_blob(scene, BUBBLES)
    item.name, own = NAME, getattr(item, PROPERTY)
    item.scale = patch.long, patch.short, depth
    item.rotation_euler = 0.0, 0.0, patch.turn
    now, sea = moving_surface.wave_time(scene, settings), sea_of(settings)
    rate = scene.render.fps / scene.render.fps_base

    def place(t: float) -> tuple[float, float, float]:
        elevation = float(sea.elevation(patch.x, patch.y, t))
        return patch.x, patch.y, plume_middle(depth, elevation)

    item.location = place(now)
    own.concentration = plume_air(patch, depth, 0.0)
    if not keyed:
        return item
    path, frame_now = f"{PROPERTY}.concentration", scene.frame_current
    for age in np.arange(-_BEFORE, LASTS + _KEYS / 2.0, _KEYS).tolist():
        frame = frame_now + round(age * rate)
        item.location = place(now + age * settings.wave_time_scale)
        own.concentration = plume_air(patch, depth, age)
        item.keyframe_insert("location", frame=frame)
        item.keyframe_insert(path, frame=frame)
    scene.frame_set(frame_now)
    return item
