"""Sequences of EuRoC: pictures named by nanoseconds, cameras in YAML, states as CSV."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..uw_spectral.errors import InputError
from .axes import Array
from .files import make_folder, place_file, write_text
from .set_files import SetFiles
from .trajectories import Trajectory, between_cameras, matrices, trajectories
from .trajectory_files import NANOSECONDS, euroc_rows
from .view import DataSetView


def write_euroc_sequences(files: SetFiles) -> None:
    """Write ``mav0`` for each way, below ``euroc``; the body is the first camera.

    References
    ----------
    M. Burri et al., Int. J. Robot. Res. 35, 1157 (2016).
    """
    for way in trajectories(files, "euroc"):
        folder = make_folder(files.folder / "euroc" / way.name / "mav0")
        first, *_ = way.cameras.values()
        for number, views in enumerate(way.cameras.values()):
            of_camera = make_folder(folder / f"cam{number}")
            make_folder(of_camera / "data")
            rows = ["#timestamp [ns],filename"]
            for time, view in zip(way.times, views, strict=True):
                name = f"{time:019d}{view.image.suffix}"
                place_file(view.image, of_camera / "data" / name)
                rows.append(f"{time:019d},{name}")
            write_text(of_camera / "data.csv", "\n".join(rows) + "\n")
            write_text(of_camera / "sensor.yaml", _sensor(way, views, first))
        states = make_folder(folder / "state_groundtruth_estimate0")
        write_text(states / "data.csv", euroc_rows(matrices(first), way.times))
        lines = ["sensor_type: pose", "comment: the first camera, as it was rendered"]
        write_text(states / "sensor.yaml", "\n".join([*lines, *_matrix(np.eye(4))]) + "\n")


def _sensor(way: Trajectory, views: Sequence[DataSetView], first: Sequence[DataSetView]) -> str:
    camera = views[0].camera
    k1, k2, p1, p2, k3 = camera.distortion
    if k3:
        raise InputError(
            f"euroc, {way.name}: EuRoC has no place for the distortion's k3; leave out the format"
        )
    fx, fy, cx, cy = camera.K_opencv[(0, 1, 0, 1), (0, 1, 2, 2)].tolist()
    lines = [
        "sensor_type: camera",
        f"comment: {views[0].metadata['camera']}",
        *_matrix(between_cameras(first[0], views[0])),
        f"rate_hz: {_rate(way.times)!r}",
        f"resolution: [{camera.width}, {camera.height}]",
        "camera_model: pinhole",
        f"intrinsics: [{fx!r}, {fy!r}, {cx!r}, {cy!r}]",
        "distortion_model: radial-tangential",
        f"distortion_coefficients: [{k1!r}, {k2!r}, {p1!r}, {p2!r}]",
    ]
    return "\n".join(lines) + "\n"


def _rate(times: Sequence[int]) -> float:
    return NANOSECONDS * (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0


def _matrix(pose: Array) -> list[str]:
    numbers = ", ".join(map(repr, pose.ravel().tolist()))
    return ["T_BS:", "  cols: 4", "  rows: 4", f"  data: [{numbers}]"]
