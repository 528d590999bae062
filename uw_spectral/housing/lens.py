"""Lenses: where in the picture light from a direction falls, and back."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]

_ITERATIONS = 50
_EXACT = 1e-13  # of a normalised image coordinate: below a billionth of a pixel


@dataclass(frozen=True)
class Lens:
    """Maps directions to normalised image coordinates, which times focal length are pixels."""

    @property
    def numbers(self) -> dict[str, float]:
        """Its coefficients by name."""
        return asdict(self)

    def image(self, directions: ArrayLike) -> Array:
        """Normalised image coordinates, shape (..., 2), of directions, shape (..., 3).

        NaN for directions that the lens does not see.
        """
        raise NotImplementedError

    def directions(self, image: ArrayLike) -> Array:
        """Unit directions of normalised image coordinates; NaN beyond the lens's picture."""
        raise NotImplementedError


def _smallest_extremum(derivative: Sequence[float]) -> float:
    """Smallest positive root of a polynomial by ascending powers; inf if it has none."""
    roots = np.polynomial.Polynomial(np.trim_zeros(derivative, "b")).roots().astype(np.complex128)
    positive = (np.abs(np.imag(roots)) < 1e-9 * np.abs(roots)) & (np.real(roots) > 0)
    return float(np.min(np.real(roots)[positive], initial=math.inf))


@dataclass(frozen=True)
class BrownConrady(Lens):
    """A rectilinear lens with distortion, in OpenCV's order; none by default.

    D. C. Brown, Photogramm. Eng. 32, 444 (1966).
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.k1, self.k2, self.p1, self.p2, self.k3))):
            raise InputError("lens: distortion is five finite numbers k1, k2, p1, p2, k3")

    @functools.cached_property
    def _farthest(self) -> float:
        """Square of the radius beyond which the picture folds back over itself."""
        return _smallest_extremum((1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3))

    def image(self, directions: ArrayLike) -> Array:
        """As of :class:`Lens`; what lies behind, or beyond where the distortion folds, is NaN."""
        found = np.asarray(directions, dtype=np.float64)
        z = np.where(found[..., 2] > 0, found[..., 2], np.nan)
        x, y = found[..., 0] / z, found[..., 1] / z
        seen = x * x + y * y < self._farthest
        return np.where(seen[..., None], np.stack(self._distorted(x, y), axis=-1), np.nan)

    def directions(self, image: ArrayLike) -> Array:
        """As of :class:`Lens`, by Newton's method."""
        wanted = np.asarray(image, dtype=np.float64)
        x, y = wanted[..., 0], wanted[..., 1]
        for _ in range(_ITERATIONS):
            at_x, at_y = self._distorted(x, y)
            miss_x, miss_y = wanted[..., 0] - at_x, wanted[..., 1] - at_y
            if _largest(np.hypot(miss_x, miss_y)) <= _EXACT:
                break
            xx, xy, yy = self._derivatives(x, y)
            det = xx * yy - xy * xy
            det = np.where(det > 0, det, np.nan)
            x = x + (miss_x * yy - miss_y * xy) / det
            y = y + (miss_y * xx - miss_x * xy) / det
        at_x, at_y = self._distorted(x, y)
        missed = np.hypot(wanted[..., 0] - at_x, wanted[..., 1] - at_y)
        seen = (missed < 1e3 * _EXACT) & (x * x + y * y < self._farthest)
        found = np.stack([x, y, np.ones_like(x)], axis=-1)
        found = np.where(seen[..., None], found, np.nan)
        return found / np.linalg.norm(found, axis=-1, keepdims=True)

    def _distorted(self, x: Array, y: Array) -> tuple[Array, Array]:
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return (
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )

    def _derivatives(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Of the distorted x by x, x by y (which is y by x), y by y."""
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3))
        return (
            radial + slope * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            slope * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y,
            radial + slope * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )


@dataclass(frozen=True)
class KannalaBrandt(Lens):
    """A fisheye: radius θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸), equidistant by default.

    Coefficients are in the order of OpenCV's ``fisheye``.

    J. Kannala & S. S. Brandt, IEEE TPAMI 28, 1335 (2006).
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, self._coefficients)):
            raise InputError("lens: a fisheye's k1, k2, k3, k4 must be finite")

    @property
    def _coefficients(self) -> tuple[float, ...]:
        return 1.0, self.k1, self.k2, self.k3, self.k4

    @functools.cached_property
    def _slopes(self) -> tuple[float, ...]:
        return tuple((2 * n + 1) * k for n, k in enumerate(self._coefficients))

    @functools.cached_property
    def _widest(self) -> float:
        """Angle up to which the radius grows."""
        return min(math.sqrt(_smallest_extremum(self._slopes)), math.pi)

    def image(self, directions: ArrayLike) -> Array:
        """As of :class:`Lens`."""
        found = np.asarray(directions, dtype=np.float64)
        across = np.hypot(found[..., 0], found[..., 1])
        angle = np.arctan2(across, found[..., 2])
        angle = np.where(angle <= self._widest, angle, np.nan)
        r = angle * np.polynomial.polynomial.polyval(angle * angle, self._coefficients)
        return found[..., :2] * _ratio(r, across)[..., None]

    def directions(self, image: ArrayLike) -> Array:
        """As of :class:`Lens`, by Newton's method."""
        wanted = np.asarray(image, dtype=np.float64)
        r = np.hypot(wanted[..., 0], wanted[..., 1])
        low, high = np.zeros_like(r), np.full_like(r, self._widest)
        angle = np.minimum(r, high)
        polynomial = np.polynomial.polynomial.polyval
        for _ in range(_ITERATIONS):
            miss = angle * polynomial(angle * angle, self._coefficients) - r
            low, high = np.where(miss < 0, angle, low), np.where(miss < 0, high, angle)
            with np.errstate(divide="ignore", invalid="ignore"):
                moved = angle - miss / polynomial(angle * angle, self._slopes)
            moved = np.where((moved > low) & (moved < high), moved, 0.5 * (low + high))
            done = np.abs(miss) <= _EXACT
            angle = np.where(done, angle, moved)
            if (done | np.isnan(miss)).all():
                break
        miss = angle * polynomial(angle * angle, self._coefficients) - r
        angle = np.where(np.abs(miss) < 1e3 * _EXACT, angle, np.nan)
        across = wanted * _ratio(np.sin(angle), r)[..., None]
        return np.concatenate([across, np.cos(angle)[..., None]], axis=-1)


