"""Lowers a scene into the water: everything by the same distance, whatever holds it.

Only delta locations change, which keyframes leave alone. Parents, constraints and paths carry
objects along, so what is lowered is looked up where Blender evaluates it, not guessed.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator

import bpy
from mathutils import Vector

from ...node_groups.node_mathematics import MARK
from ...settings.water_settings import NO_FLOOR
from ...uw_spectral.errors import first_of
from .. import stored_settings
from ..animation import curves_of

_ROUNDS = 32  # chains of objects that hold each other are no longer
_NEAR = 1e-4  # of the distance, and at least m, that counts as reached
_SHALLOWEST = 0.01  # m, of a floor
_NAMED = 5


def lower(scene: bpy.types.Scene, distance: float) -> list[str]:
    """Lower the scene's objects, those of the water aside, and an added floor, by a distance in m.

    A negative one lifts. Returns what could not be lowered, or not here alone, one line each.
    """
    items = [item for item in scene.objects if MARK not in item]
    notes = _lower_floor(scene, distance)
    with _all_evaluated(scene, items) as layer:
        before = {i: place for i in items if (place := _place(layer, i)) is not None}
        own = {item: item.delta_location.copy() for item in items}
        for item in items:
            if item.is_editable and item.parent not in items:
                _shift(item, Vector((0.0, 0.0, -distance)))
        _lower_origins(items, distance)
        left = _even_out(layer, before, own, distance)
    notes += [_held(item, moved, distance) for item, moved in left.items()]
    if scene.camera is not None and scene.camera not in items:
        notes.append(f"camera {scene.camera.name!r} is not among the scene's objects and stays")
    return notes + _elsewhere(scene, items) + _simulated(items)


@contextlib.contextmanager
def _all_evaluated(
    scene: bpy.types.Scene, items: Iterable[bpy.types.Object]
) -> Iterator[bpy.types.ViewLayer]:
    """Let a view layer evaluate all of a scene, what is hidden or left out too."""
    layer = scene.view_layers.new("UW Submerge")
    hidden = [x for x in (*items, *scene.collection.children_recursive) if x.hide_viewport]
    hidden = [x for x in hidden if x.is_editable]
    try:
        for one in hidden:
            one.hide_viewport = False
        layer.update()
        yield layer
    finally:
        for one in hidden:
            one.hide_viewport = True
        scene.view_layers.remove(layer)


def _place(layer: bpy.types.ViewLayer, item: bpy.types.Object) -> Vector | None:
    """Return where an object is, None where that is not evaluated, or simulated."""
    body, seen = item.rigid_body, item.evaluated_get(layer.depsgraph)
    if seen == item or (body is not None and body.type == "ACTIVE" and not body.kinematic):
        return None
    return seen.matrix_world.translation.copy()


def _even_out(
    layer: bpy.types.ViewLayer,
    before: dict[bpy.types.Object, Vector],
    own: dict[bpy.types.Object, Vector],
    distance: float,
) -> dict[bpy.types.Object, float]:
    """Correct what others have carried along, or held; return how far those went that stay off."""
    wanted, near = Vector((0.0, 0.0, -distance)), _NEAR * max(abs(distance), 1.0)
    tried: dict[bpy.types.Object, float] = {}
    stuck = {item for item in before if not item.is_editable}
    off: dict[bpy.types.Object, Vector] = {}
    for _ in range(_ROUNDS):
        layer.update()
        moved = {item: _place(layer, item) - place for item, place in before.items()}
        off = {i: wanted - m for i, m in moved.items() if (wanted - m).length > near}
        open_ = {item for item in off if item not in stuck}
        if not open_:
            break
        # What holds others comes first.
        for item in [i for i in open_ if not _holders(i) & open_] or list(open_):
            if tried.get(item, float("inf")) <= off[item].length + near:
                stuck.add(item)
                _shift(item, own[item] - item.delta_location)
                continue
            tried[item] = off[item].length
            seen = item.evaluated_get(layer.depsgraph)
            frame = (seen.matrix_world @ seen.matrix_basis.inverted_safe()).to_3x3()
            _shift(item, frame.inverted_safe() @ off[item])
    return {item: (wanted - missing).z for item, missing in off.items()}


def _holders(item: bpy.types.Object) -> set[bpy.types.Object]:
    """What an object is placed by: its parent, and the targets of its constraints."""
    found = {item.parent}
    for constraint in item.constraints:
        found.add(getattr(constraint, "target", None))
        found |= {one.target for one in getattr(constraint, "targets", ())}
    return found - {None}


def _shift(item: bpy.types.Object, by: Vector) -> None:
    """Change the delta location of an object, and its keyframes, if it has any."""
    item.delta_location += by
    for curve in _own_curves(item, "delta_location"):
        _raise(curve, by[curve.array_index])


def _raise(curve: bpy.types.FCurve, by: float) -> None:
    for key in curve.keyframe_points:
        for point in (key.co, key.handle_left, key.handle_right):
            point.y += by
    curve.update()


def _own_curves(block: bpy.types.ID, path: str) -> Iterator[bpy.types.FCurve]:
    """Yield the animation curves of a property in the slot that a data-block plays."""
    data = block.animation_data
    if data is None or data.action is None or not data.action.is_editable:
        return
    own = set()
    for layer in data.action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(data.action_slot) if data.action_slot else None
            own |= {curve.as_pointer() for curve in bag.fcurves} if bag else set()
    for curve in curves_of(data.action):
        if curve.as_pointer() in own and curve.data_path == path:
            yield curve


def _lower_floor(scene: bpy.types.Scene, distance: float) -> list[str]:
    """Let an added floor keep its distance to what stands on it."""
    group = getattr(scene, stored_settings.PROPERTY)
    if group.floor_depth == NO_FLOOR:
        return []
    group.floor_depth = max(group.floor_depth + distance, _SHALLOWEST)
    path, data = f"{stored_settings.PROPERTY}.floor_depth", scene.animation_data
    for curve in _own_curves(scene, path):
        _raise(curve, distance)
    if data is not None and any(curve.data_path == path for curve in data.drivers):
        return ["the floor's depth has a driver, and stays: lower it there"]
    return []


def _lower_origins(items: list[bpy.types.Object], distance: float) -> None:
    """Lower the origins of instanced collections with what is in them, or it would go twice."""
    instanced = dict.fromkeys(item.instance_collection for item in items)
    for collection in [c for c in instanced if c is not None and c.is_editable]:
        if any(item in items for item in collection.all_objects):
            collection.instance_offset.z -= distance


def _held(item: bpy.types.Object, moved: float, distance: float) -> str:
    by = [repr(constraint.name) for constraint in item.constraints if not constraint.mute]
    if not item.is_editable:
        reason = "it is linked from another file"
    elif by:
        reason = f"constraint {', '.join(by)} holds it"
    else:
        reason = "an animation or a driver holds it"
    went = f"{item.name!r} went {0.0 - moved:.3g} m down, not {distance:.3g}"
    return f"{went}: {reason}; place it by hand"


def _elsewhere(scene: bpy.types.Scene, items: list[bpy.types.Object]) -> list[str]:
    others = [other for other in bpy.data.scenes if other != scene]
    shared = {o.name: [i.name for i in items if o.objects.get(i.name) == i] for o in others}
    return [
        f"{first_of(map(repr, names), _NAMED)}: also in scene {name!r}, and lower there too"
        for name, names in shared.items()
        if names
    ]


def _simulated(items: list[bpy.types.Object]) -> list[str]:
    baked = []
    for item in items:
        caches = [getattr(modifier, "point_cache", None) for modifier in item.modifiers]
        caches += [system.point_cache for system in item.particle_systems]
        if item.rigid_body is not None or any(c is not None and c.is_baked for c in caches):
            baked.append(item.name)
    if not baked:
        return []
    return [
        f"simulations of {first_of(map(repr, baked), _NAMED)} stay where they were until they are "
        "run or baked anew"
    ]
