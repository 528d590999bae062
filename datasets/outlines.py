"""Outlines of masks: polygons along the edges of pixels."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.int64]


def outline(mask: NDArray[np.bool_]) -> Points:
    """Return one closed polygon that encloses a mask, shape (n, 2), x and y of pixels' corners.

    Parts and holes are joined by lines that are gone along twice, so that what lies inside by the
    even-odd rule is the mask exactly.
    """
    loops = _loops(mask)
    if not loops:
        return np.zeros((0, 2), np.int64)
    whole, *others = sorted(loops, key=len, reverse=True)
    for loop in others:
        apart = ((whole[:, None] - loop[None]) ** 2).sum(axis=-1)
        here, there = np.unravel_index(int(apart.argmin()), apart.shape)
        inner = np.roll(loop, -int(there), axis=0)
        whole = np.concatenate([whole[: here + 1], inner, inner[:1], whole[here:]])
    return whole


def _loops(mask: NDArray[np.bool_]) -> list[Points]:
    """Polygons with the mask to the right of the way, corners only."""
    inside = np.pad(np.asarray(mask, dtype=bool), 1)
    steps: defaultdict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    # Beside which the mask ends; where the edge starts, and where it leads, from the pixel.
    for (dy, dx), start, end in (
        ((-1, 0), (0, 0), (1, 0)),
        ((0, 1), (1, 0), (1, 1)),
        ((1, 0), (1, 1), (0, 1)),
        ((0, -1), (0, 1), (0, 0)),
    ):
        edge = inside & ~np.roll(inside, (-dy, -dx), axis=(0, 1))
        for y, x in np.argwhere(edge).tolist():
            steps[x - 1 + start[0], y - 1 + start[1]].append((x - 1 + end[0], y - 1 + end[1]))
    loops = []
    while steps:
        at = start = next(iter(steps))
        way, heading = [], (0, 0)
        while True:
            ahead = steps[at].pop()
            if not steps[at]:
                del steps[at]
            turned = (ahead[0] - at[0], ahead[1] - at[1])
            if turned != heading:
                way.append(at)
            at, heading = ahead, turned
            if at == start:
                break
        loops.append(np.array(way, dtype=np.int64))
    return loops
