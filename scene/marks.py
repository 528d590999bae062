"""What in a scene belongs to its water: found by the marks it carries, never by its name."""

from __future__ import annotations

import bpy

from ..node_groups.node_mathematics import MARK
from ..node_groups.realtime_waves import WaveImages
from ..uw_spectral.errors import InputError
from .rendered import is_hidden_by_animation

IS_SUN = "uw_sun"
"""Mark of the lamp of the direct sun."""
SURFACE, KEEPING, FLUORESCENT = "uw_surface", "uw_keeping", "uw_fluorescent"
"""Part that lights the materials in real time; see :func:`part`."""
PARTICLES = "uw_particles"
"""Mark of objects that are particles: their kind."""
CLOUD = "uw_cloud"
"""Mark of objects that are clouds: their number."""
FLOOR = "uw_floor"
"""Part that is the material of the added floor."""
FLOOR_DEPTH = "uw_floor_depth"
"""Mark of the added floor: its depth in m."""
CAUSTICS, SLOPES, LONG_WAVES = "uw_caustics", "uw_slopes", "uw_long_waves"
CROWDING, LONG_CROWDING = "uw_crowding", "uw_long_crowding"
"""Parts that are the images of the moving surface."""
FOLLOWS = "uw_follows"
"""Mark of a lamp that follows one of the scene's: its number."""
HIDDEN, UNSEEN = "uw_hidden", "uw_unseen"
"""Marks of the scene's own lamps while there is water: how they were shown."""
DIMMED = "uw_dimmed"
"""Mark of the light of such a lamp: its factors, which are 0 meanwhile."""
FACTORS = ("diffuse_factor", "specular_factor", "transmission_factor", "volume_factor")


def has_water(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds water, of either engine."""
    return collection_of(scene) is not None


def require_no_water(scene: bpy.types.Scene) -> None:
    """Refuse a scene that holds water, on behalf of jobs, which bring their own.

    Raises
    ------
    InputError
        If it does.
    """
    if has_water(scene):
        raise InputError(
            f"scene {scene.name!r} holds water already; remove it and save, the batch adds its own"
        )


def part(scene: bpy.types.Scene, name: str) -> bpy.types.ID | None:
    """Return a data-block of the water in a scene by the name its filling gave it."""
    collection = collection_of(scene)
    return None if collection is None else collection.get(name)


def images(scene: bpy.types.Scene) -> WaveImages:
    """Return the images of the moving surface of a scene."""
    names = CAUSTICS, SLOPES, LONG_WAVES, CROWDING, LONG_CROWDING
    return WaveImages(*(part(scene, name) for name in names))


def objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects of the water in a scene, copies of them included."""
    return [item for item in scene.objects if MARK in item]


def bodies(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Surface and volumes of the water in a scene, floor, lamps and particles left out."""
    others = (FLOOR_DEPTH, PARTICLES)
    kinds = ("MESH", "VOLUME")
    return [i for i in objects(scene) if i.type in kinds and not any(x in i for x in others)]


def followers(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Lamps of a scene's water that follow its own, in the order of :class:`Filling`."""
    return sorted((i for i in objects(scene) if FOLLOWS in i), key=lambda i: i[FOLLOWS])


def collection_of(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Return the collection of the water in a scene."""
    found = scene.collection.children_recursive
    return next((c for c in found if MARK in c and c.is_editable), None)


def is_hidden(item: bpy.types.Object) -> bool:
    """Whether an object does not show in renders now, or would not without the water."""
    kept = HIDDEN in item and not is_hidden_by_animation(item)
    return bool(item[HIDDEN][0]) if kept else item.hide_render


def is_seen(item: bpy.types.Object) -> bool:
    """Whether a camera sees a lamp itself, or would without the water."""
    return bool(item[UNSEEN][0]) if UNSEEN in item else item.visible_camera
