"""Waters and looks that are dropped into the viewport from the asset library, as worlds.

A world of the library carries settings; a scene that it becomes the world of takes them over, and
fills with water if it has a camera.
"""

from __future__ import annotations

import json
import sys

import bpy
from bpy.app.handlers import persistent

from ..scene import stored_settings
from ..scene.session import is_live
from ..uw_spectral.errors import InputError
from .live_updates import transaction

SETTINGS = "uw_settings"
"""Property of a world: settings by their names, as JSON."""
_TAKEN = "uw_taken"


def take_over(scene: bpy.types.Scene) -> bool:
    """Give a scene the settings of its world, if that was just dropped.

    Returns
    -------
    bool
        Whether it was.

    Raises
    ------
    InputError
        If its settings cannot be read, or the water cannot be added.
    """
    world = scene.world
    if world is None or SETTINGS not in world or world.get(_TAKEN) == scene.name:
        return False
    group = getattr(scene, stored_settings.PROPERTY)
    try:
        given = json.loads(world[SETTINGS])
    except ValueError as error:
        raise InputError(f"the settings of world {world.name!r} are not JSON: {error}") from error
    world[_TAKEN] = scene.name
    with transaction():
        for name, value in given.items():
            if name in group.bl_rna.properties:
                setattr(group, name, value)
    from ..scene import live

    if is_live(scene):
        live.rebuild(scene)
    elif scene.camera is not None:
        live.add(scene)
    return True


def _take_over_all() -> None:
    for scene in bpy.data.scenes:
        if scene.is_editable:
            try:
                take_over(scene)
            except InputError as error:
                sys.stderr.write(f"underwater: {error}\n")


@persistent
def _edited(scene: bpy.types.Scene, _: object) -> None:
    """Follow a world that was dropped, once Blender is idle and data may be added."""
    world = scene.world
    if world is None or SETTINGS not in world or world.get(_TAKEN) == scene.name:
        return
    if bpy.app.background:
        return
    if not bpy.app.timers.is_registered(_take_over_all):
        bpy.app.timers.register(_take_over_all, first_interval=0.0)


def register() -> None:
    """Watch for worlds."""
    bpy.app.handlers.depsgraph_update_post.append(_edited)


def unregister() -> None:
    """Watch no longer."""
    bpy.app.handlers.depsgraph_update_post.remove(_edited)
    if bpy.app.timers.is_registered(_take_over_all):
        bpy.app.timers.unregister(_take_over_all)
