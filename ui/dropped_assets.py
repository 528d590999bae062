"""Waters, looks and lamps that are dropped into the viewport from the asset library.

Waters and looks are worlds that carry settings; a scene that such a world becomes the world of
takes them over, and fills with water if it has a camera. Lamps are collections, of which Blender
drops an instance; lamps of the scene's own take its place, which light its water and have settings.
"""

from __future__ import annotations

import json
import sys

import bpy
from bpy.app.handlers import persistent

from ..scene import stored_settings
from ..scene.session import is_live
from ..scene.water import lamp_rigs
from ..uw_spectral.errors import InputError
from .live_updates import transaction

SETTINGS = "uw_settings"
"""Property of a world: settings by their names, as JSON."""
RIG = "uw_rig"
"""Property of a collection: which rig it holds."""
_TAKEN = "uw_taken"


def take_over(scene: bpy.types.Scene) -> bool:
    """Give a scene the settings of its world, if that was just dropped; return whether it was.

    Raises InputError if its settings cannot be read, or the water cannot be added.
    """
    world = scene.world
    if world is None or not _has_new_world(scene):
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
    from ..scene.viewport import live, live_scenes

    if is_live(scene):
        live_scenes.rebuild(scene)
    elif scene.camera is not None:
        live.add(scene)
    return True


def hang_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Put lamps where rigs of the library were dropped into a scene.

    Returns the lamps, which hang on what was dropped; raises InputError if a rig is not known.
    """
    made = []
    for item in [item for item in scene.objects if _is_rig(item)]:
        collection = item.instance_collection
        item.instance_type, item.instance_collection = "NONE", None
        rig, others = collection[RIG], bpy.data.user_map(subset=[collection])[collection]
        if not any(isinstance(user, bpy.types.Object | bpy.types.Scene) for user in others):
            inside = list(collection.objects)
            bpy.data.batch_remove([collection, *inside, *(one.data for one in inside if one.data)])
        made += lamp_rigs.add_rig(scene, rig, item)
    return made


def _is_rig(item: bpy.types.Object) -> bool:
    return (
        item.instance_type == "COLLECTION"
        and item.instance_collection is not None
        and RIG in item.instance_collection
        and item.is_editable
    )


def _take_over_all() -> None:
    for scene in bpy.data.scenes:
        if scene.is_editable:
            try:
                take_over(scene)
                hang_lamps(scene)
            except InputError as error:
                sys.stderr.write(f"underwater: {error}\n")


@persistent
def _edited(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Follow what was dropped, once Blender is idle and data may be added."""
    if bpy.app.background or not (_has_new_world(scene) or _has_new_rig(depsgraph)):
        return
    if not bpy.app.timers.is_registered(_take_over_all):
        bpy.app.timers.register(_take_over_all, first_interval=0.0)


def _has_new_world(scene: bpy.types.Scene) -> bool:
    world = scene.world
    return world is not None and SETTINGS in world and world.get(_TAKEN) != scene.name


def _has_new_rig(depsgraph: bpy.types.Depsgraph) -> bool:
    changed = (update.id.original for update in depsgraph.updates)
    return any(isinstance(item, bpy.types.Object) and _is_rig(item) for item in changed)


def register() -> None:
    """Watch for what is dropped."""
    bpy.app.handlers.depsgraph_update_post.append(_edited)


def unregister() -> None:
    """Watch no longer."""
    bpy.app.handlers.depsgraph_update_post.remove(_edited)
    if bpy.app.timers.is_registered(_take_over_all):
        bpy.app.timers.unregister(_take_over_all)
