"""Samples of surfaces moved into what they bound, so that solids are as large as they are.

All voxels that a surface crosses make a solid half a voxel larger on each side, and openings as
much narrower. Half a voxel further in those are full whose middles lie in the solid. Walls thinner
than a voxel go to their middle, and no gaps open where surfaces meet: rooms stay closed. What sinks
obliquely beside an edge would come out of the solid there, and narrow openings.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from .grid import Array, Grid
from .voxels import ways_of

_BOTH_SIDES = 0.3  # of the most that faces one way: a voxel with so much of the other has two sides
_THIN, _SMALLEST = 0.02, 1e-12  # voxels between them, at least; m²
_RIM = 1.5  # voxels long at most, in each
_NUDGE = 1e-4  # voxels
_REACH = 0.5  # voxels from the middle of the samples in a voxel to where their face ends
_LARGE = 0.2  # of a side of a voxel: what is smaller is the end of a thin thing
_EDGE, _PAST = 0.7, 0.1  # cosine of the turn from face to face, at most; voxels
_OUT = 0.3  # voxels: of windows in thick walls as much is open, in the mean, as there is

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


def out_of_edges(
    grid: Grid,
    own: NDArray[np.intp],
    cells: NDArray[np.intp],
    points: Array,
    normals: Array,
    areas: Array,
) -> Mask:
    """Which samples (m,) of solids fill voxels whose middles lie before another face, past an edge.

    That is the face closest to them, if all that fills them lies behind it: so are the sides of a
    window that is narrow. ``own`` are the voxels that samples lie in, ``cells`` those that they
    would fill.
    """
    faces, middle, facing = _faces(grid, own, points, normals, areas)
    if not len(faces):
        return np.zeros(len(own), bool)
    voxels, which = np.unique(cells, return_inverse=True)
    centre, closest = grid.centres()[voxels], _closest(grid, voxels, faces, middle, facing)
    # Of what fills each voxel: its mean normal, and whether any of it goes on beyond the face.
    normal, face = _unit(_sums(normals * areas[:, None], which, len(voxels))), closest[which]
    beyond = ((points - middle[face]) * facing[face]).sum(axis=1) > _PAST * grid.cell
    out = (closest >= 0) & (np.bincount(which, beyond, len(voxels)) == 0)
    out &= ((centre - middle[closest]) * facing[closest]).sum(axis=1) > _OUT * grid.cell
    out &= (normal * facing[closest]).sum(axis=1) < _EDGE
    return out[which]


def _closest(
    grid: Grid, voxels: NDArray[np.intp], faces: NDArray[np.intp], middle: Array, facing: Array
) -> NDArray[np.intp]:
    """Face in or next to each of some voxels (k,) that is closest to its middle, -1 for none."""
    number = np.full((grid.count + 1, 6), -1, np.intp)
    number.ravel()[faces] = np.arange(len(faces))
    place, centre = np.stack(np.unravel_index(voxels, grid.shape), axis=1), grid.centres()[voxels]
    least, closest = np.full(len(voxels), np.inf), np.full(len(voxels), -1, np.intp)
    for step in itertools.product((-1, 0, 1), repeat=3):
        at = _cells_at(grid, place + step)
        some, side = np.nonzero(number[at] >= 0)
        face = number[at[some], side]
        apart = (centre[some] - middle[face]) / grid.cell
        height = (apart * facing[face]).sum(axis=1)
        along = np.sqrt(np.maximum((apart**2).sum(axis=1) - height**2, 0.0))
        distance = np.hypot(height, np.maximum(along - _REACH, 0.0))
        # Of several faces of one voxel the closest comes last.
        order = np.argsort(-distance, kind="stable")
        some, face, distance = some[order], face[order], distance[order]
        nearer = distance < least[some]
        least[some[nearer]], closest[some[nearer]] = distance[nearer], face[nearer]
    return closest


def _faces(
    grid: Grid, own: NDArray[np.intp], points: Array, normals: Array, areas: Array
) -> tuple[NDArray[np.intp], Array, Array]:
    """What looks each way in voxels: six times the voxel and the way, middles, and normals."""
    ways = 6 * own + ways_of(normals)
    size = np.bincount(ways, areas, 6 * grid.count)
    weighed = (x * areas for x in (*normals.T, *points.T))
    sums = np.stack([np.bincount(ways, x, len(size)) for x in weighed], axis=1)
    middle = sums[:, 3:] / np.maximum(size, _SMALLEST)[:, None]
    faces = np.flatnonzero(size > _LARGE * grid.cell**2)
    # Where boxes of a wall touch there is no surface.
    other, axis = faces ^ 1, faces % 6 // 2
    touch = np.abs(middle[faces, axis] - middle[other, axis]) < _THIN * grid.cell
    touch &= size[faces] < (1.0 + _BOTH_SIDES) * size[other]
    faces = faces[~touch]
    return faces, middle[faces], _unit(sums[faces, :3])


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), _SMALLEST)


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
        other = number[_cells_at(grid, behind)]
        apart = way * (height[:, axis, side] - height[other, axis, 1 - side])
        # What touches has two sides as well, but nothing between them.
        thin = (other >= 0) & (apart > _THIN * grid.cell) & (apart < grid.cell)
        thin &= faces[:, axis, side] & faces[other, axis, 1 - side]
        found[thin, axis, side] = np.minimum(found[thin, axis, side], apart[thin])
    return found


def _cells_at(grid: Grid, place: NDArray[np.intp]) -> NDArray[np.intp]:
    """Cells at places (k, 3) of a grid, beyond it one more than all."""
    inside = ((place >= 0) & (place < grid.shape)).all(axis=1)
    return np.where(inside, grid.flat(np.where(inside[:, None], place, 0)), grid.count)


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
