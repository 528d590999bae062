"""Axes of cameras: Blender's and OpenGL's, and those of OpenCV, COLMAP and BOP.

Both are right-handed and share x, to the right of the picture. In Blender's a camera looks
along -z with y up, in OpenCV's along +z with y down. The world keeps its axes, z up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.content import constant
from ..uw_spectral.errors import InputError

Array = NDArray[np.float64]

_TURN = constant(np.diag([1.0, -1.0, -1.0, 1.0]))  # between the two; its own inverse
_RIGID = 1e-6


def rigid(pose: ArrayLike, what: str) -> Array:
    """Return a pose as an array that cannot be written to; ``what`` names it in messages.

    A pose, shape (4, 4), is a rotation with a translation (m) to the world. Raises InputError if it
    scales, mirrors or shears, or is none.
    """
    matrix = np.asarray(pose, dtype=np.float64)
    if matrix.shape != (4, 4) or not np.all(np.isfinite(matrix)):
        raise InputError(f"pose of {what}: give a finite 4×4 matrix, got shape {matrix.shape}")
    turn = matrix[:3, :3]
    if not (
        np.allclose(turn @ turn.T, np.eye(3), atol=_RIGID)
        and np.linalg.det(turn) > 0
        and np.allclose(matrix[3], (0, 0, 0, 1), atol=_RIGID)
    ):
        raise InputError(
            f"pose of {what} is no rotation with a translation; apply its scale, and keep it "
            "right-handed"
        )
    return constant(matrix)


def world_to_opencv(camera_to_world: ArrayLike) -> Array:
    """Return the matrix from the world to a camera in OpenCV's axes, shape (4, 4).

    The pose, shape (4, 4), is in Blender's axes.

    Examples
    --------
    A camera at the origin that looks along the world's -z sees what lies there in front:

    >>> (world_to_opencv(np.eye(4)) @ [1.0, 2.0, -5.0, 1.0])[:3].tolist()
    [1.0, -2.0, 5.0]
    """
    return inverse(turned(camera_to_world))


def blender_from_opencv(world_to_camera: ArrayLike) -> Array:
    """Return the pose in Blender's axes of a camera in OpenCV's; undoes :func:`world_to_opencv`."""
    return turned(inverse(np.asarray(world_to_camera, dtype=np.float64)))


def turned(pose: ArrayLike) -> Array:
    """Return a pose to the world of a camera in OpenCV's axes for one in Blender's, and back."""
    return np.asarray(pose, dtype=np.float64) @ _TURN


def inverse(pose: Array) -> Array:
    """Return the inverse of a rotation with a translation, shape (4, 4)."""
    found = np.eye(4)
    found[:3, :3] = pose[:3, :3].T
    found[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return found


def quaternion(turn: ArrayLike) -> Array:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix, w not negative, shape (4,).

    It is the eigenvector of the largest eigenvalue of Bar-Itzhack's matrix, which has no
    special cases (I. Y. Bar-Itzhack, J. Guid. Control Dyn. 23, 1085 (2000)).
    """
    m = np.asarray(turn, dtype=np.float64)
    K = np.empty((4, 4))
    K[:3, :3] = m + m.T - np.trace(m) * np.eye(3)
    K[:3, 3] = K[3, :3] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    K[3, 3] = np.trace(m)
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    q = np.array([w, x, y, z])
    first = q[np.argmax(np.abs(q))] if abs(w) < 1e-12 else w
    return np.abs(q) * np.sign(q) * np.sign(first)


def rotation(quaternion: ArrayLike) -> Array:
    """Return the rotation matrix of a quaternion (w, x, y, z) of any length, shape (3, 3)."""
    q = np.asarray(quaternion, dtype=np.float64)
    w, axis = q[0], q[1:]
    across = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    whole = (w * w - axis @ axis) * np.eye(3) + 2.0 * (np.outer(axis, axis) + w * across)
    return whole / (q @ q)


def placed(turn: ArrayLike, place: ArrayLike) -> Array:
    """Return the pose of a rotation and a translation, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, place
    return pose


def looking_at(eye: ArrayLike, target: ArrayLike, roll: float = 0.0) -> Array:
    """Return the pose in Blender's axes of a camera that looks at a point, shape (4, 4).

    ``eye`` and ``target`` are world coordinates, m; ``roll`` turns about the view direction,
    counter-clockwise as the camera sees it, degrees. Raises InputError if the two points coincide.
    """
    start = np.asarray(eye, dtype=np.float64)
    back = start - np.asarray(target, dtype=np.float64)
    length = np.linalg.norm(back)
    if not length > 0:
        raise InputError(f"a camera at {start.tolist()} m cannot look at where it is; move one")
    back = back / length
    # A camera that looks straight up or down has the world's y on top.
    up = np.array([0.0, 1.0, 0.0] if abs(back[2]) > 1 - 1e-9 else [0.0, 0.0, 1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return with_roll(right, np.cross(back, right), back, start, roll)


def with_roll(right: Array, top: Array, back: Array, eye: ArrayLike, roll: float) -> Array:
    """Return the pose of Blender's axes in the world, turned by a roll in degrees, shape (4, 4)."""
    cosine, sine = np.cos(np.radians(roll)), np.sin(np.radians(roll))
    # A camera that turns counter-clockwise has its top go to the left.
    turn = cosine * right + sine * top, cosine * top - sine * right, back
    return placed(np.stack(turn, axis=-1), eye)
