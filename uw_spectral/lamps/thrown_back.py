"""Light of lamps that things throw back into the water and on each other.

What a lamp lights is a lamp itself (Keller, Instant radiosity, Proc. SIGGRAPH 1997, 49):
Lambertian about its normal, as strong as the light that it gets and throws back. A few of them
stand for all that is lit: each has the middle and half the spread of its places, weighted by what
they bring to the camera, e^{-c r}/r², and all that they bring.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .lamp import Lamp
from .lamp_shadow import SIDE, shadow_directions
from .lamp_surface import patch_past_lamp, surface_irradiance
from .multiple_scattering import LampWater
from .profile import LAMBERT

type Array = NDArray[np.float64]

COUNT = 6
"""Lamps that stand for all that is lit."""
_TURN = 0.5  # of the distance, as which a difference of unit normals counts
_LEAST_COSINE = 0.05  # of a place that is lit
_NEAREST = 0.1  # m
_SMALLEST = 1e-30


@dataclass(frozen=True, eq=False)
class LitThings:
    """What lies in the directions of a map from a lamp (:func:`.shadow_directions`).

    Attributes
    ----------
    distances : array, shape (SIDE²,)
        m; infinite where nothing is.
    normals : array, shape (SIDE², 3)
        Unit vectors towards the lamp.
    reflectance : array, shape (SIDE², n)
    """

    distances: Array
    normals: Array
    reflectance: Array


def thrown_back(
    lamps: Sequence[Lamp],
    things: Sequence[LitThings],
    water: LampWater,
    camera: Sequence[float],
    count: int = COUNT,
) -> tuple[Lamp, ...]:
    """Return so many lamps that stand for what lamps light; dark ones where there is less.

    Parameters
    ----------
    lamps : sequence of Lamp
    things : sequence of LitThings
        What each of them lights.
    water : LampWater
        Of n bands.
    camera : sequence of 3
        Its place, m.
    count : int
    """
    dark = Lamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0 * water.a, LAMBERT, 1.0, 0.0, None, 1.0)
    found = [_of_lamp(lamp, lit, water, camera) for lamp, lit in zip(lamps, things, strict=True)]
    lit = _Lit.joined(found) if found else None
    if lit is None or not len(lit.points):
        return (dark,) * count
    groups = _groups(lit, np.array(camera), count)
    return (*map(_stands_for, groups), *(dark,) * (count - len(groups)))


def solid_angles() -> Array:
    """Solid angle of each direction of a map, sr, shape (SIDE²,).

    Examples
    --------
    >>> round(float(solid_angles().sum()) / math.pi, 2)
    4.0
    """
    # An area of the octahedron |x| + |y| + |z| = 1 is seen under its own over |x|³ in the square.
    step = np.full(SIDE, 2.0 / (SIDE - 1.0))
    step[[0, -1]] /= 2.0
    return np.outer(step, step).ravel() * np.abs(shadow_directions()).sum(axis=-1) ** 3


@dataclass(frozen=True, eq=False)
class _Lit:
    """Places that are lit: normals, radiant intensity by band, share that reaches the camera."""

    points: Array
    normals: Array
    intensity: Array
    arriving: Array

    @classmethod
    def joined(cls, parts: Sequence[_Lit]) -> _Lit:
        names = ("points", "normals", "intensity", "arriving")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def part(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> _Lit:
        return _Lit(*(x[chosen] for x in vars(self).values()))

    @property
    def weights(self) -> Array:
        return (self.intensity * self.arriving).mean(axis=-1)

    def mean(self, values: Array) -> Array:
        return np.average(values, axis=0, weights=self.weights)


def _of_lamp(lamp: Lamp, lit: LitThings, water: LampWater, camera: Sequence[float]) -> _Lit:
    hit = np.flatnonzero(lit.distances < water.reach)
    u, r, normals = shadow_directions()[hit], lit.distances[hit], lit.normals[hit]
    points = np.array(lamp.position) + r[:, None] * u
    patch = patch_past_lamp(lamp, tuple(points.T[..., None]), tuple(normals.T[..., None]))
    E = np.asarray(sum(surface_irradiance(lamp, patch, water)))
    area = solid_angles()[hit] * r * r / np.maximum(-(normals * u).sum(axis=-1), _LEAST_COSINE)
    intensity = E * area[:, None] * lit.reflectance[hit] / math.pi
    away = np.maximum(np.linalg.norm(points - np.array(camera), axis=-1), _NEAREST)[:, None]
    found = _Lit(points, normals, intensity, np.exp(-water.c * away) / away**2)
    return found.part(found.weights > 0)


def _groups(lit: _Lit, camera: Array, count: int) -> list[_Lit]:
    """Split places, each time those that are spread most, across where they are spread.

    Spread counts by the distance from the camera.
    """
    seen = lit.points - camera
    away = np.maximum(np.linalg.norm(seen, axis=-1), _NEAREST)[:, None]
    scaled = seen / away * (1.0 + np.log(away / away.min()))
    features, weights = np.concatenate([scaled, _TURN * lit.normals], axis=1), lit.weights
    groups = [np.arange(len(away))]
    while len(groups) < count:
        spread = [_spread(features[group], weights[group]) for group in groups]
        widest = int(np.argmax([size for size, _ in spread]))
        size, along = spread[widest]
        if size <= _SMALLEST * weights.sum():
            break
        group = groups.pop(widest)
        groups += [group[along > 0], group[along <= 0]]
    return [lit.part(group) for group in groups]


def _spread(features: Array, weights: Array) -> tuple[float, Array]:
    """Weighted squares of a group about its middle, and where along its length its members lie."""
    off = features - np.average(features, axis=0, weights=weights)
    moments = (off * weights[:, None]).T @ off
    return float(np.trace(moments)), off @ np.linalg.eigh(moments)[1][:, -1]


def _stands_for(lit: _Lit) -> Lamp:
    middle, normal = lit.mean(lit.points), lit.mean(lit.normals)
    # An even disc of radius R is spread by R²/2. What a ray through its middle gets goes with the
    # mean of one over the distance from it, 2/R: as of a lamp of half that radius.
    radius = math.sqrt(lit.mean(((lit.points - middle) ** 2).sum(axis=-1)) / 2.0)
    arriving = np.exp(lit.mean(np.log(lit.arriving)))
    intensity = (lit.intensity * lit.arriving).sum(axis=0) / arriving
    axis = normal / max(float(np.linalg.norm(normal)), _SMALLEST)
    return Lamp(tuple(middle), tuple(axis), intensity, LAMBERT, radius, 0.0, None, 1.0)
