"""Rays traced backwards from a camera to a black ball: the light of the water before it.

Each ray scatters as the phase function has it and gathers the sun at each turn, the sky where it
leaves the water. It shares the phase functions' values and Fresnel's formula with what it tests,
and no solution of the light in the water.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.refraction import fresnel_reflectance
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase
from ..validation.monte_carlo.phase_tables import LOOKUP_CELLS, cone_average, cumulative, s2_grid
from ..validation.monte_carlo.photons import free_path, half_sine, turned

Array = NDArray[np.float64]

_INNER = 0.8  # of the ball's angular radius: where rays set out to
_SUN = math.radians(1.0)  # half angle that the sun is spread over, so that no peak is infinite
_DIM, _CHANCE = 0.02, 0.2  # weight below which so many rays go on, for the others
_BATCH = 100_000


def traced(
    column: WaterColumn,
    phase: BandPhase,
    depth: float,
    towards: Array,
    distance: float,
    radius: float,
    *,
    rays: int,
    seed: int = 1,
) -> tuple[Array, Array]:
    """Radiance of the middle of a black ball, and its standard error.

    Parameters
    ----------
    column : WaterColumn
        One layer, with a floor and a flat surface.
    phase : BandPhase
    depth : float
        Of the camera, m.
    towards : array, shape (3,)
        Unit direction to the ball's middle, z up.
    distance, radius : float
        Of the middle and of the ball, m.
    rays : int
        Of each band.
    seed : int
        Of the random numbers.

    Returns
    -------
    mean, error : array, shape (n,)
    """
    column.require_one_layer("traced rays know")
    centre = np.array([0.0, 0.0, -depth]) + distance * towards
    mean, error = [], []
    for band in range(len(column.bands)):
        random = np.random.default_rng([seed, band])
        water = _Water(column, phase, band, centre, radius)
        found = []
        for _ in range(math.ceil(rays / _BATCH)):
            w = _towards(random, towards, math.asin(radius / distance))
            found.append(water.gathered(random, np.array([0.0, 0.0, -depth]), w))
        each = np.concatenate(found)
        mean.append(each.mean())
        error.append(each.std() / math.sqrt(len(each)))
    return np.array(mean), np.array(error)


class _Water:
    """Water of one band with a black ball."""

    def __init__(
        self, column: WaterColumn, phase: BandPhase, band: int, centre: Array, radius: float
    ) -> None:
        edges = s2_grid(phase.components)
        weights = phase.weights[:, band]
        self._edges = edges
        self._cdf = sum(
            w * cumulative(p, edges) for w, p in zip(weights, phase.components, strict=True)
        )
        self._peak = sum(
            w * cone_average(p, _SUN) for w, p in zip(weights, phase.components, strict=True)
        )
        self._c = float(column.attenuation[band])
        self._albedo = float(column.scattering[band]) / self._c
        self._column, self._band = column, band
        self._n = float(column.refractive_index)
        self._sun = np.asarray(column.sun_direction)
        self._beam = float(column.sun_irradiance[band]) / -float(self._sun[2])
        self._floor = float(column.floor_depth)
        self._reflectance = float(column.floor_reflectance[band])
        self._centre, self._radius = centre, radius

    def gathered(self, random: np.random.Generator, at: Array, w: Array) -> Array:
        """Radiance that each ray from a point along w (3, q) finds, shape (q,)."""
        count = w.shape[1]
        light, weight, ray = np.zeros(count), np.ones(count), np.arange(count)
        p = np.repeat(at[:, None], count, axis=1)
        while len(ray):
            s = free_path(random.random(len(ray)), self._c)
            up = w[2] > 0
            height = np.where(up, -p[2], self._floor + p[2])
            edge = height / np.maximum(np.abs(w[2]), 1e-12)
            ball = self._to_ball(p, w)
            event = np.where(ball < np.minimum(s, edge), 0, np.where(edge < s, 2, 1))
            p = p + np.minimum(s, edge) * w
            inside, top = event == 1, (event == 2) & up
            low = (event == 2) & ~up
            weight[inside] *= self._albedo
            cells = half_sine(*w[:, inside], *(-self._sun)) * LOOKUP_CELLS
            peak = np.interp(cells, np.arange(LOOKUP_CELLS + 1), self._peak)
            light[ray[inside]] += weight[inside] * peak * self._sunlight(p[:, inside])
            w[:, inside] = self._scattered(random, w[:, inside])
            weight[low] *= self._reflectance
            cosine = -float(self._sun[2])
            light[ray[low]] += weight[low] * cosine / math.pi * self._sunlight(p[:, low])
            w[:, low] = _cosine_distributed(random, int(low.sum()))
            R = fresnel_reflectance(np.abs(w[2, top]), 1.0 / self._n)
            sky = self._column.skylight.seen_through(w[:, top][..., None], self._n)
            bright = np.broadcast_to(sky, (int(top.sum()), len(self._column.bands)))[:, self._band]
            light[ray[top]] += weight[top] * np.where(R < 1, (1 - R) * self._n**2 * bright, 0.0)
            weight[top] *= R
            w[2, top] *= -1.0
            p[2] = np.clip(p[2], -self._floor, 0.0)
            dim = weight < _DIM
            weight[dim] /= _CHANCE
            kept = (event > 0) & (~dim | (random.random(len(ray)) < _CHANCE)) & (weight > 0)
            p, w, weight, ray = p[:, kept], w[:, kept], weight[kept], ray[kept]
        return light

    def _sunlight(self, p: Array) -> Array:
        """Irradiance of the direct sun, across it, at points (3, q)."""
        free = ~np.isfinite(self._to_ball(p, np.repeat(-self._sun[:, None], p.shape[1], axis=1)))
        return free * self._beam * np.exp(self._c * p[2] / -self._sun[2])

    def _to_ball(self, p: Array, w: Array) -> Array:
        """Distance along w to the ball; infinite where it is missed."""
        to = self._centre[:, None] - p
        along = (to * w).sum(axis=0)
        inside = self._radius**2 - (to**2).sum(axis=0) + along**2
        near = along - np.sqrt(np.maximum(inside, 0.0))
        return np.where((inside > 0) & (near > 0), near, np.inf)

    def _scattered(self, random: np.random.Generator, w: Array) -> Array:
        s2 = np.interp(random.random(w.shape[1]), self._cdf, self._edges)
        return np.array(turned(*w, s2, 2.0 * math.pi * random.random(w.shape[1])))


def _towards(random: np.random.Generator, middle: Array, angle: float) -> Array:
    """Directions (3, q) to the inner part of a ball, as its pixels have them."""
    tangent = _INNER * math.tan(angle) * np.sqrt(random.random(_BATCH))
    angle_in, turn = np.arctan(tangent), 2.0 * math.pi * random.random(_BATCH)
    start = np.repeat(middle[:, None], _BATCH, axis=1)
    return np.array(turned(*start, np.sin(angle_in / 2.0) ** 2, turn))


def _cosine_distributed(random: np.random.Generator, count: int) -> Array:
    """Directions (3, count) that a matt floor sends light to."""
    up, turn = np.sqrt(1.0 - random.random(count)), 2.0 * math.pi * random.random(count)
    across = np.sqrt(1.0 - up * up)
    return np.array([across * np.cos(turn), across * np.sin(turn), up])
