"""Sequences of KITTI's odometry benchmark: pictures, calibration, times and poses."""

from __future__ import annotations

import numpy as np

from .camera import PinholeCamera
from .files import make_folder, place_file, write_text
from .set_files import SetFiles
from .trajectories import baseline, matrices, trajectories
from .trajectory_files import NANOSECONDS, kitti_rows

LEFT, RIGHT = 2, 3
"""Numbers of the colour cameras; 0 and 1 are the same in grey, and have no pictures here."""


def write_kitti_sequences(files: SetFiles) -> None:
    """Write a numbered sequence for each way, below ``kitti``, and a table of their names.

    References
    ----------
    A. Geiger et al., CVPR 2012; *devkit_odometry*.
    """
    root, names = files.folder / "kitti", ["sequence,name"]
    poses = make_folder(root / "poses")
    for number, way in enumerate(trajectories(files, "kitti")):
        left, right = way.pair("kitti")
        folder = make_folder(root / "sequences" / f"{number:02d}")
        for camera, views in ((LEFT, left), (RIGHT, right or ())):
            if views:
                make_folder(folder / f"image_{camera}")
            for place, view in enumerate(views):
                name = f"{place:06d}{view.image.suffix}"
                place_file(view.image, folder / f"image_{camera}" / name)
        apart = 0.0 if right is None else baseline(left[0], right[0]) or 0.0
        rows = [
            f"P{camera}: {projection_row(left[0].camera, apart * (camera % 2))}"
            for camera in range(4)
        ]
        write_text(folder / "calib.txt", "\n".join(rows) + "\n")
        since = [(time - way.times[0]) / NANOSECONDS for time in way.times]
        write_text(folder / "times.txt", "".join(f"{time:.15e}\n" for time in since))
        write_text(poses / f"{number:02d}.txt", kitti_rows(matrices(left)))
        names.append(f"{number:02d},{way.name}")
    write_text(root / "sequences.csv", "\n".join(names) + "\n")


def projection_row(camera: PinholeCamera, right: float) -> str:
    """Return the 3×4 projection, in a row, of a camera that stands to the right (m)."""
    matrix = np.c_[camera.K_opencv, (-camera.fx * right, 0.0, 0.0)]
    return " ".join(f"{value:.12e}" for value in matrix.ravel())
