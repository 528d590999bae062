"""Bayer's mosaic: which of the three channels each pixel sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name

PATTERNS = ("RGGB", "BGGR", "GRBG", "GBRG")
"""Filters of the upper left four pixels, by rows."""
_CHANNELS = "RGB"


def filter_of_pixels(shape: tuple[int, int], pattern: str) -> NDArray[np.intp]:
    """Return the channel of each pixel, 0 to 2, shape (height, width).

    Raises
    ------
    InputError
        If the pattern is unknown.

    Examples
    --------
    >>> filter_of_pixels((2, 4), "RGGB").tolist()
    [[0, 1, 0, 1], [1, 2, 1, 2]]
    """
    if pattern not in PATTERNS:
        raise unknown_name("mosaic", pattern, PATTERNS)
    tile = np.array([_CHANNELS.index(letter) for letter in pattern]).reshape(2, 2)
    height, width = shape
    return np.tile(tile, (height // 2 + 1, width // 2 + 1))[:height, :width]


def mosaic(channels: ArrayLike, pattern: str) -> NDArray[np.float64]:
    """Return what the pixels behind their filters see, of channels (height, width, 3).

    Raises
    ------
    InputError
        If the pattern is unknown, or there are not three channels.
    """
    values = np.asarray(channels, dtype=np.float64)
    if values.ndim != 3 or values.shape[2] != 3:
        raise InputError(f"mosaic: a picture of three channels is needed, not {values.shape}")
    height, width, _ = values.shape
    seen = filter_of_pixels((height, width), pattern)
    return np.take_along_axis(values, seen[..., None], axis=2)[..., 0]
