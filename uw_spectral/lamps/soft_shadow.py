"""How much of a lamp's scattered light objects keep from a place: it finds its way round them.

Light that is scattered once on its way from a lamp to a place comes by a point y, is turned there
by ψ and arrives at the angle α from the lamp. Over all y the inverse squares cancel::

    ∫ d³y p / (|y - l|² |x - y|²) = (1/r) ∫ dφ ∫ dψ p(ψ) ∫_0^ψ dα,

so that points drawn evenly in α, and by ψ p(ψ) in ψ, count alike, but for the lamp's profile and
for what the longer way takes. The fraction of them that the lamp sees (:mod:`.lamp_shadow`), and
from which the way on is free, is the fraction of the light that arrives. A way on that comes into a
shadow goes through the object if it was nearer to the lamp than that, else in from the side. Light
that is scattered more often comes by such points too, and to them as if straight from the lamp:
what was found for once is carried on, order by order, which leaves it up to .1 too dark behind
objects.
"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import Operand
from ..octahedron import lattice
from ..table import Lookup, Table, discrete_axis
from ..water.phase import BandPhase
from .delta_scaled_phase import RESOLVED, wide_moments
from .lamp import Lamp
from .lamp_shadow import (
    DISTANCES,
    SOFT,
    SOFT_DISTANCES,
    SOFT_SIDE,
    behind,
    highest_near,
    lit_before,
    on_square,
    shadow_axes,
)
from .multiple_scattering import LampWater

Array = NDArray[np.float64]

ORDERS = 3
"""Of scattering, of which the third brings a twentieth."""
_TURNS, _AROUND = 16, 4  # points by ψ, and of each of them
_STEPS = 4  # of the way on from a point
_MOMENTS, _ANGLES = 64, 721
_SPREAD = 0.7548776662, 0.5698402910  # steps that spread points evenly over a square
_SMALLEST = 1e-9


def soft_map(lamp: Lamp, water: LampWater, orders: int = ORDERS) -> Table:
    """Return how much of a lamp's scattered light objects leave, in mean over the bands.

    The lamp has a shadow; light is scattered so many times at most.
    """
    shadow = lamp.shadow
    assert shadow is not None
    assert isinstance(water.phase, BandPhase)
    c, b = (float(np.mean(part)) for part in (water.a + water.wide, water.wide))
    points = _points(water.phase)
    # Of each place (distance, direction): its points, on ways that are alike at all distances.
    r, u = SOFT_DISTANCES.values()[:, None, None], lattice(SOFT_SIDE).T[:, :, None]
    y = points.ways * points.from_lamp
    ways = [
        _Passed.of(shadow, y + fraction * (u - y), r) for fraction in np.arange(_STEPS) / _STEPS
    ]
    free = np.ones_like(ways[0].r, dtype=bool)
    for before, now in itertools.pairwise(ways):
        free &= ~now.through_an_object(before)
    there = _Passed.of(shadow, np.broadcast_to(u, y.shape), r)
    hidden = _Passed(there.r, there.r * _nearest_object(shadow)[:, None])
    free_to = [free & ~end.through_an_object(ways[-1]) for end in (there, hidden)]

    weight = r * np.exp(-c * (points.length - 1.0) * r) * (b * points.gain / len(points.length))
    sent = np.broadcast_to(
        lamp.profile.value(np.tensordot(np.asarray(lamp.axis), points.ways, 1)), free.shape
    )
    got = sent * lit_before(ways[0].behind)
    all_of_it = np.full(free.shape[:2], _SMALLEST)
    arriving, arriving_hidden = all_of_it, all_of_it
    for order in range(orders):
        once = (sent * weight).sum(axis=-1)
        left, left_hidden = ((got * weight * way).sum(axis=-1) for way in free_to)
        all_of_it, arriving = all_of_it + once, arriving + left
        arriving_hidden = arriving_hidden + left_hidden
        if order + 1 < orders:
            sent, got = points.carried_on(np.stack([once, left], axis=-1))
    fractions = np.stack([arriving, arriving_hidden], axis=-1) / all_of_it[..., None]
    values = fractions.reshape(DISTANCES, SOFT_SIDE, SOFT_SIDE, 2, 1)
    return Table(values, (*SOFT, discrete_axis("fraction", 2)))


@dataclass(frozen=True, eq=False)
class _Passed:
    """Places on ways: distance from the lamp, m, and over that of the object in their direction."""

    r: Array
    behind: Array

    @classmethod
    def of(cls, shadow: Lookup, place: Array, scale: Array) -> _Passed:
        """Of places of shape (3, ...) at some scales, along which both grow."""
        r = np.sqrt((place * place).sum(axis=0))
        over = np.asarray(behind(shadow, list(place[..., None])))[..., 0]
        return cls(scale * r, scale * over)

    def through_an_object(self, before: _Passed) -> NDArray[np.bool_]:
        """Whether ways between from places before go through an object."""
        entered = (before.behind < 1.0) & (self.behind > 1.0)
        # From before an object, or from beside it and nearer.
        return entered & ((before.behind > 0.0) | (self.behind * before.r < self.r))


def _nearest_object(shadow: Lookup) -> Array:
    """One over the distance of the nearest object about each direction, 1/m, shape (SIDE²,)."""
    unit = [part[:, None] for part in lattice(SOFT_SIDE).T]
    found = np.asarray(behind(shadow, unit)).reshape(SOFT_SIDE, SOFT_SIDE)
    return highest_near(found).ravel()


def _beside(u: Array) -> tuple[Array, Array]:
    """Two unit vectors across each of u, shape (k, 3)."""
    least = np.eye(3)[np.abs(u).argmin(axis=1)]
    across = np.cross(u, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return across, np.cross(u, across)


@dataclass(frozen=True, eq=False)
class _Points:
    """Points that light is turned at on its way to the places of a map, which count alike."""

    ways: Array  #: Directions from the lamp, (3, SIDE², j).
    #: Distance from the lamp, and of the whole way, over that of the place, (j,).
    from_lamp: Array
    length: Array
    gain: float  #: Light that is scattered once over b r times what is not scattered.

    @functools.cached_property
    def _cells(self) -> dict[str, Operand]:
        """Rows and columns of the directions on the map."""
        column, row, _ = on_square(list(self.ways[..., None]), SOFT_SIDE)
        return {"row": row, "column": column}

    def carried_on(self, found: Array) -> tuple[Array, Array]:
        """Interpolate values of the places, (distance, direction, 2), at the points of each."""
        across = np.moveaxis(found, 0, 1).reshape(SOFT_SIDE, SOFT_SIDE, -1)
        shape = (*self.ways.shape[1:], DISTANCES, 2)
        at_all = Table(across, shadow_axes(SOFT_SIDE)).at(**self._cells).reshape(shape)
        place = np.asarray(SOFT_DISTANCES.place(SOFT_DISTANCES.values()[:, None] * self.from_lamp))
        low = np.minimum(place.astype(int), DISTANCES - 2)
        fraction, point = (place - low)[..., None], np.arange(len(self.from_lamp))
        near, far = (at_all[:, point, at] for at in (low, low + 1))
        between = np.moveaxis(near + fraction * (far - near), 1, 0)
        return between[..., 0], between[..., 1]


@functools.lru_cache(maxsize=4)
def _points(phase: BandPhase) -> _Points:
    moments = wide_moments(phase, _MOMENTS, RESOLVED).mean(axis=-1)
    angles = np.linspace(0.0, math.pi, _ANGLES)
    orders = 2.0 * np.arange(_MOMENTS + 1.0) + 1.0
    p = np.polynomial.legendre.legval(np.cos(angles), moments * orders / (4.0 * math.pi))
    grown = np.cumsum(angles * np.maximum(p, 0.0))
    index = np.arange(_TURNS * _AROUND)
    fractions = (index // _AROUND + 0.5) / _TURNS
    turn = np.interp(fractions * grown[-1], grown, angles)
    arriving, around = ((index * step + 0.5) % 1.0 for step in _SPREAD)
    leaving, around = turn * (1.0 - arriving), 2.0 * math.pi * around
    u = lattice(SOFT_SIDE)
    across, aside = _beside(u)
    sine, turned = np.sin(leaving), np.maximum(np.sin(turn), _SMALLEST)
    ways = [
        u[:, i : i + 1] * np.cos(leaving)
        + (across[:, i : i + 1] * np.cos(around) + aside[:, i : i + 1] * np.sin(around)) * sine
        for i in range(3)
    ]
    from_lamp = np.sin(turn * arriving) / turned
    gain = 2.0 * math.pi * grown[-1] * (angles[1] - angles[0]) / moments[0]
    return _Points(np.stack(ways), from_lamp, from_lamp + sine / turned, float(gain))
