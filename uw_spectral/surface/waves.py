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
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

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
_FINE_CELLS = 24  # lattice cells from the origin that are integrated, not sampled
_CHUNK = 1 << 22
_LEAST_STRETCH = 0.02
_RESTING = 5  # steps that find where a point rests; each leaves a fraction of the steepness


@dataclass(frozen=True)
class WaveSpectrum:
    """Directional wave spectrum: Elfouhaily et al. (1997), slopes of Cox & Munk (1954).

    Parameters
    ----------
    wind_speed : float
        At 10 m height, m/s, 0 to 40. No wind, no waves.
    wind_direction : float
        The wind blows *to* it, degrees from +x towards +y.
    fetch : float
        Length over which it blows, m.
    depth : float
        Of the water, m; it enters the dispersion only.

    Raises
    ------
    InputError
        If a value is out of its range.

    Notes
    -----
    T. Elfouhaily, B. Chapron, K. Katsaros & D. Vandemark, J. Geophys. Res. 102,
    15781 (1997), with the friction velocity of its own roughness length. As
    published it has 1.55, 1.12 and 1.12 times the slope variance of Cox & Munk
    at 2, 5 and 10 m/s; the shorter waves are scaled, by one factor per wind speed
    (that of unlimited fetch), so that it is theirs.

    Examples
    --------
    >>> round(WaveSpectrum(10.0).significant_height, 1)
    2.2
    """

    wind_speed: float
    wind_direction: float = 0.0
    fetch: float = LONGEST_FETCH
    depth: float = math.inf

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
        """Saturation B(k) = k³ S(k), the slope variance per unit of ln k.

        Parameters
        ----------
        k : array_like
            Wave number, rad/m, positive.

        Returns
        -------
        array
            Dimensionless.
        """
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
        """Slope variance of the waves between two wave numbers.

        Returns
        -------
        array, shape (2,)
            Along and across the wind; their sum is the mean square slope.

        Examples
        --------
        >>> WaveSpectrum(5.0).slope_variance().sum().round(3)
        np.float64(0.028)
        """
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
        k_min: float = 0.0,
        k_max: float = math.inf,
        loop_seconds: float | None = None,
    ) -> WaveComponents:
        """Draw one sea on a periodic tile.

        Parameters
        ----------
        tile : float
            Side of the tile, m.
        resolution : int
            Samples along a side that must carry the waves: components go up to
            ``resolution/2 - 1`` periods per tile in either axis.
        seed : int
            Of the phases.
        k_min, k_max : float
            Range of wave numbers, rad/m: for several tiles that share the spectrum.
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
        kept = with_wind & (k >= k_min) & (k < k_max)
        index = np.stack([ix[kept], iy[kept]], axis=-1)
        variance = 2 * _cell_variance(self, index, unit)
        # Drawn before the empty cells go, one per cell: the phases do not depend on the wind.
        phase = np.random.default_rng(seed).uniform(0, 2 * math.pi, len(index))
        present = variance > 0
        index, variance, phase = index[present], variance[present], phase[present]
        frequency = angular_frequency(unit * np.hypot(*index.T), self.depth)
        if loop_seconds is not None:
            step = 2 * math.pi / loop_seconds
            frequency = np.maximum(np.round(frequency / step), 1) * step
        # Circles of the same area as the squares of the lattice.
        longest = max(k_min, unit / math.sqrt(math.pi))
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
        )


@dataclass(frozen=True, eq=False)
class WaveComponents:
    """A sea surface: a sum of travelling cosines on the lattice of a tile.

    ``η = Σ a cos(k·x - ω t + φ)`` with ``k = 2π index / tile``.

    Attributes
    ----------
    tile : float
        Side of the square after which the surface repeats, m.
    index : array of int, shape (m, 2)
        Periods per tile along x and y.
    amplitude, frequency, phase : array, shape (m,)
        a in m, ω in rad/s, φ in rad.
    wind_direction : float
        Degrees from +x towards +y, where the wind blows to.
    longer, shorter : array, shape (2,)
        Slope variance along and across the wind of the waves left out because
        they are longer than the tile, and shorter than its resolution.
    """

    tile: float
    index: NDArray[np.int64]
    amplitude: NDArray[np.float64]
    frequency: NDArray[np.float64]
    phase: NDArray[np.float64]
    wind_direction: float
    longer: NDArray[np.float64]
    shorter: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.amplitude)

    @property
    def k(self) -> NDArray[np.float64]:
        """Wave vectors, rad/m, shape (m, 2)."""
        return 2 * math.pi / self.tile * self.index.astype(np.float64)

    @property
    def slope_variance(self) -> NDArray[np.float64]:
        """Slope variance of the realised waves along and across the wind, shape (2,)."""
        turn = math.radians(self.wind_direction)
        kx, ky = self.k.T
        along, across = (
            kx * math.cos(turn) + ky * math.sin(turn),
            ky * math.cos(turn) - kx * math.sin(turn),
        )
        half = self.amplitude**2 / 2
        return np.array([np.sum(half * along**2), np.sum(half * across**2)])

    @property
    def elevation_variance(self) -> float:
        """Variance of the elevation, m²."""
        return float(np.sum(self.amplitude**2) / 2)

    def below(self, k_max: float) -> WaveComponents:
        """Keep the waves below a wave number; the slope variance of the others adds to `shorter`.

        Parameters
        ----------
        k_max : float
            rad/m.
        """
        kept = np.hypot(*self.k.T) < k_max
        low = self._only(kept)
        lost = self.slope_variance - low.slope_variance
        return self._only(kept, shorter=self.shorter + np.maximum(lost, 0))

    def elevation(self, x: ArrayLike, y: ArrayLike, t: float) -> NDArray[np.float64]:
        """Elevation of the surface at points, m.

        Parameters
        ----------
        x, y : array_like
            Horizontal position, m; any shape.
        t : float
            Time, s.
        """
        return self._sum(x, y, t)[0]

    def slopes(self, x: ArrayLike, y: ArrayLike, t: float) -> tuple[NDArray, NDArray]:
        """Slopes ∂η/∂x and ∂η/∂y at points."""
        _, slope_x, slope_y = self._sum(x, y, t)
        return slope_x, slope_y

    def on_grid(self, resolution: int, t: float) -> tuple[NDArray, NDArray, NDArray]:
        """Elevation and slopes on a grid of the tile, by FFT.

        Parameters
        ----------
        resolution : int
            Samples N along a side; row i, column j is at y = i tile/N, x = j tile/N.
        t : float
            Time, s.

        Returns
        -------
        elevation, slope_x, slope_y : array, shape (N, N)

        Raises
        ------
        InputError
            If the grid is too coarse for the shortest wave.
        """
        half, kx, ky = self._transform(resolution, t)
        elevation, slope_x, slope_y = (
            np.fft.irfft2(factor * half, (resolution, resolution), norm="forward")
            for factor in (1.0, 1j * kx, 1j * ky)
        )
        return elevation, slope_x, slope_y

    def choppy(self, resolution: int, t: float, choppiness: float = 1.0) -> ChoppySurface:
        """Move the water to and fro beneath its waves, which sharpens crests, on a grid by FFT.

        Parameters
        ----------
        resolution, t
            As for :meth:`on_grid`.
        choppiness : float
            1 moves a particle of deep water on its circle; 0 is the linear surface.

        Raises
        ------
        InputError
            If the grid is too coarse for the shortest wave.

        Notes
        -----
        F. Nouguier, C.-A. Guérin & B. Chapron, J. Geophys. Res. 114, C09012 (2009): the horizontal
        displacement is the Hilbert transform of the elevation, as in J. Tessendorf,
        *Simulating Ocean Water*, SIGGRAPH course notes (1999). A single wave becomes Gerstner's.
        """
        half, kx, ky = self._transform(resolution, t)
        k = np.hypot(kx, ky)
        per_k = choppiness / np.where(k > 0, k, 1.0)
        elevation, rise_x, rise_y, shift_x, shift_y, xx, xy, yy = (
            np.asarray(
                np.fft.irfft2(factor * half, (resolution, resolution), norm="forward"), np.float64
            )
            for factor in (
                1.0, 1j * kx, 1j * ky, 1j * kx * per_k, 1j * ky * per_k,
                -kx * kx * per_k, -kx * ky * per_k, -ky * ky * per_k,
            )
        )  # fmt: skip
        stretch = (1 + xx) * (1 + yy) - xy * xy
        # Where the surface folds it stands upright: no slope is steeper than this.
        safe = np.where(stretch < 0, -1.0, 1.0) * np.maximum(np.abs(stretch), _LEAST_STRETCH)
        slope_x = ((1 + yy) * rise_x - xy * rise_y) / safe
        slope_y = ((1 + xx) * rise_y - xy * rise_x) / safe
        return ChoppySurface(self.tile, elevation, shift_x, shift_y, slope_x, slope_y, stretch)

    def crowding(self, resolution: int, t: float) -> NDArray[np.float64]:
        """How much the choppy waves crowd the water together where it rests, on a grid by FFT.

        Parameters
        ----------
        resolution, t
            As for :meth:`on_grid`.

        Returns
        -------
        array, shape (N, N)
            1 less the Jacobian of the displacement of :meth:`choppy`, to first order in the
            steepness: ``Σ k a cos``.
        """
        half, kx, ky = self._transform(resolution, t)
        shape = resolution, resolution
        return np.asarray(np.fft.irfft2(np.hypot(kx, ky) * half, shape, norm="forward"), np.float64)

    def _transform(self, resolution: int, t: float) -> tuple[NDArray, NDArray, NDArray]:
        """Elevation as irfft2 with norm "forward" takes it, and the wave numbers of its columns
        and rows.
        """
        if len(self) and resolution <= 2 * np.abs(self.index).max():
            raise InputError(
                f"waves: a grid of {resolution} cannot carry {np.abs(self.index).max()} periods; "
                "take a finer one, or drop short waves with below()"
            )
        half = np.zeros((resolution, resolution // 2 + 1), dtype=np.complex128)
        ix, iy = self.index.T
        value = self.amplitude / 2 * np.exp(1j * self._angle(t))
        # The spectrum of a real field: a wave with ix < 0 is the conjugate one at -k.
        sign = np.where(ix < 0, -1, 1)
        value = np.where(ix < 0, np.conj(value), value)
        rows, columns = (sign * iy) % resolution, sign * ix
        half[rows, columns] = value
        axis = columns == 0  # both signs of ky are stored there
        half[-rows[axis] % resolution, 0] = np.conj(value[axis])
        unit = 2 * math.pi / self.tile
        kx = unit * np.arange(resolution // 2 + 1)
        ky = unit * resolution * np.fft.fftfreq(resolution)[:, None]
        return half, kx, ky

    def _only(self, kept: NDArray, shorter: NDArray[np.float64] | None = None) -> WaveComponents:
        return WaveComponents(
            self.tile, self.index[kept], self.amplitude[kept], self.frequency[kept],
            self.phase[kept], self.wind_direction, self.longer,
            self.shorter if shorter is None else shorter,
        )  # fmt: skip

    def _angle(self, t: float) -> NDArray[np.float64]:
        return self.phase - np.mod(self.frequency * t, 2 * math.pi)

    def _sum(self, x: ArrayLike, y: ArrayLike, t: float) -> tuple[NDArray, NDArray, NDArray]:
        x, y = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, np.float64))
        unit = 2 * math.pi / self.tile
        points = np.stack([np.mod(x, self.tile).ravel(), np.mod(y, self.tile).ravel()])
        total = np.zeros((3, points.shape[1]))
        start, step = self._angle(t), max(_CHUNK // max(points.shape[1], 1), 1)
        for first in range(0, len(self), step):
            part = slice(first, first + step)
            k, a = unit * self.index[part], self.amplitude[part]
            angle = k @ points + start[part, None]
            total[0] += a @ np.cos(angle)
            total[1:] -= (a[:, None] * k).T @ np.sin(angle)
        elevation, slope_x, slope_y = total.reshape(3, *x.shape)
        return elevation, slope_x, slope_y


@dataclass(frozen=True, eq=False)
class ChoppySurface:
    """A surface whose points are displaced horizontally too; all arrays have shape (N, N).

    The point that rests at y = i tile/N, x = j tile/N is at that place plus its shift.

    Attributes
    ----------
    tile : float
        Side of the square after which the surface repeats, m.
    elevation : array
        m.
    shift_x, shift_y : array
        Horizontal displacement, m.
    slope_x, slope_y : array
        Slopes of the displaced surface at the point.
    stretch : array
        Jacobian of the displacement: area of the mean surface that a unit of area at rest covers.
        Small at crests; below 0 the surface folds over.
    """

    tile: float
    elevation: NDArray[np.float64]
    shift_x: NDArray[np.float64]
    shift_y: NDArray[np.float64]
    slope_x: NDArray[np.float64]
    slope_y: NDArray[np.float64]
    stretch: NDArray[np.float64]

    def over_mean(self, resolution: int, *fields: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return fields of the points at the places over which the points are.

        Where the surface folds it is one of the layers that lie over a place.

        Parameters
        ----------
        resolution : int
            Samples M along a side; half of N keeps the shortest waves.
        *fields : arrays of shape (N, N)
            Such as :attr:`elevation`: of the points, by where they rest.

        Returns
        -------
        list of arrays of shape (M, M)
            Row i, column j is at y = i tile/M, x = j tile/M.
        """
        size = len(self.elevation)
        per_cell = size / self.tile
        rest = np.arange(resolution, dtype=np.float64) * (size / resolution)
        x, y = np.meshgrid(rest, rest)
        row: NDArray[np.float64] = y
        column: NDArray[np.float64] = x
        for _ in range(_RESTING):
            shift_x, shift_y = periodic_at([self.shift_x, self.shift_y], row, column)
            row, column = y - per_cell * shift_y, x - per_cell * shift_x
        return periodic_at(fields, row, column)


