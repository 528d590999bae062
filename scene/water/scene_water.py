"""The water of a scene: what it brings along, what it hides, and the way back.

The water of either engine is a collection of the scene. It points at the world that it replaced and
at the data-blocks that the engine asks for again; all that was made carries a mark. Nothing is
found by its name, so several scenes of a file can hold water. When a scene gives its water up, what
no other wet scene holds goes; so copies of a scene or of its objects leave no trace either.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import bpy
from mathutils import Matrix, Vector

from ...node_groups.node_mathematics import MARK
from ...uw_spectral.errors import InputError
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import contents, marks
from ..readers.shown_lamps import ShownLamp
from ..rendered import is_hidden_by_animation
from . import giving_back, pass_values, seabed, water_body
from .water_body import WaterExtent

SUN_DIAMETER_IN_AIR = math.radians(0.53)
"""Seen from the water the disc shrinks with refraction by about the index."""


@dataclass(frozen=True, eq=False)
class Filling:
    """What an engine brings into a scene; the sun is the first of the lamps."""

    world: bpy.types.World
    lamps: list[bpy.types.Light]
    floor: bpy.types.Material | None
    objects: list[bpy.types.Object]
    #: Data-blocks that :func:`.marks.part` returns.
    parts: Mapping[str, bpy.types.ID] = field(default_factory=dict)
    #: Lamps that are where lamps of the scene are.
    followers: Sequence[tuple[bpy.types.Light, ShownLamp]] = ()
    #: Rays meet lamps: cameras see followers where they see what these follow, and nothing sees the
    #: scene's own, not even as instances.
    traced: bool = True
    #: The floor throws shadows; nothing is seen under it, and maps of it cost time.
    floor_occlusions: bool = True


def prepare(scene: bpy.types.Scene) -> None:
    """Ready a scene for :func:`add`; clear up what copies have left in the file.

    InputError if the scene has water already, or is linked from another file.
    """
    if marks.has_water(scene):
        raise InputError(f"scene {scene.name!r} has water already; remove it first")
    if not scene.is_editable:
        raise InputError(
            f"scene {scene.name!r} is linked from another file; add the water to it there"
        )
    giving_back.let_go()


def own_materials(
    scene: bpy.types.Scene, *, routed: bool
) -> tuple[list[bpy.types.Material], list[str]]:
    """Return the materials that a scene's water may change, and a note of the others.

    Those of another wet scene stay with its water. Only where both scenes have their
    colours ``routed`` through the bands of a pass, each sees its own.
    """
    found, others = contents.materials(scene), {}
    for other, water in marks.waters().items():
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
    """Put water of an engine into a scene that is ready, in place of its own world and lamps.

    The column tells of sun and floor. Returns what could not be treated, one line each.
    """
    notes = _hide_lamps(scene, from_rays=filling.traced)
    collection = bpy.data.collections.new("Underwater")
    items, parts = list(filling.objects), dict(filling.parts)
    for lamp in filling.lamps:
        items.append(bpy.data.objects.new(lamp.name, lamp))
        items[-1][marks.IS_SUN] = lamp == filling.lamps[0]
    for number, (lamp, leader) in enumerate(filling.followers):
        items.append(_follower(lamp, leader, seen=filling.traced))
        items[-1][marks.FOLLOWS] = number
    if filling.floor is not None:
        parts[marks.FLOOR] = filling.floor
        items.append(water_body.floor_plane(extent, filling.floor))
        items[-1][marks.FLOOR_DEPTH] = math.inf
        items[-1].visible_shadow = filling.floor_occlusions
        items[-1].hide_render = items[-1].hide_viewport = True
    for item in items:
        collection.objects.link(item)
        _mark(item, item.data, *(slot.material for slot in item.material_slots))
    _mark(collection, filling.world, *parts.values())
    collection[marks.FOLLOWERS] = len(filling.followers)
    scene[marks.WATER] = True
    if scene.world is not None:
        scene[marks.OWN_WORLD] = scene.world
    for name, block in parts.items():
        collection[name] = block
    scene.collection.children.link(collection)
    scene.world = filling.world
    place(scene, column)
    return notes


def remove(scene: bpy.types.Scene) -> list[str]:
    """Take the water out; the scene is as it was before :func:`add`.

    What the user has deleted meanwhile stays away; what has got other values keeps them. Returns
    what could not be given back, one line each.
    """
    if not marks.has_water(scene):
        return []
    notes = _give_world_back(scene)
    while (collection := marks.collection_of(scene)) is not None:  # the user may have copied it
        _detach(scene, collection)
    for layer in scene.view_layers:
        pass_values.clear(layer)
    return notes + giving_back.let_go()


def _give_world_back(scene: bpy.types.Scene) -> list[str]:
    own, had_one = scene.get(marks.OWN_WORLD), marks.OWN_WORLD in scene
    for name in (marks.WATER, marks.OWN_WORLD):
        scene.pop(name, None)
    if scene.world is not None and MARK not in scene.world:
        if own in (None, scene.world):
            return []
        return [
            f"scene {scene.name!r} keeps world {scene.world.name!r}, which it got meanwhile; its "
            f"own was {own.name!r}"
        ]
    scene.world = own
    if had_one and own is None:
        return [f"the own world of scene {scene.name!r} was deleted; it has none now"]
    return []


def lost_parts(scene: bpy.types.Scene) -> list[str]:
    """Name what a picture of the water needs, and the user has deleted or replaced."""
    lost = []
    if scene.world is None or MARK not in scene.world:
        lost.append("its world")
    if not marks.suns(scene):
        lost.append("its sun")
    return lost


def link(scene: bpy.types.Scene, item: bpy.types.Object) -> None:
    """Add an object to the water in a scene; it leaves with it."""
    _mark(item, item.data, *(slot.material for slot in item.material_slots))
    collection = marks.collection_of(scene)
    assert collection is not None, "there is no water to add to"
    collection.objects.link(item)


def place(scene: bpy.types.Scene, column: WaterColumn, own_seabed: float | None = None) -> None:
    """Turn the sun and move the floor of a scene's water to where they are.

    A floor at the depth ``own_seabed``, m, continues the scene's own; it is hidden if infinite.
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


