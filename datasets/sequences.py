"""Ways as sequences of benchmarks: TUM RGB-D, EuRoC, and KITTI's odometry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import write_codes
from .axes import Array
from .files import make_folder, place_file, write_text
from .set_files import SetFiles
from .trajectories import Trajectory, baseline, between_cameras, trajectories
from .trajectory_files import NANOSECONDS, euroc_rows, kitti_rows, seconds, tum_rows
from .view import DataSetView

_DEPTH_SCALE = 5000  # codes of TUM's depth in a metre
_MOST = np.iinfo(np.uint16).max
_LEFT, _RIGHT = 2, 3  # KITTI's colour cameras; 0 and 1 are the same in grey, without pictures here


def write_tum_sequences(files: SetFiles) -> None:
    """Write a sequence for each way and camera, below ``tum``.

    Depth is planar; 0 where nothing is seen or it is above 13.1 m, where 16 bits end.

    Source: J. Sturm et al., IROS 2012; *File formats*.
    """
    for way in trajectories(files, "tum"):
        for camera, views in way.cameras.items():
            folder = make_folder(files.folder / "tum" / way.name / files.camera_names[camera])
            lists: dict[str, list[str]] = {"rgb": [], "depth": []}
            for kind in lists:
                make_folder(folder / kind)
            for time, view in zip(way.times, views, strict=True):
                rgb = f"rgb/{seconds(time)}{view.image.suffix}"
                place_file(view.image, folder / rgb)
                codes = files.planar_depth(view).astype(np.float64) * _DEPTH_SCALE
                codes = np.where(codes > _MOST, 0.0, np.minimum(codes, _MOST))
                depth = f"depth/{seconds(time)}.png"
                write_codes(folder / depth, np.round(codes).astype(np.uint16))
                for kind, path in (("rgb", rgb), ("depth", depth)):
                    lists[kind].append(f"{seconds(time)} {path}")
            for kind, rows in lists.items():
                write_text(folder / f"{kind}.txt", "\n".join(("# timestamp filename", *rows, "")))
            write_text(folder / "groundtruth.txt", tum_rows(_poses(views), way.times))


def write_euroc_sequences(files: SetFiles) -> None:
    """Write ``mav0`` for each way, below ``euroc``; the body is the first camera.

    Source: M. Burri et al., Int. J. Robot. Res. 35, 1157 (2016).
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
        write_text(states / "data.csv", euroc_rows(_poses(first), way.times))
        lines = ["sensor_type: pose", "comment: the first camera, as it was rendered"]
        write_text(states / "sensor.yaml", "\n".join([*lines, *_matrix(np.eye(4))]) + "\n")


def _sensor(way: Trajectory, views: Sequence[DataSetView], first: Sequence[DataSetView]) -> str:
    camera = views[0].camera
    k1, k2, p1, p2, k3 = camera.distortion
    if k3:
        raise InputError(
            f"euroc, {way.name}: EuRoC has no place for the distortion's k3; leave out the format"
        )
    times, rate = way.times, 0.0
    if len(times) > 1:
        rate = NANOSECONDS * (len(times) - 1) / (times[-1] - times[0])
    fx, fy, cx, cy = camera.K_opencv[(0, 1, 0, 1), (0, 1, 2, 2)].tolist()
    lines = [
        "sensor_type: camera",
        f"comment: {views[0].metadata['camera']}",
        *_matrix(between_cameras(first[0], views[0])),
        f"rate_hz: {rate!r}",
        f"resolution: [{camera.width}, {camera.height}]",
        "camera_model: pinhole",
        f"intrinsics: [{fx!r}, {fy!r}, {cx!r}, {cy!r}]",
        "distortion_model: radial-tangential",
        f"distortion_coefficients: [{k1!r}, {k2!r}, {p1!r}, {p2!r}]",
    ]
    return "\n".join(lines) + "\n"


def _matrix(pose: Array) -> list[str]:
    numbers = ", ".join(map(repr, pose.ravel().tolist()))
    return ["T_BS:", "  cols: 4", "  rows: 4", f"  data: [{numbers}]"]


def write_kitti_sequences(files: SetFiles) -> None:
    """Write a numbered sequence for each way, below ``kitti``, and a table of their names.

    Source: A. Geiger et al., CVPR 2012; *devkit_odometry*.
    """
    root, names = files.folder / "kitti", ["sequence,name"]
    poses = make_folder(root / "poses")
    for number, way in enumerate(trajectories(files, "kitti")):
        left, right = way.pair("kitti")
        folder = make_folder(root / "sequences" / f"{number:02d}")
        for camera, views in ((_LEFT, left), (_RIGHT, right or ())):
            if views:
                make_folder(folder / f"image_{camera}")
            for place, view in enumerate(views):
                name = f"{place:06d}{view.image.suffix}"
                place_file(view.image, folder / f"image_{camera}" / name)
        apart = 0.0 if right is None else baseline(left[0], right[0]) or 0.0
        rows = []
        for camera in range(4):
            P = left[0].camera.projection(apart * (camera % 2)).ravel()
            rows.append(f"P{camera}: {' '.join(f'{value:.12e}' for value in P)}\n")
        write_text(folder / "calib.txt", "".join(rows))
        since = [(time - way.times[0]) / NANOSECONDS for time in way.times]
        write_text(folder / "times.txt", "".join(f"{time:.15e}\n" for time in since))
        write_text(poses / f"{number:02d}.txt", kitti_rows(_poses(left)))
        names.append(f"{number:02d},{way.name}")
    write_text(root / "sequences.csv", "\n".join(names) + "\n")


def _poses(views: Sequence[DataSetView]) -> list[Array]:
    return [view.camera_to_world for view in views]
