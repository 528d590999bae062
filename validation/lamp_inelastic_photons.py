"""Photons of a point lamp that change their wavelength in endless water, followed forwards (numba).

About an isotropic lamp all is symmetric: what photons carry through a sphere round it, by their
angle from the radius, is the radiance of a camera anywhere on it. Each flight of a photon that has
changed its wavelength counts on all spheres that it would cross, by its chance to get there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.water.phase import BandPhase
from .monte_carlo.phase_tables import cumulative, s2_grid

Array = NDArray[np.float64]

_CHANGE = 0.3  # of the photons that meet the water: chance to change the wavelength there
_FAINT, _KEPT = 1e-3, 0.2  # weight from which on some are kept, and their chance
_RAMAN = 0.53


@dataclass(frozen=True, eq=False)
class Photons:
    """What a lamp's photons meet: bands that excite, (m,), and one that is seen."""

    intensity: Array  #: Of the lamp in the bands that excite.
    #: Absorption and scattering, 1/m: of the bands that excite, and last of that which is seen.
    a: Array
    b: Array
    phase: BandPhase  #: Of the same bands.
    #: Power emitted per scalar irradiance, isotropic and by Raman scattering, 1/m, (2, m).
    matrices: Array

    def radiance(
        self, spheres: Sequence[float], edges: Sequence[float], count: int, seed: int, batches: int
    ) -> Array:
        """Radiance on spheres, m, between angles from the lamp, rad, (batches, spheres, angles).

        Angles are those of the view from the lamp; ``count`` photons make a batch.
        """
        s2 = s2_grid(self.phase.components)
        each = np.array([cumulative(part, s2) for part in self.phase.components])
        cdf = self.phase.weights.T @ each
        power = self.intensity * self.matrices.sum(axis=0)
        chances = power / (self.a + self.b)[:-1]
        cosines = np.cos(np.asarray(edges, dtype=np.float64))
        radii = np.asarray(spheres, dtype=np.float64)
        found = np.empty((batches, len(radii), len(cosines) - 1))
        for batch in range(batches):
            rng = np.random.default_rng((seed, batch))
            found[batch] = _traced(
                rng, count, np.cumsum(chances / chances.sum()), 4.0 * math.pi * self.intensity,
                self.b, self.a + self.b, s2, cdf, self.matrices, radii, cosines,
            )  # fmt: skip
        solid = 2.0 * math.pi * -np.diff(cosines)
        return found / (4.0 * math.pi * radii[:, None] ** 2 * solid)


@numba.njit(cache=True, error_model="numpy")
def _turned(w, cosine, azimuth):  # noqa: ANN001, ANN202
    x, y, z = w
    sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    u, v = sine * math.cos(azimuth), sine * math.sin(azimuth)
    across = math.sqrt(max(1.0 - z * z, 0.0))
    if across < 1e-8:
        return u, v, math.copysign(cosine, z)
    return (
        u * x * z / across - v * y / across + cosine * x,
        u * y * z / across + v * x / across + cosine * y,
        -u * across + cosine * z,
    )


@numba.njit(cache=True, error_model="numpy")
def _scattered(rng, w, s2, cdf):  # noqa: ANN001, ANN202
    place = rng.random()
    i = min(max(np.searchsorted(cdf, place, side="right"), 1), len(cdf) - 1)
    fraction = (place - cdf[i - 1]) / max(cdf[i] - cdf[i - 1], 1e-300)
    found = s2[i - 1] + (s2[i] - s2[i - 1]) * fraction
    return _turned(w, 1.0 - 2.0 * found, 2.0 * math.pi * rng.random())


@numba.njit(cache=True, error_model="numpy")
def _tally(p, w, weight, c, radii, cosines, out):  # noqa: ANN001, ANN202
    x, y, z = p
    along = x * w[0] + y * w[1] + z * w[2]
    r2 = x * x + y * y + z * z
    for k in range(len(radii)):
        root2 = along * along + radii[k] * radii[k] - r2
        if root2 <= 0.0:
            continue
        root = math.sqrt(root2)
        for sign in (-1.0, 1.0):
            s = sign * root - along
            if s <= 0.0:
                continue
            # A camera that looks at the lamp sees light that goes outwards.
            mu = sign * root / radii[k]
            for j in range(len(cosines) - 1):
                if cosines[j + 1] <= mu < cosines[j]:
                    out[k, j] += weight * math.exp(-c * s) / max(abs(mu), 1e-9)


@numba.njit(cache=True, error_model="numpy")
def _traced(rng, count, cdf_band, sent, b, c, s2, cdf, matrices, radii, cosines):  # noqa: ANN001, ANN202
    out, last = np.zeros((len(radii), len(cosines) - 1)), len(b) - 1
    for _ in range(count):
        band = min(np.searchsorted(cdf_band, rng.random(), side="right"), last - 1)
        chance = cdf_band[band] - (cdf_band[band - 1] if band else 0.0)
        weight, p = sent[band] / (chance * count), (0.0, 0.0, 0.0)
        scale = weight
        w = _turned((0.0, 0.0, 1.0), 2.0 * rng.random() - 1.0, 2.0 * math.pi * rng.random())
        changed = False
        while weight > 0.0:
            now = last if changed else band
            if changed:
                _tally(p, w, weight, c[now], radii, cosines, out)
            s = -math.log(1.0 - rng.random()) / c[now]
            p = (p[0] + s * w[0], p[1] + s * w[1], p[2] + s * w[2])
            if not changed and rng.random() < _CHANGE:
                whole = matrices[0, band] + matrices[1, band]
                weight *= whole / (c[band] * _CHANGE)
                scale, changed = weight, True
                cosine = 2.0 * rng.random() - 1.0
                if rng.random() * whole < matrices[1, band]:
                    while rng.random() * (1.0 + _RAMAN) > 1.0 + _RAMAN * cosine * cosine:
                        cosine = 2.0 * rng.random() - 1.0
                w = _turned(w, cosine, 2.0 * math.pi * rng.random())
                continue
            weight *= b[now] / (c[now] * (1.0 if changed else 1.0 - _CHANGE))
            if weight < _FAINT * scale:
                weight = weight / _KEPT if rng.random() < _KEPT else 0.0
            w = _scattered(rng, w, s2, cdf[now])
    return out
