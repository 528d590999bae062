"""The camera of a render: found, and under water."""

from __future__ import annotations

import math

import bpy

from ..uw_spectral.errors import InputError


def find_camera(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object:
    """Return the named camera, or the scene's own.

    Raises
    ------
    InputError
        If there is no such camera.
    """
    cameras = sorted(o.name for o in scene.objects if o.type == "CAMERA")
    if name is None:
        if scene.camera is None:
            known = f"; set one of {', '.join(cameras)}" if cameras else "; add one"
            raise InputError(f"scene {scene.name!r} has no active camera{known}, or use --camera")
        return scene.camera
    if name not in cameras:
        known = ", ".join(cameras) or "none"
        raise InputError(f"--camera: no camera {name!r} in {scene.name!r}; there are: {known}")
    return scene.objects[name]


def camera_depth(camera: bpy.types.Object, floor_depth: float) -> float:
    """Return the camera's depth in m at the current frame.

    Raises
    ------
    InputError
        If the camera is above the surface, or at or below the floor.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    depth = -camera.evaluated_get(depsgraph).matrix_world.translation.z
    frame = bpy.context.scene.frame_current
    if depth <= 0:
        raise InputError(
            f"camera {camera.name!r} is {-depth:g} m above the water at frame {frame}; "
            "the surface is z = 0, move the camera below it"
        )
    if math.isfinite(floor_depth) and depth >= floor_depth:
        raise InputError(
            f"the floor at {floor_depth:g} m is above camera {camera.name!r}, which is at "
            f"{depth:g} m depth at frame {frame}; give a larger --floor-depth"
        )
    return depth


def eye_of(camera: bpy.types.Object) -> tuple[float, ...]:
    """Return the camera's place, m, and the unit vector to where it looks, at this frame."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    matrix = camera.evaluated_get(depsgraph).matrix_world
    ahead = -matrix.to_3x3().col[2].normalized()
    return (*matrix.translation, *ahead)
