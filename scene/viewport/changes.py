"""Whether live water is still that of its scene."""

from __future__ import annotations

import bpy

from ...node_groups.node_mathematics import MARK
from ...settings.scene_settings import SceneSettings
from .. import contents, stored_settings
from ..materials import fluorescence, material_kinds, wet_colours, wet_trees
from ..readers import clouds, lamps, moving_surface
from ..session import KINDS, SESSION, STALE
from ..water import new_materials
from .live_water import KNOWN, places_of


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
        and new_materials.is_dry(item)
        and item.name in scene.objects
        for item in changed
    )


def has_new_kinds(scene: bpy.types.Scene) -> bool:
    """Whether objects mirror the water or emit light now that did not, or the other way round."""
    session = scene.get(SESSION)
    if session is None or KINDS not in session:
        return False
    return session[KINDS] != kinds(scene)


def kinds(scene: bpy.types.Scene) -> str:
    """Return what of the materials decides the nodes, to be compared."""
    materials = list(contents.materials(scene))
    found = material_kinds.kinds(materials), wet_colours.of(materials)
    glowing = [(name, one.fluorophore) for name, one in fluorescence.of(materials).items()]
    return repr((*found, glowing, getattr(scene, stored_settings.PROPERTY).hide_own_water))


def is_stale(scene: bpy.types.Scene) -> bool:
    """Whether the water was drawn in haste, or objects have moved since."""
    session = scene.get(SESSION)
    return session is not None and bool(session.get(STALE, False))


def note_moves(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Take note that occlusion and grids, if there are any, are not what they were.

    Objects may have moved, and densities of volume objects may be others.
    """
    known = KNOWN.get(scene.session_uid)
    if known is None:
        return
    if any(u.is_updated_geometry and clouds.is_grid(u.id.original) for u in depsgraph.updates):
        scene[SESSION][STALE] = True
    if known.occlusion is None:
        return
    moved = any(u.is_updated_geometry or u.is_updated_transform for u in depsgraph.updates)
    if moved and known.places != places_of(scene, depsgraph):
        scene[SESSION][STALE] = True


def key(scene: bpy.types.Scene, chosen: SceneSettings, depth: float) -> str:
    """Return what decides the values of the water, to be compared."""
    moving = chosen.surface == moving_surface.WAVES
    time = moving_surface.wave_time(scene, chosen) if moving else 0.0
    glowing = fluorescence.of(contents.materials(scene))
    return repr((chosen, depth, time, lamps.state(scene), clouds.state(scene), glowing))
