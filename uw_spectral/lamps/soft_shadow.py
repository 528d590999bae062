"""How much of a lamp's scattered light things keep from a place: it finds its way round them.

Light that is scattered once on its way from a lamp to a place comes by a point y, is turned there
by ψ and arrives at the angle α from the lamp. Over all y the inverse squares cancel,

    ∫ d³y p / (|y - l|² |x - y|²) = (1/r) ∫ dφ ∫ dψ p(ψ) ∫_0^ψ dα,

so that points drawn evenly in α, and by ψ p(ψ) in ψ, count alike, but for the lamp's profile and
for what the longer way takes. The share of them that the lamp sees (:mod:`.lamp_shadow`), and from
which the way on is free, is the share of the light that arrives. A way on that comes into a shadow
goes through the thing if it was nearer to the lamp than that, else in from the side.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import Operand
from ..octahedron import lattice
from ..water.phase import BandPhase
from .angular_spread import Lookup, interpolated
from .lamp import Lamp
from .lamp_shadow import DISTANCES, SOFT_SIDE, behind, highest_near, lit, soft_distances
from .multiple_scattering import LampWater
from .wide_phase import RESOLVED, wide_moments

Array = NDArray[np.float64]

_TURNS, _AROUND = 8, 4  # points by ψ, and of each of them
_STEPS = 3  # of the way on from a point
_MOMENTS, _ANGLES = 64, 721
_GOLDEN = 0.618034  # spreads the points evenly
_SMALLEST = 1e-9


@dataclass(frozen=True, eq=False)
class SoftMap:
    """A :class:`.SoftShadow` of arrays, shape (DISTANCES, SIDE, SIDE, 2)."""

    values: Array

    def at(self, distance: Operand, column: Operand, row: Operand) -> list[Array]:
        """Interpolate between the entries, at places of shape (..., 1), or of no shape."""
        found = interpolated(self.values, (distance, row, column))
        return [found[..., i : i + 1] for i in range(2)]


def soft_map(lamp: Lamp, water: LampWater) -> SoftMap:
    """Return how much of a lamp's scattered light things leave, in mean over the bands.

    Parameters
    ----------
    lamp : Lamp
        With a shadow.
    water : LampWater
    """
    shadow = lamp.shadow
    assert shadow is not None
    assert isinstance(water.phase, BandPhase)
    c = float(np.mean(water.a + water.wide))
    turn, arriving, around = _points(water.phase)
    leaving = turn - arriving
    u, r = lattice(SOFT_SIDE), soft_distances()
    # Of each direction (k, 1): its points (k, j), at distances that grow with its own.
    across, aside = _beside(u)
    sine = np.sin(leaving)
    way = [
        u[:, i : i + 1] * np.cos(leaving)
        + (across[:, i : i + 1] * np.cos(around) + aside[:, i : i + 1] * np.sin(around)) * sine
        for i in range(3)
    ]
    cosine = sum(way[i] * lamp.axis[i] for i in range(3))
    shining = np.asarray(lamp.profile.value(cosine))
    from_lamp = np.sin(arriving) / np.maximum(np.sin(turn), _SMALLEST)
    longer = from_lamp + sine / np.maximum(np.sin(turn), _SMALLEST) - 1.0
    weight = shining * np.exp(-c * longer * r[:, None, None])

    at, there = from_lamp * r[:, None, None], r[:, None, None]
    points = [[part * at for part in way]]
    for share in np.arange(1.0, _STEPS) / _STEPS:
        points.append([y + share * (there * u[:, i : i + 1] - y) for i, y in enumerate(points[0])])
    first = np.asarray(lit(shadow, [part[..., None] for part in points[0]]))[..., 0]
    free, before = np.ones_like(first), _Passed.of(shadow, points[0])
    for place in points[1:]:
        now = _Passed.of(shadow, place)
        free = free * ~now.through_a_thing(before)
        before = now
    ends = np.broadcast_to(_nearest_thing(shadow)[:, None], first.shape)
    last = _Passed(np.broadcast_to(there, first.shape), there * ends)
    into = ~last.through_a_thing(before)
    least = _SMALLEST * np.exp(-c * r)[:, None]

    def mean(part: Array) -> Array:
        return ((part * weight).sum(axis=-1) + least) / (weight.sum(axis=-1) + least)

    shares = np.stack([mean(first * free), mean(first * free * into)], axis=-1)
    return SoftMap(shares.reshape(DISTANCES, SOFT_SIDE, SOFT_SIDE, 2))


@dataclass(frozen=True, eq=False)
class _Passed:
    """Places on ways: distance from the lamp, m, and over that of the thing in their direction."""

    r: Array
    behind: Array

    @classmethod
    def of(cls, shadow: Lookup, place: Sequence[Array]) -> _Passed:
        r = np.sqrt(sum(part * part for part in place))
        return cls(r, np.asarray(behind(shadow, [part[..., None] for part in place]))[..., 0])

    def through_a_thing(self, before: _Passed) -> NDArray[np.bool_]:
        """Whether ways between from places before go through a thing."""
        entered = (before.behind < 1.0) & (self.behind > 1.0)
        # From before a thing, or from beside it and nearer.
        return entered & ((before.behind > 0.0) | (self.behind * before.r < self.r))


def _nearest_thing(shadow: Lookup) -> Array:
    """One over the distance of the nearest thing about each direction, 1/m, shape (SIDE²,)."""
    unit = [part[:, None] for part in lattice(SOFT_SIDE).T]
    found = np.asarray(behind(shadow, unit)).reshape(SOFT_SIDE, SOFT_SIDE)
    return highest_near(found).ravel()


def _beside(u: Array) -> tuple[Array, Array]:
    """Two unit vectors across each of u, shape (k, 3)."""
    least = np.eye(3)[np.abs(u).argmin(axis=1)]
    across = np.cross(u, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return across, np.cross(u, across)


@functools.lru_cache(maxsize=8)
def _points(phase: BandPhase) -> tuple[Array, Array, Array]:
    """Angles ψ and α, and azimuths, of points that count alike."""
    moments = wide_moments(phase, _MOMENTS, RESOLVED).mean(axis=-1)
    angles = np.linspace(0.0, math.pi, _ANGLES)
    p = np.polynomial.legendre.legval(
        np.cos(angles), moments * (2.0 * np.arange(_MOMENTS + 1.0) + 1.0)
    )
    grown = np.cumsum(angles * np.maximum(p, 0.0))
    index = np.arange(_TURNS * _AROUND)
    shares = (index // _AROUND + 0.5) / _TURNS
    turn: Array = np.interp(shares * grown[-1], grown, angles)
    arriving: Array = turn * ((index + 0.5) / len(index) * _TURNS % 1.0)
    around: Array = 2.0 * math.pi * (index.astype(np.float64) * _GOLDEN % 1.0)
    return turn, arriving, around
