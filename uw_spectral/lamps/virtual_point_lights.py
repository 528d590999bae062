"""Light of lamps that objects throw back into the water and on each other.

What a lamp lights is a lamp itself (Keller, Instant radiosity, Proc. SIGGRAPH 1997, 49):
Lambertian about its normal, as strong as the light that it gets and throws back. A few of them
stand for all that a lamp lights, whatever others do, so that the light of lamps adds up: each has
the middle and the spread of its places, weighted by what they bring to the camera, e^{-c r}/r²,
and all that they bring. Places belong to several of them by shares that change smoothly as lamps,
camera and objects move. Of each there are six parts, found likewise: what is near lit objects gets
its light from these. What is lit is found by rays, most of them where the lamp shines: the edges of
objects pass few of them as it moves.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .lamp import Lamp, LitPart, LitParts
from .lamp_shadow import SIDE, shadow_directions
from .lamp_surface import patch_past_lamp, surface_irradiance
from .multiple_scattering import LampWater
from .profile import LAMBERT

Array = NDArray[np.float64]

COUNT = 6
"""Lamps that stand for what a single lamp lights, and parts of each: on both sides of its middle,
along three axes."""
_SIDES = {COUNT: list(range(COUNT)), 3: [0, 1, 2], 2: [0, 3]}
"""Which of these there are where there are fewer."""
IN_BEAM = 2048
"""Rays from a lamp that are spread as its light is, beside those of the map."""
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))
_PLACES = 512  # of a profile's integral
_TURN = 0.5  # of the distance, as which a difference of unit normals counts
_WIDE = 2.1  # deviations from its middle to the ends of what is spread evenly over a disc
_OVER_MEAN = (
    math.sqrt(math.e) / 2.0
)  # half a disc's radius, over the geometric mean from its middle
_SOFT = 0.05  # of all variance, as that of each lamp's share
_LEAST_COSINE = 0.05  # of a place that is lit
_NEAREST = 0.1  # m
_LEAST_FRACTION = 1e-6
_FAINTEST = 1e-200  # of what reaches the camera
_SMALLEST = 1e-30
_TURNS = np.radians([15.0, 135.0, 255.0])  # so that no two are one above the other on most walls
_AXES = np.stack(
    [math.sqrt(2.0) * np.cos(_TURNS), math.sqrt(2.0) * np.sin(_TURNS), np.ones(3)], axis=-1
) / math.sqrt(3.0)


@dataclass(frozen=True, eq=False)
class LampRays:
    """Directions in which a lamp is looked from; make it with :func:`rays_of`."""

    #: Unit vectors; the first are those of a map (:func:`.shadow_directions`), (k, 3).
    directions: Array
    solid_angles: Array  #: That each stands for, sr, (k,).


@dataclass(frozen=True, eq=False)
class LitSurfaces:
    """What lies in directions from a lamp."""

    rays: LampRays  #: k of them.
    distances: Array  #: m; infinite where nothing is, (k,).
    normals: Array  #: Unit vectors towards the lamp, (k, 3).
    reflectance: Array  #: Shape (k, n).


def virtual_point_lights(
    lamps: Sequence[Lamp],
    surfaces: Sequence[LitSurfaces | None],
    water: LampWater,
    camera: Sequence[float],
) -> tuple[Lamp, ...]:
    """Return the lamps that stand for what lamps light; dark ones where that is nothing.

    They are so many as there are lamps, whether these shine or not: six of one, three of each of
    two, two of each up to six. Of more than six lamps some share theirs.

    ``surfaces`` are what each of them lights, if anything.
    """
    groups = min(max(len(lamps), 1), COUNT)
    count, found = max(COUNT // groups, min(_SIDES)), []
    pairs = list(zip(lamps, surfaces, strict=True))
    for first, last in itertools.pairwise(len(pairs) * k // groups for k in range(groups + 1)):
        parts = [_of_lamp(lamp, lit, water, camera) for lamp, lit in pairs[first:last] if lit]
        lit = _Lit.joined(parts) if parts else None
        if lit is None or not len(lit.points):
            found += [_dark(water)] * count
        else:
            found += _standing_for(lit, np.array(camera), count)
    return tuple(found)


def _dark(water: LampWater) -> Lamp:
    place, up, none = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0 * water.a
    parts = LitParts((LitPart(place, up, none, 1.0),) * COUNT)
    return Lamp(place, up, none, LAMBERT, 1.0, 0.0, None, 1.0, parts=parts)


def _standing_for(lit: _Lit, camera: Array, count: int) -> list[Lamp]:
    fractions = _fractions(lit, camera, count)
    return [
        _with_parts(lamp, lit.shared(fraction), camera)
        for lamp, fraction in zip(_middles(lit, fractions), fractions, strict=True)
    ]


def rays_of(lamp: Lamp) -> LampRays:
    """Return rays in all directions, most of them where a lamp shines.

    Each counts by how densely those of both kinds lie about it (the balance heuristic of Veach).
    """
    widest = math.pi if lamp.profile.edge is None else math.acos(float(lamp.profile.edge))
    theta = np.linspace(0.0, widest, _PLACES)
    values = np.asarray(lamp.profile.value(np.cos(theta))) * np.sin(theta)
    within = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2.0)])
    within *= 2.0 * math.pi * widest / (_PLACES - 1.0)
    order = np.arange(IN_BEAM) + 0.5
    off = np.interp(order / IN_BEAM * within[-1], within, theta)
    axis = np.array(lamp.axis, dtype=np.float64)
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    turn = np.stack([across, np.cross(axis, across), axis])
    around = _GOLDEN * order
    sine = np.sin(off)
    beam = np.stack([sine * np.cos(around), sine * np.sin(around), np.cos(off)], axis=-1) @ turn
    directions: Array = np.concatenate([shadow_directions(), np.asarray(beam, np.float64)])
    # An area of the octahedron |x| + |y| + |z| = 1 is seen under its own over |x|³ in the square.
    step = 2.0 / (SIDE - 1.0)
    of_map = 1.0 / (step * step * np.abs(directions).sum(axis=-1) ** 3)
    shines = np.maximum(np.asarray(lamp.profile.value(directions @ axis)), 0.0)
    fraction = np.ones(SIDE)
    fraction[[0, -1]] /= 2.0  # directions of the border are there twice
    fractions = np.concatenate([np.outer(fraction, fraction).ravel(), np.ones(IN_BEAM)])
    in_beam = shines * IN_BEAM / max(float(within[-1]), _SMALLEST)
    return LampRays(directions, fractions / (of_map + in_beam))


@dataclass(frozen=True, eq=False)
class _Lit:
    """Places that are lit: what of their light, by band, and which fraction of it arrives."""

    points: Array
    normals: Array
    brought: Array
    log_arriving: Array
    weights: Array
    fraction: Array

    @classmethod
    def of(cls, points: Array, normals: Array, intensity: Array, arriving: Array) -> _Lit:
        brought = intensity * arriving
        weights = brought.mean(axis=-1)
        lit = weights > 0
        found = points, normals, brought, np.log(arriving), weights, np.ones(len(points))
        return cls(*(x[lit] for x in found))

    @classmethod
    def joined(cls, parts: Sequence[_Lit]) -> _Lit:
        each = zip(*(vars(part).values() for part in parts), strict=True)
        return cls(*(np.concatenate(x) for x in each))

    def shared(self, fraction: Array) -> _Lit:
        return replace(self, fraction=self.fraction * fraction, weights=self.weights * fraction)


def _of_lamp(lamp: Lamp, lit: LitSurfaces, water: LampWater, camera: Sequence[float]) -> _Lit:
    hit = np.flatnonzero(lit.distances < water.reach)
    u, r, normals = lit.rays.directions[hit], lit.distances[hit], lit.normals[hit]
    points = np.array(lamp.position) + r[:, None] * u
    patch = patch_past_lamp(lamp, tuple(points.T[..., None]), tuple(normals.T[..., None]))
    E = np.asarray(sum(surface_irradiance(lamp, patch, water)))
    area = (
        lit.rays.solid_angles[hit] * r * r / np.maximum(-(normals * u).sum(axis=-1), _LEAST_COSINE)
    )
    intensity = E * area[:, None] * lit.reflectance[hit] / math.pi
    away = np.maximum(np.linalg.norm(points - np.array(camera), axis=-1), _NEAREST)[:, None]
    arriving = np.maximum(np.exp(-water.c * away) / away**2, _FAINTEST)
    return _Lit.of(points, normals, intensity, arriving)


def _fractions(lit: _Lit, camera: Array, count: int) -> Array:
    """Fraction of each place in each lamp, shape (count, places).

    Lamps are wanted on both sides of the middle of all places, along three axes that are equally
    steep, so that there are six on a floor, and as far as the places are spread; a place belongs to
    those near it. Distances count by those from the camera.
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
    sides = _AXES @ root[:3]
    wanted = _WIDE * np.concatenate([sides, -sides])[_SIDES[count]]
    off = ((features - wanted[:, None]) ** 2).sum(axis=-1)
    near = np.exp((off.min(axis=0) - off) / (2.0 * _SOFT * variance.sum() + _SMALLEST))
    near += _LEAST_FRACTION
    return near / near.sum(axis=0)


