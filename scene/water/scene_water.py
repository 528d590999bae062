"""The water of a scene: what it brings along, what it hides, and the way back.

The water of either engine is a collection of the scene. It points at the world
that it replaced and at the data-blocks that the engine asks for again; all that
was made carries a mark. Nothing is found by its name, so several scenes of a
file can hold water. When a scene gives its water up, what no other wet scene
holds goes; so copies of a scene or of its objects leave no trace either.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import bpy
from mathutils import Vector

from ...node_groups.node_mathematics import MARK
from ...node_groups.realtime_waves import WaveImages
from ...uw_spectral.errors import InputError
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import contents, marks
from ..materials import (
    band_colors,
    bare_colours,
    bare_surfaces,
    clear_shadows,
    hidden_above,
    inlined_shaders,
    realtime_materials,
)
from ..rendered import is_hidden_by_animation
from . import apparent_places, pass_values, seabed, water_body
from .water_body import WaterExtent

SUN_DIAMETER_IN_AIR = math.radians(0.53)
"""Seen from the water the disc shrinks with refraction by about the index."""
_RAYS = (
    "visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission",
    "visible_volume_scatter",
)  # fmt: skip
_WORLD = "uw_own_world"


@dataclass(frozen=True, eq=False)
class Filling:
    """What an engine brings into a scene.

    Parameters
    ----------
    world : World
        Takes the place of the scene's own.
    lamps : list of Light
        The sun first.
    floor : Material
        Of the added floor, if the water has one.
    objects : list of Object
        The others.
    images : WaveImages, optional
        Of a moving surface.
    parts : mapping of str to ID
        Data-blocks that :func:`part` returns.
    followers : sequence of tuples
        Lamps that are where objects of the scene are.
    followers_seen : bool
        Whether cameras see them where they see these objects; else never.
    floor_shades : bool
        Whether the floor throws shadows; nothing is seen under it, and maps of it cost time.
    """

    world: bpy.types.World
    lamps: list[bpy.types.Light]
    floor: bpy.types.Material | None
    objects: list[bpy.types.Object]
    images: WaveImages | None = None
    parts: Mapping[str, bpy.types.ID] = field(default_factory=dict)
    followers: Sequence[tuple[bpy.types.Light, bpy.types.Object]] = ()
    followers_seen: bool = True
    floor_shades: bool = True


def prepare(scene: bpy.types.Scene) -> None:
    """Ready a scene for :func:`add`; clear up what copies have left in the file.

    Raises
    ------
    InputError
        If the scene has water already, or is linked from another file.
    """
    if marks.has_water(scene):
        raise InputError(f"scene {scene.name!r} has water already; remove it first")
    if not scene.is_editable:
        raise InputError(
            f"scene {scene.name!r} is linked from another file; add the water to it there"
        )
    _let_go()


def own_materials(
    scene: bpy.types.Scene, *, routed: bool
) -> tuple[list[bpy.types.Material], list[str]]:
    """Return the materials that a scene's water may change, and a note of the others.

    Those of another wet scene stay with its water. Only where both scenes have their
    colours ``routed`` through the bands of a pass, each sees its own.
    """
    found, others = contents.materials(scene), {}
    for other, water in _waters().items():
        if other != scene and (marks.SURFACE in water or not routed):
            shared = [m for m in contents.materials(other) if m in found]
            others |= dict.fromkeys(shared, other.name)
    notes = []
    for name in dict.fromkeys(others.values()):
        shared = ", ".join(repr(m.name) for m, of in others.items() if of == name)
        notes.append(
            f"materials {shared} are also in scene {name!r} and show its water, not that of scene "
            f"{scene.name!r}; give one of the scenes copies of them"
        )
    return [m for m in found if m not in others], notes


def add(
    scene: bpy.types.Scene, filling: Filling, column: WaterColumn, extent: WaterExtent
) -> list[str]:
    """Put water into a scene in place of its own world and lamps.

    Parameters
    ----------
    scene : Scene
        Ready by :func:`prepare`.
    filling : Filling
        The water of an engine.
    column : WaterColumn
        Its sun and its floor.
    extent : WaterExtent
        Its size.

    Returns
    -------
    list of str
        What could not be treated, one line each.
    """
    notes = _hide_lamps(scene)
    collection = bpy.data.collections.new("Underwater")
    items, parts = list(filling.objects), dict(filling.parts)
    for lamp in filling.lamps:
        items.append(bpy.data.objects.new(lamp.name, lamp))
        items[-1][marks.IS_SUN] = lamp == filling.lamps[0]
    for number, (lamp, leader) in enumerate(filling.followers):
        items.append(_follower(lamp, leader, seen=filling.followers_seen))
        items[-1][marks.FOLLOWS] = number
    if filling.images is not None:
        parts[marks.CAUSTICS], parts[marks.SLOPES] = filling.images.caustics, filling.images.slopes
        for name, image in (
            (marks.LONG_WAVES, filling.images.far),
            (marks.CROWDING, filling.images.crowding),
            (marks.LONG_CROWDING, filling.images.far_crowding),
        ):
            if image is not None:
                parts[name] = image
    if filling.floor is not None:
        parts[marks.FLOOR] = filling.floor
        items.append(water_body.floor_plane(extent, filling.floor))
        items[-1][marks.FLOOR_DEPTH] = math.inf
        items[-1].visible_shadow = filling.floor_shades
        items[-1].hide_render = items[-1].hide_viewport = True
    for item in items:
        collection.objects.link(item)
        _mark(item, item.data, *(slot.material for slot in item.material_slots))
    _mark(collection, filling.world, *parts.values())
    if scene.world is not None:
        parts[_WORLD] = scene.world
    for name, block in parts.items():
        collection[name] = block
    scene.collection.children.link(collection)
    scene.world = filling.world
    place(scene, column)
    return notes


def remove(scene: bpy.types.Scene) -> None:
    """Take the water out; the scene is as it was before :func:`add`."""
    collection = marks.collection_of(scene)
    if collection is None:
        return
    if scene.world is not None and MARK in scene.world:
        scene.world = collection.get(_WORLD)
    while collection is not None:  # the user may have copied it
        _detach(scene, collection)
        collection = marks.collection_of(scene)
    for layer in scene.view_layers:
        pass_values.clear(layer)
    _let_go()


def link(scene: bpy.types.Scene, item: bpy.types.Object) -> None:
    """Add an object to the water in a scene; it leaves with it."""
    _mark(item, item.data, *(slot.material for slot in item.material_slots))
    collection = marks.collection_of(scene)
    assert collection is not None, "there is no water to add to"
    collection.objects.link(item)


def place(scene: bpy.types.Scene, column: WaterColumn, own_seabed: float | None = None) -> None:
    """Turn the sun and move the floor of a scene's water to where they are.

    Parameters
    ----------
    scene : Scene
    column : WaterColumn
        Its sun, and the depth of an added floor.
    own_seabed : float, optional
        Depth in m of a floor that continues the scene's own seabed; it is hidden if infinite.
    """
    for item in marks.objects(scene):
        if item.get(marks.IS_SUN):
            turn(item, column.sun_direction)
        elif marks.FLOOR_DEPTH in item:
            _place_floor(scene, item, column.floor_depth, own_seabed)


def _place_floor(
    scene: bpy.types.Scene, item: bpy.types.Object, added: float, own_seabed: float | None
) -> None:
    depth = added if own_seabed is None else own_seabed
    if item[marks.FLOOR_DEPTH] == depth:
        return
    item[marks.FLOOR_DEPTH] = depth
    item.hide_render = item.hide_viewport = not math.isfinite(depth)
    if math.isfinite(depth):
        item.location.z = -(depth if own_seabed is not None else seabed.clear_depth(scene, depth))


def centre_floor(scene: bpy.types.Scene, camera: Sequence[float]) -> None:
    """Bring the middle of the added floor, where its faces are fine, below the camera."""
    for item in marks.objects(scene):
        if marks.FLOOR_DEPTH in item:
            item.location.x, item.location.y = camera[:2]


def turn(lamp: bpy.types.Object, direction: Iterable[float]) -> None:
    """Let a lamp's light travel along a direction."""
    lamp.rotation_mode = "QUATERNION"
    lamp.rotation_quaternion = Vector([float(x) for x in direction]).to_track_quat("-Z", "Y")


