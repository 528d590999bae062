"""Monte Carlo of a point lamp in endless water: light traced back from the camera.

A ray starts at the camera. From each place where it is scattered, and from the camera itself,
the lamp's light scattered once into the rest of the ray is estimated at random places, even in
the angle that the lamp sees, and half of those rays are drawn about the lamp: no term has the pole
1/r² of a scattering close to the lamp, nor 1/h of a ray that passes it. Radiance
comes by order of scattering, so that one run serves every albedo. Lengths are in units of 1/c.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.water.phase import BandPhase
from .monte_carlo.phase_tables import cumulative, s2_grid

_NEAREST = 1e-4  # of a ray to the lamp, in 1/c
_TABLE = 4000
_DECADES = 16.0  # in e; of angles from the lamp
_NARROWEST = math.pi * math.exp(-_DECADES)


@dataclass(frozen=True, eq=False)
class PhaseTables:
    """A phase function to look up and to draw from."""

    log_s2: NDArray[np.float64]
    log_p: NDArray[np.float64]
    fraction: NDArray[np.float64]
    edges: NDArray[np.float64]

    def per_steradian(self, s2: NDArray) -> NDArray[np.float64]:
        """Value, 1/sr."""
        return np.exp(np.interp(np.log(np.maximum(s2, 1e-14)), self.log_s2, self.log_p))

    def drawn(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Random s2."""
        return np.interp(rng.random(count), self.fraction, self.edges)


def tables_of(phase: BandPhase) -> PhaseTables:
    """Tabulate a phase function of one band."""
    edges = s2_grid(phase.components)
    log_s2 = np.linspace(math.log(1e-14), 0.0, _TABLE)
    log_s2 = np.union1d(log_s2, np.log(np.linspace(1e-3, 1.0, 1000)))
    each = [part.per_steradian(np.exp(log_s2)) for part in phase.components]
    fraction = [cumulative(part, edges) for part in phase.components]
    weights = phase.weights[:, 0]
    return PhaseTables(
        log_s2, np.log(weights @ np.array(each)), weights @ np.array(fraction), edges
    )


def turned(w: NDArray, s2: NDArray, rng: np.random.Generator) -> NDArray[np.float64]:
    """Turn unit vectors by random azimuths and the angles of s2; shapes (n, 3) and (n,)."""
    azimuth = 2 * math.pi * rng.random(len(w))
    cosine, sine = 1 - 2 * s2, 2 * np.sqrt(s2 * (1 - s2))
    sign = np.where(w[:, 2] >= 0, 1.0, -1.0)
    a = -1.0 / (sign + w[:, 2])
    b = w[:, 0] * w[:, 1] * a
    u = np.stack([1 + sign * w[:, 0] ** 2 * a, sign * b, -sign * w[:, 0]], axis=-1)
    v = np.stack([b, sign + w[:, 1] ** 2 * a, -w[:, 1]], axis=-1)
    new = (
        cosine[:, None] * w
        + (sine * np.cos(azimuth))[:, None] * u
        + (sine * np.sin(azimuth))[:, None] * v
    )
    return new / np.linalg.norm(new, axis=1, keepdims=True)


def single_scattering(
    x: NDArray,
    w: NDArray,
    P: float,
    lamp: NDArray,
    profile: Callable[[NDArray], NDArray],
    axis: NDArray,
    phase: PhaseTables,
    rng: np.random.Generator,
    samples: int = 2,
) -> NDArray[np.float64]:
    """Random estimate of the light scattered once along rays, for b = c = I = 1."""
    to_lamp = lamp - x
    t0 = (to_lamp * w).sum(axis=1)
    nearest = w * t0[:, None] - to_lamp
    h = np.maximum(np.linalg.norm(nearest, axis=1), _NEAREST)

    def xi(s: NDArray) -> NDArray:
        small = np.arctan2(h, np.hypot(s, h) + np.abs(s))
        return np.where(s < 0, small, math.pi / 2 - small)

    start, end = np.cbrt(xi(-t0)), np.cbrt(np.minimum(xi(P - t0), math.pi / 2 - 1e-9))
    total = np.zeros(len(x))
    for i in range(samples):
        q = start + (end - start) * (i + rng.random(len(x))) / samples
        angle = q**3
        s = -h / np.tan(2 * angle)
        place = nearest + s[:, None] * w
        cosine = place @ axis / np.maximum(np.linalg.norm(place, axis=1), 1e-12)
        path = np.maximum(t0 + h * np.tan(angle), 0.0)
        total += (
            6 * q**2 * (end - start) / h
            * phase.per_steradian(np.sin(angle) ** 2) * profile(cosine) * np.exp(-path)
        )  # fmt: skip
    return total / samples


