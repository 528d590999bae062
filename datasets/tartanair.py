"""Trajectories of TartanAir: pictures, depth, flow and masks as numpy has them, poses in NED."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.spectral_image import replacing
from .axes import Array, placed, quaternion, turned
from .files import make_folder, place_file, write_text
from .optical_flow import flow_between, flow_mask
from .picture_codes import read_codes
from .set_files import SetFiles
from .trajectories import Trajectory, trajectories
from .view import DataSetView

_WORLD = placed(((0, 1, 0), (1, 0, 0), (0, 0, -1)), (0, 0, 0))
"""From our world to north (+y), east (+x), down."""
_BODY = placed(((0, 1, 0), (0, 0, 1), (1, 0, 0)), (0, 0, 0))
"""From a camera that looks along x, with y to the right and z down, to OpenCV's axes."""


def write_tartanair(files: SetFiles) -> None:
    """Write each way as ``tartanair/NAME/Easy/P000``.

    Depth is planar, m, infinite where nothing is seen; the mask of the flow is 100 there.

    Source: W. Wang et al., IROS 2020; *tartanair_tools*, data type.
    """
    for way in trajectories(files, "tartanair"):
        folder = make_folder(files.folder / "tartanair" / way.name / "Easy" / "P000")
        left, right = way.pair("tartanair")
        for side, views in (("left", left), ("right", right or ())):
            for number, view in enumerate(views):
                _view(files, folder, side, number, view)
            if views:
                rows = [" ".join(map(repr, ned_row(view.camera_to_world))) for view in views]
                write_text(folder / f"pose_{side}.txt", "\n".join(rows) + "\n")
        _flow(files, folder, way, left)


def ned_row(camera_to_world: Array) -> list[float]:
    """Return ``tx ty tz qx qy qz qw`` in north, east, down, the camera looking along its x.

    Examples
    --------
    >>> ned_row(placed(((1, 0, 0), (0, 0, -1), (0, 1, 0)), (1.0, 2.0, -3.0)))  # looks north, level
    [2.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0]
    """
    pose = _WORLD @ turned(camera_to_world) @ _BODY
    w, x, y, z = quaternion(pose[:3, :3]).tolist()
    return [*pose[:3, 3].tolist(), x, y, z, w]


def write_array(path: Path, values: NDArray[Any]) -> None:
    """Write an array as numpy has it; whole under its name, or not at all."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.save(file, values)


def _view(files: SetFiles, folder: Path, side: str, number: int, view: DataSetView) -> None:
    names = {kind: make_folder(folder / f"{kind}_{side}") for kind in ("image", "depth", "seg")}
    place_file(view.image, names["image"] / f"{number:06d}_{side}{view.image.suffix}")
    depth = files.planar_depth(view).astype(np.float32)
    write_array(names["depth"] / f"{number:06d}_{side}_depth.npy", depth)
    if view.instance_map is not None:
        path = names["seg"] / f"{number:06d}_{side}_seg.npy"
        write_array(path, read_codes(view.instance_map))


def _flow(files: SetFiles, folder: Path, way: Trajectory, views: tuple[DataSetView, ...]) -> None:
    make_folder(folder / "flow")
    for here, there in way.steps:
        view, following = views[here], views[there]
        depth, next_depth = files.planar_depth(view), files.planar_depth(following)
        flow = np.nan_to_num(flow_between(files, view, following)).astype(np.float32)
        name = f"{here:06d}_{there:06d}"
        write_array(folder / "flow" / f"{name}_flow.npy", flow)
        mask = flow_mask(view, depth, following, next_depth)
        write_array(folder / "flow" / f"{name}_mask.npy", mask)
