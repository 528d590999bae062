"""The pinhole picture in the water that a picture through a port is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .camera import LensCamera
from .housing import Housing
from .lens import BrownConrady

Array = NDArray[np.float64]

_WIDEST = 80.0  # degrees from the axis that a pinhole picture may hold
_CUSHION = 3  # pixels around what is needed, for sampling
_GRID = 33
_EVERYWHERE = 1e9  # m: as good as infinity
_ROUNDS = 8


@dataclass(frozen=True)
class PinholeView:
    """A pinhole in the water, parallel to the camera, and its picture."""

    camera: LensCamera  #: Without distortion.
    #: Of the pinhole, in the camera's axes from its entrance pupil, m.
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
    *,
    finest: bool = True,
) -> PinholeView:
    """Return the pinhole picture that holds all that a picture through the port shows.

    The nearest object is ``nearest`` m from the port, the pinhole at ``position``, by default
    :func:`viewpoint`. Its pixels are as small as the smallest of the picture if ``finest``; else as
    small as these are on average, and square.

    Raises
    ------
    InputError
        If nothing is seen, or the field is too wide for a pinhole.
    """
    if not nearest > 0:
        raise InputError(
            f"housing: the nearest object is {nearest:g} m before the port, not above 0"
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
    fx, fy = _focal_lengths(grid, origins, w, placed, finest=finest)
    left, top = (math.floor(value * f) - _CUSHION for value, f in ((x.min(), fx), (y.min(), fy)))
    right, bottom = (math.ceil(v * f) + _CUSHION for v, f in ((x.max(), fx), (y.max(), fy)))
    camera = LensCamera(right - left, bottom - top, fx, fy, float(-left), float(-top))
    return PinholeView(camera, placed)


def water_begins(housing: Housing, view: PinholeView, wavelength: float = 550.0) -> float:
    """Distance from a pinhole along its axis to where the water begins, mean of the picture, m.

    What the pinhole's rays have before them there is no water of the picture's.

    Examples
    --------
    >>> from underwater_spectral.uw_spectral.housing import FlatPort
    >>> camera = LensCamera(1920, 1080, 1400.0, 1400.0, 960.0, 540.0)
    >>> housing = Housing(camera, FlatPort(0.03, 0.008))
    >>> round(water_begins(housing, field_needed(housing, 0.1, [550.0])), 3)
    0.05
    """
    origins, _ = housing.ray_in_water(_grid(housing.camera), wavelength)
    return float(np.nanmean(origins[..., 2]) - view.position[2])


def intrinsics_in_water(
    housing: Housing, wavelength: float, distance: float = 2.0, *, distorted: bool = False
) -> tuple[PinholeView, float]:
    """Return the pinhole that a camera in its housing resembles most, and how well.

    Software that knows no ports takes it for the camera: what a calibration in water finds. Its
    picture has the size of the camera's; what it cannot hold of lens and port is the error.

    The fit is best for objects at a distance from the port, m; if ``distorted``, it has a lens of
    Brown and Conrady's five coefficients. The error is the root mean square over the picture,
    pixels.

    Raises
    ------
    InputError
        If the picture sees nothing through the port, or more than a half-space.
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
    if distorted:
        camera = _with_distortion(camera, slopes, pixels)
    missed = camera.project(offsets) - pixels
    return PinholeView(camera, position), float(np.sqrt(np.nanmean((missed**2).sum(axis=-1))))


def _with_distortion(camera: LensCamera, slopes: Array, pixels: Array) -> LensCamera:
    """Fit intrinsics and distortion together, by Gauss and Newton's method."""
    x, y = slopes.T
    r2 = x * x + y * y
    values = np.array([camera.fx, camera.fy, camera.cx, camera.cy, *[0.0] * 5])
    zero, one = np.zeros_like(x), np.ones_like(x)
    # Of the image coordinates by k1, k2, p1, p2, k3, which they are linear in.
    bent = np.stack([
        np.stack([x * r2, x * r2**2, 2 * x * y, r2 + 2 * x * x, x * r2**3], axis=-1),
        np.stack([y * r2, y * r2**2, r2 + 2 * y * y, 2 * x * y, y * r2**3], axis=-1),
    ])  # fmt: skip
    for _ in range(_ROUNDS):
        u, v = slopes.T + bent @ values[4:]
        missed = pixels.T - (values[0] * u + values[2], values[1] * v + values[3])
        by_x = np.column_stack([u, zero, one, zero, values[0] * bent[0]])
        by_y = np.column_stack([zero, v, zero, one, values[1] * bent[1]])
        step, *_ = np.linalg.lstsq(np.concatenate([by_x, by_y]), missed.ravel(), rcond=None)
        values = values + step
    fx, fy, cx, cy, *lens = values.tolist()
    return LensCamera(camera.width, camera.height, fx, fy, cx, cy, BrownConrady(*lens))


def _focal_lengths(
    grid: Array, origins: Array, w: Array, position: tuple[float, float, float], *, finest: bool
) -> tuple[float, float]:
    """Focal lengths, pixels, with which pixels in the pinhole's picture are as fine."""
    far = origins + _EVERYWHERE * w - position
    image = far[..., :2] / far[..., 2:]
    across = np.diff(grid[0, :, 0]) / np.hypot(*np.moveaxis(np.diff(image, axis=-2), -1, 0))
    down = np.diff(grid[:, 0, 1])[:, None] / np.hypot(*np.moveaxis(np.diff(image, axis=-3), -1, 0))
    if finest:
        return float(np.nanmax(across)), float(np.nanmax(down))
    mean = float(np.exp(0.5 * (np.nanmean(np.log(across)) + np.nanmean(np.log(down)))))
    return mean, mean


def _grid(camera: LensCamera) -> Array:
    """Image coordinates spread over the picture, its edges among them, shape (n, n, 2)."""
    x, y = (np.linspace(0.0, n, _GRID) for n in (camera.width, camera.height))
    return np.stack(np.meshgrid(x, y), axis=-1)
