"""The camera of a render: found, above the floor, and what it sees."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...uw_spectral.errors import InputError
from .unusable_places import has_place

_CLIP_RATIO, _FAR = 1e6, 1e4
PORT_DISTANCE = "uw_port"
"""Property of a camera that looks through a port: where the water begins, m along its axis."""


def before_water(camera: bpy.types.Object | None) -> float:
    """Return how far from a camera the water begins, m along its axis; 0 without a port."""
    return 0.0 if camera is None else float(camera.get(PORT_DISTANCE, 0.0))


@contextlib.contextmanager
def stand_in(
    scene: bpy.types.Scene, camera: bpy.types.Object, name: str
) -> Iterator[bpy.types.Object]:
    """Make a camera with the data of another, without its animation, while the block runs."""
    data = camera.data.copy()
    data.animation_data_clear()
    made = bpy.data.objects.new(f"{camera.name} {name}", data)
    scene.collection.objects.link(made)
    try:
        yield made
    finally:
        bpy.data.objects.remove(made)
        bpy.data.cameras.remove(data)


def camera_of(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return a scene's camera; None if it has none, or another object in its place."""
    camera = scene.camera
    return camera if camera is not None and camera.type == "CAMERA" else None


def clip_range(start: float, end: float) -> tuple[float, float]:
    """Return from where to where EEVEE can draw, for the clip distances of a camera, m.

    Far over near above some 1e7, it loses the light of water and lamps, and at last draws nothing.
    What is farther than 10 km gives way first.

    Examples
    --------
    >>> clip_range(0.1, 1000.0), clip_range(1e-4, 5000.0), clip_range(0.1, 1e7)
    ((0.1, 1000.0), (0.005, 5000.0), (0.1, 100000.0))
    """
    end = min(end, max(start * _CLIP_RATIO, _FAR))
    return max(start, end / _CLIP_RATIO), end


def clip_notes(camera: bpy.types.Object | None) -> list[str]:
    """Say where EEVEE draws a camera's view in other clip distances than its own."""
    if camera is None or camera.type != "CAMERA":
        return []
    own = camera.data.clip_start, camera.data.clip_end
    start, end = clip_range(*own)
    if np.allclose((start, end), own, rtol=1e-4):
        return []
    return [
        f"EEVEE draws camera {camera.name!r} from {start:.3g} to {end:.3g} m, not from "
        f"{own[0]:.3g} to {own[1]:.3g} m: where the far is more than a million times the near, it "
        "loses the light of the water; raise Clip Start"
    ]


