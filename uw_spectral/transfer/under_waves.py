"""Light that comes down from waves on average: the sky through facets, and what they mirror."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import constant
from ..surface.refraction import direction_in_air
from .radiance_field import mirrored_ray, sky_and_mirrored, surface_normal
from .rough_surface import WaterSurface, facet_slopes
from .sky import Sky
from .solved_layer import Array

_RINGS, _AROUND = 10, 24  # sizes and azimuths of slopes that a ray meets
_AT_ONCE = 1 << 13  # facets, of all rays together
_UPS, _TURNS = 64, 24
UPWELLING_COSINES = constant(np.maximum(np.linspace(0.0, 1.0, _UPS), 0.5 / _UPS))
"""Cosines of travel of the light that rises to waves."""
UPWELLING_TURNS = constant(np.linspace(0.0, math.pi, _TURNS))
"""Azimuths of its travel against the sun's, rad."""


@dataclass(frozen=True, eq=False)
class UpwellingLight:
    """Radiance that rises to the surface."""

    table: Array  #: By :data:`UPWELLING_COSINES` and :data:`UPWELLING_TURNS`, (u, t, n).
    sun: Sequence[float]  #: Unit direction that sunlight travels to in the water.

    def along(self, x: Array, y: Array, z: Array) -> Array:
        """Radiance along directions (q, 1) of view down, shape (q, n)."""
        sx, sy = self.sun[:2]
        away = np.arctan2(sx * y - sy * x, -(sx * x + sy * y))
        (i, u), (j, t) = _cell(-z[:, 0], _UPS), _cell(np.abs(away[:, 0]) / math.pi, _TURNS)
        L = self.table
        level = L[i, j] * (1.0 - t) + L[i, j + 1] * t
        return level * (1.0 - u) + (L[i + 1, j] * (1.0 - t) + L[i + 1, j + 1] * t) * u


def under_waves(
    waves: WaterSurface, sky: Sky, upwelling: UpwellingLight, w: Sequence[Array]
) -> Array:
    """Radiance that comes down from waves along view directions (q, 1), shape (q, n)."""
    n, q = waves.refractive_index, len(w[0])
    turn = math.atan2(upwelling.sun[1], upwelling.sun[0])
    x, y, fraction = facet_slopes(waves.slope_variance, _RINGS, _AROUND)
    x, y = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
    total, area = np.zeros(1), np.zeros(1)
    for some in np.array_split(np.arange(len(fraction)), math.ceil(q * len(fraction) / _AT_ONCE)):
        rays = [np.repeat(part, len(some), axis=0) for part in w]
        slopes = np.tile(x[some], q)[:, None], np.tile(y[some], q)[:, None]
        normal = surface_normal(*slopes)
        met, mirrored = mirrored_ray(rays, slopes=slopes)
        risen = upwelling.along(*mirrored)
        # Towards the horizon other waves hide the sky; they show what they mirror, and water.
        passing = waves.passing(direction_in_air(rays, normal, n)[2])
        L_sky = passing * sky.seen_through(rays, n, slopes=slopes)
        L_sky = L_sky + (1.0 - passing) / n**2 * risen
        seen = np.tile(fraction[some], q)[:, None] * met / normal[2]
        light = seen * sky_and_mirrored(met, L_sky, risen, n)
        area = area + seen.reshape(q, -1, 1).sum(axis=1)
        total = total + light.reshape(q, len(some), -1).sum(axis=1)
    return total / area


def _cell(fraction: Array, count: int) -> tuple[NDArray[np.intp], Array]:
    """Index before a place on a scale of so many from 0 to 1, and fraction of the next, (q, 1)."""
    at = fraction * (count - 1)
    low = np.clip(at.astype(np.intp), 0, count - 2)
    return low, np.clip(at - low, 0.0, 1.0)[:, None]