def _with_parts(lamp: Lamp, lit: _Lit, camera: Array) -> Lamp:
    """Return the lamp for places with its parts, which are what stands for them in turn."""
    parts = []
    for one in _middles(lit, _fractions(lit, camera, COUNT)):
        fraction = one.intensity / np.maximum(lamp.intensity, _SMALLEST)
        parts.append(LitPart(one.position, one.axis, fraction, one.radius))
    return replace(lamp, parts=LitParts(parts))


def _middles(lit: _Lit, fractions: Array) -> list[Lamp]:
    """Return the lamps for fractions of places, shape (k, places)."""
    weights = fractions * lit.weights
    weights /= weights.sum(axis=-1, keepdims=True)
    middles, normals = weights @ lit.points, weights @ lit.normals
    # What a ray through the middle of an even disc of radius R gets goes with the mean of one over
    # the distance from it, 2/R: as of a lamp of half that radius. Where light falls off to all
    # sides a geometric mean finds that, and a mean square what is far away.
    off = [np.linalg.norm(lit.points - middle, axis=-1) for middle in middles]
    radii = _OVER_MEAN * np.exp((weights * np.log(np.maximum(off, _SMALLEST))).sum(axis=-1))
    intensities = ((fractions * lit.fraction) @ lit.brought) / np.exp(weights @ lit.log_arriving)
    axes = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), _SMALLEST)
    return [
        Lamp(tuple(middle), tuple(axis), intensity, LAMBERT, float(radius), 0.0, None, 1.0)
        for middle, axis, intensity, radius in zip(middles, axes, intensities, radii, strict=True)
    ]
