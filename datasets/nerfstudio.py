"""The ``transforms.json`` of nerfstudio, and of instant-ngp before it.

Poses are camera-to-world with a camera that looks along -z, which are Blender's; the world has
z up. Depth is planar, in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .camera import PinholeCamera
from .depth_maps import MILLIMETRE
from .files import relative, write_json
from .set_files import SetFiles
from .view import SPLITS, DataSetView, check_views


def write_nerfstudio(path: Path, views: Sequence[DataSetView]) -> None:
    """Write ``transforms.json``; paths in it are relative to its folder.

    Raises InputError if there are none, two share a name, or the file cannot be written.

    Source: nerfstudio documentation, *Data conventions*.
    """
    check_views(views)
    folder = path.parent
    cameras = {view.camera for view in views}
    content: dict[str, Any] = {"camera_model": "OPENCV"}
    if len(cameras) == 1:
        content |= _intrinsics(views[0].camera)
    if any(view.depth for view in views):
        content["depth_unit_scale_factor"] = MILLIMETRE
    frames = []
    for view in views:
        frame: dict[str, Any] = {"file_path": relative(view.image, folder)}
        if len(cameras) > 1:
            frame |= _intrinsics(view.camera)
        frame["transform_matrix"] = view.camera_to_world.tolist()
        if view.mask:
            frame["mask_path"] = relative(view.mask, folder)
        if view.depth:
            frame["depth_file_path"] = relative(view.depth, folder)
        frames.append(frame)
    content["frames"] = frames
    for split in SPLITS:
        named = [relative(view.image, folder) for view in views if view.split == split]
        content[f"{split}_filenames"] = named
    write_json(path, content)


def write_nerfstudio_set(files: SetFiles) -> None:
    """Write the whole set, and each scene of it."""
    write_nerfstudio(files.folder / "transforms.json", files.views)
    for name, views in files.scenes.items():
        write_nerfstudio(files.scene_folder(name) / "transforms.json", views)


def _intrinsics(camera: PinholeCamera) -> dict[str, float | int]:
    k1, k2, p1, p2, k3 = camera.distortion
    return {
        "w": camera.width,
        "h": camera.height,
        "fl_x": camera.fx,
        "fl_y": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "k1": k1,
        "k2": k2,
        "k3": k3,
        "p1": p1,
        "p2": p2,
    }
