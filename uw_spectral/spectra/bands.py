"""Spectral bands: centres, widths, and their packing into passes of three."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError

MAXIMUM_BANDS = 512


@dataclass(frozen=True, eq=False)
class Bands(ComparedByContent):
    """Spectral bands by centre and width.

    A band stands for the spectrum over its width, taken at its centre
    (midpoint rule).

    Raises
    ------
    InputError
        If centres do not increase or a width is not positive.
    """

    centres: NDArray[np.float64]  #: Band centres in nm, strictly increasing, (n,).
    widths: NDArray[np.float64]  #: Band widths in nm, positive, (n,).

    def __post_init__(self) -> None:
        centres = constant(np.atleast_1d(self.centres))
        widths = constant(np.atleast_1d(self.widths))
        if centres.ndim != 1 or centres.shape != widths.shape or not len(centres):
            raise InputError("bands: give one width per band centre, and at least one band")
        if not np.all(np.isfinite(centres)) or np.any(np.diff(centres) <= 0) or centres[0] <= 0:
            raise InputError(
                f"bands: centres must be positive and increase, got {centres.tolist()}"
            )
        if not np.all(np.isfinite(widths)) or np.any(widths <= 0):
            raise InputError(f"bands: widths must be positive, got {widths.tolist()}")
        object.__setattr__(self, "centres", centres)
        object.__setattr__(self, "widths", widths)

    def __len__(self) -> int:
        return len(self.centres)

    @classmethod
    def uniform(cls, count: int, start: float = 400.0, end: float = 700.0) -> Bands:
        """Divide a range in nm into 1 to 512 equal bands.

        Raises
        ------
        InputError
            If the range is empty or the count out of bounds.
        """
        if not 1 <= count <= MAXIMUM_BANDS:
            raise InputError(f"bands: the number must be 1 to {MAXIMUM_BANDS}, got {count}")
        if not (np.isfinite(start) and np.isfinite(end) and 0 < start < end):
            raise InputError(f"bands: the range {start:g} to {end:g} nm is empty or not positive")
        width = (end - start) / count
        index = np.arange(count, dtype=np.float64)
        return cls(start + width * (index + 0.5), np.full(count, width))

    @classmethod
    def at_wavelengths(cls, wavelengths: ArrayLike) -> Bands:
        """Bands around listed wavelengths, meeting half way between neighbours.

        The outer bands are symmetric about their centre. A single wavelength
        gets a width of 1 nm.

        Examples
        --------
        >>> Bands.at_wavelengths([450, 500, 600]).widths
        array([ 50.,  75., 100.])
        """
        centres = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        if len(centres) < 2:
            return cls(centres, np.ones(len(centres)))
        gaps = np.diff(centres)
        before = np.concatenate([gaps[:1], gaps])
        after = np.concatenate([gaps, gaps[-1:]])
        return cls(centres, (before + after) / 2)

    def packed(self, bands_per_pass: int) -> list[tuple[int, ...]]:
        """Indices of the bands that each render pass carries.

        A pass has 3 where one render can carry three bands exactly, else 1.
        """
        indices = range(len(self))
        return [
            tuple(indices[first : first + bands_per_pass])
            for first in range(0, len(self), bands_per_pass)
        ]
