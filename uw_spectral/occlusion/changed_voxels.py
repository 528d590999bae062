"""What differs between two sets of voxels, and which rays it concerns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .grid import Array
from .voxels import SurfaceVoxels

_BLOCK = 8  # voxels along a side, of those that are looked at as one
_SLACK = 0.01  # of a voxel

Reals = NDArray[np.floating]


class ChangedVoxels:
    """Voxels in which the surfaces are not what they were."""

    def __init__(self, before: SurfaceVoxels, now: SurfaceVoxels) -> None:
        self.grid = now.grid
        was, full = before.number >= 0, now.number >= 0
        self.mask = was != full
        both = was & full
        one, other = before.number[both], now.number[both]
        differ = (before.middle[one] != now.middle[other]).any(axis=(1, 2))
        differ |= (before.facing[one] != now.facing[other]).any(axis=(1, 2))
        differ |= (before.extent[one] != now.extent[other]).any(axis=1)
        self.mask[both] = differ
        self.renumbered = now.number[was]
        """New number of each old surface, -1 where there is none any more."""
        places = np.argwhere(self.mask)
        blocks, which = np.unique(places // _BLOCK, axis=0, return_inverse=True)
        low = np.full((len(blocks), 3), np.iinfo(np.intp).max)
        high = np.zeros((len(blocks), 3), np.intp)
        np.minimum.at(low, which, places)
        np.maximum.at(high, which, places + 1)
        first = np.asarray(self.grid.lower)
        self._middles = first + (low + high) / 2.0 * self.grid.cell
        size = np.linalg.norm(high - low, axis=1)
        self._radii = (size / 2.0 + _SLACK) * self.grid.cell

    def __bool__(self) -> bool:
        return bool(self.mask.any())

    @property
    def parts(self) -> int:
        """Number of places where something has changed."""
        return len(self._radii)

    def crossed(
        self, origin: Reals, heading: Reals, length: Reals | float, around_end: float = 0.0
    ) -> NDArray[np.bool_]:
        """Which rays may pass a changed voxel, or end close to one; others do not.

        Rays count as far as their length, m; ``around_end`` is the distance of their end from a
        changed voxel, m.
        """
        found = np.zeros(np.broadcast_shapes(origin.shape, heading.shape)[:-1], bool)
        for middle, radius in zip(self._middles, self._radii, strict=True):
            to = (middle - origin).astype(np.float32)
            along = _dot(to, heading)
            squared = (to * to).sum(axis=-1)
            off = squared - along * along
            near = (off <= radius * radius * 1.001) & (along > -radius) & (along < length + radius)
            if around_end:
                reach = radius + around_end
                near |= squared - length * (2.0 * along - length) <= reach * reach * 1.001
            found |= near
        return found

    def between(self, low: Array, high: Array) -> NDArray[np.bool_]:
        """Whether there is a changed voxel in boxes with such corners, (m, 3), m."""
        total = np.pad(self.mask.astype(np.int32), ((1, 0),) * 3)
        for axis in range(3):
            np.cumsum(total, axis=axis, out=total)
        shape = np.asarray(self.grid.shape)
        first = np.floor((low - self.grid.lower) / self.grid.cell - _SLACK).astype(np.intp)
        last = np.ceil((high - self.grid.lower) / self.grid.cell + _SLACK).astype(np.intp)
        (x, y, z), (u, v, w) = (np.clip(at, 0, shape).T for at in (first, last))
        upper = total[u, v, w] - total[x, v, w] - total[u, y, w] + total[x, y, w]
        lower = total[u, v, z] - total[x, v, z] - total[u, y, z] + total[x, y, z]
        return upper > lower


def _dot(to: NDArray[np.float32], heading: Reals) -> Reals:
    x, y, z = (to[..., k] * heading[..., k] for k in range(3))
    return x + y + z