def periodic_at(
    fields: Sequence[NDArray[np.float64]], row: NDArray[np.float64], column: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Interpolate periodic fields of one square shape between their samples, bilinearly.

    Parameters
    ----------
    fields : sequence of arrays of shape (N, N)
    row, column : array
        Places, in samples.

    Examples
    --------
    >>> periodic_at([np.arange(4.0).reshape(2, 2)], np.array([0.0, 0.5]), np.array([0.5, 1.0]))
    [array([0.5, 2. ])]
    """
    size = len(fields[0])
    lower, left = np.floor(row), np.floor(column)
    up, right = row - lower, column - left
    i, j = np.mod(lower, size).astype(np.intp), np.mod(left, size).astype(np.intp)
    k, m = np.where(i == size - 1, 0, i + 1), np.where(j == size - 1, 0, j + 1)
    return [
        (1 - up) * ((1 - right) * f[i, j] + right * f[i, m])
        + up * ((1 - right) * f[k, j] + right * f[k, m])
        for f in fields
    ]


def angular_frequency(k: ArrayLike, depth: float = math.inf) -> NDArray[np.float64]:
    """Dispersion of gravity-capillary waves, ω² = g k (1 + (k/km)²) tanh(k d).

    Parameters
    ----------
    k : array_like
        Wave number, rad/m.
    depth : float
        Of the water, m.

    Returns
    -------
    array
        rad/s.

    Examples
    --------
    >>> angular_frequency(1.0).round(3)
    np.float64(3.132)
    """
    k = np.asarray(k, dtype=np.float64)
    shallow = np.tanh(np.minimum(k * depth, 30.0)) if math.isfinite(depth) else 1.0
    return np.sqrt(GRAVITY * k * (1 + (k / _KM) ** 2) * shallow)


def slope_variance_CoxMunk1954(wind_speed: float) -> NDArray[np.float64]:
    """Slope variance of a clean sea, along and across the wind.

    Parameters
    ----------
    wind_speed : float
        At 12.5 m, m/s; measured between 1 and 14.

    Returns
    -------
    array, shape (2,)

    Notes
    -----
    C. Cox & W. Munk, J. Opt. Soc. Am. 44, 838 (1954): 0.00316 U ± 0.004 and
    0.003 + 0.00192 U ± 0.002; their sum has ± 0.004.

    Examples
    --------
    >>> slope_variance_CoxMunk1954(10.0)
    array([0.0316, 0.0222])
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
    near = np.abs(index).max(axis=-1) <= _FINE_CELLS
    if near.any():
        offsets = (np.arange(8) + 0.5) / 8 - 0.5
        sub = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
        k = unit * (index[near][:, None] + sub)
        slope = spectrum.density(k[..., 0], k[..., 1]) * (k**2).sum(axis=-1)
        variance[near] = slope.mean(axis=-1) / (unit**2 * (index[near] ** 2).sum(axis=-1))
    return variance * unit**2
