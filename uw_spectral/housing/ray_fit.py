"""Rays through a port as a polynomial of the place in the picture, for engines that trace rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .housing import Housing

Array = NDArray[np.float64]

_DEGREES = (6, 8, 10, 12, 14, 16, 20)
_ACCURATE = 1e-3  # of a pixel
_SAMPLES = 3  # by degree, along each side
_FEWEST = 0.1  # of the picture that sees something
_CHECKED = 41


@dataclass(frozen=True, eq=False)
class RayFit:
    """Origins and directions of the rays of a picture at one wavelength."""

    #: Of Chebyshev polynomials of x and y, which go from -1 at the left and upper edge of the
    #: picture to 1: of the three coordinates of the origin (m), then of the direction, in OpenCV's
    #: camera axes, (6, n, n).
    coefficients: Array
    error: float  #: Largest that was found, pixels; origins count by what they move at 1 m.

    def rays(self, pixels: ArrayLike, size: tuple[int, int]) -> tuple[Array, Array]:
        """Origins and unit directions, shape (..., 3), of image coordinates, shape (..., 2)."""
        x, y = np.moveaxis(2.0 * np.asarray(pixels, dtype=np.float64) / size - 1.0, -1, 0)
        found = np.stack([chebyshev.chebval2d(y, x, c) for c in self.coefficients], axis=-1)
        directions = found[..., 3:]
        return found[..., :3], directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def fit_rays(housing: Housing, wavelength: float) -> RayFit:
    """Fit the rays of a picture through a port, by as low a degree as holds a 10⁻³ of a pixel.

    Where the port shows nothing the fit goes on as it likes.

    Raises
    ------
    InputError
        If less than a tenth of the picture sees anything through the port.
    """
    size = np.array([housing.camera.width, housing.camera.height])
    checked = _seen(housing, np.linspace(-1.0, 1.0, _CHECKED), wavelength)
    if len(checked[0]) < _FEWEST * _CHECKED**2:
        raise InputError(
            f"housing: only {len(checked[0]) / _CHECKED**2:.0%} of the picture sees anything "
            "through the port; take a longer focal length or another lens"
        )
    fit = None
    for degree in _DEGREES:
        x = np.cos(np.pi * (np.arange(_SAMPLES * degree) + 0.5) / (_SAMPLES * degree))
        pixels, origins, w = _seen(housing, x, wavelength)
        at = 2.0 * pixels / size - 1.0
        basis = chebyshev.chebvander2d(at[:, 1], at[:, 0], [degree, degree])
        found, *_ = np.linalg.lstsq(basis, np.concatenate([origins, w], axis=1), rcond=None)
        fit = RayFit(found.T.reshape(6, degree + 1, degree + 1), 0.0)
        fit = RayFit(fit.coefficients, _largest_error(housing, fit, checked))
        if fit.error < _ACCURATE:
            break
    assert fit is not None
    return fit


def _seen(housing: Housing, x: Array, wavelength: float) -> tuple[Array, Array, Array]:
    """Pixels at coordinates -1 to 1 that see something, and their rays."""
    camera = housing.camera
    along = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    pixels = 0.5 * (along + 1.0) * (camera.width, camera.height)
    origins, w = housing.ray_in_water(pixels, wavelength)
    seen = np.isfinite(w).all(axis=-1)
    return pixels[seen], origins[seen], w[seen]


def _largest_error(housing: Housing, fit: RayFit, checked: tuple[Array, Array, Array]) -> float:
    camera = housing.camera
    pixels, origins, w = checked
    at, towards = fit.rays(pixels, (camera.width, camera.height))
    missed = np.linalg.norm((at + towards) - (origins + w), axis=-1)
    return float(missed.max() * max(camera.fx, camera.fy))
