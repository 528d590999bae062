"""Ports, points and outside truths for housings: least time, polynomials, boards, calibration."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from ..uw_spectral.housing import (
    GLASSES,
    BrownConrady,
    DomePort,
    FlatPort,
    Housing,
    LensCamera,
    SeaWater,
)

Array = NDArray[np.float64]

NM = (400.0, 550.0, 700.0)
DISTANCES = (0.5, 2.0, 10.0)
CAMERA = LensCamera(1920, 1080, 1400.0, 1400.0, 950.0, 545.0)
WATER = SeaWater(35.0, 12.0, 40.0)
_BK7, _ACRYLIC = GLASSES["BK7"], GLASSES["acrylic"]
PORTS = {
    "flat, 8 mm BK7": FlatPort(0.03, 0.008, _BK7),
    "flat, tilted 5°": FlatPort.tilted(0.03, 0.008, _BK7, degrees=5.0, towards=30.0),
    "flat, 20 mm acrylic, tilted 20°": FlatPort.tilted(
        0.012, 0.02, _ACRYLIC, degrees=20.0, towards=200.0
    ),
    "flat, 2 mm, 50 mm away": FlatPort(0.05, 0.002, _ACRYLIC),
    "dome, centred": DomePort(0.05, 0.004, _BK7),
    "dome, 5 mm forward": DomePort(0.05, 0.004, _BK7, (0.0, 0.0, 0.005)),
    "dome, 20 mm back": DomePort(0.1, 0.01, _ACRYLIC, (0.0, 0.0, -0.02)),
    "dome, decentred to all sides": DomePort(0.05, 0.006, _BK7, (0.004, -0.006, 0.003)),
}


def seen_points(distance: float, count: int = 5) -> Array:
    """Points at a distance in m, spread over three quarters of the picture."""
    x = np.linspace(0.125, 0.875, count)
    pixels = np.stack(np.meshgrid(x * CAMERA.width, x * CAMERA.height), axis=-1).reshape(-1, 2)
    # A camera in water sees a narrower field.
    middle = np.array([CAMERA.cx, CAMERA.cy])
    return distance * CAMERA.directions(middle + (pixels - middle) / 1.4)


def least_time(housing: Housing, point: Array, wavelength: float) -> tuple[Array, Array]:
    """Places on both faces of the path of least time from the pupil to a point (Fermat)."""
    glass = float(housing.port.glass.refractive_index(wavelength))
    water = float(housing.water.refractive_index(wavelength))
    faces = _faces(housing, point)

    def time(at: NDArray[Any]) -> complex:
        inner, outer = faces(at[:2], 0), faces(at[2:], 1)
        return _length(inner) + glass * _length(outer - inner) + water * _length(point - outer)

    def slope(at: Array) -> Array:
        """Exact derivative, by a step along the imaginary axis."""
        steps = 1e-30j * np.eye(4)
        return np.array([time(at + step).imag for step in steps]) / 1e-30

    found = scipy.optimize.minimize(lambda at: np.real(time(at)), np.zeros(4), jac=slope, tol=1e-12)
    least = scipy.optimize.root(slope, found.x, tol=1e-15)
    # The root is the minimum, not another stationary path.
    assert np.abs(least.x - found.x).max() < 1e-4
    return np.real(faces(least.x[:2], 0)), np.real(faces(least.x[2:], 1))


def _length(vector: NDArray[Any]) -> complex:
    return np.sqrt((vector * vector).sum())


def _faces(housing: Housing, point: Array) -> Callable[[NDArray[Any], int], NDArray[Any]]:
    port = housing.port
    if isinstance(port, FlatPort):
        first, second = np.linalg.svd(port.axis[None])[2][1:]
        depths = port.distance, port.distance + port.thickness
        return lambda at, face: depths[face] * port.axis + at[0] * first + at[1] * second
    assert isinstance(port, DomePort)
    centre = -np.array(port.pupil)
    towards = (point - centre) / np.linalg.norm(point - centre)
    first, second = np.linalg.svd(towards[None])[2][1:]
    radii = port.inner_radius, port.radius

    def on_sphere(at: NDArray[Any], face: int) -> NDArray[Any]:
        radial = towards + at[0] * first + at[1] * second
        return centre + radii[face] * radial / _length(radial)

    return on_sphere


def errors(housing: Housing, distance: float, wavelength: float) -> tuple[float, float]:
    """Largest errors against least time: of pixels, and in m of where rays of pixels pass."""
    worst_pixel = worst_metre = 0.0
    for point in seen_points(distance):
        inner, outer = least_time(housing, point, wavelength)
        pixel = housing.camera.project(inner)
        worst_pixel = max(
            worst_pixel, float(np.abs(housing.project(point, wavelength) - pixel).max())
        )
        origin, w = housing.ray_in_water(pixel, wavelength)
        assert np.abs(origin - outer).max() < 1e-8
        worst_metre = max(worst_metre, float(np.linalg.norm(np.cross(point - origin, w))))
    return worst_pixel, worst_metre


@dataclasses.dataclass(frozen=True)
class Board:
    """A square of the plane through a point, half its edge in m; infinite is a wall."""

    middle: tuple[float, float, float]
    normal: tuple[float, float, float] = (0.0, 0.0, -1.0)
    half: float = math.inf

    def met(self, origins: Array, w: Array) -> Array:
        """Distance along rays; infinite where they miss it."""
        normal = np.array(self.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            way = ((np.array(self.middle) - origins) @ normal) / (w @ normal)
            places = origins + way[..., None] * w - self.middle
            on = (np.abs(places[..., :2]) <= self.half).all(axis=-1) & (way > 0)
        return np.where(on, way, np.inf)


BOARDS = (
    Board((0.0, 0.0, 3.0), (0.2, -0.5, -1.0)),
    Board((-0.25, 0.1, 1.0), half=0.12),
    Board((0.3, -0.15, 0.5), (0.3, 0.2, -1.0), 0.05),
)
"""A sloping wall and two squares before it."""


def cast(origins: Array, w: Array) -> tuple[Array, NDArray[np.int64]]:
    """Distance along rays to the nearest board, and which it is."""
    ways = np.stack([board.met(origins, w) for board in BOARDS])
    return ways.min(axis=0), ways.argmin(axis=0)


def painted(points: Array) -> Array:
    """A pattern of 3 cm on places, smooth."""
    x, y, z = np.moveaxis(points, -1, 0)
    return 0.5 + 0.2 * np.sin(200 * x + 60 * z) + 0.2 * np.cos(200 * y)


def edges(which: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Pixels within two of another board."""
    steps = range(-2, 3)
    return np.any([np.roll(which, (x, y), (0, 1)) != which for x in steps for y in steps], axis=0)


