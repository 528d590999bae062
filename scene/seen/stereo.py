"""Blender's stereo cameras, as a left and a right camera that a job renders one by one."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

import bpy

SIDES = ("left", "right")
# Offsets of the two eyes from their camera, in interocular distances, by pivot.
_OFFSETS = {"CENTER": (-0.5, 0.5), "LEFT": (0.0, 1.0), "RIGHT": (-1.0, 0.0)}


@contextlib.contextmanager
def two_eyes(scene: bpy.types.Scene) -> Iterator[None]:
    """Give every camera of a stereo scene its two eyes while the block runs.

    They follow their camera, and render with Blender's own multi-view off, which would put
    several pictures into a pass. A scene without stereo stays as it is.
    """
    if not scene.render.use_multiview:
        yield
        return
    made = []
    stereo = scene.render.views_format == "STEREO_3D"
    scene.render.use_multiview = False
    try:
        if stereo:
            cameras = [item for item in scene.objects if item.type == "CAMERA"]
            made = [_eye(scene, camera, place) for camera in cameras for place in (0, 1)]
            bpy.context.view_layer.update()
        yield
    finally:
        for eye in made:
            data = eye.data
            bpy.data.objects.remove(eye)
            bpy.data.cameras.remove(data)
        scene.render.use_multiview = True


def eyes_of(scene: bpy.types.Scene, camera: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the eyes that :func:`two_eyes` made of a camera, left first; else the camera."""
    found = [scene.objects.get(_name(camera, side)) for side in SIDES]
    eyes = [eye for eye in found if eye is not None and eye.parent == camera]
    return eyes if len(eyes) == len(SIDES) else [camera]


def _name(camera: bpy.types.Object, side: str) -> str:
    return f"{camera.name} {side}"


def _eye(scene: bpy.types.Scene, camera: bpy.types.Object, place: int) -> bpy.types.Object:
    data = camera.data.copy()
    stereo = data.stereo
    offset = _OFFSETS[stereo.pivot][place] * stereo.interocular_distance
    distance = stereo.convergence_distance
    if stereo.convergence_mode == "OFFAXIS":
        sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
        data.shift_x -= offset * data.lens / (sensor * distance)
    eye = bpy.data.objects.new(_name(camera, SIDES[place]), data)
    scene.collection.objects.link(eye)
    eye.parent = camera
    # A camera's scale does not count in its picture, but it would move its children.
    eye.location.x = offset / camera.matrix_world.to_scale().x
    if stereo.convergence_mode == "TOE":
        eye.rotation_euler.y = math.atan(offset / distance)
    return eye
