"""The formats of data sets: what each writes, in which axes, and what it needs of the views."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Collection
from dataclasses import dataclass

from ..uw_spectral.errors import InputError
from .bop import write_bop_set
from .coco import write_coco_splits
from .colmap import write_colmap_scenes
from .croissant import write_croissant
from .nerfstudio import write_nerfstudio_set
from .optical_flow import MOTION, write_flows
from .pairs import IMAGE, UNATTENUATED, write_air_pairs, write_pairs
from .rosbag import write_camera_infos, write_rosbags
from .sequences import write_euroc_sequences, write_kitti_sequences, write_tum_sequences
from .set_files import SetFiles
from .tartanair import write_tartanair
from .view_arrays import COMPOSITOR_LAYERS, write_compositor_exrs, write_hdf5s
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
    """A format of data sets: ``write`` writes its files into a set."""

    write: Callable[[SetFiles], None]
    convention: str = ""  #: Of its poses, for the card; empty where it has none.
    silhouettes: bool = False  #: Whether it tells how much of an object is hidden.
    layers: tuple[str, ...] = ()  #: That have to be rendered for it.
    package: str = ""  #: Of Python, that it needs and the extension does not bring; empty if none.
    way: bool = False  #: Whether it needs poses that follow each other.
    #: Whether it takes no more than one camera, or two of one lens side by side.
    side_by_side: bool = False
    dry: bool = False  #: Whether it needs the same views in air.
    distortion: int = 5  #: Coefficients of a lens that it holds, of k1, k2, p1, p2, k3.
    pixel_bytes: int = 0  #: That its own files take of a pixel, where these are no links.

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


FORMATS = {
    "nerfstudio": Format(
        write_nerfstudio_set,
        "`transforms.json` (nerfstudio): camera to world, the camera looks along -z, y is up.",
    ),
    "colmap": Format(write_colmap_scenes, _OPENCV),
    "bop": Format(write_bop_set, _OPENCV, silhouettes=True, distortion=0),
    "coco": Format(write_coco_splits),
    "yolo": Format(write_yolo_boxes),
    "yolo_segments": Format(write_yolo_segments),
    "tum": Format(write_tum_sequences, _WAYS, way=True, pixel_bytes=2),
    "euroc": Format(write_euroc_sequences, _WAYS, way=True, distortion=4),
    "kitti": Format(write_kitti_sequences, _WAYS, way=True, side_by_side=True, distortion=0),
    "tartanair": Format(
        write_tartanair,
        _NED,
        layers=(MOTION,),
        way=True,
        side_by_side=True,
        distortion=0,
        pixel_bytes=15,
    ),
    "rosbag2": Format(write_rosbags, _WAYS, package="rosbags", way=True, pixel_bytes=7),
    "camera_info": Format(write_camera_infos),
    "flow": Format(write_flows, _FLOW, layers=(MOTION,), way=True, pixel_bytes=16),
    "pairs": Format(write_pairs, layers=(IMAGE, UNATTENUATED), pixel_bytes=6),
    "pairs_air": Format(write_air_pairs, layers=(IMAGE,), dry=True, pixel_bytes=6),
    "exr": Format(write_compositor_exrs, layers=tuple(COMPOSITOR_LAYERS), pixel_bytes=48),
    "hdf5": Format(write_hdf5s, package="h5py", pixel_bytes=9),
    "croissant": Format(write_croissant),
}
"""By the names that a specification gives them."""

DEFAULT = ("nerfstudio", "colmap", "bop", "coco")
"""What a set without ``formats`` has."""


def conventions(names: Collection[str]) -> tuple[str, ...]:
    """Return the conventions of formats, each once."""
    found = (FORMATS[name].convention for name in FORMATS if name in names)
    return tuple(dict.fromkeys(text for text in found if text))
