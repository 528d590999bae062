"""COLMAP's text model: ``cameras.txt``, ``images.txt``, ``points3D.txt``.

Poses are world-to-camera in OpenCV's axes, as unit quaternion and translation.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..uw_spectral.errors import InputError
from .axes import Array, quaternion
from .camera import PinholeCamera
from .depth_maps import read_depth_png
from .files import make_folder, place_file, relative, write_text
from .set_files import SetFiles, shown_pixels
from .sparse_points import SparsePoint, sparse_points
from .view import DataSetView, check_views


def write_colmap(
    folder: Path,
    views: Sequence[DataSetView],
    points: Sequence[SparsePoint] = (),
    images: Path | None = None,
) -> None:
    """Write a model as text; without points, an empty ``points3D.txt``.

    Raises InputError if there are no views, two share a name, a picture's has a space, or a file
    cannot be written.

    Parameters
    ----------
    folder : Path
        Of the three files; made if it is not there.
    images : Path, optional
        Folder that the pictures' names are relative to; by default the one above ``folder``.

    References
    ----------
    COLMAP documentation, *Output format*.
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
