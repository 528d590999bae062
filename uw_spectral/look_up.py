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

    Parameters
    ----------
    values : array, shape (..., n)
    places : sequence of array_like
        Of each axis but the last, in entries, of one shape.
    first : tuple of arrays
        Entries of axes before those of ``places``, taken as they are.

    Returns
    -------
    array, shape (..., n)

    Examples
    --------
    >>> multilinear(np.arange(4.0).reshape(2, 2, 1), (1.0, 0.5))
    array([2.5])
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

    Parameters
    ----------
    values, places
        As of :func:`multilinear`; places of shape (..., 1), or of no shape.

    Returns
    -------
    array, shape (..., n)
    """
    found = (np.asarray(place) for place in places)
    return multilinear(values, [at[..., 0] if at.ndim else at for at in found])