def orders(
    x: NDArray,
    w: NDArray,
    P: float,
    lamp: NDArray,
    profile: Callable[[NDArray], NDArray],
    axis: NDArray,
    phase: PhaseTables,
    rng: np.random.Generator,
    count: int = 40,
    batches: int = 10,
    weight: NDArray | float = 1.0,
) -> NDArray[np.float64]:
    """Radiance by order of scattering, for albedo 1 and intensity 1, shape (batches, count).

    It is the mean over rays that start at x into the unit directions w, shape (n, 3), with a weight
    each; light from beyond P, the length of their first part, does not count. Place and axis of the
    lamp have the shape (3,); its profile is of the cosine from the axis. The rays are divided into
    batches for the error.
    """
    found = np.empty((batches, count))
    weight = weight * np.ones(len(x))
    seen, chosen = w, weight
    for order in range(count):
        light = chosen * single_scattering(x, seen, P, lamp, profile, axis, phase, rng)
        found[:, order] = light.reshape(batches, -1).mean(axis=1)
        if math.isinf(P):
            t = rng.exponential(size=len(x))
        else:
            inside = -math.expm1(-P)
            weight = weight * inside
            t = -np.log1p(-inside * rng.random(len(x)))
        P = math.inf
        x, before = x + t[:, None] * w, w
        w = turned(w, phase.drawn(rng, len(x)), rng)
        seen, fraction = _towards_lamp(x, before, w, lamp, phase, rng)
        chosen = weight * fraction
    return found


def _towards_lamp(
    x: NDArray,
    before: NDArray,
    after: NDArray,
    lamp: NDArray,
    phase: PhaseTables,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions to look for light in: half of them as scattered, half about the lamp; weights.

    Light scattered once has the pole 1/sin α there, α from the direction to the lamp, and that of
    the phase function besides.
    """
    to_lamp = lamp - x
    to_lamp = to_lamp / np.maximum(np.linalg.norm(to_lamp, axis=1, keepdims=True), 1e-12)
    seen = np.where((rng.random(len(x)) < 0.5)[:, None], after, _about(to_lamp, rng))
    p = phase.per_steradian(((seen - before) ** 2).sum(axis=1) / 4)
    return seen, 2.0 * p / (p + _density_about(seen, to_lamp))


def onto_patch(
    normals: NDArray, lamp: NDArray, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Random directions that a patch is lit from, and weights that make their mean irradiance.

    Half of them are drawn by the cosine, half about the lamp: by the cosine alone few would find
    the light scattered by small angles.
    """
    count = len(normals)
    by_cosine = turned(normals, (1.0 - np.sqrt(rng.random(count))) / 2.0, rng)
    to_lamp = np.tile(lamp / np.linalg.norm(lamp), (count, 1))
    w = np.where((rng.random(count) < 0.5)[:, None], by_cosine, _about(to_lamp, rng))
    cosine = np.maximum((w * normals).sum(axis=1), 0.0)
    return w, 2.0 * cosine / (cosine / math.pi + _density_about(w, to_lamp))


def _about(to_lamp: NDArray, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw directions about the lamp: half even in the angle from it, half in its logarithm."""
    even, fraction = rng.random(len(to_lamp)) < 0.5, rng.random(len(to_lamp))
    angle = math.pi * np.where(even, fraction, np.exp(-_DECADES * fraction))
    return turned(to_lamp, np.sin(angle / 2) ** 2, rng)


def _density_about(w: NDArray, to_lamp: NDArray) -> NDArray[np.float64]:
    """Density of these directions, 1/sr."""
    half = np.linalg.norm(w - to_lamp, axis=1) / 2
    angle = 2 * np.arcsin(np.clip(half, 0.0, 1.0))
    per_angle = 1.0 / math.pi + (angle > _NARROWEST) / (_DECADES * np.maximum(angle, _NARROWEST))
    return per_angle / (4 * math.pi * np.maximum(np.sin(angle), 1e-12))


def summed(found: NDArray, albedo: float) -> tuple[float, float]:
    """Radiance and its standard error at an albedo."""
    values = found @ albedo ** np.arange(1, found.shape[1] + 1)
    return float(values.mean()), float(values.std(ddof=1) / math.sqrt(len(values)))
