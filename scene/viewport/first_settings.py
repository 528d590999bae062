"""What a scene that never held water starts with, so that its first picture is a good one."""

from __future__ import annotations

import bpy

from ...settings.scene_settings import BY_PICTURE
from ...settings.water_settings import WORLD
from .. import stored_lamps, stored_settings
from ..readers import world_state
from ..readers.shown_lamps import ShownLamp, is_lamp, shown_lamps
from ..water.water_body import scene_reach
from . import preview_depths, submerging

_SETTINGS = {
    "surface": "waves",
    "wind_speed": 4.0,
    "white_balance": "depth",
    "exposure": BY_PICTURE,
    "tone": "nikon-d7000",
    "floor_reflectance": "0.3",
}
_DRY = 2.0
"""Lowest object, m, of a scene that was not built for water around z = 0."""
_OWN_GROUND = 20.0
"""From this radius on, m, a scene brings its own seabed."""
_DEEPEST_FLOOR = 60.0


def is_dry(scene: bpy.types.Scene) -> bool:
    """Whether a scene was not built for a water surface at z = 0: camera and objects are above."""
    depth = preview_depths.camera_depth(scene)
    return depth is not None and depth <= 0.0 and scene_reach(scene).lowest < _DRY


def leave_lamps_in_air(scene: bpy.types.Scene) -> None:
    """Let the lamps that are above the water stay out of it, wherever they go."""
    hidden_too = [ShownLamp(item, item.matrix_world) for item in scene.objects if is_lamp(item)]
    for lamp in (*hidden_too, *shown_lamps(scene)):
        if lamp.is_above and lamp.light.is_editable:
            getattr(lamp.light, stored_lamps.PROPERTY).in_water = False


def start(scene: bpy.types.Scene, depth: float | None) -> list[str]:
    """Give a scene the settings of a first picture; returns notes on what could not be lowered.

    A dry scene is lowered until its camera is at the depth, m, None leaves it; and its lamps, which
    hang in the air, are left out: the sun lights it. Under objects that bring no seabed of their
    own a pale floor is put, where they end. A world with a picture or a sky texture lights it.
    """
    notes = []
    above = preview_depths.camera_depth(scene)
    if depth is not None and above is not None and is_dry(scene):
        leave_lamps_in_air(scene)
        notes = submerging.lower(scene, depth - above)
        for layer in scene.view_layers:
            layer.update()
    group = getattr(scene, stored_settings.PROPERTY)
    for name, value in _SETTINGS.items():
        setattr(group, name, value)
    if world_state.has_sky(world_state.own_world(scene)):
        group.sky_picture = WORLD
    reach, camera = scene_reach(scene), preview_depths.camera_depth(scene)
    lowest = round(reach.lowest, 3)
    under = camera is not None and 0.0 < camera < lowest < _DEEPEST_FLOOR
    if under and reach.radius < _OWN_GROUND:
        group.floor_depth = lowest
    return notes
