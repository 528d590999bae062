"""Caustics: how waves gather the sunlight under them.

Rays of a regular grid are refracted by the waves and land on a plane below;
the irradiance is what they bring. The plane is seen along the refracted sun:
a point at depth y belongs to the place where the straight ray through it meets
the mean surface. Patterns of different depths therefore lie on top of each
other, and a renderer blends them without ghosts.

What blurs the pattern is a product of transfer functions of its wave number: the disc
of the sun, the waves too short for the grid, the collector of an instrument, and
scattering by small angles (:mod:`..transfer.sunlit_water`).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .refraction import REFRACTIVE_INDEX, fresnel_reflectance
from .wave_components import WaveComponents, wave_numbers

SUN_RADIUS = math.radians(0.2665)
"""Angular radius of the sun in air, rad."""

_STEEPEST = 0.05  # least downward component of a refracted ray
_DISC_END = 300.0
_FINEST = 6.0  # wave number times radius of the disc, of the finest waves that draw a pattern
_UNFOCUSED = 100.0  # wave number times depth from which ripples only spread the light


def refracted_offset(
    slope_x: ArrayLike,
    slope_y: ArrayLike,
    sun_direction: ArrayLike,
    refractive_index: float = REFRACTIVE_INDEX,
) -> tuple[NDArray, NDArray, NDArray]:
    """Where sunlight goes behind a tilted surface, per unit of depth, and how much of it.

    ``sun_direction`` is that below a flat surface (:func:`.sun_travel_direction`). The flux is the
    transmitted power per horizontal area, relative to the normal irradiance of the sun in air; 0
    where the surface faces away.
    """
    px, py = np.asarray(slope_x, dtype=np.float64), np.asarray(slope_y, dtype=np.float64)
    n = refractive_index
    sx, sy = (n * float(value) for value in np.asarray(sun_direction)[:2])
    sz = -math.sqrt(max(1 - sx * sx - sy * sy, 0.0))
    length = np.sqrt(1 + px * px + py * py)
    facing = np.maximum((px * sx + py * sy - sz) / length, 0.0)
    inside = np.sqrt(facing * facing + (n * n - 1)) / n  # cosine behind the surface
    bend = (facing / n - inside) / length
    down = np.maximum(-(sz / n + bend), _STEEPEST)
    flux = facing * length * (1 - fresnel_reflectance(facing, n))
    return (sx / n - bend * px) / down, (sy / n - bend * py) / down, flux


def ray_density(
    waves: WaveComponents,
    sun_direction: ArrayLike,
    depth: float,
    t: float,
    resolution: int,
    *,
    refractive_index: float = REFRACTIVE_INDEX,
    rays: int | None = None,
    choppiness: float = 0.0,
) -> NDArray[np.float64]:
    """Irradiance by a point sun in water that does not scatter, mean 1, (resolution, resolution).

    Arguments as of :func:`caustic_pattern`, with so many rays along the side, as many as samples by
    default. Row i, column j: rays that cross the mean surface around y = i tile/N, x = j tile/N if
    they went straight. Exactly 1 without waves.
    """
    if not len(waves):
        return np.ones((resolution, resolution))
    rays = rays or resolution
    shift_x = shift_y = 0.0
    if choppiness:
        surface = waves.choppy(rays, t, choppiness)
        height, slope_x, slope_y = surface.elevation, surface.slope_x, surface.slope_y
        shift_x, shift_y = surface.shift_x, surface.shift_y
        area = np.maximum(surface.stretch, 0.0)
    else:
        height, slope_x, slope_y = waves.on_grid(rays, t)
        area = 1.0
    offset_x, offset_y, flux = refracted_offset(slope_x, slope_y, sun_direction, refractive_index)
    straight = refracted_offset(0.0, 0.0, sun_direction, refractive_index)
    if not flux.any():
        return np.ones((resolution, resolution))
    drop = np.maximum(depth + height, 0.0)
    cell = waves.tile / resolution
    grid = np.arange(rays) * (resolution / rays)
    x = grid + (shift_x + drop * offset_x - depth * straight[0]) / cell
    y = grid[:, None] + (shift_y + drop * offset_y - depth * straight[1]) / cell
    total = _splat(x, y, flux * area, resolution)
    return total / total.mean()


def _splat(x: NDArray, y: NDArray, weight: NDArray, resolution: int) -> NDArray[np.float64]:
    """Bilinear deposit on a periodic grid, in units of its cells."""
    column, row = np.floor(x), np.floor(y)
    fx, fy = (x - column).ravel(), (y - row).ravel()
    column = np.mod(column, resolution).astype(np.int32).ravel()
    row = np.mod(row, resolution).astype(np.int32).ravel() * np.int32(resolution)
    right = np.where(column == resolution - 1, 0, column + 1)
    below = np.where(row == resolution * (resolution - 1), 0, row + resolution)
    weight = np.broadcast_to(weight, x.shape).ravel()
    upper, lower = weight * (1 - fy), weight * fy
    total = np.zeros(resolution * resolution)
    for index, part in (
        (row + column, upper * (1 - fx)),
        (row + right, upper * fx),
        (below + column, lower * (1 - fx)),
        (below + right, lower * fx),
    ):
        total += np.bincount(index, part, minlength=len(total))
    return total.reshape(resolution, resolution)


def disc_transfer(x: ArrayLike) -> NDArray[np.float64]:
    """Transfer function 2 J1(x)/x of a uniform disc, x = wave number × radius."""
    knots, values = _disc_table()
    return np.interp(np.abs(x), knots, values, right=0.0)


@functools.cache
def _disc_table() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    knots = np.arange(0.0, _DISC_END, 0.02)
    angle = np.arange(1, 201) * math.pi / 401  # half of the nodes, by symmetry
    weights = 8 / 401 * np.sin(angle) ** 2
    values = np.zeros_like(knots)
    for cosine, weight in zip(np.cos(angle), weights, strict=True):
        values += weight * np.cos(cosine * knots)
    return knots, values / values[0]


def caustic_pattern(
    waves: WaveComponents,
    sun_direction: ArrayLike,
    depth: float,
    t: float,
    resolution: int,
    *,
    refractive_index: float = REFRACTIVE_INDEX,
    sun_radius: float = SUN_RADIUS,
    choppiness: float = 0.0,
) -> NDArray[np.float64]:
    """Irradiance of unscattered sunlight at a depth, relative to its mean.

    Parameters
    ----------
    sun_direction : array_like, shape (3,)
        Travel direction in the water below a flat surface, z up.
    sun_radius : float
        Angular radius of the sun in air, rad.
    choppiness : float
        Of the crests, see :meth:`.WaveComponents.choppy`.

    Returns
    -------
    array, shape (N, N)
        Mean 1, not negative; exactly 1 without waves. A point (px, py) at
        this depth belongs to the sample at p + depth s/s_z, s the sun's
        direction: row i, column j is y = i tile/N, x = j tile/N. Periodic.

    Raises
    ------
    InputError
        If the depth is negative, or the grid too coarse for the waves.
    """
    if not (depth >= 0 and math.isfinite(depth)):
        raise InputError(f"caustics: the depth must be finite and not negative, got {depth:g} m")
    if not len(waves):
        return np.ones((resolution, resolution))
    disc = sun_radius / refractive_index * depth
    # Waves finer than the disc only spread the light, and ripples do far below their focus: they
    # are part of the blur.
    finest = _FINEST / disc if disc > 0 else math.inf
    if depth > 0:
        finest = min(finest, max(waves.ripples.longest, _UNFOCUSED / depth))
    seen = waves.below(finest)
    # A disc smaller than two cells does not hide the gaps between rays: take four per cell.
    rays = resolution if disc > 2.0 * waves.tile / resolution else 2 * resolution
    density = ray_density(
        seen, sun_direction, depth, t, resolution, refractive_index=refractive_index, rays=rays,
        choppiness=choppiness,
    )  # fmt: skip
    kx, ky = wave_numbers(waves.tile, resolution)
    transfer = _sun_transfer(kx, ky, sun_direction, depth, refractive_index, sun_radius)
    transfer = transfer * _tail_transfer(kx, ky, seen, sun_direction, depth, refractive_index)
    # The filter rings below zero.
    pattern = np.maximum(np.fft.irfft2(np.fft.rfft2(density) * transfer, density.shape), 0.0)
    return pattern / pattern.mean()


class PatternCarrier(Protocol):
    """Water that shows a pattern of sunlight in each band: :class:`.SunlitWater`."""

    def sun_fraction(self, depth: float) -> NDArray[np.float64]:
        """Fraction of the direct and forward-scattered sun in the irradiance, shape (n,)."""
        ...

    def variation(self, pattern: NDArray, tile: float, depth: float) -> NDArray[np.float64]:
        """Coefficient of variation of Ed under a pattern, shape (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class CausticLayers:
    """Grey patterns at a few depths, from which a renderer makes any depth and band.

    ``sunlight(y, band) = mean × (1 + contrast(y, band) × (blend(y) - 1))``, not
    below 0, where blend goes linearly in log y from layer to layer and stays as
    it is above the first and below the last. Make it with :func:`bake_layers`.
    """

    tile: float  #: Side of the images, m.
    depths: NDArray[np.float64]  #: Increasing, m, (d,).
    images: NDArray[np.float32]  #: Patterns of :func:`caustic_pattern`, mean 1, (d, N, N).

    def position(self, depth: float) -> tuple[int, float]:
        """Lower layer and the fraction of the next one at a depth."""
        last = len(self.depths) - 1
        where = float(
            np.interp(math.log(max(depth, 1e-6)), np.log(self.depths), np.arange(last + 1))
        )
        first = min(int(where), max(last - 1, 0))
        return first, where - first

    def blend(self, depth: float) -> NDArray[np.float64]:
        """Blended image, shape (N, N)."""
        first, fraction = self.position(depth)
        image = self.images[first].astype(np.float64)
        return (
            image if fraction == 0 else (1 - fraction) * image + fraction * self.images[first + 1]
        )

    def contrast(self, water: PatternCarrier, depth: float) -> NDArray[np.float64]:
        """Factor per band on the blended image, shape (n,), 0 to 1.5.

        It holds what scattering takes from the band, and gives back the
        variation that blending two layers loses.
        """
        first, fraction = self.position(depth)
        blended = self.blend(depth).astype(np.float64)
        spread, sun = blended.std(), water.sun_fraction(depth)
        if spread == 0:
            return np.ones_like(sun)
        # What each layer shows through the water of this depth; a blend of two shows less.
        ends = self.images[first : first + (2 if fraction else 1)].astype(np.float64)
        shown = [water.variation(image, self.tile, depth) for image in ends]
        wanted = shown[0] if fraction == 0 else (1 - fraction) * shown[0] + fraction * shown[1]
        ratio = np.divide(wanted, sun * spread, out=np.zeros_like(sun), where=sun > 0)
        return np.minimum(ratio, 1.5)


def bake_layers(
    waves: WaveComponents,
    sun_direction: ArrayLike,
    depths: ArrayLike,
    t: float,
    resolution: int,
    *,
    refractive_index: float = REFRACTIVE_INDEX,
    sun_radius: float = SUN_RADIUS,
    choppiness: float = 0.0,
) -> CausticLayers:
    """Compute the patterns of one moment; arguments as :func:`caustic_pattern`.

    Raises
    ------
    InputError
        If the depths do not increase from above 0.
    """
    depths = np.atleast_1d(np.asarray(depths, dtype=np.float64))
    if not (depths.ndim == 1 and len(depths) and depths[0] > 0 and np.all(np.diff(depths) > 0)):
        raise InputError(f"caustics: depths of layers must increase from above 0, got {depths}")
    images = [
        caustic_pattern(
            waves, sun_direction, depth, t, resolution,
            refractive_index=refractive_index, sun_radius=sun_radius, choppiness=choppiness,
        )
        for depth in depths.tolist()
    ]  # fmt: skip
    return CausticLayers(waves.tile, depths, np.stack(images).astype(np.float32))


def _sun_transfer(
    kx: NDArray,
    ky: NDArray,
    sun_direction: ArrayLike,
    depth: float,
    refractive_index: float,
    sun_radius: float,
) -> NDArray[np.float64]:
    """Of the refracted disc of the sun: an ellipse, flatter as the sun sinks."""
    sx, sy, sz = (float(value) for value in np.asarray(sun_direction))
    flat = math.hypot(sx, sy)
    ux, uy = (sx / flat, sy / flat) if flat > 0 else (1.0, 0.0)
    in_air = math.sqrt(max(1 - (refractive_index * flat) ** 2, 0.0))
    # Snell's law shrinks angles by 1/n across, by cos/(n cos') along the sun's azimuth.
    along = (kx * ux + ky * uy) * (in_air / sz**2)
    across = ky * ux - kx * uy
    reach = sun_radius / refractive_index * depth / -sz
    return disc_transfer(reach * np.hypot(along, across))


def _tail_transfer(
    kx: NDArray,
    ky: NDArray,
    waves: WaveComponents,
    sun_direction: ArrayLike,
    depth: float,
    refractive_index: float,
) -> NDArray[np.float64]:
    """Of the waves that the components leave out at the short end.

    Gaussian slopes of one variance v spread as exp(-x v). Where that of ripples differs from place
    to place by a gamma distribution, the variance of a pattern is the mean over it of that squared:
    ``(1 + 2 u x v)^(-1/u)``, u the unevenness.
    """
    turn = math.radians(waves.wind_direction)
    step, ripples = 1e-3, waves.ripples
    even = uneven = 0.0
    for variance, of_ripples, (dx, dy) in zip(
        waves.shorter,
        np.minimum(waves.shorter, ripples.variance),
        ((math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))),
        strict=True,
    ):
        slopes = np.array([step, -step])
        x, y, _ = refracted_offset(slopes * dx, slopes * dy, sun_direction, refractive_index)
        moved = kx * ((x[0] - x[1]) / (2 * step)) + ky * ((y[0] - y[1]) / (2 * step))
        spread = 0.5 * (depth * moved) ** 2
        even, uneven = even + (variance - of_ripples) * spread, uneven + of_ripples * spread
    u = ripples.unevenness
    return np.exp(-even) * ((1.0 + 2.0 * u * uneven) ** (-0.5 / u) if u > 0 else 1.0)


def pattern_power(pattern: NDArray) -> NDArray[np.float64]:
    """Variance per wave number of rfft2, of a pattern of mean 1."""
    size = pattern.size
    power = np.abs(np.fft.rfft2(pattern) / size) ** 2
    power[0, 0] = 0.0
    twice = np.full(power.shape[1], 2.0)
    twice[0] = 1.0
    if len(pattern) % 2 == 0:
        twice[-1] = 1.0
    return power * twice
