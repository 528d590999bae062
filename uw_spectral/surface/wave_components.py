"""A sea as a sum of waves that move: heights, slopes and sharp crests of a periodic square."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

FINE_CELLS = 24  # lattice cells from the origin that are integrated, not sampled
_CHUNK = 1 << 22
_LEAST_STRETCH = 0.02
_RESTING = 5  # steps that find where a point rests; each leaves a fraction of the steepness


@dataclass(frozen=True, eq=False)
class WavePatches:
    """Waves so short that gusts and longer waves make them rise here and vanish there."""

    longest: float  #: Wave number from which waves are ripples, rad/m.
    variance: NDArray[np.float64]  #: Mean slope variance along and across the wind, (2,).
    #: Variance of the slope variance from place to place, over its mean squared.
    unevenness: float


EVEN = WavePatches(math.inf, np.zeros(2), 0.0)
"""No ripples apart from the other waves."""


@dataclass(frozen=True, eq=False)
class WaveComponents:
    """A sea surface: a sum of travelling cosines on the lattice of a tile.

    ``η = Σ a cos(k·x - ω t + φ)`` with ``k = 2π index / tile``.
    """

    tile: float  #: Side of the square after which the surface repeats, m.
    index: NDArray[np.int64]  #: Periods per tile along x and y, (m, 2).
    #: a in m, ω in rad/s, φ in rad, (m,).
    amplitude: NDArray[np.float64]
    frequency: NDArray[np.float64]
    phase: NDArray[np.float64]
    wind_direction: float  #: Degrees from +x towards +y, where the wind blows to.
    #: Slope variance along and across the wind of the waves left out because they are longer than
    #: the tile, and shorter than its resolution, (2,).
    longer: NDArray[np.float64]
    shorter: NDArray[np.float64]
    ripples: WavePatches = EVEN  #: Those of the whole sea, on the tile or not.

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
        """Keep the waves below a wave number; `shorter` gains the slope variance of the others."""
        kept = np.hypot(*self.k.T) < k_max
        arrays = ("index", "amplitude", "frequency", "phase")
        low = replace(self, **{name: getattr(self, name)[kept] for name in arrays})
        lost = self.slope_variance - low.slope_variance
        return replace(low, shorter=self.shorter + np.maximum(lost, 0))

    def elevation(self, x: ArrayLike, y: ArrayLike, t: float) -> NDArray[np.float64]:
        """Elevation of the surface at points, m."""
        return self._sum(x, y, t)[0]

    def slopes(self, x: ArrayLike, y: ArrayLike, t: float) -> tuple[NDArray, NDArray]:
        """Slopes ∂η/∂x and ∂η/∂y at points."""
        _, slope_x, slope_y = self._sum(x, y, t)
        return slope_x, slope_y

    def on_grid(self, resolution: int, t: float) -> tuple[NDArray, NDArray, NDArray]:
        """Elevation and slopes along x and y on a grid of the tile, by FFT, each (N, N).

        Row i, column j is at y = i tile/N, x = j tile/N for the resolution N.

        Raises
        ------
        InputError
            If the grid is too coarse for the shortest wave.
        """
        half, kx, ky = self._transform(resolution, t)
        elevation, slope_x, slope_y = _on_grid(half, 1.0, 1j * kx, 1j * ky)
        return elevation, slope_x, slope_y

    def choppy(self, resolution: int, t: float, choppiness: float = 1.0) -> ChoppySurface:
        """Move the water to and fro beneath its waves, which sharpens crests, on a grid by FFT.

        A choppiness of 1 moves a particle of deep water on its circle; 0 is the linear surface.

        F. Nouguier, C.-A. Guérin & B. Chapron, J. Geophys. Res. 114, C09012 (2009): the horizontal
        displacement is the Hilbert transform of the elevation, as in J. Tessendorf,
        *Simulating Ocean Water*, SIGGRAPH course notes (1999). A single wave becomes Gerstner's.

        Raises
        ------
        InputError
            If the grid is too coarse for the shortest wave.
        """
        half, kx, ky = self._transform(resolution, t)
        k = np.hypot(kx, ky)
        per_k = choppiness / np.where(k > 0, k, 1.0)
        elevation, rise_x, rise_y, shift_x, shift_y, xx, xy, yy = _on_grid(
            half, 1.0, 1j * kx, 1j * ky, 1j * kx * per_k, 1j * ky * per_k,
            -kx * kx * per_k, -kx * ky * per_k, -ky * ky * per_k,
        )  # fmt: skip
        stretch = (1 + xx) * (1 + yy) - xy * xy
        # Where the surface folds it stands upright: no slope is steeper than this.
        safe = np.where(stretch < 0, -1.0, 1.0) * np.maximum(np.abs(stretch), _LEAST_STRETCH)
        slope_x = ((1 + yy) * rise_x - xy * rise_y) / safe
        slope_y = ((1 + xx) * rise_y - xy * rise_x) / safe
        return ChoppySurface(self.tile, elevation, shift_x, shift_y, slope_x, slope_y, stretch)

    def crowding(self, resolution: int, t: float) -> NDArray[np.float64]:
        """How much the choppy waves crowd the water together where it rests, (N, N), by FFT.

        1 less the Jacobian of the displacement of :meth:`choppy`, to first order in the steepness:
        ``Σ k a cos``.
        """
        half, kx, ky = self._transform(resolution, t)
        return _on_grid(half, np.hypot(kx, ky))[0]

    def _transform(self, resolution: int, t: float) -> tuple[NDArray, NDArray, NDArray]:
        """Elevation as :func:`_on_grid` takes it, and wave numbers of its columns and rows."""
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
        return half, *wave_numbers(self.tile, resolution)

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
    """

    tile: float  #: Side of the square after which the surface repeats, m.
    elevation: NDArray[np.float64]  #: m.
    #: Horizontal displacement, m.
    shift_x: NDArray[np.float64]
    shift_y: NDArray[np.float64]
    #: Slopes of the displaced surface at the point.
    slope_x: NDArray[np.float64]
    slope_y: NDArray[np.float64]
    #: Jacobian of the displacement: area of the mean surface that a unit of area at rest covers.
    #: Small at crests; below 0 the surface folds over.
    stretch: NDArray[np.float64]

    def over_mean(self, resolution: int, *fields: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return fields of the points at the places over which the points are.

        Where the surface folds it is one of the layers that lie over a place.

        Fields such as :attr:`elevation` are of the points by where they rest; a resolution of half
        of theirs keeps the shortest waves. Row i, column j is at y = i tile/M, x = j tile/M.
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


def wave_numbers(tile: float, resolution: int) -> tuple[NDArray, NDArray]:
    """Wave numbers of rfft2, shapes (1, N/2 + 1) and (N, 1)."""
    unit = 2 * math.pi / tile
    return (
        unit * np.arange(resolution // 2 + 1)[None, :],
        unit * resolution * np.fft.fftfreq(resolution)[:, None],
    )


def _on_grid(half: NDArray, *factors: NDArray | float) -> list[NDArray[np.float64]]:
    """Fields (N, N) whose spectra are half of one (N, N/2 + 1) times factors."""
    shape = len(half), len(half)
    fields = (np.fft.irfft2(factor * half, shape, norm="forward") for factor in factors)
    return [np.asarray(field, np.float64) for field in fields]


def periodic_at(
    fields: Sequence[NDArray[np.float64]], row: NDArray[np.float64], column: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Interpolate periodic fields of one square shape between their samples, bilinearly.

    Rows and columns are places in samples.
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