@dataclass(frozen=True)
class LateralColour:
    """Magnification that differs with the wavelength; none by default.

    The radius in the picture is r (1 + a + b r²), a and b polynomials of the wavelength without a
    constant: what the lens does at ``reference`` is what its distortion says.

    The form is that of S. B. Kang, ECCV, 4th workshop (2007), for every wavelength.

    Raises
    ------
    InputError
        If a number is not finite, or the reference not positive.

    Examples
    --------
    >>> colour = LateralColour((0.001,))
    >>> seen = colour.applied([[1.0, 0.0]], 650.0)
    >>> seen.round(6).tolist(), colour.undone(seen, 650.0).round(9).tolist()
    ([[1.001, 0.0]], [[1.0, 0.0]])
    """

    #: Coefficients of a and of b by ascending powers, from the first, of (λ - reference) / 100 nm.
    magnification: tuple[float, ...] = ()
    cubic: tuple[float, ...] = ()
    reference: float = 550.0  #: nm.

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.magnification, *self.cubic))):
            raise InputError("lateral colour: the coefficients must be finite")
        if not 0 < self.reference < math.inf:
            raise InputError(f"lateral colour: {self.reference:g} nm is no wavelength")

    def _terms(self, wavelength: ArrayLike) -> tuple[Array, Array]:
        x = (np.asarray(wavelength, dtype=np.float64) - self.reference) / 100.0
        scale = np.polynomial.Polynomial((1.0, *self.magnification))
        cubic = np.polynomial.Polynomial((0.0, *self.cubic))
        return np.asarray(scale(x)), np.asarray(cubic(x))

    def applied(self, image: ArrayLike, wavelength: ArrayLike) -> Array:
        """Image coordinates at wavelengths in nm, shape (...), of those at the reference."""
        found = np.asarray(image, dtype=np.float64)
        scale, cubic = self._terms(wavelength)
        r2 = (found * found).sum(axis=-1)
        return found * (scale + cubic * r2)[..., None]

    def undone(self, image: ArrayLike, wavelength: ArrayLike) -> Array:
        """Image coordinates at the reference of those at wavelengths; NaN if there are none."""
        wanted = np.asarray(image, dtype=np.float64)
        scale, cubic = self._terms(wavelength)
        goal = np.hypot(wanted[..., 0], wanted[..., 1])
        r = goal / scale
        for _ in range(_ITERATIONS):
            miss = r * (scale + cubic * r * r) - goal
            if _largest(np.abs(miss)) <= _EXACT:
                break
            slope = scale + 3.0 * cubic * r * r
            r = r - miss / np.where(slope > 0, slope, np.nan)
        miss = np.abs(r * (scale + cubic * r * r) - goal)
        r = np.where(miss < 1e3 * _EXACT, r, np.nan)
        return wanted * _ratio(r, goal, 1.0 / scale)[..., None]


def _largest(values: NDArray) -> float:
    """Largest of values, NaN left out."""
    return float(np.nan_to_num(values).max(initial=0.0))


def _ratio(above: NDArray, below: NDArray, at_zero: ArrayLike = 1.0) -> Array:
    """Ratio of two lengths that vanish together, and the limit where they do."""
    some = below > 0
    ratio = above / np.where(some, below, 1.0)
    return np.where(some, ratio, np.where(np.isnan(above), np.nan, at_zero))
