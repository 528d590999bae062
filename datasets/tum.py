"""Sequences of the TUM RGB-D benchmark: pictures and depth with times, and where the camera was."""

from __future__ import annotations

import numpy as np

from ..uw_spectral.spectra.spectral_image import write_codes
from .files import make_folder, place_file, write_text
from .set_files import SetFiles
from .trajectories import matrices, trajectories
from .trajectory_files import seconds, tum_rows

DEPTH_SCALE = 5000
"""Codes of depth in a metre."""
_MOST = np.iinfo(np.uint16).max


def write_tum_sequences(files: SetFiles) -> None:
    """Write a sequence for each way and camera, below ``tum``.

    Depth is planar; 0 where nothing is seen or it is above 13.1 m, where 16 bits end.

    References
    ----------
    J. Sturm et al., IROS 2012; *File formats*.
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
                codes = files.planar_depth(view).astype(np.float64) * DEPTH_SCALE
                codes = np.where(codes > _MOST, 0.0, np.minimum(codes, _MOST))
                depth = f"depth/{seconds(time)}.png"
                write_codes(folder / depth, np.round(codes).astype(np.uint16))
                for kind, path in (("rgb", rgb), ("depth", depth)):
                    lists[kind].append(f"{seconds(time)} {path}")
            for kind, rows in lists.items():
                write_text(folder / f"{kind}.txt", "\n".join(("# timestamp filename", *rows, "")))
            write_text(folder / "groundtruth.txt", tum_rows(matrices(views), way.times))
