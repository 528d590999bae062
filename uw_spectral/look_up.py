"""Values between the entries of a table: the one interpolation of arrays."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray


def multilinear(
    values: NDArray[np.floating],
    places: Sequence[ArrayLike],
    first: tuple[NDArray[np.intp], ...] = (),
) -> NDArray[np.float64]:
    """Interpolate linearly between entries; beyond its ends a table goes on as it ends.

    Values have shape (..., n); places are entries of each axis but the last, of one shape.
    ``first`` are entries of axes before those, taken as they are.
    """
    ends = []
    for place, count in zip(places, values.shape[len(first) :], strict=False):
        at = np.asarray(place, np.float64)
        # Not clip, which takes many times as long on few numbers.
        low = np.minimum(np.maximum(np.floor(at).astype(np.intp), 0), max(count - 2, 0))
        fraction = (at - low)[..., None]
        ends.append(((low, 1.0 - fraction), (np.minimum(low + 1, count - 1), fraction)))
    total = np.zeros(values.shape[-1])
    for corner in itertools.product(*ends):
        index, fractions = zip(*corner, strict=True)
        total = total + values[(*first, *index)] * math.prod(fractions)
    return total


def multilinear_of_columns(
    values: NDArray[np.floating], places: Sequence[ArrayLike]
) -> NDArray[np.float64]:
    """Interpolate at places whose last axis has one entry, as that of values has n.

    Places have shape (..., 1), or none.
    """
    found = (np.asarray(place) for place in places)
    return multilinear(values, [at[..., 0] if at.ndim else at for at in found])
