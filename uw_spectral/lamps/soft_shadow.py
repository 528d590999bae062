"""How much of a lamp's scattered light things keep from a place: it finds its way round them.

Light that is scattered once on its way from a lamp to a place comes by a point y, is turned there
by ψ and arrives at the angle α from the lamp. Over all y the inverse squares cancel,

    ∫ d³y p / (|y - l|² |x - y|²) = (1/r) ∫ dφ ∫ dψ p(ψ) ∫_0^ψ dα,

so that points drawn evenly in α, and by ψ p(ψ) in ψ, count alike, but for the lamp's profile and
for what the longer way takes. The share of them that the lamp sees (:mod:`.lamp_shadow`) is the
share of the light that arrives. A place in a shadow gets none by points whose direction ends at
a thing: that is between, as a rule.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import Operand
from ..octahedron import lattice
from ..water.phase import BandPhase
from .lamp import Lamp
from .lamp_shadow import DISTANCES, SOFT_SIDE, lit, soft_distances
from .multiple_scattering import LampWater
from .wide_phase import RESOLVED, wide_moments

type Array = NDArray[np.float64]

_TURNS, _AROUND = 8, 4  # points by ψ, and of each of them
_MOMENTS, _ANGLES = 64, 721
_GOLDEN = 0.618034  # spreads the points evenly
_SMALLEST = 1e-9


@dataclass(frozen=True, eq=False)
class SoftMap:
    """A :class:`.SoftShadow` of arrays, shape (DISTANCES, SIDE, SIDE, 3)."""

    values: Array

    def at(self, distance: Operand, column: Operand, row: Operand) -> list[Array]:
        """Interpolate between the entries, at places of shape (..., 1), or of no shape."""
        ends = []
        for place, count in zip((distance, row, column), self.values.shape, strict=False):
            low = np.clip(np.floor(np.asarray(place)).astype(int), 0, count - 2)
            share = np.asarray(place) - low
            ends.append(((low, 1.0 - share), (low + 1, share)))
        total: Operand = 0.0
        for d, along in ends[0]:
            for v, down in ends[1]:
                for h, across in ends[2]:
                    total = total + self.values[d, v, h] * (along * down * across)[..., None]
        return [total[..., i] for i in range(3)]


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

    def seen(distances: Array) -> Array:
        return np.asarray(lit(shadow, [(part * distances)[..., None] for part in way]))[..., 0]

    at = from_lamp * r[:, None, None]
    first = seen(at)
    # Where the way on to the place ends, at its own distance.
    clear = first * seen(np.maximum(at, r[:, None, None]))
    least = _SMALLEST * np.exp(-c * r)[:, None]

    def mean(part: Array) -> Array:
        return ((part * weight).sum(axis=-1) + least) / (weight.sum(axis=-1) + least)

    bright, dark, ahead = mean(first), mean(clear), mean(np.cos(arriving))
    about = np.clip(mean(clear * np.cos(arriving)) / (dark * ahead), 0.0, 1.0)
    shares = np.stack([bright, dark, about], axis=-1)
    return SoftMap(shares.reshape(DISTANCES, SOFT_SIDE, SOFT_SIDE, 3))


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
