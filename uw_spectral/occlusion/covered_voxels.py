"""Which of the voxels at the edges of surfaces are full, so that edges are in their place.

A voxel that a surface crosses from side to side is full: walls hold. One in which a surface ends is
covered in part; all such voxels would narrow gaps and make rails as thick as they are. Of them as
many are full as they are covered in the mean, always the same ones of a lattice; so are those with
slits, narrower than a voxel, of walls along the axes, and those of nets and leaves, which let light
through.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from .grid import Array, Grid

_STEPS = 0.8191725133961645, 0.6710436067037893, 0.5497004779019703
"""Of a sequence that fills (0, 1) evenly along all axes: powers of the root of x⁴ = x + 1."""
_FIRST = 3e-3, 2e-3, 0.0  # of a side: which of two faces of an edge counts must not be chance
_SOLID = 0.95  # of a voxel: so much of it covered is a wall without slits
_ALIGNED = 0.99  # of its area a wall shows along an axis; oblique ones would seem to have slits
_NARROW = 1e-9  # voxels
_UNIT = np.eye(3, dtype=np.intp)
_BESIDE = [steps for steps in itertools.product((-1, 0, 1), repeat=2) if any(steps)]


def full_enough(grid: Grid, points: Array, coverage: Array) -> NDArray[np.bool_]:
    """Which samples fill their voxels, where these stop a fraction of the light, (m,)."""
    full = coverage >= _SOLID
    some = np.flatnonzero(~full)
    place = np.floor((points[some] - grid.lower) / grid.cell) + np.asarray(grid.first)
    full[some] = coverage[some] >= _limit(place)
    return full


def _limit(number: NDArray) -> Array:
    """How much of voxels, counted along a lattice (m, 3), must be covered that they are full."""
    return np.asarray(number @ np.asarray(_STEPS) % 1.0)


def left_free(
    grid: Grid,
    cells: NDArray[np.intp],
    normals: Array,
    areas: Array,
    thin: NDArray[np.bool_],
    covered: Array,
) -> NDArray[np.intp]:
    """Return the voxels in which surfaces end and that are not full.

    ``cells`` are the voxels of samples of surfaces; normals of the two sides of an object are
    opposite; areas, m², are what samples stand for; ``thin`` tells which are of walls thinner than
    a voxel, ``covered`` how much of a voxel these cover.
    """
    voxels, which = np.unique(cells, return_inverse=True)
    part = normals * (areas / grid.cell**2)[:, None]
    # An object thinner than a voxel shows one side to each way.
    sides = [
        np.bincount(which, np.maximum(s * x, 0.0), len(voxels)) for x in part.T for s in (1, -1)
    ]
    ways = np.stack(sides, axis=1).reshape(-1, 3, 2)
    place = np.stack(np.unravel_index(voxels, grid.shape), axis=1)
    axis = (ways.sum(axis=2) + _FIRST).argmax(axis=1)
    # All that lie behind one another in a wall alike, or few would be free through and through.
    limit = _limit(np.where(_UNIT[axis], 0, place + np.asarray(grid.first)))
    few = np.flatnonzero(ways.max(axis=(1, 2), initial=0.0) < limit)
    number = np.full(grid.shape, -1, np.intp)
    number.ravel()[voxels] = np.arange(len(voxels))
    number = np.pad(number, 1, constant_values=-1)
    # Beyond the grid surfaces go on.
    full = np.pad(number[1:-1, 1:-1, 1:-1] >= 0, 1, constant_values=True)
    of_wall = _of_wall(grid, which, ways, areas, thin)[few]
    axes = np.append(axis, -1)
    axis, place = axis[few], place[few] + 1
    column = [(place + k * _UNIT[axis]).T for k in (-1, 0, 1)]
    # A wall may lie between two layers of voxels.
    part = np.sum([covered[(*some, axis)] for some in column], axis=0).max(axis=1)
    ends = of_wall & (part < np.minimum(limit[few], _SOLID))
    # Where walls meet, little of the voxel between them is covered.
    beyond = [number[tuple(some)] for some in column[::2]]
    meets = np.logical_or.reduce([(some >= 0) & (axes[some] != axis) for some in beyond])
    for one, other in _BESIDE:
        beside = place + one * _UNIT[(axis + 1) % 3] + other * _UNIT[(axis + 2) % 3]
        goes_on = [full[tuple((beside + k * _UNIT[axis]).T)] for k in (-1, 0, 1)]
        ends |= ~np.logical_or.reduce(goes_on)
    return voxels[few[ends & ~meets]]


def covered_by_walls(
    grid: Grid, points: Array, normals: Array, areas: Array, extents: Array
) -> Array:
    """Fraction of voxels that walls cover, along axes either way, (nx + 2, ny + 2, nz + 2, 3, 2).

    There is one more around the grid. Samples are spread over what they stand for, or else
    solid walls would seem to have slits.
    """
    shape = np.add(grid.shape, 2)
    axis = np.abs(normals).argmax(axis=1)
    facing = normals[np.arange(len(axis)), axis]
    whole = np.isfinite(extents).all(axis=1)
    area = np.where(whole, np.abs(facing) * areas / grid.cell**2, 1.0)
    position = (points - grid.lower) / grid.cell + 1.0
    half = np.where(whole[:, None], extents, 0.0) / (2.0 * grid.cell)
    half[np.arange(len(axis)), axis] = 0.0
    low = np.floor(position - half).astype(np.intp)
    in_low = np.clip((low + 1.0 - position + half) / np.maximum(2.0 * half, _NARROW), 0.0, 1.0)
    ways, parts = [], []
    for step in itertools.product((0, 1), repeat=3):
        part = np.where(step, 1.0 - in_low, in_low).prod(axis=1) * area
        some = np.flatnonzero(part > 0)
        at = np.clip(low[some] + step, 0, shape - 1)
        cell = (at[:, 0] * shape[1] + at[:, 1]) * shape[2] + at[:, 2]
        ways.append(6 * cell + 2 * axis[some] + (facing[some] < 0))
        parts.append(part[some])
    found = np.bincount(np.concatenate(ways), np.concatenate(parts), 6 * math.prod(shape))
    # What reaches into the grid from beyond it is not among the samples.
    inner = np.zeros(shape, bool)
    inner[2:-2, 2:-2, 2:-2] = True
    return np.where(inner[..., None, None], found.reshape(*shape, 3, 2), 1.0)


def _of_wall(
    grid: Grid, which: NDArray[np.intp], ways: Array, areas: Array, thin: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether all that is in a voxel is a wall along an axis, which is thinner than it."""
    total = np.bincount(which, areas, len(ways)) / grid.cell**2
    aligned = ways.sum(axis=2).max(axis=1) > _ALIGNED * total
    return aligned & (np.bincount(which, ~thin, len(ways)) == 0)
