"""The formats of data sets: what each writes, in which axes, and what it needs of the views."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from ..uw_spectral.errors import InputError
from .axes import Array
from .bop import camera_record, write_bop, write_bop_models
from .camera_info import write_camera_infos
from .coco import category_ids, write_coco
from .colmap import write_colmap
from .compositor_exr import LAYERS as COMPOSITOR_LAYERS
from .compositor_exr import write_compositor_exrs
from .croissant import write_croissant
from .depth_maps import read_depth_png
from .euroc import write_euroc_sequences
from .files import make_folder, place_file, write_json
from .hdf5 import write_hdf5s
from .kitti import write_kitti_sequences
from .nerfstudio import write_nerfstudio
from .optical_flow import write_flows
from .pairs import IMAGE, UNATTENUATED, write_air_pairs, write_pairs
from .rosbag import write_rosbags
from .set_files import SetFiles, camera_of_view, shown_pixels
from .sparse_points import sparse_points
from .tartanair import write_tartanair
from .tum import write_tum_sequences
from .view import SPLITS, DataSetView
from .yolo import write_yolo_boxes, write_yolo_segments

_OPENCV = "COLMAP and BOP: world or model to camera, the camera looks along +z, y is down."
_WAYS = (
    "TUM, EuRoC, KITTI and bags of ROS: camera to world, the camera looks along +z, y is down; "
    "KITTI's world is the first camera."
)
_NED = (
    "TartanAir: camera to world in north (our +y), east (our +x), down; the camera looks along +x, "
    "y to the right, z down."
)
_FLOW = (
    "Flow: pixels to the right and down, to the next picture of the way; the scene stands still."
)


@dataclass(frozen=True)
class Format:
    """A format of data sets: ``write`` writes its files into a set.

    Attributes
    ----------
    convention : str
        Of its poses, for the card; empty where it has none.
    silhouettes : bool
        Whether it tells how much of an object is hidden.
    layers : tuple of str
        That have to be rendered for it.
    package : str
        Of Python, that it needs and the extension does not bring; empty if none.
    way : bool
        Whether it needs poses that follow each other.
    side_by_side : bool
        Whether it takes no more than one camera, or two of one lens side by side.
    dry : bool
        Whether it needs the same views in air.
    distortion : int
        Coefficients of a lens that it holds, of k1, k2, p1, p2, k3.
    pixel_bytes : int
        That its own files take of a pixel, where these are no links.
    default : bool
        Whether a set that names no formats has it.
    """

    write: Callable[[SetFiles], None]
    convention: str = ""
    silhouettes: bool = False
    layers: tuple[str, ...] = ()
    package: str = ""
    way: bool = False
    side_by_side: bool = False
    dry: bool = False
    distortion: int = 5
    pixel_bytes: int = 0
    default: bool = False

    def require_lens(self, name: str, camera: str, coefficients: int) -> None:
        """Refuse a lens that the format, of this name, has no place for.

        ``coefficients`` are up to the last one that is not 0; 5 for a camera behind a port.
        """
        if coefficients > self.distortion:
            held = "k1, k2, p1 and p2 alone" if self.distortion else "none"
            raise InputError(
                f"output.formats: {name!r} holds {held} of a lens's distortion, and camera "
                f"{camera!r} has some, by its lens or its port; give it a lens and a port without, "
                "or name output.formats without it"
            )

    def require(self, name: str) -> None:
        """Refuse a format whose package is not there."""
        if self.package and importlib.util.find_spec(self.package) is None:
            raise InputError(
                f"format {name!r} is written by the Python package {self.package}, which is not "
                f"installed here; install it (pip install {self.package}) where the set is "
                "exported, or leave the format out"
            )


def _nerfstudio(files: SetFiles) -> None:
    """Write the whole set, and each scene of it."""
    write_nerfstudio(files.folder / "transforms.json", files.views)
    for name, views in _groups(files.views).items():
        write_nerfstudio(_scene(files, name) / "transforms.json", views)


def _colmap(files: SetFiles) -> None:
    """Write each scene, with its pictures beside, where loaders of 3D Gaussians seek them."""
    for name, views in _groups(files.views).items():
        images = make_folder(_scene(files, name) / "images")
        for view in views:
            place_file(view.image, images / view.image.name)
        points = sparse_points(views, _depth, shown_pixels, files.points, files.seed)
        write_colmap(_scene(files, name) / "sparse" / "0", views, points, files.folder / "images")


def _bop(files: SetFiles) -> None:
    """Write a scene for each split and water, and the models and targets of all."""
    root, targets = files.folder / "bop", list[dict[str, int]]()
    for split in SPLITS:
        for number, views in enumerate(_groups(files.of_split(split)).values()):
            found = write_bop(root / split / f"{number:06d}", views)
            if split == "test":
                targets += [
                    {"scene_id": number, "im_id": seen.picture, "obj_id": model, "inst_count": n}
                    for seen in found
                    for model, n in sorted(seen.counts.items())
                ]
    if targets:
        write_json(root / "test_targets_bop19.json", targets)
    cameras = {camera_of_view(view): view.camera for view in files.views}
    for place, (name, camera) in enumerate(cameras.items()):
        for file in ([] if place else ["camera.json"]) + (
            [f"camera_{files.camera_names[name]}.json"] if len(cameras) > 1 else []
        ):
            write_json(root / file, camera_record(camera))
    seen = {item.model: item.category for view in files.views for item in view.instances}
    shapes = files.shapes(seen.keys())
    without = [f"{number} ({seen[number]})" for number in sorted(seen.keys() - shapes.keys())]
    if without:
        files.report_note(
            f"BOP: models {', '.join(without)} have no mesh of their own: their poses, masks and "
            "targets are written, a PLY is not; make them meshes, or leave these models out"
        )
    for folder in ("models", "models_eval") if shapes else ():
        write_bop_models(root / folder, shapes)


def _coco(files: SetFiles) -> None:
    """Write a file for each split."""
    categories = category_ids(files.views)
    for split in SPLITS:
        views = files.of_split(split)
        if views:
            write_coco(files.folder / f"coco_{split}.json", views, files.card, categories)


FORMATS = {
    "nerfstudio": Format(
        _nerfstudio,
        "`transforms.json` (nerfstudio): camera to world, the camera looks along -z, y is up.",
        default=True,
    ),
    "colmap": Format(_colmap, _OPENCV, default=True),
    "bop": Format(_bop, _OPENCV, silhouettes=True, distortion=0, default=True),
    "coco": Format(_coco, default=True),
    "yolo": Format(write_yolo_boxes),
    "yolo_segments": Format(write_yolo_segments),
    "tum": Format(write_tum_sequences, _WAYS, way=True, pixel_bytes=2),
    "euroc": Format(write_euroc_sequences, _WAYS, way=True, distortion=4),
    "kitti": Format(write_kitti_sequences, _WAYS, way=True, side_by_side=True, distortion=0),
    "tartanair": Format(
        write_tartanair, _NED, way=True, side_by_side=True, distortion=0, pixel_bytes=15
    ),
    "rosbag2": Format(write_rosbags, _WAYS, package="rosbags", way=True, pixel_bytes=7),
    "camera_info": Format(write_camera_infos),
    "flow": Format(write_flows, _FLOW, way=True, pixel_bytes=8),
    "pairs": Format(write_pairs, layers=(IMAGE, UNATTENUATED), pixel_bytes=6),
    "pairs_air": Format(write_air_pairs, layers=(IMAGE,), dry=True, pixel_bytes=6),
    "exr": Format(write_compositor_exrs, layers=COMPOSITOR_LAYERS, pixel_bytes=48),
    "hdf5": Format(write_hdf5s, package="h5py", pixel_bytes=9),
    "croissant": Format(write_croissant),
}
"""By the names that a specification gives them; a set without ``formats`` has the usual ones."""

DEFAULT = tuple(name for name, each in FORMATS.items() if each.default)


def conventions(names: Collection[str]) -> tuple[str, ...]:
    """Return the conventions of formats, each once."""
    found = (FORMATS[name].convention for name in FORMATS if name in names)
    return tuple(dict.fromkeys(text for text in found if text))


def _groups(views: Iterable[DataSetView]) -> dict[str, list[DataSetView]]:
    """Views of one water, light and rig, which show one scene."""
    found: dict[str, list[DataSetView]] = {}
    for view in views:
        found.setdefault(str(view.metadata["group"]), []).append(view)
    return found


def _scene(files: SetFiles, name: str) -> Path:
    return make_folder(files.folder / "scenes" / name)


def _depth(view: DataSetView) -> Array:
    assert view.depth is not None
    return read_depth_png(view.depth)
