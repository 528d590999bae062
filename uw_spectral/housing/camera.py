"""The camera behind a port: a lens before a picture of pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .lens import BrownConrady, LateralColour, Lens

Array = NDArray[np.float64]

PIXEL_CENTRE = 0.5
"""Image coordinates of the first pixel's centre; OpenCV and BOP count it as 0."""


@dataclass(frozen=True)
class LensCamera:
    """Picture size, focal length in air, and lens.

    Image coordinates are pixels from the upper left corner, x to the right and y down, so that the
    first pixel's centre is at (0.5, 0.5). Directions are in OpenCV's camera axes: x to the right,
    y down, z forward.

    Raises
    ------
    InputError
        If the picture is empty, or a focal length not positive.
    """

    width: int
    height: int
    #: Focal lengths and principal point, pixels.
    fx: float
    fy: float
    cx: float
    cy: float
    lens: Lens = field(default_factory=BrownConrady)
    lateral: LateralColour = field(default_factory=LateralColour)

    def __post_init__(self) -> None:
        if not (self.width > 0 and self.height > 0):
            raise InputError(f"camera: a picture of {self.width} × {self.height} pixels is empty")
        if not (0 < self.fx < math.inf and 0 < self.fy < math.inf):
            raise InputError(f"camera: focal lengths must be positive, got {self.fx}, {self.fy}")
        if not (math.isfinite(self.cx) and math.isfinite(self.cy)):
            raise InputError(f"camera: the principal point {self.cx}, {self.cy} is not finite")

    def project(self, directions: ArrayLike, wavelength: ArrayLike | None = None) -> Array:
        """Image coordinates, shape (..., 2), of directions in air, shape (..., 3).

        NaN comes of directions that the lens does not see. Wavelengths in nm; that of the lens's
        distortion by default.
        """
        image = self.lens.image(directions)
        if wavelength is not None:
            image = self.lateral.applied(image, wavelength)
        return image * (self.fx, self.fy) + (self.cx, self.cy)

    def directions(self, pixels: ArrayLike, wavelength: ArrayLike | None = None) -> Array:
        """Unit directions in air, shape (..., 3), of image coordinates, shape (..., 2)."""
        image = (np.asarray(pixels, dtype=np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        if wavelength is not None:
            image = self.lateral.undone(image, wavelength)
        return self.lens.directions(image)

    def pixel_centres(self) -> Array:
        """Image coordinates of all pixels' centres, shape (height, width, 2)."""
        x, y = (np.arange(n, dtype=np.float64) + PIXEL_CENTRE for n in (self.width, self.height))
        return np.stack(np.meshgrid(x, y), axis=-1)
