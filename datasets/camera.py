"""A pinhole camera with lens distortion, as computer vision calibrates it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.errors import InputError
from ..uw_spectral.housing import PIXEL_CENTRE, BrownConrady, LensCamera
from .axes import Array


@dataclass(frozen=True)
class PinholeCamera:
    """Intrinsics of a camera.

    Image coordinates are pixels from the upper left corner of the picture, x to the right and y
    down, so that the first pixel's centre is at (0.5, 0.5), as in COLMAP and nerfstudio. Raises
    InputError if a size or focal length is not positive, or a number not finite.

    Source: D. C. Brown, Photogramm. Eng. 32, 444 (1966).
    """

    #: Size of the picture and focal lengths, pixels.
    width: int
    height: int
    fx: float
    fy: float
    #: Principal point, image coordinates.
    cx: float
    cy: float
    #: k1, k2, p1, p2, k3 of Brown and Conrady, in OpenCV's order.
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.distortion) != 5 or not all(map(math.isfinite, self.distortion)):
            raise InputError("camera: distortion is five finite numbers k1, k2, p1, p2, k3")
        self.lens_camera()

    @classmethod
    def from_field_of_view(cls, width: int, height: int, degrees: float) -> PinholeCamera:
        """Return a camera without distortion and square pixels, of a horizontal field of view.

        Raises InputError if the angle is not between 0 and 180 degrees.

        Examples
        --------
        >>> round(PinholeCamera.from_field_of_view(640, 480, 90.0).fx, 9)
        320.0
        """
        if not 0 < degrees < 180:
            raise InputError(f"camera: a field of view of {degrees:g}° is not between 0 and 180")
        f = width / 2 / math.tan(math.radians(degrees) / 2)
        return cls(width, height, f, f, width / 2, height / 2)

    def lens_camera(self) -> LensCamera:
        """Return the same as the camera of a housing; raises InputError as said above."""
        lens = BrownConrady(*self.distortion)
        return LensCamera(self.width, self.height, self.fx, self.fy, self.cx, self.cy, lens)

    @property
    def K(self) -> Array:
        """Calibration matrix in our image coordinates, shape (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def K_opencv(self) -> Array:
        """Calibration matrix where the first pixel's centre is (0, 0), shape (3, 3)."""
        K = self.K
        K[:2, 2] -= PIXEL_CENTRE
        return K

    def projection(self, right: float) -> Array:
        """Return OpenCV's of a rectified camera that stands so far (m) to the right, (3, 4)."""
        return np.c_[self.K_opencv, (-self.fx * right, 0.0, 0.0)]

    def project(self, points: ArrayLike) -> Array:
        """Image coordinates of points, shape (..., 3) in OpenCV's camera axes, m, to (..., 2).

        Points behind the camera are NaN, and those beyond where the distortion folds.

        Examples
        --------
        >>> camera = PinholeCamera.from_field_of_view(640, 480, 90.0)
        >>> camera.project([0.5, -0.25, 2.0]).round(6).tolist()
        [400.0, 200.0]
        """
        return self.lens_camera().project(points)

    def rays(self) -> Array:
        """Unit view directions of the pixels' centres in OpenCV's axes, shape (height, width, 3).

        Raises InputError if the distortion folds the picture over, so that it cannot be undone.
        """
        camera = self.lens_camera()
        directions = camera.directions(camera.pixel_centres())
        if np.isnan(directions).any():
            raise InputError(
                f"camera: the distortion {self.distortion} folds the picture over; take smaller "
                "coefficients or a narrower lens"
            )
        return directions