def find_camera(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object:
    """Return the named camera, or the scene's own; InputError if there is none."""
    cameras = sorted(o.name for o in scene.objects if o.type == "CAMERA")
    if name is None and (own := camera_of(scene)) is not None:
        name = own.name
    elif name is None:
        known = f"; set one of {', '.join(cameras)}" if cameras else "; add one"
        raise InputError(f"scene {scene.name!r} {why_no_camera(scene)}{known}, or use --camera")
    if name not in cameras:
        known = ", ".join(cameras) or "none"
        raise InputError(f"--camera: no camera {name!r} in {scene.name!r}; there are: {known}")
    return scene.objects[name]


def why_no_camera(scene: bpy.types.Scene) -> str:
    """Say of a scene why :func:`camera_of` finds no camera."""
    other = scene.camera
    if other is None:
        return "has no active camera"
    return f"has {other.name!r} as its active camera, which is none ({other.type.lower()})"


def camera_depth(camera: bpy.types.Object, floor_depth: float) -> float:
    """Return the camera's depth in m at the current frame, 0 above the water.

    InputError if it is at or below the floor, or has no usable place.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    place = camera.evaluated_get(depsgraph).matrix_world
    require_usable(camera, place)
    depth = max(-place.translation.z, 0.0)
    frame = bpy.context.scene.frame_current
    if math.isfinite(floor_depth) and depth >= floor_depth:
        raise InputError(
            f"the floor at {floor_depth:g} m is above camera {camera.name!r}, which is at "
            f"{depth:g} m depth at frame {frame}; give a larger --floor-depth"
        )
    return depth


def require_usable(camera: bpy.types.Object, place: Matrix) -> None:
    """Refuse a camera that looks nowhere, is too far away, or has no finite place or direction."""
    if not has_place(place):
        raise InputError(
            f"camera {camera.name!r}: its place or direction at frame "
            f"{bpy.context.scene.frame_current} is not finite, or farther away than 1000 km; check "
            "its transforms, constraints and drivers"
        )
    if not all(axis.length for axis in place.to_3x3().col):
        raise InputError(
            f"camera {camera.name!r} has a scale of 0 at frame "
            f"{bpy.context.scene.frame_current}, by which it looks nowhere; give it one of 1"
        )


def camera_rays(
    scene: bpy.types.Scene, camera: bpy.types.Object, width: int, height: int
) -> Iterator[tuple[Vector, Vector]]:
    """Yield origin and unit direction of as many rays, spread over a picture.

    A panorama's are spread over the sphere, or over the cone of a fisheye.
    """
    place = camera.matrix_world
    turn, data = turn_of(camera), camera.data
    if data.type == "PANO":
        for direction in _sphere(width * height, _panorama_angle(data)):
            yield place.translation.copy(), turn @ direction
        return
    corner, _, opposite, left = (
        Vector(c) for c in data.view_frame(scene=scene)
    )  # right top, right bottom, left bottom, left top
    for row in range(height):
        for column in range(width):
            across, down = (column + 0.5) / width, (row + 0.5) / height
            at = left + (corner - left) * across + (opposite - left) * down
            if data.type == "ORTHO":
                yield place @ Vector((at.x, at.y, 0.0)), turn @ Vector((0.0, 0.0, -1.0))
            else:
                yield place.translation.copy(), turn @ at.normalized()


def ray_arrays(
    scene: bpy.types.Scene, camera: bpy.types.Object, width: int, height: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what :func:`camera_rays` yields as arrays of shape (m, 3)."""
    origins, directions = zip(*camera_rays(scene, camera, width, height), strict=True)
    return np.array(origins, dtype=np.float64), np.array(directions, dtype=np.float64)


def _panorama_angle(data: bpy.types.Camera) -> float:
    """Half the angle of the cone that a panorama shows."""
    if data.panorama_type.startswith("FISHEYE_EQUI"):
        return min(data.fisheye_fov / 2, math.pi)
    return math.pi


def _sphere(count: int, half_angle: float) -> Iterator[Vector]:
    """Directions spread evenly over a cone about -z (a spiral by the golden angle)."""
    golden = math.pi * (3 - math.sqrt(5))
    for i in range(count):
        z = 1 - (1 - math.cos(half_angle)) * (i + 0.5) / count
        side = math.sqrt(max(1 - z * z, 0.0))
        yield Vector((side * math.cos(golden * i), side * math.sin(golden * i), -z))


def turn_of(camera: bpy.types.Object) -> Matrix:
    """Axes of a camera in the world as columns, without its size; a mirrored one stays so."""
    turn = camera.matrix_world.to_3x3()
    turn.transpose()
    turn = Matrix([row.normalized() for row in turn])
    turn.transpose()
    return turn


def eye_of(camera: bpy.types.Object) -> tuple[float, ...]:
    """Return the camera's place, m, and the unit vector to where it looks, at this frame."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    matrix = camera.evaluated_get(depsgraph).matrix_world
    ahead = -matrix.to_3x3().col[2].normalized()
    return (*matrix.translation, *ahead)


def orthographic_frame(
    scene: bpy.types.Scene, camera: bpy.types.Object | None
) -> tuple[float, ...] | None:
    """Left and bottom edge, width and height in m of an orthographic picture; None of others."""
    if camera is None or camera.data.type != "ORTHO":
        return None
    frame = np.array([corner[:] for corner in camera.data.view_frame(scene=scene)])
    low, high = frame.min(axis=0), frame.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1])
