"""Water from which objects beside it hide a part of the light from above.

Whether a few directions are free is looked for in all voxels at once, along the lines of their
lattice: for finding where occlusion is worth computing, not for computing it.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Step = tuple[int, int, int]

_STEPS: tuple[tuple[Step, Step], ...] = (
    ((2, 0, 1), (1, 0, 0)),
    ((1, 0, 1), (0, 0, 0)),
    ((1, 0, 2), (0, 0, 1)),
    ((2, 2, 1), (1, 1, 0)),
    ((1, 1, 1), (0, 0, 0)),
    ((1, 1, 2), (0, 0, 1)),
)
"""Steps along a ray, in voxels, and the place that is looked at between two; elevations of 19° to
63°. Of uniform light from above, each brings a level surface about as much as another."""
RAYS = 4 * len(_STEPS)


def hidden_rays(full: Mask) -> NDArray[np.uint8]:
    """Return how many of :data:`RAYS` upward directions are closed to each voxel.

    Voxels beyond the box are full.
    """
    count = np.zeros(full.shape, np.uint8)
    for step, between in _STEPS:
        for turn in range(4):
            count += _closed(full, _turned(step, turn), _turned(between, turn))
    return count


def _closed(full: Mask, step: Step, between: Step) -> Mask:
    """Voxels from which a ray in steps meets a full one."""
    seen = full.copy() if any(between) else full
    if any(between):
        _join(seen, full, (-between[0], -between[1], -between[2]))
    closed = np.zeros_like(full)
    _join(closed, seen, step)
    # Of as many steps as are known to be closed or not, twice as many are.
    longest = min(math.ceil(n / abs(s)) for n, s in zip(full.shape, step, strict=True) if s)
    known = 1
    while known < longest:
        _join(closed, closed.copy(), tuple(known * s for s in step))
        known *= 2
    return closed


def _join(closed: Mask, other: Mask, step: tuple[int, ...]) -> None:
    """Close voxels from which the one at a step is closed in another mask."""
    here, there = [], []
    for s in step:
        here.append(slice(max(-s, 0), -s if s > 0 else None))
        there.append(slice(max(s, 0), s if s < 0 else None))
    closed[tuple(here)] |= other[tuple(there)]


@functools.lru_cache(maxsize=32)
def _turned(step: Step, quarters: int) -> Step:
    x, y, z = step
    for _ in range(quarters):
        x, y = -y, x
    return x, y, z
