"""Light of lamps that things throw back into the water and on each other.

What a lamp lights is a lamp itself (Keller, Instant radiosity, Proc. SIGGRAPH 1997, 49):
Lambertian about its normal, as strong as the light that it gets and throws back. A few of them
stand for all that is lit: each has the middle and half the spread of its places, weighted by what
they bring to the camera, e^{-c r}/r², and all that they bring. Places belong to several of them by
shares that change smoothly as lamps, camera and things move.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .lamp import Lamp
from .lamp_shadow import SIDE, shadow_directions
from .lamp_surface import patch_past_lamp, surface_irradiance
from .multiple_scattering import LampWater
from .profile import LAMBERT

Array = NDArray[np.float64]

COUNT = 6
"""Lamps that stand for all that is lit: on both sides of its middle, along three axes."""
_TURN = 0.5  # of the distance, as which a difference of unit normals counts
_WIDE = math.sqrt(3.0)  # deviations from its middle to the ends of what is spread evenly
_SOFT = 0.05  # of all variance, as that of each lamp's share
_LEAST_COSINE = 0.05  # of a place that is lit
_NEAREST = 0.1  # m
_LEAST_SHARE = 1e-6
_FAINTEST = 1e-200  # of what reaches the camera
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
) -> tuple[Lamp, ...]:
    """Return the lamps that stand for what lamps light; dark ones where that is nothing.

    Parameters
    ----------
    lamps : sequence of Lamp
    things : sequence of LitThings
        What each of them lights.
    water : LampWater
        Of n bands.
    camera : sequence of 3
        Its place, m.
    """
    dark = Lamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0 * water.a, LAMBERT, 1.0, 0.0, None, 1.0)
    found = [_of_lamp(lamp, lit, water, camera) for lamp, lit in zip(lamps, things, strict=True)]
    lit = _Lit.joined(found) if found else None
    if lit is None or not len(lit.points):
        return (dark,) * COUNT
    return tuple(_stands_for(lit.shared(share)) for share in _shares(lit, np.array(camera)))


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

    def part(self, chosen: NDArray[np.bool_]) -> _Lit:
        return _Lit(*(x[chosen] for x in vars(self).values()))

    def shared(self, share: Array) -> _Lit:
        return replace(self, intensity=self.intensity * share[:, None])

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
    arriving = np.maximum(np.exp(-water.c * away) / away**2, _FAINTEST)
    found = _Lit(points, normals, intensity, arriving)
    return found.part(found.weights > 0)


def _shares(lit: _Lit, camera: Array) -> Array:
    """Share of each place in each lamp, shape (COUNT, places).

    Lamps are wanted on both sides of the middle of all places, along three axes and as far as the
    places are spread; a place belongs to those near it. Distances count by those from the camera.
    """
    seen, weights = lit.points - camera, lit.weights / lit.weights.sum()
    away = np.maximum(np.linalg.norm(seen, axis=-1), _NEAREST)
    typical = math.exp(weights @ np.log(away))
    features = np.concatenate([seen / typical, _TURN * lit.normals], axis=1)
    features -= weights @ features
    covariance = (features * weights[:, None]).T @ features
    # Its symmetric root changes smoothly even where eigenvectors are exchanged.
    variance, along = np.linalg.eigh(covariance)
    root = (along * np.sqrt(np.maximum(variance, 0.0))) @ along.T
    wanted = _WIDE * np.concatenate([root[:3], -root[:3]])
    off = ((features - wanted[:, None]) ** 2).sum(axis=-1)
    near = np.exp((off.min(axis=0) - off) / (2.0 * _SOFT * variance.sum() + _SMALLEST))
    near += _LEAST_SHARE
    return near / near.sum(axis=0)


def _stands_for(lit: _Lit) -> Lamp:
    middle, normal = lit.mean(lit.points), lit.mean(lit.normals)
    # An even disc of radius R is spread by R²/2. What a ray through its middle gets goes with the
    # mean of one over the distance from it, 2/R: as of a lamp of half that radius.
    radius = math.sqrt(lit.mean(((lit.points - middle) ** 2).sum(axis=-1)) / 2.0)
    arriving = np.exp(lit.mean(np.log(lit.arriving)))
    intensity = (lit.intensity * lit.arriving).sum(axis=0) / arriving
    axis = normal / max(float(np.linalg.norm(normal)), _SMALLEST)
    return Lamp(tuple(middle), tuple(axis), intensity, LAMBERT, radius, 0.0, None, 1.0)