def turn(lamp: bpy.types.Object, direction: Iterable[float]) -> None:
    """Let a lamp's light travel along a direction."""
    lamp.rotation_mode = "QUATERNION"
    lamp.rotation_quaternion = Vector([float(x) for x in direction]).to_track_quat("-Z", "Y")


def follow(follower: bpy.types.Object, leader: ShownLamp) -> None:
    """Bring a lamp to an instance that it follows; objects it follows by itself."""
    if leader.instancer is None:
        return
    # An object has no shear, and a mirrored matrix no rotation of its own.
    across, _, back = (column.normalized() for column in leader.place.to_3x3().col)
    along = back.cross(across).normalized()
    rotation = Matrix((along.cross(back), along, back)).transposed().to_quaternion()
    size = [abs(x) for x in leader.place.to_scale()] if follower.data.type == "AREA" else None
    place = Matrix.LocRotScale(leader.place.translation, rotation, size)
    if follower.matrix_basis != place:
        follower.matrix_basis = place


def _follower(lamp: bpy.types.Light, leader: ShownLamp, *, seen: bool) -> bpy.types.Object:
    item = bpy.data.objects.new(lamp.name, lamp)
    item.visible_camera = seen and marks.is_seen(leader.item)
    if leader.instancer is not None:
        follow(item, leader)
        return item
    item.constraints.new("COPY_TRANSFORMS").target = leader.item
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
        if child not in scene.collection.children.values():
            scene.collection.children.link(child)
    for item in collection.objects:
        if MARK not in item and len(item.users_collection) == 1:
            scene.collection.objects.link(item)
    bpy.data.collections.remove(collection)


def _mark(*blocks: bpy.types.ID | None) -> None:
    for block in blocks:
        if block is not None:
            block[MARK] = True


def _hide_lamps(scene: bpy.types.Scene, *, from_rays: bool = False) -> list[str]:
    notes = []
    for item in contents.objects(scene):
        if item.type != "LIGHT" or marks.HIDDEN in item:
            continue
        if not item.is_editable:
            notes.append(f"lamp {item.name!r} is linked and cannot be hidden; make it local")
            continue
        # The next frame would show it again, and instances show: no ray of Cycles meets it.
        animated = is_hidden_by_animation(item)
        marks.hide(
            item,
            render=not animated,
            viewport=item.data.type == "SUN" or not item.data.is_editable,
            rays=animated or from_rays,
        )
        if item.data.is_editable:
            marks.dim(item.data)
    return list(dict.fromkeys(notes))
