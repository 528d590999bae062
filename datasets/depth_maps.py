"""How far objects are: Euclidean range along the ray, and planar depth along the optical axis.

Every file says which of the two it holds. Where nothing is seen both are 0 in a PNG, which
readers take for *not measured*, and infinite in an EXR.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr, write_codes, write_exr
from .axes import Array, inverse, world_to_opencv
from .camera import PinholeCamera
from .picture_codes import read_codes

RANGE, PLANAR = "range", "planar_depth"
"""Channels of an EXR: Euclidean distance from the camera's centre; along its optical axis."""
MILLIMETRE = 1e-3
DEEPEST = np.iinfo(np.uint16).max * MILLIMETRE
"""Largest depth in a 16-bit PNG, m."""


def planar_depth(distances: ArrayLike, camera: PinholeCamera) -> Array:
    """Return the planar depth of Euclidean ranges, shape (height, width), m."""
    return _of_picture(distances, camera) * camera.rays()[..., 2]


def euclidean_range(depth: ArrayLike, camera: PinholeCamera) -> Array:
    """Return the Euclidean range of planar depths, shape (height, width), m."""
    return _of_picture(depth, camera) / camera.rays()[..., 2]


def world_positions(
    distances: ArrayLike, camera: PinholeCamera, camera_to_world: ArrayLike
) -> Array:
    """Return what is seen as points of the world, shape (height, width, 3), m.

    ``distances`` are Euclidean ranges, m, shape (height, width); where they are infinite, points
    are at 0. ``camera_to_world``, shape (4, 4), is the pose in Blender's axes.

    Examples
    --------
    >>> camera = PinholeCamera.from_field_of_view(1, 1, 90.0)
    >>> world_positions([[5.0]], camera, np.eye(4)).round(3).tolist()
    [[[0.0, 0.0, -5.0]]]
    """
    far = _of_picture(distances, camera)[..., None]
    pose = inverse(world_to_opencv(camera_to_world))
    near = np.where(np.isfinite(far), far, 0.0)
    points = camera.rays() * near @ pose[:3, :3].T + pose[:3, 3]
    return np.where(np.isfinite(far), points, 0.0)


def write_depth_png(path: Path, depth: ArrayLike) -> int:
    """Write planar depth as 16-bit PNG in mm, 0 where nothing is seen.

    ``depth`` is in m, shape (height, width), infinite or 0 where nothing is seen. Returns how many
    pixels are farther than :data:`DEEPEST` and were written as 0. Raises InputError if a depth is
    negative or no number, or the file cannot be written.
    """
    metres = np.asarray(depth, dtype=np.float64)
    if np.isnan(metres).any() or (metres < 0).any():
        raise InputError(f"cannot write {path}: a depth is negative or not a number")
    far = metres > DEEPEST
    codes = np.where(far, 0.0, np.round(np.where(far, 0.0, metres) / MILLIMETRE))
    write_codes(path, codes.astype(np.uint16))
    return int(np.count_nonzero(far & np.isfinite(metres)))


def read_depth_png(path: Path) -> Array:
    """Read planar depth in m; infinite where nothing is seen."""
    codes = read_codes(path)
    return np.where(codes > 0, codes * MILLIMETRE, np.inf)


def write_depth_exr(path: Path, distances: ArrayLike, camera: PinholeCamera) -> None:
    """Write Euclidean range and planar depth, both in m, as the channels of an EXR.

    Ranges, shape (height, width), are infinite where nothing is seen.
    """
    pixels = np.stack([_of_picture(distances, camera), planar_depth(distances, camera)], axis=-1)
    header = {
        "range_is": "Euclidean distance from the centre of the camera, m",
        "planar_depth_is": "distance along the optical axis, m",
    }
    write_exr(path, pixels, (RANGE, PLANAR), header)


def read_depth_exr(path: Path) -> tuple[Array, Array]:
    """Read Euclidean range and planar depth, m.

    Raises InputError if the file lacks one of them.
    """
    pixels, names = read_exr(path)
    if not {RANGE, PLANAR} <= set(names):
        raise InputError(f"{path} has channels {', '.join(names)}; it needs {RANGE} and {PLANAR}")
    found = (pixels[..., names.index(name)].astype(np.float64) for name in (RANGE, PLANAR))
    return next(found), next(found)


def _of_picture(values: ArrayLike, camera: PinholeCamera) -> Array:
    found = np.asarray(values, dtype=np.float64)
    if found.shape != (camera.height, camera.width):
        raise InputError(
            f"distances have shape {found.shape}, the camera's picture "
            f"{(camera.height, camera.width)}; give one per pixel"
        )
    return found
