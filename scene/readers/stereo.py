"""Blender's stereo cameras, as a left and a right camera that a job renders one by one."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping

import bpy

from ..animation import curves_of

SIDES = ("left", "right")
_EYE = "uw_eye"
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
    eyes = [item for item in scene.objects if _EYE in item and item.parent == camera]
    return sorted(eyes, key=lambda eye: eye[_EYE]) or [camera]


def _eye(scene: bpy.types.Scene, camera: bpy.types.Object, place: int) -> bpy.types.Object:
    data = camera.data.copy()
    stereo = data.stereo
    offset = _OFFSETS[stereo.pivot][place] * stereo.interocular_distance
    distance = stereo.convergence_distance
    _follow(data, camera.data)
    if stereo.convergence_mode == "OFFAXIS":
        vertical = data.sensor_fit == "VERTICAL"
        sensor = "sensor_height" if vertical else "sensor_width"
        # Lens and shift may be animated.
        data.driver_remove("shift_x")
        names = {"shift": "shift_x", "lens": "lens", "sensor": sensor}
        towards = f"shift - {offset / distance!r} * lens / sensor"
        _drive(data, "shift_x", camera.data, names, towards)
    eye = bpy.data.objects.new(f"{camera.name} {SIDES[place]}", data)
    eye[_EYE] = place
    scene.collection.objects.link(eye)
    eye.parent = camera
    # A camera's scale does not count in its picture, but it would move its children.
    eye.location.x = offset / camera.matrix_world.to_scale().x
    if stereo.convergence_mode == "TOE":
        eye.rotation_euler.y = math.atan(offset / distance)
    return eye


def _follow(data: bpy.types.Camera, original: bpy.types.Camera) -> None:
    """Let what is animated of a camera's data be that of the original."""
    moved = original.animation_data
    if moved is None:
        return
    data.animation_data_clear()
    action = [] if moved.action is None else list(curves_of(moved.action))
    for path in dict.fromkeys(curve.data_path for curve in (*action, *moved.drivers)):
        if isinstance(original.path_resolve(path), float | int):
            _drive(data, path, original, {"value": path}, "value")


def _drive(
    data: bpy.types.Camera,
    path: str,
    original: bpy.types.Camera,
    names: Mapping[str, str],
    expression: str,
) -> None:
    """Drive a property by properties of another camera, without a script."""
    driver = data.driver_add(path).driver
    driver.type, driver.expression = "SCRIPTED", expression
    for name, source in names.items():
        variable = driver.variables.new()
        variable.name = name
        variable.targets[0].id_type, variable.targets[0].id = "CAMERA", original
        variable.targets[0].data_path = source
