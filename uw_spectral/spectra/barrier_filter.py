"""Barrier filters before a camera: they keep the exciting light away that fluorescence outshines.

A long-pass filter is told by the wavelength where it lets half through, and by the width over
which its transmittance rises from a tenth to nine tenths.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .bands import Bands

NO_FILTER = "none"
CONTENT = "long-pass:CUT,WIDTH in nm, as long-pass:500,15 for a yellow one"
"""What names a filter, in words."""
_KIND = "long-pass"
_TYPICAL_WIDTH = 15.0  # nm
_STEPS = 16  # of a band, of which its mean is taken
_LARGEST = 500.0


def transmittance(text: str, bands: Bands) -> NDArray[np.float64]:
    """Return the mean transmittance over bands, shape (n,), of what :func:`parse_filter` reads."""
    known = parse_filter(text)
    if known is None:
        return np.ones(len(bands))
    cut, width = known
    places = (np.arange(_STEPS) + 0.5) / _STEPS - 0.5
    return _logistic((bands.centres[:, None] + places * bands.widths[:, None] - cut) / width).mean(
        axis=1
    )


def parse_filter(text: str) -> tuple[float, float] | None:
    """Return cut-off and width, nm, of :data:`CONTENT`, 15 nm wide by default; None of ``"none"``.

    Raises
    ------
    InputError
        If it is neither, the cut-off is not between 200 and 1100 nm, or the width not above 0.
    """
    if text.strip().lower() == NO_FILTER:
        return None
    kind, _, rest = text.strip().partition(":")
    parts = rest.split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if kind.lower() != _KIND or not 1 <= len(numbers) <= 2:
        raise InputError(f"filter {text!r} is not known; write {NO_FILTER}, or {CONTENT}")
    cut, width = (*numbers, _TYPICAL_WIDTH)[:2]
    if not 200.0 <= cut <= 1100.0 or not 0.0 < width <= 1000.0:
        raise InputError(
            f"filter {text!r}: give a cut-off of 200 to 1100 nm and a width above 0, in nm"
        )
    return cut, width


def _logistic(x: ArrayLike) -> NDArray[np.float64]:
    """Rise from 0.1 to 0.9 over a unit about 0."""
    exponent = np.clip(-2.0 * math.log(9.0) * np.asarray(x, np.float64), -_LARGEST, _LARGEST)
    return 1.0 / (1.0 + np.exp(exponent))
