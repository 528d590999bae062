"""Which of the voxels at the edges of surfaces are full, so that edges are in their place.

A voxel that a surface crosses from side to side is full: walls hold. One in which a surface ends is
covered in part; all such voxels would narrow gaps and make rails as thick as they are. Of them as
many are full as they are covered in the mean, always the same ones of a lattice.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from .grid import Array, Grid

_STEPS = 0.8191725133961645, 0.6710436067037893, 0.5497004779019703
"""Of a sequence that fills (0, 1) evenly along all axes: powers of the root of x⁴ = x + 1."""
_FIRST = 3e-3, 2e-3, 0.0  # of a side: which of two faces of an edge counts must not be chance
_UNIT = np.eye(3, dtype=np.intp)
_BESIDE = [steps for steps in itertools.product((-1, 0, 1), repeat=2) if any(steps)]


def left_free(
    grid: Grid, cells: NDArray[np.intp], normals: Array, areas: Array
) -> NDArray[np.intp]:
    """Return the voxels in which surfaces end and that are not full.

    ``cells`` are the voxels of samples of surfaces; normals of the two sides of an object are
    opposite; areas, m², are what samples stand for.
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
    number = np.where(_UNIT[axis], 0, place + np.asarray(grid.first))
    limit = number @ np.asarray(_STEPS) % 1.0
    few = np.flatnonzero(ways.max(axis=(1, 2), initial=0.0) < limit)
    facing = np.full(grid.shape, -1, np.int8)
    facing.ravel()[voxels] = axis
    # Beyond the grid surfaces go on.
    full = np.pad(facing >= 0, 1, constant_values=True)
    facing = np.pad(facing, 1, constant_values=-1)
    axis, place = axis[few], place[few] + 1
    ends = np.zeros(len(few), bool)
    # Where walls meet, little of the voxel between them is covered.
    beyond = [facing[tuple((place + k * _UNIT[axis]).T)] for k in (-1, 1)]
    meets = np.logical_or.reduce([(x >= 0) & (x != axis) for x in beyond])
    for one, other in _BESIDE:
        beside = place + one * _UNIT[(axis + 1) % 3] + other * _UNIT[(axis + 2) % 3]
        goes_on = [full[tuple((beside + k * _UNIT[axis]).T)] for k in (-1, 0, 1)]
        ends |= ~np.logical_or.reduce(goes_on)
    return voxels[few[ends & ~meets]]
