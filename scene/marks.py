"""What in a scene belongs to its water: found by the marks it carries, never by its name."""

from __future__ import annotations

import bpy

from ..node_groups.node_mathematics import MARK
from ..node_groups.realtime_waves import WaveImages, images_in
from ..uw_spectral.errors import InputError
from .rendered import is_hidden_by_animation

IS_SUN = "uw_sun"
"""Mark of the lamp of the direct sun."""
VALUES = "uw_values"
"""Part that holds the numbers of the real-time water; see :func:`part`."""
SURFACE, NATIVE, FLUORESCENT = "uw_surface", "uw_keeping", "uw_fluorescent"
"""Parts that light the materials in real time."""
PARTICLES = "uw_particles"
"""Mark of objects that are particles: their kind."""
CLOUD = "uw_cloud"
"""Mark of objects that are clouds: their number."""
FLOOR = "uw_floor"
"""Part that is the material of the added floor."""
FLOOR_DEPTH = "uw_floor_depth"
"""Mark of the added floor: its depth in m."""
FOLLOWS, FOLLOWERS = "uw_follows", "uw_followers"
"""Mark of a lamp that follows one of the scene's: its number; of the collection: how many do."""
HIDDEN, UNSEEN = "uw_hidden", "uw_unseen"
"""Marks of the scene's own lamps while there is water: how they were shown."""
DIMMED = "uw_dimmed"
"""Mark of the light of such a lamp: its factors, which are 0 meanwhile."""
WATER, OWN_WORLD = "uw_water", "uw_own_world"
"""Marks of a scene with water, and its own world, which the water's takes the place of."""
_SWITCHES = ("hide_render", "hide_viewport")
_RAYS = (
    "visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission",
    "visible_volume_scatter",
)  # fmt: skip
FACTORS = ("diffuse_factor", "specular_factor", "transmission_factor", "volume_factor")


def has_water(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds water, of either engine."""
    return WATER in scene or collection_of(scene) is not None


def require_no_water(scene: bpy.types.Scene) -> None:
    """Refuse a scene that holds water, on behalf of jobs, which bring their own."""
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
    found = images_in(collection_of(scene) or {})
    assert found is not None, "the surface moves"
    return found


def objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects of the water in a scene, copies of them included."""
    return [item for item in scene.objects if MARK in item]


def suns(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The sun of the water in a scene, copies of it included."""
    return [item for item in objects(scene) if item.get(IS_SUN)]


def bodies(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Surface and volumes of the water in a scene, floor, lamps and particles left out."""
    others = (FLOOR_DEPTH, PARTICLES)
    kinds = ("MESH", "VOLUME")
    return [i for i in objects(scene) if i.type in kinds and not any(x in i for x in others)]


def followers(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Lamps of a scene's water that follow its own, in the order of :class:`Filling`."""
    found: dict[int, bpy.types.Object] = {}
    for item in objects(scene):
        if FOLLOWS in item:
            found.setdefault(item[FOLLOWS], item)  # the user may have copied it
    return [found[number] for number in sorted(found)]


def collection_of(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Return the collection of the water in a scene."""
    found = scene.collection.children_recursive
    return next((c for c in found if MARK in c and c.is_editable), None)


def waters() -> dict[bpy.types.Scene, bpy.types.Collection]:
    """Return the wet scenes of the file, and the collections of their water."""
    found = {scene: collection_of(scene) for scene in bpy.data.scenes}
    return {scene: water for scene, water in found.items() if water is not None}


def hide(
    item: bpy.types.Object, *, render: bool = True, viewport: bool = False, rays: bool = False
) -> None:
    """Keep an object out of renders, of the viewport or from rays while there is water."""
    if HIDDEN in item:
        return
    item[HIDDEN] = [item.hide_render, item.hide_viewport, render, viewport]
    for name, wanted in zip(_SWITCHES, (render, viewport), strict=True):
        if wanted:
            setattr(item, name, True)
    if rays:
        item[UNSEEN] = [getattr(item, name) for name in _RAYS]
        for name in _RAYS:
            setattr(item, name, False)


def show_again(item: bpy.types.Object) -> None:
    """Undo :func:`hide`; switches that the user has set back meanwhile stay so."""
    kept = list(item.get(HIDDEN, ()))
    for name, was, hidden in zip(_SWITCHES, kept, kept[2:], strict=False):
        if hidden and getattr(item, name):
            setattr(item, name, bool(was))
    for name, was in zip(_RAYS, item.get(UNSEEN, ()), strict=False):
        if not getattr(item, name):
            setattr(item, name, bool(was))
    for mark in (HIDDEN, UNSEEN):
        item.pop(mark, None)


def dim(light: bpy.types.Light) -> None:
    """Let a lamp light nothing by itself while there is water; it can be seen and moved."""
    if DIMMED not in light:
        light[DIMMED] = [getattr(light, name) for name in FACTORS]
        for name in FACTORS:
            setattr(light, name, 0.0)


def light_again(light: bpy.types.Light) -> None:
    """Undo :func:`dim`; factors that the user has set meanwhile stay."""
    for name, was in zip(FACTORS, light.get(DIMMED, ()), strict=False):
        if not getattr(light, name):
            setattr(light, name, was)
    light.pop(DIMMED, None)


def is_hidden(item: bpy.types.Object) -> bool:
    """Whether an object does not show in renders now, or would not without the water."""
    kept = HIDDEN in item and not is_hidden_by_animation(item)
    return bool(item[HIDDEN][0]) if kept else item.hide_render


def is_seen(item: bpy.types.Object) -> bool:
    """Whether a camera sees a lamp itself, or would without the water."""
    return bool(item[UNSEEN][0]) if UNSEEN in item else item.visible_camera
