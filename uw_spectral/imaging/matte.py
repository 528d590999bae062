"""A picture without its open water, to be laid over another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_NEAREST = 2  # pixels about one, in which open water is looked for first


def without_open_water(
    picture: NDArray[np.floating], alpha: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Return a picture with alpha, by which its colours are multiplied, shape (height, width, 4).

    Where a pixel shows some open water, that is taken to be as in the pixels about it; water before
    an object belongs to the object.

    ``alpha`` is what fraction of a pixel is no open water.
    """
    fraction = np.clip(alpha, 0.0, 1.0)[..., None]
    left = picture - (1.0 - fraction) * _water_behind(picture, fraction)
    # Noise should not leave less than nothing.
    colours = np.where(fraction > 0.0, np.maximum(left, np.minimum(picture, 0.0)), 0.0)
    return np.concatenate([colours, fraction], axis=-1).astype(np.float32)


def _water_behind(
    picture: NDArray[np.floating], fraction: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Return the mean of the nearest open water; without any, the picture itself."""
    open_water = fraction == 0.0
    if not open_water.any():
        return picture
    found, missing = np.array(picture, np.float64), (fraction > 0.0) & (fraction < 1.0)
    seen = np.concatenate([np.where(open_water, picture, 0.0), open_water], axis=-1)
    radius = _NEAREST
    while missing.any():
        total = _sums(seen, radius)
        there = missing & (total[..., 3:] > 0.0)
        found = np.where(there, total[..., :3] / np.maximum(total[..., 3:], 1.0), found)
        missing &= ~there
        radius *= 2
    return found


def _sums(values: NDArray[np.floating], radius: int) -> NDArray[np.floating]:
    """Return sums over squares about pixels."""
    for axis in (0, 1):
        count = values.shape[axis]
        sums = np.insert(np.cumsum(values, axis=axis, dtype=np.float64), 0, 0.0, axis=axis)
        at = np.arange(count)
        last, first = np.minimum(at + radius + 1, count), np.maximum(at - radius, 0)
        values = np.take(sums, last, axis=axis) - np.take(sums, first, axis=axis)
    return values
