"""Triangles, as arrays of corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def quartered(corners: NDArray) -> NDArray:
    """Split triangles (t, 3, 3) at the middles of their edges, (4 t, 3, 3).

    Examples
    --------
    >>> quartered(np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]]))[3].tolist()
    [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def cut_across(corners: NDArray, counts: NDArray[np.intp]) -> tuple[NDArray, NDArray[np.intp]]:
    """Cut triangles (t, 3, 3) along their shortest edge into so many slices of one width, (t,).

    Returns triangles (m, 3, 3), two a slice, one at the tip, and of which they are parts, (m,).

    Examples
    --------
    >>> parts, _ = cut_across(np.array([[[0.0, 0, 0], [0, 1, 0], [4, 0, 0]]]), np.array([2]))
    >>> parts[:, :, 0].tolist()
    [[4.0, 2.0, 2.0], [2.0, 0.0, 0.0], [2.0, 0.0, 2.0]]
    """
    edges = np.roll(corners, -1, axis=1) - corners
    shortest = (edges**2).sum(axis=2).argmin(axis=1)
    each = np.arange(len(corners))
    a, b, tip = (corners[each, (shortest + k) % 3] for k in range(3))
    which = np.repeat(each, counts)
    number = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    ends = [((number + k) / counts[which]).astype(corners.dtype)[:, None] for k in (0, 1)]
    one, other = ([tip[which] + (x - tip)[which] * end for end in ends] for x in (a, b))
    rest = number > 0
    parts = (one[0], one[1], other[1]), (one[0][rest], other[1][rest], other[0][rest])
    found = np.concatenate([np.stack(part, axis=1) for part in parts])
    return found, np.concatenate([which, which[rest]])
