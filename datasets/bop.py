"""Scenes of the BOP benchmark: ``scene_camera.json``, ``scene_gt.json``, ``scene_gt_info.json``.

Poses are model-to-camera in OpenCV's axes, translations in mm, and the first pixel's centre is
at (0, 0). A scene lies in ``<set>/<split>/<scene>``; its pictures are numbered.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import write_codes
from .depth_maps import read_depth_png
from .files import make_folder, place_file, read_codes, write_json
from .instance_maps import box, visible_masks
from .view import DataSetView, SeenInstance, check_views

_MILLIMETRES = 1e3  # in a metre
_FORMATS = (".png", ".jpg", ".tif")


def write_bop(folder: Path, views: Sequence[DataSetView]) -> None:
    """Write one scene, its pictures, depths and masks included.

    Parameters
    ----------
    folder : Path
        Of the scene, such as ``set/train/000000``; made if it is not there.
    views : sequence of DataSetView
        Each with its depth, by cameras without distortion; instances with their silhouettes, as
        BOP counts what is hidden.

    Raises
    ------
    InputError
        If a view lacks something, BOP has no place for the picture's format or the lens's
        distortion, or a file cannot be written.

    References
    ----------
    bop_toolkit, *docs/bop_datasets_format.md*.
    """
    check_views(views)
    for name in ("rgb", "depth", "mask", "mask_visib"):
        make_folder(folder / name)
    cameras: dict[str, Any] = {}
    poses: dict[str, Any] = {}
    infos: dict[str, Any] = {}
    for number, view in enumerate(views):
        key, world = str(number), view.world_to_opencv
        if view.image.suffix.lower() not in _FORMATS:
            raise InputError(
                f"view {view.name}: BOP knows pictures {', '.join(_FORMATS)}, not "
                f"{view.image.suffix!r}; develop it to one of them"
            )
        if any(view.camera.distortion):
            raise InputError(
                f"view {view.name}: BOP knows no lens distortion; render with a camera without"
            )
        if view.depth is None:
            raise InputError(f"view {view.name}: BOP needs its depth; write it in mm")
        place_file(view.image, folder / "rgb" / f"{number:06d}{view.image.suffix.lower()}")
        place_file(view.depth, folder / "depth" / f"{number:06d}.png")
        cameras[key] = {
            "cam_K": view.camera.K_opencv.ravel().tolist(),
            "depth_scale": 1.0,
            "cam_R_w2c": world[:3, :3].ravel().tolist(),
            "cam_t_w2c": (world[:3, 3] * _MILLIMETRES).tolist(),
        }
        masks, known = visible_masks(view), np.isfinite(read_depth_png(view.depth))
        poses[key], infos[key] = [], []
        for place, item in enumerate(view.instances):
            pose = world @ item.object_to_world
            poses[key].append(
                {
                    "cam_R_m2c": pose[:3, :3].ravel().tolist(),
                    "cam_t_m2c": (pose[:3, 3] * _MILLIMETRES).tolist(),
                    "obj_id": item.model,
                }
            )
            whole, seen = _silhouette(view, item), masks[item.number]
            infos[key].append(_info(whole, seen, known))
            for kind, mask in (("mask", whole), ("mask_visib", seen)):
                codes = np.where(mask, 255, 0).astype(np.uint8)
                write_codes(folder / kind / f"{number:06d}_{place:06d}.png", codes)
    write_json(folder / "scene_camera.json", cameras)
    write_json(folder / "scene_gt.json", poses)
    write_json(folder / "scene_gt_info.json", infos)


def _info(
    whole: NDArray[np.bool_], seen: NDArray[np.bool_], known: NDArray[np.bool_]
) -> dict[str, Any]:
    count, visible = int(np.count_nonzero(whole)), int(np.count_nonzero(seen))
    return {
        "bbox_obj": box(whole),
        "bbox_visib": box(seen),
        "px_count_all": count,
        "px_count_valid": int(np.count_nonzero(whole & known)),
        "px_count_visib": visible,
        "visib_fract": visible / count if count else 0.0,
    }


def _silhouette(view: DataSetView, item: SeenInstance) -> NDArray[np.bool_]:
    if item.silhouette is None:
        raise InputError(
            f"view {view.name}: instance {item.number} ({item.category}) has no silhouette, from "
            "which BOP counts what is hidden; render it alone"
        )
    mask = read_codes(item.silhouette) > 0
    if mask.shape != (view.camera.height, view.camera.width):
        raise InputError(f"{item.silhouette} has another size than view {view.name}")
    return mask
