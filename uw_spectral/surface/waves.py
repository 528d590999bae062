"""Wind waves: a directional spectrum and one realisation of it on a periodic tile.

The spectrum is the unified one of Elfouhaily et al. (1997): JONSWAP-like
gravity waves of a given fetch and gravity-capillary waves. What matters for
light is the slope, so the shorter waves are scaled until the slope variance of
the open sea is that of Cox & Munk (1954). A realisation is a finite sum of
cosines on the integer lattice of a square tile, so that it repeats without a
seam; it is a function of place and time, never of history.

Axes are Blender's: x, y horizontal, z up, metres.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .wave_components import FINE_CELLS, WaveComponents, WavePatches

GRAVITY = 9.81
"""m/s²."""
LONGEST_FETCH = 5e5
"""m; a longer one changes nothing, the sea is fully developed."""
FASTEST_WIND = 40.0
"""m/s; beyond, the spectrum is not supported by any measurement."""

_KM = 370.0  # rad/m, of the slowest wave
_CM = 0.23  # m/s, its phase speed
_SHORTEST = 6000.0  # rad/m; the spectrum is zero well before
_SHORT = 10.0  # times the peak: where the scaling of the shorter waves is half of its whole
_RIPPLES = 100.0  # rad/m; shorter waves follow the wind of the moment, longer ones hardly do
_PEAKEDNESS = 0.12


@dataclass(frozen=True)
class WaveSpectrum:
    """Directional wave spectrum: Elfouhaily et al. (1997), slopes of Cox & Munk (1954).

    T. Elfouhaily, B. Chapron, K. Katsaros & D. Vandemark, J. Geophys. Res. 102,
    15781 (1997), with the friction velocity of its own roughness length. As
    published it has 1.55, 1.12 and 1.12 times the slope variance of Cox & Munk
    at 2, 5 and 10 m/s; the shorter waves are scaled, by one factor per wind speed
    (that of unlimited fetch), so that it is theirs.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> round(WaveSpectrum(10.0).significant_height, 1)
    2.2
    """

    wind_speed: float  #: At 10 m height, m/s, 0 to 40. No wind, no waves.
    wind_direction: float = 0.0  #: The wind blows *to* it, degrees from +x towards +y.
    fetch: float = LONGEST_FETCH  #: Length over which it blows, m.
    depth: float = math.inf  #: Of the water, m; it enters the dispersion only.

    def __post_init__(self) -> None:
        if not 0 <= self.wind_speed <= FASTEST_WIND:
            raise InputError(
                f"wind speed must be 0 to {FASTEST_WIND:g} m/s, got {self.wind_speed:g}"
            )
        if not math.isfinite(self.wind_direction):
            raise InputError(f"wind direction must be finite, got {self.wind_direction:g}")
        if not self.fetch > 0:
            raise InputError(f"fetch must be positive, got {self.fetch:g} m")
        if not self.depth > 0:
            raise InputError(f"depth of the water must be positive, got {self.depth:g} m")

    @property
    def wave_age(self) -> float:
        """Inverse wave age Ω, 0.84 for a fully developed sea, up to 5."""
        reach = GRAVITY * min(self.fetch, LONGEST_FETCH) / max(self.wind_speed, 0.1) ** 2
        return min(0.84 * math.tanh((reach / 2.2e4) ** 0.4) ** -0.75, 5.0)

    @property
    def friction_velocity(self) -> float:
        """u* of the logarithmic wind profile, m/s."""
        wind = max(self.wind_speed, 0.1)
        roughness = 3.7e-5 * wind**2 / GRAVITY * self.wave_age**0.9
        return 0.4 * wind / math.log(10 / roughness)

    @property
    def peak(self) -> float:
        """Wave number of the spectral peak, rad/m."""
        return GRAVITY * (self.wave_age / max(self.wind_speed, 0.1)) ** 2

    def curvature(self, k: ArrayLike) -> NDArray[np.float64]:
        """Saturation B(k) = k³ S(k), the slope variance per unit of ln k."""
        k = np.asarray(k, dtype=np.float64)
        if self.wind_speed == 0:
            return np.zeros_like(k)
        fraction = k / (k + _SHORT * self.peak)
        return self.curvature_Elfouhaily1997(k) * (
            1 + (_short_gain(self.wind_speed) - 1) * fraction
        )

    def curvature_Elfouhaily1997(self, k: ArrayLike) -> NDArray[np.float64]:
        """Saturation as published, without the constraint by Cox & Munk."""
        k = np.asarray(k, dtype=np.float64)
        age, kp = self.wave_age, self.peak
        root = np.sqrt(k / kp)
        speed = _phase_speed(k)
        gamma = 1.7 + 6 * math.log10(max(age, 1.0))
        sigma = 0.08 * (1 + 4 * age**-3)
        peak = np.exp(-1.25 * (kp / k) ** 2) * gamma ** np.exp(-((root - 1) ** 2) / (2 * sigma**2))
        long = 3e-3 * math.sqrt(age) * math.sqrt(GRAVITY / kp) / speed
        long = long * np.exp(-age / math.sqrt(10) * (root - 1))
        ratio = math.log(self.friction_velocity / _CM)
        short = max(0.005 * (1 + (3 if ratio > 0 else 1) * ratio), 0.0) * _CM / speed
        return peak * (long + short * np.exp(-0.25 * (k / _KM - 1) ** 2))

    def spreading(self, k: ArrayLike) -> NDArray[np.float64]:
        """Δ(k) of the angular spreading (1 + Δ cos 2φ)/(2π), φ from the wind."""
        speed = _phase_speed(np.asarray(k, dtype=np.float64))
        peak_speed = math.sqrt(GRAVITY / self.peak)
        short = 0.13 * self.friction_velocity / _CM
        return np.tanh(
            math.log(2) / 4 + 4 * (speed / peak_speed) ** 2.5 + short * (_CM / speed) ** 2.5
        )

    def density(self, kx: ArrayLike, ky: ArrayLike) -> NDArray[np.float64]:
        """Variance of elevation Ψ(kx, ky) per (rad/m)², m⁴, symmetric in k.

        Its integral over all k is the variance of the elevation.
        """
        kx, ky = np.broadcast_arrays(
            np.asarray(kx, dtype=np.float64), np.asarray(ky, dtype=np.float64)
        )
        k2 = np.maximum(kx * kx + ky * ky, 1e-12)
        k = np.sqrt(k2)
        turn = math.radians(self.wind_direction)
        cos2 = 2 * (kx * math.cos(turn) + ky * math.sin(turn)) ** 2 / k2 - 1
        return self.curvature(k) * (1 + self.spreading(k) * cos2) / (2 * math.pi * k2 * k2)

    def slope_variance(self, k_min: float = 0.0, k_max: float = math.inf) -> NDArray[np.float64]:
        """Slope variance of the waves between two wave numbers, along and across the wind, (2,)."""
        k, weight = _logarithmic(max(k_min, self.peak / 30), min(k_max, _SHORTEST))
        B, spread = self.curvature(k) * weight, self.spreading(k)
        return np.array([np.sum(B * (1 + spread / 2)), np.sum(B * (1 - spread / 2))]) / 2

    @property
    def mean_square_slope(self) -> float:
        """Slope variance of all waves, along and across the wind together.

        Examples
        --------
        >>> round(WaveSpectrum(5.0).mean_square_slope, 3)
        0.028
        """
        return _mean_square_slope(self)

    @property
    def ripples(self) -> WavePatches:
        """Waves shorter than 6 cm, and how unevenly they lie on the sea.

        Slopes of Cox & Munk (1954) are more peaked than Gaussian ones: c₂₂ = 0.12 ± 0.06. Where
        the slope variance differs from place to place (Chapron et al., J. Geophys. Res. 105, 17195,
        2000), that is its relative variance. It is laid on the waves that follow the local wind,
        those beyond 100 rad/m (Yurovskaya et al., J. Geophys. Res. 118, 4380, 2013).
        """
        variance = self.slope_variance(_RIPPLES)
        fraction = variance.sum() / max(self.mean_square_slope, 1e-12)
        return WavePatches(_RIPPLES, variance, _PEAKEDNESS / fraction**2 if fraction > 0 else 0.0)

    @property
    def significant_height(self) -> float:
        """Significant wave height, four standard deviations of the elevation, m."""
        k, weight = _logarithmic(self.peak / 30, _SHORTEST)
        return 4 * math.sqrt(np.sum(self.curvature(k) * weight / k**2))

    def realise(
        self,
        tile: float,
        resolution: int,
        seed: int = 0,
        *,
        k_max: float = math.inf,
        loop_seconds: float | None = None,
    ) -> WaveComponents:
        """Draw one sea on a periodic tile.

        Parameters
        ----------
        resolution : int
            Samples along a side that must carry the waves: components go up to
            ``resolution/2 - 1`` periods per tile in either axis.
        k_max : float
            Highest wave number, rad/m: for several tiles that share the spectrum.
        loop_seconds : float, optional
            Make the motion repeat after this time: frequencies become whole
            multiples of 2π over it.

        Returns
        -------
        WaveComponents
            Empty without wind. Amplitudes follow the spectrum, only the phases
            are drawn: variance is that of the spectrum for every seed.

        Raises
        ------
        InputError
            If the tile, the resolution or the loop is not positive.
        """
        if not (tile > 0 and math.isfinite(tile)):
            raise InputError(f"waves: the tile must have a positive side, got {tile:g} m")
        if not 4 <= resolution <= 8192:
            raise InputError(f"waves: the resolution must be 4 to 8192, got {resolution}")
        if loop_seconds is not None and not (loop_seconds > 0 and math.isfinite(loop_seconds)):
            raise InputError(f"waves: the loop must last a positive time, got {loop_seconds:g} s")
        unit, reach = 2 * math.pi / tile, resolution // 2 - 1
        span = np.arange(-reach, reach + 1)
        ix, iy = (axis.ravel() for axis in np.meshgrid(span, span))
        turn = math.radians(self.wind_direction)
        # The spectrum is symmetric; the energy of k and -k travels with the wind.
        along = ix * math.cos(turn) + iy * math.sin(turn)
        across = iy * math.cos(turn) - ix * math.sin(turn)
        with_wind = (along > 1e-9) | ((along > -1e-9) & (across > 0))
        k = unit * np.hypot(ix, iy)
        kept = with_wind & (k < k_max)
        index = np.stack([ix[kept], iy[kept]], axis=-1)
        variance = 2 * _cell_variance(self, index, unit)
        # Drawn before the empty cells go, one per cell: the phases do not depend on the wind.
        phase = np.random.default_rng(seed).uniform(0, 2 * math.pi, len(index))
        present = variance > 0
        index, variance, phase = index[present], variance[present], phase[present]
        frequency = angular_frequency(unit * np.hypot(*index.T), self.depth)
        frequency = in_loop(frequency, loop_seconds)
        # Circles of the same area as the squares of the lattice.
        longest = unit / math.sqrt(math.pi)
        shortest = min(k_max, unit * (2 * reach + 1) / math.sqrt(math.pi))
        return WaveComponents(
            tile=float(tile),
            index=index,
            amplitude=np.sqrt(2 * variance),
            frequency=frequency,
            phase=phase,
            wind_direction=self.wind_direction,
            longer=self.slope_variance(0.0, longest),
            shorter=self.slope_variance(shortest),
            ripples=self.ripples,
        )


def angular_frequency(k: ArrayLike, depth: float = math.inf) -> NDArray[np.float64]:
    """Dispersion of gravity-capillary waves, ω² = g k (1 + (k/km)²) tanh(k d)."""
    k = np.asarray(k, dtype=np.float64)
    shallow = np.tanh(np.minimum(k * depth, 30.0)) if math.isfinite(depth) else 1.0
    return np.sqrt(GRAVITY * k * (1 + (k / _KM) ** 2) * shallow)


def in_loop(frequency: NDArray[np.float64], loop_seconds: float | None) -> NDArray[np.float64]:
    """Nearest frequencies, rad/s, with which motion repeats after a time; as they are without."""
    if loop_seconds is None:
        return frequency
    step = 2 * math.pi / loop_seconds
    return np.maximum(np.round(frequency / step), 1) * step


def slope_variance_CoxMunk1954(wind_speed: float) -> NDArray[np.float64]:
    """Slope variance of a clean sea, along and across the wind, shape (2,).

    The wind speed is at 12.5 m, m/s; measured between 1 and 14.

    C. Cox & W. Munk, J. Opt. Soc. Am. 44, 838 (1954): 0.00316 U ± 0.004 and
    0.003 + 0.00192 U ± 0.002; their sum has ± 0.004.
    """
    return np.array([0.00316 * wind_speed, 0.003 + 0.00192 * wind_speed])


def _phase_speed(k: NDArray[np.float64]) -> NDArray[np.float64]:
    """In deep water, as the spectrum was fitted."""
    return np.sqrt(GRAVITY / k * (1 + (k / _KM) ** 2))


def _logarithmic(low: float, high: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wave numbers and weights dln k of a quadrature."""
    nodes, weights = _legendre()
    span = max(math.log(high / low), 0.0)
    return low * np.exp(span * nodes), span * weights