def _follower(lamp: bpy.types.Light, leader: bpy.types.Object, *, seen: bool) -> bpy.types.Object:
    item = bpy.data.objects.new(lamp.name, lamp)
    item.visible_camera = seen and marks.is_seen(leader)
    item.constraints.new("COPY_TRANSFORMS").target = leader
    if lamp.type != "AREA":
        # Scale is in the profile; here it would stretch the directions that nodes read.
        even = item.constraints.new("LIMIT_SCALE")
        for name in ("min_x", "max_x", "min_y", "max_y", "min_z", "max_z"):
            setattr(even, f"use_{name}", True)
            setattr(even, name, 1.0)
    return item


def _detach(scene: bpy.types.Scene, collection: bpy.types.Collection) -> None:
    shared = any(
        marks.collection_of(other) == collection for other in bpy.data.scenes if other != scene
    )
    if shared and collection in scene.collection.children.values():
        scene.collection.children.unlink(collection)  # a linked copy of the scene keeps it
        return
    # What the user has put there by hand stays.
    for child in collection.children:
        scene.collection.children.link(child)
    for item in collection.objects:
        if MARK not in item and len(item.users_collection) == 1:
            scene.collection.objects.link(item)
    bpy.data.collections.remove(collection)


def _waters() -> dict[bpy.types.Scene, bpy.types.Collection]:
    """Wet scenes of the file, and the collections of their water."""
    found = {scene: marks.collection_of(scene) for scene in bpy.data.scenes}
    return {scene: water for scene, water in found.items() if water is not None}


