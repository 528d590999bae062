"""Lamps that hang on a camera, as divers and vehicles carry them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
from mathutils import Matrix

from ...uw_spectral.errors import InputError, unknown_name
from ...uw_spectral.lamps.emission import LUMENS
from ..stored_lamps import PROPERTY, ROV


@dataclass(frozen=True)
class Rig:
    """Lamps of one kind around a camera."""

    label: str
    places: tuple[tuple[float, float, float], ...]  #: In its axes, m: right, up, back.
    aim: float  #: Distance before the camera at which the beams meet, m.
    lumens: float  #: Of each lamp.
    profile: str = ""  #: As lamps store it; empty for a spot.
    cone: float = 180.0  #: Full angle of a spot, degrees.


RIGS = {
    "torch": Rig("Torch", ((0.25, -0.15, 0.1),), 4.0, 4000.0, cone=24.0),
    "strobes": Rig("Two Strobes", ((-0.4, 0.25, 0.1), (0.4, 0.25, 0.1)), 3.0, 20000.0, cone=110.0),
    "rov2": Rig("Two ROV Lights", ((-0.6, 0.4, 0.0), (0.6, 0.4, 0.0)), 5.0, 12000.0, ROV),
    "rov4": Rig(
        "Four ROV Lights",
        ((-0.8, 0.4, 0.0), (0.8, 0.4, 0.0), (-0.8, -0.4, 0.0), (0.8, -0.4, 0.0)),
        5.0,
        12000.0,
        ROV,
    ),
}
"""Usual arrangements: lamps some way beside the lens keep the lit water before it thin."""
_RADIUS = 0.03  # m
_BLEND = 0.35


def add_rig(
    scene: bpy.types.Scene, name: str, camera: bpy.types.Object | None = None
) -> list[bpy.types.Object]:
    """Hang the lamps of one of :data:`RIGS` on a camera, the scene's by default; they move with it.

    InputError if there is no such rig, or no camera.
    """
    if name not in RIGS:
        raise unknown_name("lamps", name, RIGS)
    camera = camera or scene.camera
    if camera is None:
        raise InputError("the scene has no camera for the lamps to hang on; add one")
    rig, made = RIGS[name], []
    for place in rig.places:
        item = add_lamp(scene, rig.label, rig.lumens, rig.profile)
        if not rig.profile:
            item.data.type = "SPOT"
            item.data.spot_size, item.data.spot_blend = math.radians(rig.cone), _BLEND
        item.parent = camera
        x, y, _ = place
        aim = Matrix.Rotation(-math.atan2(-x, rig.aim), 4, "Y")
        tilt = Matrix.Rotation(math.atan2(-y, math.hypot(x, rig.aim)), 4, "X")
        item.matrix_local = Matrix.Translation(place) @ aim @ tilt
        made.append(item)
    return made


def add_lamp(scene: bpy.types.Scene, name: str, lumens: float, profile: str) -> bpy.types.Object:
    """Add an LED lamp at the origin that shines down, or without a profile to all sides."""
    light = bpy.data.lights.new(name, "POINT")
    light.energy, light.shadow_soft_size = lumens, _RADIUS
    chosen = getattr(light, PROPERTY)
    chosen.spectrum, chosen.unit, chosen.profile = "led", LUMENS, profile
    item = bpy.data.objects.new(name, light)
    item.visible_camera = True
    scene.collection.objects.link(item)
    return item
