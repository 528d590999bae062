"""Rays and photons traced through random waves: what the averaged surface is measured with.

It shares no formula with :mod:`..uw_spectral.transfer.rough_surface` but Fresnel's: waves with
heights that hide each other, and light that meets them as often as it does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.refraction import fresnel_reflectance

Array = NDArray[np.float64]

_SIDE, _LENGTH = 512, 16  # cells of the tile, and of the correlation
_STEP, _HALVINGS = 0.5, 12  # cells of a step of a ray; halvings where it meets the surface
_OFF = 1e-4  # cells off the surface at which a ray goes on
_DIM = 1e-4  # weight of a photon that is given up


class TracedSea:
    """A periodic surface of normal heights with a Gaussian correlation; n is the water's index.

    ``slope_variance`` is the mean square slope.
    """

    def __init__(self, slope_variance: float, random: np.random.Generator, n: float) -> None:
        self.n, self.random = n, random
        k = 2.0 * math.pi * np.fft.fftfreq(_SIDE)
        smooth = np.exp(-(k[:, None] ** 2 + k**2) * _LENGTH**2 / 8.0)
        z = np.fft.ifft2(np.fft.fft2(random.normal(size=(_SIDE, _SIDE))) * smooth).real
        slopes = (np.roll(z, -1, axis) - z for axis in (0, 1))
        z *= math.sqrt(slope_variance / sum(float(slope.var()) for slope in slopes))
        self._z = z - z.mean()

    def reflectance(self, cosines: Array, *, above: bool) -> tuple[float, float]:
        """Fraction of rays that stay on their side, and its standard error."""
        w = _around(self.random, cosines if not above else -cosines)
        up = self.trace(w, above=above)[2] > 0
        fraction = float(np.mean(up if above else ~up))
        return fraction, math.sqrt(fraction * (1.0 - fraction) / len(cosines))

    def trace(self, w: Array, *, above: bool) -> Array:
        """Directions (3, q) of rays after the waves: up in air, down in the water."""
        w, p = w.copy(), self.random.uniform(0.0, _SIDE, w.shape)
        top, low = self._z.max() + 0.01, self._z.min() - 0.01
        p[2] = top if above else low
        side = np.full(w.shape[1], 1.0 if above else -1.0)
        live = np.arange(w.shape[1])
        while len(live):
            q = p[:, live] + _STEP * w[:, live]
            met = (q[2] - self._surface(q)[0]) * side[live] < 0
            if met.any():
                hit = live[met]
                w[:, hit], side[hit], q[:, met] = self._meet(p[:, hit], w[:, hit], side[hit])
            p[:, live] = q
            live = live[(q[2] <= top) & (q[2] >= low)]
        return w

    def _surface(self, p: Array) -> tuple[Array, Array, Array]:
        """Height and slopes at points, bilinear between the cells."""
        j, i = (np.floor(each).astype(np.intp) for each in p[:2])
        x, y = p[0] - j, p[1] - i
        i, j, below, right = i % _SIDE, j % _SIDE, (i + 1) % _SIDE, (j + 1) % _SIDE
        a, b, c, d = self._z[i, j], self._z[i, right], self._z[below, j], self._z[below, right]
        z = (a * (1 - x) + b * x) * (1 - y) + (c * (1 - x) + d * x) * y
        return z, (b - a) * (1 - y) + (d - c) * y, (c - a) * (1 - x) + (d - b) * x

    def _meet(self, p: Array, w: Array, side: Array) -> tuple[Array, Array, Array]:
        """Direction, side and place of rays after they met the surface within a step."""
        near, far = np.zeros(len(side)), np.full(len(side), _STEP)
        for _ in range(_HALVINGS):
            middle = (near + far) / 2.0
            q = p + middle * w
            beyond = (q[2] - self._surface(q)[0]) * side < 0
            near, far = np.where(beyond, near, middle), np.where(beyond, middle, far)
        q = p + near * w
        _, x, y = self._surface(q)
        normal = np.array([-x, -y, np.ones_like(x)]) / np.sqrt(1.0 + x * x + y * y) * side
        cosine = np.maximum(-(w * normal).sum(axis=0), 1e-9)
        index = np.where(side > 0, self.n, 1.0 / self.n)
        R = np.where(side > 0, *(fresnel_reflectance(cosine, n) for n in (self.n, 1.0 / self.n)))
        behind = np.sqrt(np.maximum(1.0 - (1.0 - cosine**2) / index**2, 0.0))
        mirrored = self.random.random(len(R)) < R
        w = np.where(
            mirrored, w + 2.0 * cosine * normal, w / index + (cosine / index - behind) * normal
        )
        side = np.where(mirrored, side, -side)
        q[2] = self._surface(q)[0] + _OFF * side
        return w, side, q


@dataclass(frozen=True)
class Below:
    """Irradiances at a depth: downwards, upwards, scalar."""

    Ed: float
    Eu: float
    E0: float


def photons(
    sea: TracedSea,
    w: Array,
    *,
    a: float,
    b: float,
    g: float,
    floor: float,
    reflectance: float,
    y: float,
) -> Below:
    """Trace photons that set out just below waves, through Henyey-Greenstein water over a floor.

    ``w``, shape (3, q), are their directions; together they carry an irradiance of 1. ``a`` and
    ``b`` are in 1/m, ``g`` is the mean cosine of the phase function; ``floor`` and ``y`` are depths
    of the floor and of the result, m.
    """
    random, total = sea.random, np.zeros(3)
    w, count = w.copy(), w.shape[1]
    weight, depth = np.ones(count), np.zeros(count)
    while len(depth):
        end = depth - w[2] * random.exponential(1.0 / (a + b), len(depth))
        crossed = (depth < y) != (np.clip(end, 0.0, floor) < y)
        down = w[2] < 0
        total[0] += weight[crossed & down].sum()
        total[1] += weight[crossed & ~down].sum()
        total[2] += (weight[crossed] / np.abs(w[2, crossed])).sum()
        out, low = end < 0.0, end > floor
        inside = ~(out | low)
        depth = np.clip(end, 0.0, floor)
        weight[low] *= reflectance
        weight[inside] *= b / (a + b)
        w[:, low] = _around(random, np.sqrt(random.random(int(low.sum()))))
        w[:, inside] = _scattered(random, w[:, inside], g)
        w[:, out] = sea.trace(w[:, out], above=False)
        kept = (weight > _DIM) & ~(out & (w[2] > 0))
        w, weight, depth = w[:, kept], weight[kept], depth[kept]
    return Below(*(total / count).tolist())


def _around(random: np.random.Generator, up: Array) -> Array:
    """Directions of given upward components, of any azimuth."""
    turn, across = random.uniform(0.0, 2.0 * math.pi, len(up)), np.sqrt(1.0 - up * up)
    return np.array([across * np.cos(turn), across * np.sin(turn), up])


def _scattered(random: np.random.Generator, w: Array, g: float) -> Array:
    """Directions after scattering by the phase function of Henyey and Greenstein."""
    fraction = (1.0 - g * g) / (1.0 - g + 2.0 * g * random.random(w.shape[1]))
    x, y, z = _around(random, np.clip((1.0 + g * g - fraction**2) / (2.0 * g), -1.0, 1.0))
    # Axes across w: T. Duff et al., J. Comput. Graph. Tech. 6, 1 (2017).
    sign = np.copysign(1.0, w[2])
    s = -1.0 / (sign + w[2])
    t = w[0] * w[1] * s
    first = np.array([1.0 + sign * w[0] ** 2 * s, sign * t, -sign * w[0]])
    return x * first + y * np.array([t, sign + w[1] ** 2 * s, -w[1]]) + z * w
