"""Foam of breaking waves: how much of the sea it covers, where, and how bright it is.

Choppy waves crowd the water together at their crests; where it would fold over, a wave breaks.
Foam lies where the crowding exceeds a bound, which is chosen so that foam covers as much of the
sea as was measured. The crowding is a sum of many waves, so how often a bound is exceeded is
known without drawing one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from .wave_components import WaveComponents

EFFECTIVE_REFLECTANCE = 0.22
"""Of foam of all ages, thin and thick: P. Koepke, Appl. Opt. 23, 1816 (1984)."""
FRESH_REFLECTANCE = 0.55
"""Of dense new foam, from which that was derived."""
SHORTEST = 0.5
"""Length in m of the shortest waves that leave foam."""

_NOWHERE = 1e3  # crowding that no sea has
_SAMPLES = 12  # along a wave, of images that are interpolated: fewer would flatten its crest
_CALM = 1e-12  # variance of slopes that break nowhere
_WIDEST = 8.0  # standard deviations between which bounds are looked for
_NODES, _STEPS, _HALVINGS = 20, 16, 30
# R. Frouin, M. Schwindling & P.-Y. Deschamps, J. Geophys. Res. 101, 14361 (1996), as the
# processing of NASA's ocean colour has it.
_WAVELENGTHS = (555.0, 670.0, 765.0, 865.0)
_FALL = (1.0, 0.889, 0.760, 0.645)


def whitecap_cover_Monahan1980(wind_speed: float) -> float:
    """Fraction of the sea that foam covers, by the wind at 10 m in m/s, measured up to 17.

    E. C. Monahan & I. O'Muircheartaigh, J. Phys. Oceanogr. 10, 2094 (1980): 3.84e-6 U^3.41.
    """
    return min(3.84e-6 * wind_speed**3.41, 1.0)


def foam_reflectance(wavelength: ArrayLike) -> NDArray[np.float64]:
    """Reflectance of fresh foam: that of the visible, falling in the red and infrared, from nm.

    Level: :data:`FRESH_REFLECTANCE`. Fall: R. Frouin, M. Schwindling & P.-Y. Deschamps,
    J. Geophys. Res. 101, 14361 (1996), 1 up to 555 nm, .889 at 670 nm, .760 at 765 nm and .645 at
    865 nm, linear between them.
    """
    wavelength = np.asarray(wavelength, dtype=np.float64)
    return FRESH_REFLECTANCE * np.interp(wavelength, _WAVELENGTHS, _FALL)


@dataclass(frozen=True)
class Foam:
    """Bounds of the crowding."""

    first: Operand  #: Where foam begins.
    per_crowding: Operand  #: How fast its fraction of the surface grows from there.

    def fraction(self, crowding: Operand, m: Mathematics = NUMPY) -> Operand:
        """Fraction of the surface, 0 to 1, that is fresh foam: it reflects so much of that's."""
        return m.clamp((crowding - self.first) * self.per_crowding, 0.0, 1.0)


def seen_with_foam(surface: Operand, foam: Operand, fraction: Operand) -> Operand:
    """Radiance of a surface part of which is foam.

    Examples
    --------
    >>> seen_with_foam(0.2, 1.0, 0.25)
    0.4
    """
    return surface + fraction * (foam - surface)


def breaking(waves: WaveComponents, resolution: int) -> WaveComponents:
    """Waves that are long enough to leave foam which so many samples along a tile show."""
    return waves.below(2 * math.pi / max(SHORTEST, _SAMPLES * waves.tile / resolution))


def foam_of(parts: tuple[WaveComponents, WaveComponents], cover: float) -> Foam:
    """Choose the bounds for a cover of the sea, and for the mean reflectance of foam.

    ``parts`` break on two tiles, each moved by its own waves only; ``cover`` is the fraction of the
    sea that foam covers.

    To first order in the steepness the crowding is Gaussian, with the variance σ² of the slopes. A
    unit of area at rest covers the mean area ``1 - c + q (c² - σ²)`` of the surface where its
    crowding is c: the expectation of the Jacobian, in which q is 1/4 if waves run to all sides.
    """
    sea = tuple(_Crowding.of(waves) for waves in parts)
    width = math.hypot(*(part.sigma for part in sea))
    if not (cover > 0 and width > 0):
        return Foam(_NOWHERE, 1.0)
    first = _zero_of(lambda bound: cover - _exceeded(sea, bound), -_WIDEST * width, _WIDEST * width)
    wanted = EFFECTIVE_REFLECTANCE / FRESH_REFLECTANCE * _exceeded(sea, first)

    def too_dim(ramp: float) -> float:
        bounds = np.linspace(first, first + ramp, _STEPS)
        return wanted - float(np.mean(_between([_exceeded(sea, x) for x in bounds.tolist()])))

    return Foam(first, 1.0 / _zero_of(too_dim, 0.0, _WIDEST * width))


@dataclass(frozen=True)
class _Crowding:
    """Statistics of the crowding of a tile.

    Standard deviation, q of :func:`foam_of`, and the excess kurtosis: waves of a tile are many but
    not endlessly many, and do not reach as far as a Gaussian. Edgeworth's series takes it in.
    """

    sigma: float
    q: float
    excess: float

    @classmethod
    def of(cls, waves: WaveComponents) -> _Crowding:
        half, (kx, ky) = waves.amplitude**2 / 2, waves.k.T
        xx, yy, xy = (float(np.sum(half * k2)) for k2 in (kx * kx, ky * ky, kx * ky))
        variance = xx + yy
        if variance < _CALM:
            return cls(0.0, 0.0, 0.0)
        fourth = float(np.sum((half * (kx * kx + ky * ky) / variance) ** 2))
        return cls(math.sqrt(variance), (xx * yy - xy**2) / variance**2, -1.5 * fourth)

    def covers(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Area where the crowding is z standard deviations, over the Gaussian density there."""
        area = 1.0 - self.sigma * z + self.q * self.sigma**2 * (z**2 - 1.0)
        return area * (1.0 + self.excess / 24.0 * (z**4 - 6.0 * z**2 + 3.0))

    def area_above(self, bound: float) -> float:
        """Area where it exceeds a bound."""
        if self.sigma == 0:
            return float(bound < 0)
        z, s, q2 = bound / self.sigma, self.sigma, self.q * self.sigma**2
        density = math.exp(-0.5 * z * z) / math.sqrt(2 * math.pi)
        # Hermite polynomials, each of which times the density is an integral of the next.
        h2, h3, h4 = z**2 - 1, z**3 - 3 * z, z**4 - 6 * z**2 + 3
        h5 = z**5 - 10 * z**3 + 15 * z
        skewed = h3 - s * (h4 + 4 * h2) + q2 * (h5 + 8 * h3 + 12 * z)
        rest = q2 * z - s + self.excess / 24.0 * skewed
        return 0.5 * math.erfc(z / math.sqrt(2)) + rest * density


def _exceeded(sea: tuple[_Crowding, ...], bound: float) -> float:
    """Fraction of the surface where the crowding of two tiles exceeds a bound."""
    near, far = sea
    z, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    above = [near.area_above(bound - far.sigma * x) for x in z.tolist()]
    return float(np.sum(weights * far.covers(z) * above) / math.sqrt(2 * math.pi))


def _between(values: list[float]) -> NDArray[np.float64]:
    found = np.array(values)
    return 0.5 * (found[1:] + found[:-1])


def _zero_of(rising: Callable[[float], float], low: float, high: float) -> float:
    """Where a rising function is 0, by halving."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rising(middle) < 0 else (low, middle)
    return high
