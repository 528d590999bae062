"""How a lens darkens towards the corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError


@dataclass(frozen=True)
class Vignetting:
    """Fraction of the light that reaches each pixel.

    D. B. Goldman, IEEE TPAMI 32, 2276 (2010).

    Raises
    ------
    InputError
        If a coefficient is not finite.
    """

    natural: bool = True  #: Whether it falls with cos⁴ of the angle from the optical axis.
    #: k1, k2, … of the fraction 1 + k1 r² + k2 r⁴ + …, with r from the principal point, 1 at the
    #: farthest corner.
    radial: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, self.radial)):
            raise InputError("vignetting: coefficients must be finite numbers")

    def fraction(
        self, size: tuple[int, int], focal: tuple[float, float], centre: tuple[float, float]
    ) -> NDArray[np.float64]:
        """Return the fraction of each pixel, shape (height, width).

        Focal lengths fx, fy and principal point cx, cy are in pixels from the upper left corner.

        Raises
        ------
        InputError
            If a fraction is negative.
        """
        width, height = size
        x = np.arange(width) + 0.5 - centre[0]
        y = (np.arange(height) + 0.5 - centre[1])[:, None]
        found = np.ones((height, width))
        if self.natural:
            found /= (1.0 + (x / focal[0]) ** 2 + (y / focal[1]) ** 2) ** 2
        if self.radial:
            corner = (
                max(centre[0], width - centre[0]) ** 2 + max(centre[1], height - centre[1]) ** 2
            )
            r2 = (x * x + y * y) / corner
            found *= np.polynomial.polynomial.polyval(r2, (1.0, *self.radial))
        if (found < 0).any():
            raise InputError(
                f"vignetting: the coefficients {self.radial} make the corners darker than black"
            )
        return found
