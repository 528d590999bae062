"""The pinhole in the water that stands in for a camera behind a port: a camera of its own."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy

from ...uw_spectral.errors import InputError
from ...uw_spectral.housing import LensCamera, PinholeView
from ..temporary import held
from .cameras import PORT_DISTANCE, stand_in
from .pinhole import of_size, pinhole_of, set_pinhole
from .waterline import above

_NEAREST = 1e-3  # m, of a focus
_SMALLEST_NUMBER = 1e-3


def lens_camera(scene: bpy.types.Scene, camera: bpy.types.Object) -> LensCamera:
    """Return a perspective camera as it would be in air, at the size of the scene's render."""
    if camera.data.type != "PERSP":
        raise InputError(
            f"--housing: camera {camera.name!r} is of type {camera.data.type}; a port and a lens "
            "need a perspective camera (a fisheye is one with --lens fisheye:0)"
        )
    if camera.matrix_world.is_negative:
        raise InputError(
            f"--housing: camera {camera.name!r} is mirrored by a negative scale; apply its scale"
        )
    return pinhole_of(scene, camera).lens_camera()


def require_under_water(
    camera: bpy.types.Object, eyes: tuple[tuple[float, ...], ...], trough: float
) -> None:
    """Refuse a port that is not under water at every frame of a job.

    The surface may fall by ``trough``, in m.
    """
    if above(camera, eyes, trough):
        raise InputError(
            f"--housing: camera {camera.name!r} is above the water or at its surface; a port is "
            "drawn under water only: lower the camera, or use --housing none"
        )


@contextlib.contextmanager
def port_eye(scene: bpy.types.Scene, camera: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """Make a camera that hangs on another while the block runs."""
    with stand_in(scene, camera, "port") as eye:
        eye.parent = camera
        yield eye


def focus_of(camera: bpy.types.Object) -> float:
    """Return the distance along the axis on which a camera is focused, m."""
    dof = camera.data.dof
    if dof.focus_object is None:
        return max(dof.focus_distance, _NEAREST)
    there = dof.focus_object.matrix_world.translation - camera.matrix_world.translation
    return max(-there.dot(camera.matrix_world.to_3x3().col[2].normalized()), _NEAREST)


def set_eye(
    eye: bpy.types.Object,
    camera: bpy.types.Object,
    view: PinholeView,
    port: float,
    aperture: float,
    focus: float,
) -> None:
    """Give the eye its place and intrinsics.

    The water begins at the planar distance ``port`` before it, m; the ``aperture`` is the diameter
    of its lens, mm; in focus is what lies at a distance from the camera along its axis, m.
    """
    x, y, z = view.position
    # A camera's scale does not count in its picture, but it moves its children.
    scale = camera.matrix_world.to_scale()
    eye.location = [a / b for a, b in zip((x, -y, -z), scale, strict=True)]
    eye.scale = [1.0 / b for b in scale]
    eye[PORT_DISTANCE] = max(port, 0.0)
    of, data, seen = view.camera, eye.data, camera.data
    set_pinhole(data, (of.width, of.height), (of.fx, of.fy), (of.cx, of.cy))
    data.clip_start, data.clip_end = seen.clip_start, seen.clip_end
    data.dof.use_dof, data.dof.focus_object = seen.dof.use_dof, None
    data.dof.focus_distance = max(focus - z, _NEAREST)
    data.dof.aperture_fstop = max(data.lens / aperture, _SMALLEST_NUMBER)
    bpy.context.view_layer.update()


@contextlib.contextmanager
def picture_of(scene: bpy.types.Scene, view: PinholeView) -> Iterator[None]:
    """Give a scene the size of the eye's picture while the block runs."""
    render = scene.render
    wanted = [
        *of_size(render, view.camera.width, view.camera.height),
        (render, "pixel_aspect_x", 1.0),
        (render, "pixel_aspect_y", 1.0),
    ]
    with held(wanted):
        yield
