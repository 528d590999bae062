"""``CameraInfo`` of ROS: as YAML, as ``camera_calibration_parsers`` reads it, and as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .axes import Array
from .camera import PinholeCamera
from .files import make_folder, write_text
from .set_files import SetFiles, camera_of_view
from .trajectories import baseline
from .view import DataSetView

MODEL = "plumb_bob"
"""Of the distortion: Brown and Conrady's, five coefficients in OpenCV's order."""


@dataclass(frozen=True)
class CameraInfo:
    """A camera as ROS describes it; the first pixel's centre is at (0, 0).

    ``name`` is that in paths, ``right`` how far it stands to the right of the first one of its
    pair, m.
    """

    name: str
    camera: PinholeCamera
    right: float = 0.0

    @property
    def P(self) -> Array:
        """Projection of the rectified picture, shape (3, 4)."""
        return self.camera.projection(self.right)

    def yaml(self) -> str:
        """Return it as a file."""
        matrices = (
            ("camera_matrix", self.camera.K_opencv),
            ("distortion_coefficients", np.array([self.camera.distortion])),
            ("rectification_matrix", np.eye(3)),
            ("projection_matrix", self.P),
        )
        lines = [
            f"image_width: {self.camera.width}",
            f"image_height: {self.camera.height}",
            f"camera_name: {self.name}",
            f"distortion_model: {MODEL}",
        ]
        for name, matrix in matrices:
            rows, columns = matrix.shape
            numbers = ", ".join(map(repr, matrix.ravel().tolist()))
            lines += [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{numbers}]"]
        return "\n".join(lines) + "\n"


def camera_infos(files: SetFiles) -> dict[str, CameraInfo]:
    """Return the cameras of a set by name; the right one of a pair knows how far it stands."""
    views, plain = files.views, files.camera_names
    cameras = {camera_of_view(view): view.camera for view in views}
    right = dict.fromkeys(cameras, 0.0)
    if len(cameras) == 2:
        one, two = cameras
        apart = _baseline(views, one)
        right[two if apart > 0 else one] = abs(apart)
    return {name: CameraInfo(plain[name], camera, right[name]) for name, camera in cameras.items()}


def _baseline(views: Sequence[DataSetView], first: str) -> float:
    """How far the other camera stands to the right, where a pose is seen by both; else 0."""
    waiting: dict[tuple[object, object], DataSetView] = {}
    for view in views:
        place = view.metadata.get("pose"), view.metadata.get("lowered_m")
        other = waiting.setdefault(place, view)
        if camera_of_view(other) != camera_of_view(view):
            pair = (other, view) if camera_of_view(other) == first else (view, other)
            return baseline(*pair) or 0.0
    return 0.0


def write_camera_infos(files: SetFiles) -> None:
    """Write a file for each camera, ``camera_info/NAME.yaml``.

    Source: ROS, *sensor_msgs/CameraInfo*; *camera_calibration_parsers*.
    """
    folder = make_folder(files.folder / "camera_info")
    for info in camera_infos(files).values():
        write_text(folder / f"{info.name}.yaml", info.yaml())
