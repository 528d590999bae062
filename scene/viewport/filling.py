"""Puts the live water of a scene into it, and tells its session."""

from __future__ import annotations

import bpy

from ...settings.scene_settings import SceneSettings
from .. import sources
from ..materials import own_water
from ..session import BUILD
from ..water import realtime, scene_water
from ..water.frame_water import RealtimeWater
from ..water.water_body import water_extent
from . import camera_reach

ROAM = "roam"
"""Of a session: how far from the middle its camera may be."""


def fill(
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
    return notes, {ROAM: camera_reach.reach(extent, water.column), BUILD: sources.source_digest()}
