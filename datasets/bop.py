"""Scenes of the BOP benchmark: ``scene_camera.json``, ``scene_gt.json``, ``scene_gt_info.json``.

A set has besides ``camera.json``, the ``models`` in mm, and the targets of its test.

Poses are model-to-camera in OpenCV's axes, translations in mm, and the first pixel's centre is
at (0, 0). A scene lies in ``<set>/<split>/<scene>``; its pictures are numbered.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import replacing, write_codes
from .camera import PinholeCamera
from .depth_maps import read_depth_png
from .files import make_folder, place_file, write_json
from .instance_maps import box, visible_masks
from .picture_codes import read_codes
from .set_files import SetFiles, Shape, camera_of_view
from .view import SPLITS, DataSetView, SeenInstance, check_views

_MILLIMETRES = 1e3  # in a metre
_TARGET = 0.1  # fraction of an object that is seen, from which BOP asks for it
_MANY, _DIRECTIONS = 2000, 2000
_FORMATS = (".png", ".jpg", ".tif")


def write_bop(folder: Path, views: Sequence[DataSetView]) -> list[Mapping[int, int]]:
    """Write one scene, its pictures, depths and masks included; return what each picture shows.

    That is how often it shows a model as BOP counts it, where a tenth of it is seen at least.

    ``folder`` is that of the scene, such as ``set/train/000000``, and made if it is not there;
    ``views`` have their depths, cameras without distortion, and instances with their silhouettes,
    as BOP counts what is hidden. Raises InputError if a view lacks something, BOP has no place for
    the picture's format or the lens's distortion, or a file cannot be written.

    Source: bop_toolkit, *docs/bop_datasets_format.md*.
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
    return [
        Counter(
            pose["obj_id"]
            for pose, info in zip(poses[key], infos[key], strict=True)
            if info["visib_fract"] >= _TARGET
        )
        for key in poses
    ]


def write_bop_set(files: SetFiles) -> None:
    """Write a scene for each split and water, and the models and targets of all."""
    root, targets = files.folder / "bop", list[dict[str, int]]()
    for split in SPLITS:
        of_split = replace(files, views=files.of_split(split))
        for number, views in enumerate(of_split.scenes.values()):
            found = write_bop(root / split / f"{number:06d}", views)
            if split == "test":
                targets += [
                    {"scene_id": number, "im_id": picture, "obj_id": model, "inst_count": n}
                    for picture, counts in enumerate(found)
                    for model, n in sorted(counts.items())
                ]
    if targets:
        write_json(root / "test_targets_bop19.json", targets)
    cameras = {camera_of_view(view): view.camera for view in files.views}
    for place, (name, camera) in enumerate(cameras.items()):
        for file in ([] if place else ["camera.json"]) + (
            [f"camera_{files.camera_names[name]}.json"] if len(cameras) > 1 else []
        ):
            write_json(root / file, _camera_record(camera))
    seen = {item.model: item.category for view in files.views for item in view.instances}
    shapes = files.shapes(seen.keys())
    without = [f"{number} ({seen[number]})" for number in sorted(seen.keys() - shapes.keys())]
    if without:
        files.report_note(
            f"BOP: models {', '.join(without)} have no mesh of their own: their poses, masks and "
            "targets are written, a PLY is not; make them meshes, or leave these models out"
        )
    for folder in ("models", "models_eval") if shapes else ():
        _write_models(root / folder, shapes)


def _write_models(folder: Path, shapes: Mapping[int, Shape]) -> None:
    """Write the models of a set as PLY in mm, and their sizes."""
    make_folder(folder)
    infos = {}
    for number, shape in sorted(shapes.items()):
        vertices = np.asarray(shape.vertices, dtype=np.float64) * _MILLIMETRES
        write_ply(folder / f"obj_{number:06d}.ply", vertices, shape.triangles)
        low, size = vertices.min(axis=0), np.ptp(vertices, axis=0)
        infos[str(number)] = {
            "diameter": diameter(vertices),
            **{f"min_{a}": float(x) for a, x in zip("xyz", low, strict=True)},
            **{f"size_{a}": float(x) for a, x in zip("xyz", size, strict=True)},
        }
    write_json(folder / "models_info.json", infos)


def write_ply(path: Path, vertices: ArrayLike, triangles: ArrayLike) -> None:
    """Write a mesh as binary PLY; whole under its name, or not at all."""
    places, faces = np.asarray(vertices, dtype="<f4"), np.asarray(triangles, dtype="<i4")
    head = [
        "ply", "format binary_little_endian 1.0", f"element vertex {len(places)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", "",
    ]  # fmt: skip
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    with replacing(path) as temporary:
        content = "\n".join(head).encode() + places.tobytes() + rows.tobytes()
        temporary.write_bytes(content)


def diameter(vertices: NDArray[np.float64]) -> float:
    """Return the largest distance between two vertices.

    Of many, those that lie outermost in some directions count, which is within 0.1 % of it.
    """
    outer = vertices
    if len(outer) > _MANY:
        number = np.arange(_DIRECTIONS) + 0.5
        z, turn = 1.0 - 2.0 * number / _DIRECTIONS, number * np.pi * (1.0 + 5.0**0.5)
        flat = np.sqrt(1.0 - z * z)
        ways = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=-1)
        outer = vertices[np.unique([int((vertices @ way).argmax()) for way in ways])]
    apart = [np.linalg.norm(outer - place, axis=1).max() for place in outer]
    return float(max(apart, default=0.0))


def _camera_record(camera: PinholeCamera) -> dict[str, Any]:
    """Return what ``camera.json`` says of a camera."""
    K = camera.K_opencv
    return {
        "cx": float(K[0, 2]),
        "cy": float(K[1, 2]),
        "depth_scale": 1.0,
        "fx": camera.fx,
        "fy": camera.fy,
        "height": camera.height,
        "width": camera.width,
    }


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
