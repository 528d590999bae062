"""Samples of surfaces moved into what they bound, so that solids are as large as they are.

All voxels that a surface crosses make a solid half a voxel larger on each side, and openings as
much narrower. Half a voxel further in those are full whose middles lie in the solid. Walls thinner
than a voxel go to their middle, and no gaps open where surfaces meet: rooms stay closed.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from .grid import Array, Grid

_BOTH_SIDES = 0.3  # of the most that faces one way: a voxel with so much of the other has two sides
_THIN, _SMALLEST = 0.02, 1e-12  # voxels between them, at least; m²
_RIM = 1.5  # voxels long at most, in each
_NUDGE = 1e-4  # voxels

Mask = NDArray[np.bool_]


def sunk(
    grid: Grid, cells: NDArray[np.intp], points: Array, normals: Array, areas: Array
) -> tuple[Array, Mask, Mask]:
    """Return where samples (m, 3) in cells (m,) fill voxels.

    And which are of the sides of walls thinner than a voxel, and which of the rims of such walls,
    that fill nothing. Normals are outward, areas in m².
    """
    voxels, which = np.unique(cells, return_inverse=True)
    ways = np.maximum(normals[:, :, None] * [1, -1] * areas[:, None, None], 0.0)
    size = _sums(ways, which, len(voxels))
    height = _sums(ways * points[:, :, None], which, len(voxels)) / np.maximum(size, _SMALLEST)
    faces = size > _BOTH_SIDES * size.max(axis=(1, 2))[:, None, None]
    thickness = _thickness(grid, voxels, height, faces)
    axis, each = np.abs(normals).argmax(axis=1), np.arange(len(normals))
    facing = normals[each, axis]
    own = thickness[which, axis, np.where(facing > 0.0, 0, 1)]
    thin = np.isfinite(own)
    to_middle = np.where(thin, 0.5 * own, 0.0) * np.abs(facing)
    depth = np.where(thin, to_middle, 0.5 * grid.cell * np.abs(normals).sum(axis=1))
    # What lies between two voxels fills one of them.
    places = points - normals * depth[:, None] + thin[:, None] * (_NUDGE * grid.cell)
    # What touches, as boxes of a wall do, has two sides of one area there, and is no surface.
    others = np.abs(_sums(normals * (areas * ~thin)[:, None], which, len(voxels))).sum(axis=1)
    thickest = np.where(np.isfinite(thickness), thickness, 0.0).max(axis=(1, 2))
    has_rim = (thickest > 0.0) & (others <= _RIM * grid.cell * thickest)
    return places, thin, has_rim[which] & ~thin


def _thickness(grid: Grid, voxels: NDArray[np.intp], height: Array, faces: Mask) -> Array:
    """Thickness in m behind what looks each way in voxels (k,), if it is less than one, (k, 3, 2).

    Else it is infinite. The other side lies in the same voxel, or in the next one.
    """
    number = np.full(grid.count + 1, -1, np.intp)
    number[voxels] = np.arange(len(voxels))
    place = np.stack(np.unravel_index(voxels, grid.shape), axis=1)
    found = np.full(height.shape, np.inf)
    for axis, side, step in itertools.product(range(3), (0, 1), (0, 1)):
        way = 1 - 2 * side
        behind = place - way * step * np.eye(3, dtype=np.intp)[axis]
        inside = ((behind >= 0) & (behind < grid.shape)).all(axis=1)
        other = number[
            np.where(inside, grid.flat(np.where(inside[:, None], behind, 0)), grid.count)
        ]
        apart = way * (height[:, axis, side] - height[other, axis, 1 - side])
        # What touches has two sides as well, but nothing between them.
        thin = (other >= 0) & (apart > _THIN * grid.cell) & (apart < grid.cell)
        thin &= faces[:, axis, side] & faces[other, axis, 1 - side]
        found[thin, axis, side] = np.minimum(found[thin, axis, side], apart[thin])
    return found


def _sums(values: Array, which: NDArray[np.intp], count: int) -> Array:
    flat = values.reshape(len(values), math.prod(values.shape[1:])).T
    sums = [np.bincount(which, x, count) for x in flat]
    return np.stack(sums, axis=1).reshape(count, *values.shape[1:])


def gaps(grid: Grid, cells: NDArray[np.intp], crossed: NDArray[np.intp]) -> Mask:
    """Voxels that close gaps between full cells which only touch along an edge, shape of the grid.

    Such voxels are among those that surfaces cross.
    """
    full, own = (_mask(grid, some) for some in (cells, crossed))
    found = np.zeros_like(full)
    low, high = slice(None, -1), slice(1, None)
    for axes in itertools.combinations(range(3), 2):
        corners: list[tuple[slice, ...]] = []
        for ends in itertools.product((low, high), repeat=2):
            corner = [slice(None)] * 3
            for axis, end in zip(axes, ends, strict=True):
                corner[axis] = end
            corners.append(tuple(corner))
        a, b, c, d = corners
        for one, other, left, right in ((a, d, b, c), (b, c, a, d)):
            gap = full[one] & full[other] & ~full[left] & ~full[right]
            found[left] |= gap & own[left]
            found[right] |= gap & own[right] & ~own[left]
    return found


def _mask(grid: Grid, cells: NDArray[np.intp]) -> Mask:
    found = np.zeros(grid.shape, bool)
    found.ravel()[cells] = True
    return found
