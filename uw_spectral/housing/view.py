"""The pinhole picture in the water that a picture through a port is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .camera import LensCamera
from .housing import Housing

Array = NDArray[np.float64]

_WIDEST = 80.0  # degrees from the axis that a pinhole picture may hold
_CUSHION = 3  # pixels around what is needed, for sampling
_GRID = 33
_EVERYWHERE = 1e9  # m: as good as infinity


@dataclass(frozen=True)
class PinholeView:
    """A pinhole in the water, parallel to the camera, and its picture.

    Parameters
    ----------
    camera : LensCamera
        Without distortion.
    position : three floats
        Of the pinhole, in the camera's axes from its entrance pupil, m.
    """

    camera: LensCamera
    position: tuple[float, float, float]

    def rays(self) -> Array:
        """Directions of the pixels with z = 1, shape (height, width, 3)."""
        directions = self.camera.directions(self.camera.pixel_centres())
        return directions / directions[..., 2:]


def viewpoint(housing: Housing, wavelength: float = 550.0) -> tuple[float, float, float]:
    """Point that the rays of a picture come closest to, by least squares.

    Seen from there a pinhole picture differs least from the one through the port: behind a centred
    dome it is the pupil; with a flat port it lies behind the pupil, by about (n - 1) times the
    distance of the port.

    Raises
    ------
    InputError
        If the picture sees nothing through the port.

    Examples
    --------
    >>> from underwater_spectral.uw_spectral.housing import DomePort
    >>> camera = LensCamera(1920, 1080, 1400.0, 1400.0, 960.0, 540.0)
    >>> np.abs(viewpoint(Housing(camera, DomePort(0.05, 0.004)))).max() < 1e-12
    np.True_
    """
    origins, w = housing.ray_in_water(_grid(housing.camera), wavelength)
    seen = np.isfinite(w).all(axis=-1)
    if not seen.any():
        raise InputError("housing: no pixel sees anything through the port")
    origins, w = origins[seen], w[seen]
    aside = np.eye(3) - w[:, :, None] * w[:, None, :]
    found = np.linalg.solve(aside.sum(axis=0), np.einsum("nij,nj->i", aside, origins))
    x, y, z = found.tolist()
    return x, y, z


def field_needed(
    housing: Housing,
    nearest: float,
    wavelengths: ArrayLike,
    position: tuple[float, float, float] | None = None,
) -> PinholeView:
    """Return the pinhole picture that holds all that a picture through the port shows.

    Parameters
    ----------
    housing : Housing
    nearest : float
        Distance from the port of the nearest thing, m.
    wavelengths : array_like
        nm, all that are warped.
    position : three floats, optional
        Of the pinhole; :func:`viewpoint` by default.

    Raises
    ------
    InputError
        If nothing is seen, or the field is too wide for a pinhole.
    """
    if not nearest > 0:
        raise InputError(
            f"housing: the nearest thing is {nearest:g} m before the port, not above 0"
        )
    placed = viewpoint(housing) if position is None else position
    nm = np.asarray(wavelengths, dtype=np.float64)
    ends = np.array([nm.min(), nm.max()])
    grid = _grid(housing.camera)
    origins, w = housing.ray_in_water(grid, ends[:, None, None])
    reach = np.array([nearest, _EVERYWHERE])[:, None, None, None, None]
    offsets = origins + reach * w - placed
    seen = np.isfinite(offsets).all(axis=-1)
    if not seen.any():
        raise InputError("housing: no pixel sees anything through the port")
    offsets = offsets[seen]
    angle = np.degrees(np.arctan2(np.hypot(offsets[:, 0], offsets[:, 1]), offsets[:, 2]).max())
    if angle > _WIDEST:
        raise InputError(
            f"housing: the picture reaches {angle:.0f}° from the axis in the water; a pinhole "
            f"picture holds {_WIDEST:g}° at most: take a longer focal length"
        )
    x, y = offsets[:, 0] / offsets[:, 2], offsets[:, 1] / offsets[:, 2]
    # As fine as the picture through the port where that is finest.
    fx, fy = _finest(grid, origins, w, placed)
    left, top = (math.floor(value * f) - _CUSHION for value, f in ((x.min(), fx), (y.min(), fy)))
    right, bottom = (math.ceil(v * f) + _CUSHION for v, f in ((x.max(), fx), (y.max(), fy)))
    camera = LensCamera(right - left, bottom - top, fx, fy, float(-left), float(-top))
    return PinholeView(camera, placed)


def intrinsics_in_water(
    housing: Housing, wavelength: float, distance: float = 2.0
) -> tuple[PinholeView, float]:
    """Return the pinhole that a camera in its housing resembles most, and how well.

    Software that knows no ports takes it for the camera. Its picture has the size of the camera's;
    lens distortion and what the port adds to it are what does not fit.

    Parameters
    ----------
    housing : Housing
    wavelength : float
        nm.
    distance : float
        Of things from the port, m, at which it fits best.

    Returns
    -------
    view : PinholeView
    error : float
        Root mean square, pixels, over the picture.

    Raises
    ------
    InputError
        If the picture sees nothing through the port, or more than a half-space.

    Examples
    --------
    >>> from underwater_spectral.uw_spectral.housing import FlatPort
    >>> camera = LensCamera(200, 200, 4000.0, 4000.0, 100.0, 100.0)
    >>> view, error = intrinsics_in_water(Housing(camera, FlatPort(0.03, 0.0)), 550.0)
    >>> round(view.camera.fx / camera.fx, 3), round(error, 3)
    (1.341, 0.005)
    """
    position, grid = viewpoint(housing, wavelength), _grid(housing.camera)
    origins, w = housing.ray_in_water(grid, wavelength)
    offsets = origins + distance * w - position
    seen = np.isfinite(offsets).all(axis=-1)
    offsets, pixels = offsets[seen], grid[seen]
    if not (offsets[:, 2] > 0).all():
        raise InputError("housing: the picture holds more than a half-space, which no pinhole does")
    slopes = offsets[:, :2] / offsets[:, 2:]
    (fx, cx), (fy, cy) = (np.polyfit(slopes[:, i], pixels[:, i], 1).tolist() for i in (0, 1))
    camera = LensCamera(housing.camera.width, housing.camera.height, fx, fy, cx, cy)
    missed = camera.project(offsets) - pixels
    return PinholeView(camera, position), float(np.sqrt((missed**2).sum(axis=-1).mean()))


def _finest(
    grid: Array, origins: Array, w: Array, position: tuple[float, float, float]
) -> tuple[float, float]:
    """Focal lengths, pixels, with which no pixel of the picture is larger in the pinhole's."""
    far = origins + _EVERYWHERE * w - position
    image = far[..., :2] / far[..., 2:]
    across = np.diff(grid[0, :, 0]) / np.hypot(*np.moveaxis(np.diff(image, axis=-2), -1, 0))
    down = np.diff(grid[:, 0, 1])[:, None] / np.hypot(*np.moveaxis(np.diff(image, axis=-3), -1, 0))
    return float(np.nanmax(across)), float(np.nanmax(down))


def _grid(camera: LensCamera) -> Array:
    """Image coordinates spread over the picture, its edges among them, shape (n, n, 2)."""
    x, y = (np.linspace(0.0, n, _GRID) for n in (camera.width, camera.height))
    return np.stack(np.meshgrid(x, y), axis=-1)
