"""Known points of a scene, from the depth of its pictures, and where the views see them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .axes import Array, inverse
from .camera import PIXEL_CENTRE
from .quantities import generator
from .view import DataSetView

_SAME = 0.01  # of the depth, within which a view sees a point and not what hides it


@dataclass(frozen=True)
class SparsePoint:
    """A point of the scene, and where it is seen: image coordinates by the name of the view.

    ``position`` is in world coordinates, m; ``colour`` 0 to 255.
    """

    position: tuple[float, float, float]
    colour: tuple[int, int, int]
    seen: Mapping[str, tuple[float, float]]


def sparse_points(
    views: Sequence[DataSetView],
    depth_of: Callable[[DataSetView], Array],
    picture_of: Callable[[DataSetView], NDArray[np.uint8]],
    count: int,
    seed: int = 0,
) -> list[SparsePoint]:
    """Return ``count`` points at the centres of pixels of each view, and the views that see each.

    ``views`` show one scene that does not move. ``depth_of`` returns the planar depth of a view,
    shape (height, width), m, infinite where nothing is seen; ``picture_of`` its picture, shape
    (height, width, 3).
    """
    depths = {view.name: depth_of(view) for view in views}
    found = []
    for view in views:
        depth = depths[view.name]
        there = np.argwhere(np.isfinite(depth) & (depth > 0))
        if not len(there):
            continue
        chosen = generator(seed, "points", view.name).choice(
            len(there), min(count, len(there)), replace=False
        )
        rows, columns = there[np.sort(chosen)].T
        rays = view.camera.rays()[rows, columns]
        local = rays / rays[:, 2:] * depth[rows, columns, None]
        pose = inverse(view.world_to_opencv)
        world = local @ pose[:3, :3].T + pose[:3, 3]
        colours = picture_of(view)[rows, columns]
        seen = {other.name: _seen(other, depths[other.name], world) for other in views}
        # Its own picture sees a point where it was taken.
        own = np.stack([columns, rows], axis=-1) + PIXEL_CENTRE
        seen[view.name] = own.astype(np.float64)
        for number, (place, colour) in enumerate(zip(world, colours, strict=True)):
            x, y, z = place.tolist()
            red, green, blue = colour.tolist()
            places = {
                name: (float(at[number, 0]), float(at[number, 1]))
                for name, at in seen.items()
                if np.isfinite(at[number]).all()
            }
            found.append(SparsePoint((x, y, z), (red, green, blue), places))
    return found


def _seen(view: DataSetView, depth: Array, points: Array) -> Array:
    """Image coordinates of points that a view sees, shape (m, 2); NaN for others."""
    at = view.project(points)
    pose = view.world_to_opencv
    far = points @ pose[2, :3] + pose[2, 3]
    cell = np.floor(np.nan_to_num(at, nan=-1.0)).astype(int)
    inside = (
        (cell >= 0).all(axis=1)
        & (cell[:, 0] < view.camera.width)
        & (cell[:, 1] < view.camera.height)
    )
    column, row = np.where(inside[:, None], cell, 0).T
    same = inside & (np.abs(depth[row, column] - far) < _SAME * far)
    return np.where(same[:, None], at, np.nan)
