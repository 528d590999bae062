"""Objects of the user's, set on the seabed or swimming in a school."""

from __future__ import annotations

import math
from collections.abc import Mapping

import bpy
from mathutils import Vector

from ..node_groups import distributed as nodes
from ..uw_spectral.errors import InputError

_AHEAD = 6.0  # m before the camera
_MOST = 200_000
_STEP = 1e-3  # m, past what is not the seabed


def _standing(
    density: float, sizes: tuple[float, float], others: Mapping[str, float]
) -> dict[str, float]:
    return {
        nodes.RADIUS: 12.0, nodes.SEED: 0, nodes.DENSITY: density, nodes.PATCH: 3.0,
        nodes.STEEPEST: math.radians(60.0), nodes.CLUMPS: 0.7, nodes.UPRIGHT: 0.5,
        nodes.SMALLEST: sizes[0], nodes.LARGEST: sizes[1], **others,
    }  # fmt: skip


PRESETS: Mapping[str, Mapping[str, float]] = {
    "corals": _standing(4.0, (0.5, 1.4), {nodes.STEEPEST: 1.3}),
    "rocks": _standing(0.6, (0.3, 1.5), {nodes.UPRIGHT: 0.0, nodes.CLUMPS: 0.3}),
    "meadow": _standing(
        30.0, (0.6, 1.2), {nodes.UPRIGHT: 0.9, nodes.STEEPEST: 0.5, nodes.CLUMPS: 0.5}
    ),
    "school": {
        nodes.RADIUS: 6.0, nodes.SEED: 0, nodes.NUMBER: 60, nodes.SPEED: 0.6, nodes.LENGTH: 2.0,
        nodes.BREADTH: 0.8, nodes.HEIGHT: 0.5, nodes.WANDER: 0.1, nodes.TURN: 0.0,
        nodes.SMALLEST: 0.8, nodes.LARGEST: 1.2,
    },
}  # fmt: skip
"""Inputs of the modifier, by name; those of a school have a number."""


def distribute(
    scene: bpy.types.Scene,
    objects: bpy.types.Collection | None,
    preset: str,
    seabed: bpy.types.Object | None = None,
    **changes: float,
) -> bpy.types.Object:
    """Set a collection's objects about what the camera looks at; return what carries them.

    ``changes`` are inputs of the modifier by name. Without ``seabed`` it is what lies below the
    place.

    Raises
    ------
    InputError
        If the collection is empty, there is no seabed, or there would be more than 200 000 objects.
    """
    values: dict[str, nodes.Value] = {**PRESETS[preset], **changes}
    swims = nodes.NUMBER in values
    if objects is None or not objects.all_objects:
        raise InputError("there is nothing to scatter; choose a collection with objects in it")
    values[nodes.OBJECTS] = objects
    place = _place(scene)
    if not swims:
        count = math.pi * float(values[nodes.RADIUS]) ** 2 * float(values[nodes.DENSITY])  # pyright: ignore[reportArgumentType]
        if not count <= _MOST:
            raise InputError(
                f"{count:.3g} objects would be scattered, and {_MOST} are the most; choose a lower "
                "density or a smaller radius"
            )
        seabed = seabed or _below(scene, place)
        if seabed is None or seabed in objects.all_objects[:]:
            raise InputError(
                f"there is no seabed below ({place.x:.1f}, {place.y:.1f}); select the mesh to "
                "stand on, or add a floor"
            )
        values[nodes.SEABED] = seabed
        place.z = 0.0
    build = nodes.build_school if swims else nodes.build_on_seabed
    tree = build(f"Scattered {preset.title()}", values)
    item = bpy.data.objects.new(tree.name, bpy.data.meshes.new(tree.name))
    item.location = place
    item.modifiers.new(tree.name, "NODES").node_group = tree
    scene.collection.objects.link(item)
    return item


def _place(scene: bpy.types.Scene) -> Vector:
    camera = scene.camera
    if camera is None:
        return scene.cursor.location.copy()
    ahead = camera.matrix_world.to_quaternion() @ Vector((0.0, 0.0, -_AHEAD))
    return camera.matrix_world.translation + ahead


def _below(scene: bpy.types.Scene, place: Vector) -> bpy.types.Object | None:
    """What a thing that sinks there comes to lie on; no instance, such as what stands there."""
    graph, at = bpy.context.evaluated_depsgraph_get(), place
    while True:
        found, at, _, _, item, matrix = scene.ray_cast(graph, at, (0.0, 0.0, -1.0))
        if not found:
            return None
        if matrix == item.matrix_world:
            return item.original
        at = at - Vector((0.0, 0.0, _STEP))