@functools.lru_cache(maxsize=256)
def _mean_square_slope(sea: WaveSpectrum) -> float:
    return float(sea.slope_variance().sum())


@functools.lru_cache(maxsize=256)
def _short_gain(wind_speed: float) -> float:
    """Factor of the shorter waves that gives the slope variance of Cox & Munk."""
    sea = WaveSpectrum(wind_speed)
    k, weight = _logarithmic(sea.peak / 30, _SHORTEST)
    B = sea.curvature_Elfouhaily1997(k) * weight
    short = np.sum(B * k / (k + _SHORT * sea.peak))
    return max(1 + float((slope_variance_CoxMunk1954(wind_speed).sum() - B.sum()) / short), 0.0)


@functools.cache
def _legendre() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    nodes, weights = np.polynomial.legendre.leggauss(400)
    return (nodes + 1) / 2, weights / 2


def _cell_variance(
    spectrum: WaveSpectrum, index: NDArray[np.int64], unit: float
) -> NDArray[np.float64]:
    """Elevation variance of each lattice cell such that its slope variance is right."""
    variance = spectrum.density(*(unit * index.T))
    near = np.abs(index).max(axis=-1) <= FINE_CELLS
    if near.any():
        offsets = (np.arange(8) + 0.5) / 8 - 0.5
        sub = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
        k = unit * (index[near][:, None] + sub)
        slope = spectrum.density(k[..., 0], k[..., 1]) * (k**2).sum(axis=-1)
        variance[near] = slope.mean(axis=-1) / (unit**2 * (index[near] ** 2).sum(axis=-1))
    return variance * unit**2
