"""COLMAP's text model: ``cameras.txt``, ``images.txt``, ``points3D.txt``.

Poses are world-to-camera in OpenCV's axes, as unit quaternion and translation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from .axes import Array, inverse, quaternion
from .camera import PIXEL_CENTRE, PinholeCamera
from .depth_maps import read_depth_png
from .files import make_folder, place_file, relative, write_text
from .quantities import generator
from .set_files import SetFiles, shown_pixels
from .view import DataSetView, check_views

_SAME = 0.01  # of the depth, within which a view sees a point and not what hides it


@dataclass(frozen=True)
class SparsePoint:
    """A point of the scene, and where it is seen: image coordinates by the name of the view.

    ``position`` is in world coordinates, m; ``colour`` 0 to 255.
    """

    position: tuple[float, float, float]
    colour: tuple[int, int, int]
    seen: Mapping[str, tuple[float, float]]


def sparse_points(
    views: Sequence[DataSetView],
    depth_of: Callable[[DataSetView], Array],
    picture_of: Callable[[DataSetView], NDArray[np.uint8]],
    count: int,
    seed: int = 0,
) -> list[SparsePoint]:
    """Return ``count`` points at the centres of pixels of each view, and the views that see each.

    ``views`` show one scene that does not move. ``depth_of`` returns the planar depth of a view,
    shape (height, width), m, infinite where nothing is seen; ``picture_of`` its picture, shape
    (height, width, 3).
    """
    depths = {view.name: depth_of(view) for view in views}
    found = []
    for view in views:
        depth = depths[view.name]
        there = np.argwhere(np.isfinite(depth) & (depth > 0))
        if not len(there):
            continue
        chosen = generator(seed, "points", view.name).choice(
            len(there), min(count, len(there)), replace=False
        )
        rows, columns = there[np.sort(chosen)].T
        rays = view.camera.rays()[rows, columns]
        local = rays / rays[:, 2:] * depth[rows, columns, None]
        pose = inverse(view.world_to_opencv)
        world = local @ pose[:3, :3].T + pose[:3, 3]
        colours = picture_of(view)[rows, columns]
        seen = {other.name: _seen(other, depths[other.name], world) for other in views}
        # Its own picture sees a point where it was taken.
        own = np.stack([columns, rows], axis=-1) + PIXEL_CENTRE
        seen[view.name] = own.astype(np.float64)
        for number, (place, colour) in enumerate(zip(world, colours, strict=True)):
            x, y, z = place.tolist()
            red, green, blue = colour.tolist()
            places = {
                name: (float(at[number, 0]), float(at[number, 1]))
                for name, at in seen.items()
                if np.isfinite(at[number]).all()
            }
            found.append(SparsePoint((x, y, z), (red, green, blue), places))
    return found


def _seen(view: DataSetView, depth: Array, points: Array) -> Array:
    """Image coordinates of points that a view sees, shape (m, 2); NaN for others."""
    at = view.project(points)
    pose = view.world_to_opencv
    far = points @ pose[2, :3] + pose[2, 3]
    cell = np.floor(np.nan_to_num(at, nan=-1.0)).astype(int)
    inside = (
        (cell >= 0).all(axis=1)
        & (cell[:, 0] < view.camera.width)
        & (cell[:, 1] < view.camera.height)
    )
    column, row = np.where(inside[:, None], cell, 0).T
    same = inside & (np.abs(depth[row, column] - far) < _SAME * far)
    return np.where(same[:, None], at, np.nan)


def write_colmap(
    folder: Path,
    views: Sequence[DataSetView],
    points: Sequence[SparsePoint] = (),
    images: Path | None = None,
) -> None:
    """Write a model as text; without points, an empty ``points3D.txt``.

    ``folder`` is made if it is not there; names of pictures are relative to ``images``, by default
    to the folder above. Raises InputError if there are no views, two share a name, a picture's has
    a space, or a file cannot be written.

    Source: COLMAP documentation, *Output format*.
    """
    check_views(views)
    root = images or folder.absolute().parent
    make_folder(folder)
    cameras = {camera: i for i, camera in enumerate(dict.fromkeys(v.camera for v in views), 1)}
    lines = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
    lines += [f"{number} {_camera(camera)}" for camera, number in cameras.items()]
    write_text(folder / "cameras.txt", "\n".join(lines) + "\n")

    places: dict[str, list[str]] = {view.name: [] for view in views}
    numbers = {view.name: i for i, view in enumerate(views, 1)}
    rows = ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"]
    for number, point in enumerate(points, 1):
        track = []
        for name, (x, y) in point.seen.items():
            track += [numbers[name], len(places[name])]
            places[name].append(f"{x!r} {y!r} {number}")
        rows.append(_row(number, *point.position, *point.colour, 0, *track))
    write_text(folder / "points3D.txt", "\n".join(rows) + "\n")

    lines = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; POINTS2D[]"]
    for view in views:
        pose = view.world_to_opencv
        q, t = quaternion(pose[:3, :3]).tolist(), pose[:3, 3].tolist()
        name = relative(view.image, root)
        if name.split() != [name]:
            raise InputError(f"COLMAP reads no picture {name!r}; name it without spaces")
        lines.append(_row(numbers[view.name], *q, *t, cameras[view.camera], name))
        lines.append(" ".join(places[view.name]))
    write_text(folder / "images.txt", "\n".join(lines) + "\n")


def write_colmap_scenes(files: SetFiles) -> None:
    """Write each scene, with its pictures beside, where loaders of 3D Gaussians seek them."""
    for name, views in files.scenes.items():
        images = make_folder(files.scene_folder(name) / "images")
        for view in views:
            place_file(view.image, images / view.image.name)
        points = sparse_points(views, _depth, shown_pixels, files.points, files.seed)
        write_colmap(
            files.scene_folder(name) / "sparse" / "0", views, points, files.folder / "images"
        )


def _depth(view: DataSetView) -> Array:
    assert view.depth is not None
    return read_depth_png(view.depth)


def _camera(camera: PinholeCamera) -> str:
    """Return the simplest model that the distortion needs, and its parameters."""
    focal = camera.fx, camera.fy, camera.cx, camera.cy
    k1, k2, p1, p2, k3 = camera.distortion
    if k3:
        model = "FULL_OPENCV", (*focal, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0)
    elif any(camera.distortion):
        model = "OPENCV", (*focal, k1, k2, p1, p2)
    else:
        model = "PINHOLE", focal
    return _row(model[0], camera.width, camera.height, *model[1])


def _row(*values: object) -> str:
    return " ".join(value if isinstance(value, str) else repr(value) for value in values)
