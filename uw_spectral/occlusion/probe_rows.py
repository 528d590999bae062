"""Light of rows of probes, and its products."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .probes import RAYS

_ROWS = 32  # of a matrix product
Light = NDArray[np.float32]
Rows = slice | NDArray[np.intp]


def as_slice(rows: NDArray[np.intp]) -> Rows:
    """Return rows that follow one another as a slice, which copies nothing."""
    first, last = int(rows[0]), int(rows[-1])
    return slice(first, last + 1) if last - first + 1 == len(rows) else rows


def joined(found: Sequence[Sequence[Light]]) -> list[Light]:
    """Join what was found of parts of all probes, each of several things."""
    return [np.concatenate(parts) for parts in zip(*found, strict=True)]


def flat(x: Light) -> Light:
    """Return light in rows of its last axis."""
    return x.reshape(-1, x.shape[-1])


def product_of_rows(L: Light, weights: Light) -> Light:
    """Matrix product of radiances (n, m, RAYS) with weights, few rows at once.

    Small products are not shared out among threads, which are all at work already.
    """
    parts = [np.matmul(L[:, k : k + _ROWS], weights) for k in range(0, L.shape[1], _ROWS)]
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)


def by_band(x: Light) -> Light:
    """Return light (n, rows, RAYS) of columns of n bands."""
    return np.ascontiguousarray(x.T).reshape(x.shape[1], -1, RAYS)
