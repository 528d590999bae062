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
