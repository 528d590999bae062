"""Optical flow: where what a picture shows is in the next one; and Middlebury's ``.flo``.

It follows from depth and the two poses, exactly, but for what moves, where it is Blender's own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.spectra.spectral_image import replacing
from .axes import Array
from .depth_maps import PLANAR, euclidean_range, world_positions
from .files import make_folder, write_text
from .set_files import SetFiles
from .trajectories import trajectories
from .view import DataSetView

UNKNOWN = 1e10
"""What a ``.flo`` holds where there is no flow; its readers take all above 1e9 for that."""
VISIBLE, HIDDEN, OUTSIDE = 0, 1, 100
"""Of a mask of flow, as TartanAir has it: whether the next picture shows the same."""
_TAG = b"PIEH"
MOTION = "motion"
_SAME = 0.01  # of the depth, within which the next picture shows the same and not what hides it
_MOVED, _CUT = 0.5, 2.0**-8  # pixels, and of the motion, which has eleven binary digits


def optical_flow(view: DataSetView, depth: ArrayLike, following: DataSetView) -> Array:
    """Return where each pixel's content is in another picture, less where it is in this one.

    ``depth`` is the planar depth of the first, m, shape (height, width), infinite where nothing is
    seen. The flow, shape (height, width, 2), is pixels to the right and down; NaN where nothing is
    seen, and behind the other camera.
    """
    here = view.camera.lens_camera().pixel_centres()
    there = following.project(_points(view, depth))
    return np.where(np.isfinite(np.asarray(depth))[..., None], there - here, np.nan)


def flow_between(files: SetFiles, view: DataSetView, other: DataSetView) -> Array:
    """Return the flow from a view to the one before or after it, as :func:`optical_flow` has it.

    Where the layer ``motion`` of the two, if they are rendered as frames in turn, tells of another
    it is taken: there something moves.
    """
    layers = files.layers(view)
    exact = optical_flow(view, layers[PLANAR], other)
    here, there = (each.metadata.get("frame", 0) for each in (view, other))
    if MOTION not in layers or abs(there - here) != 1:
        return exact
    motion = layers[MOTION].astype(np.float64)
    # Blender's is to where it was, and from where it will be; right and up.
    moved = motion[..., 2:] * (-1, 1) if there > here else motion[..., :2] * (1, -1)
    size = np.linalg.norm(moved, axis=-1)
    apart = np.linalg.norm(moved - exact, axis=-1)
    return np.where((apart > np.maximum(_MOVED, _CUT * size))[..., None], moved, exact)


def flow_mask(
    view: DataSetView, depth: ArrayLike, following: DataSetView, next_depth: ArrayLike
) -> NDArray[np.uint8]:
    """Return whether the other picture shows the same: 0, 1 if it is hidden, 100 if outside.

    Planar depths of both have the shape (height, width), m.
    """
    points, flow = _points(view, depth), optical_flow(view, depth, following)
    here = view.camera.lens_camera().pixel_centres()
    at = np.floor(here + np.nan_to_num(flow, nan=-1e9)).astype(np.int64)
    wide, high = following.camera.width, following.camera.height
    inside = (at >= 0).all(axis=-1) & (at[..., 0] < wide) & (at[..., 1] < high)
    pose = following.world_to_opencv
    ahead = points @ pose[2, :3] + pose[2, 3]
    seen = np.asarray(next_depth)[at[..., 1].clip(0, high - 1), at[..., 0].clip(0, wide - 1)]
    hidden = ahead > seen * (1.0 + _SAME)
    return np.where(inside, np.where(hidden, HIDDEN, VISIBLE), OUTSIDE).astype(np.uint8)


def write_flo(path: Path, flow: ArrayLike) -> None:
    """Write a flow, NaN where there is none; whole under its name, or not at all.

    Source: S. Baker et al., Int. J. Comput. Vis. 92, 1 (2011); *flow-code*.
    """
    values = np.nan_to_num(np.asarray(flow), nan=UNKNOWN).astype("<f4")
    size = np.array(values.shape[1::-1], dtype="<i4")
    with replacing(path) as temporary:
        temporary.write_bytes(_TAG + size.tobytes() + values.tobytes())


def write_flows(files: SetFiles) -> None:
    """Write the flow from each view to the next of its way, that back, and a table of them."""
    folder, rows = make_folder(files.folder / "flow"), ["flow,view,next"]
    for way in trajectories(files, "flow"):
        for views in way.cameras.values():
            for here, there in way.steps:
                pair = views[here], views[there]
                for end, (view, other) in (("", pair), ("_back", pair[::-1])):
                    name = f"{view.name}{end}.flo"
                    write_flo(folder / name, flow_between(files, view, other))
                    rows.append(f"{name},{view.name},{other.name}")
    write_text(folder / "flow.csv", "\n".join(rows) + "\n")


def _points(view: DataSetView, depth: ArrayLike) -> Array:
    distances = euclidean_range(depth, view.camera)
    return world_positions(distances, view.camera, view.camera_to_world)
