"""A camera of Blender as computer vision describes it."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.camera import PinholeCamera
from ...uw_spectral.errors import InputError
from .cameras import turn_of
from .picture_size import rendered_size

SENSOR = 36.0
"""Width of the sensor of cameras that are given intrinsics, mm."""


def require_pinhole(camera: bpy.types.Object) -> None:
    """Refuse a camera that has no calibration matrix: no perspective one, or of negative scale."""
    if camera.matrix_world.is_negative:
        raise InputError(
            f"--layers: camera {camera.name!r} is mirrored by a negative scale, which no pose "
            "tells; apply its scale (Object, Apply, Scale)"
        )
    if camera.data.type != "PERSP":
        raise InputError(
            f"--layers: camera {camera.name!r} is of type {camera.data.type}; layers and the truth "
            "of a picture need a perspective camera, or --layers none"
        )


def pinhole_of(scene: bpy.types.Scene, camera: bpy.types.Object) -> PinholeCamera:
    """Return the intrinsics of a perspective camera at the size of the scene's render."""
    render = scene.render
    width, height = rendered_size(
        render.resolution_x, render.resolution_y, render.resolution_percentage
    )
    corners = np.array([tuple(corner) for corner in camera.data.view_frame(scene=scene)])
    corners = corners[:, :2] / -corners[:, 2:]
    (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
    fx, fy = width / (right - left), height / (top - bottom)
    return PinholeCamera(width, height, fx, fy, -left * fx, top * fy)


def set_pinhole(
    data: bpy.types.Camera,
    size: tuple[int, int],
    focal: tuple[float, float],
    centre: tuple[float, float],
) -> None:
    """Give a camera intrinsics in pixels, for pictures of a size whose pixels are as they say."""
    (width, height), (fx, fy), (cx, cy) = size, focal, centre
    data.type, data.sensor_fit, data.sensor_width = "PERSP", "HORIZONTAL", SENSOR
    data.lens = SENSOR * fx / width
    # Shifts count in widths of the picture; a pixel may be higher than wide.
    data.shift_x = (width / 2 - cx) / width
    data.shift_y = (cy - height / 2) / width * (fx / fy)


def of_size(
    render: bpy.types.RenderSettings, width: int, height: int
) -> list[tuple[bpy.types.bpy_struct, str, object]]:
    """Settings of a render, see :func:`.temporary.held`, under which a picture has a size."""
    sides = ("resolution_x", width), ("resolution_y", height), ("resolution_percentage", 100)
    return [(render, name, value) for name, value in (*sides, ("use_border", False))]


def pose_of(camera: bpy.types.Object) -> NDArray[np.float64]:
    """Return the pose of a camera at this frame, Blender's axes to the world, shape (4, 4)."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = camera.evaluated_get(depsgraph)
    pose = np.eye(4)
    pose[:3, :3] = np.array(turn_of(seen))
    pose[:3, 3] = seen.matrix_world.translation
    return pose