def shift(expected: Array, miss: Array, where: NDArray[np.bool_]) -> Array:
    """Least-squares shift, pixels, that explains a difference (Lucas & Kanade)."""
    down, across = (np.asarray(g)[where] for g in np.gradient(expected))
    return np.linalg.lstsq(np.stack([across, down], axis=-1), miss[where], rcond=None)[0]


# A board of corners in many poses, as a user calibrates with.
GRID = np.stack([*np.meshgrid(np.arange(9), np.arange(6)), np.zeros((6, 9))], axis=-1)
CORNERS: Array = np.asarray(GRID.reshape(-1, 3) * 0.04 - (0.16, 0.1, 0.0), np.float64)


def poses(count: int, near: float, far: float) -> list[tuple[Array, Array]]:
    """Rotation vectors and places of the board."""
    rng = np.random.default_rng(7)
    found = []
    for _ in range(count):
        z = rng.uniform(near, far)
        aside = rng.uniform(-0.25, 0.25, 2) * z * (1.0, 0.6)
        found.append((rng.uniform(-0.6, 0.6, 3), np.array([*aside, z])))
    return found


MIDDLE = 550.0
IN_AIR = LensCamera(
    1920, 1080, 1400.0, 1395.0, 955.0, 548.0, BrownConrady(-0.12, 0.05, 1e-3, -5e-4)
)
TILTED = FlatPort.tilted(0.035, 0.008, _BK7, degrees=3.0, towards=120.0)
POSES = poses(14, 0.5, 1.6)


def placed(pose: tuple[Array, Array]) -> Array:
    """Corners of a board in the camera's axes."""
    return CORNERS @ cv2.Rodrigues(pose[0])[0].T + pose[1]


def calibrated(camera: LensCamera, pictures: Sequence[Array]) -> tuple[LensCamera, float, list]:
    """What OpenCV makes of corners: camera, root mean square error in pixels, and poses."""
    objects = [CORNERS.astype(np.float32)] * len(pictures)
    seen = [(picture - 0.5).astype(np.float32) for picture in pictures]
    error, K, k, turns, places = cv2.calibrateCamera(
        objects, seen, (camera.width, camera.height), None, None,
        criteria=(cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12),
    )  # fmt: skip
    lens = BrownConrady(*k.ravel()[:5].tolist())
    found = dataclasses.replace(
        camera, fx=K[0, 0], fy=K[1, 1], cx=K[0, 2] + 0.5, cy=K[1, 2] + 0.5, lens=lens
    )
    return found, error, [(a.ravel(), b.ravel()) for a, b in zip(turns, places, strict=True)]


def calibrated_port(
    guess: Housing, pictures: Sequence[Array], start: Sequence[tuple[Array, Array]], nm: float
) -> tuple[FlatPort, float]:
    """Distance and normal of a flat port, of corners in water; the camera is known from air.

    Least squares of the distance, two slopes of the normal, and a pose for each picture; returns
    also the root mean square error in pixels.
    """
    port = guess.port
    assert isinstance(port, FlatPort)

    def housing(values: Array) -> Housing:
        x, y = values[1:3].tolist()
        moved = dataclasses.replace(port, distance=math.exp(values[0]), normal=(x, y, 1.0))
        return dataclasses.replace(guess, port=moved)

    def misses(values: Array) -> Array:
        board_poses = values[3:].reshape(-1, 2, 3)
        points = np.stack([placed((pose[0], pose[1])) for pose in board_poses])
        return (housing(values).project(points, nm) - np.stack(pictures)).ravel()

    first = np.concatenate([[math.log(port.distance), 0.0, 0.0], np.array(start).ravel()])
    found = scipy.optimize.least_squares(misses, first, x_scale="jac", xtol=1e-14, ftol=1e-14)
    fitted = housing(found.x).port
    assert isinstance(fitted, FlatPort)
    return fitted, float(np.sqrt(2.0 * np.mean(found.fun**2)))