def _mark(*blocks: bpy.types.ID | None) -> None:
    for block in blocks:
        if block is not None:
            block[MARK] = True


def _hide_lamps(scene: bpy.types.Scene) -> list[str]:
    notes = []
    for item in contents.objects(scene):
        if item.type != "LIGHT" or marks.HIDDEN in item:
            continue
        if not item.is_editable:
            notes.append(f"lamp {item.name!r} is linked and cannot be hidden; make it local")
            continue
        item[marks.HIDDEN] = [item.hide_render, item.hide_viewport]
        if is_hidden_by_animation(item):
            # The next frame would show it again: no ray of Cycles meets it instead.
            item[marks.UNSEEN] = [getattr(item, name) for name in _RAYS]
            for name in _RAYS:
                setattr(item, name, False)
        else:
            item.hide_render = True
        if item.data.type == "SUN" or not item.data.is_editable:
            item.hide_viewport = True
        if item.data.is_editable and marks.DIMMED not in item.data:
            # It lights nothing by itself, but can be seen and moved.
            item.data[marks.DIMMED] = [getattr(item.data, name) for name in marks.FACTORS]
            for name in marks.FACTORS:
                setattr(item.data, name, 0.0)
    return list(dict.fromkeys(notes))


def _let_go() -> None:
    """Give back, dry and delete what no wet scene of the file holds."""
    waters = _waters()
    lamps = {item for scene in waters for item in contents.objects(scene)}
    held = set(waters.values())
    for stray in [c for c in bpy.data.collections if MARK in c and c.is_editable]:
        if stray not in held:
            bpy.data.collections.remove(stray)
    for item in [o for o in bpy.data.objects if o.is_editable]:
        if MARK in item and not held.intersection(item.users_collection):
            bpy.data.objects.remove(item)
        elif marks.HIDDEN in item and item not in lamps:
            item.hide_render, item.hide_viewport = (bool(x) for x in item[marks.HIDDEN])
            del item[marks.HIDDEN]
            for name, value in zip(_RAYS, item.get(marks.UNSEEN, ()), strict=False):
                setattr(item, name, bool(value))
            item.pop(marks.UNSEEN, None)
    dark = {item.data for item in lamps if marks.HIDDEN in item}
    for light in [
        light for light in bpy.data.lights if marks.DIMMED in light and light not in dark
    ]:
        for name, value in zip(marks.FACTORS, light[marks.DIMMED], strict=True):
            setattr(light, name, value)
        del light[marks.DIMMED]
    lit, routed = {}, set()
    for scene, water in waters.items():
        materials = set(contents.materials(scene))
        if marks.SURFACE in water:
            for name in (marks.SURFACE, marks.KEEPING, marks.FLUORESCENT):
                if name in water:
                    lit[water[name]] = lit.get(water[name], set()) | materials
        else:
            routed |= materials
    bare_surfaces.undress({x for scene in waters for x in contents.objects(scene)})
    # Colours go home before the nodes that they are led through are taken away.
    wet = routed | realtime_materials.behind(lit)
    band_colors.remove(wet)
    clear_shadows.remove(wet)
    realtime_materials.remove(lit)
    bare_colours.remove(wet)
    inlined_shaders.remove(wet)
    stay = set().union(*lit.values()) if lit else ()
    apparent_places.give_back(stay)
    hidden_above.give_back(stay)
    apparent_places.unite(waters)
    data = bpy.data
    kinds = (
        data.meshes, data.volumes, data.lights, data.materials, data.worlds, data.node_groups,
        data.images,
    )  # fmt: skip
    while unused := [b for k in kinds for b in k if MARK in b and b.is_editable and not b.users]:
        data.batch_remove(unused)
