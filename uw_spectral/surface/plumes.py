"""Plumes of bubbles below whitecaps: where waves break, and how much air they leave there.

A breaker leaves its bubbles behind: foam runs on with the crest, a plume stays, and thins out as
bubbles rise. How much air it begins with follows from what is measured below whitecaps of all
winds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .raised_waves import RaisedWaves

AIR_COLUMN = 0.11 * 0.07
"""Air in m³ below a m² of foam, seconds after it was mixed in. 0.11 m lie below a m² of whitecaps
at any wind (estimated from their energy: arXiv:1906.11202, 2019); bubbles below the Hinze radius of
1 mm, which stay that long, have 7 % of the volume of Deane & Stokes' (2002) sizes up to 10 mm."""
FADES = 3.0
"""Time in s after which 1/e of the air is left. Foam of whitecaps decays in 0.5 to 8 s: A. H.
Callaghan et al., 18th Conference on Air-Sea Interaction, Boston, 6.3 (2012)."""
MOST = 8.0
"""Litres of air in a m³ that a plume is drawn with at most. Below a breaker there are tens, but so
much is hardly brighter, and real time draws dense clouds with a dark middle."""
LASTS = 9.0
"""Time in s after which a plume is over: a twentieth of its air is left."""

_DEEPEST_FRACTION = 0.5  # of the height of the wave: P. M. Kalvoda, L. Xu & J. Wu (2003)
_HIGHEST_BREAKER = 0.8  # m: a tenth of the longest waves that break (the same, up to 3.5 m/s)
_SHALLOWEST = 0.15  # m
_NARROWEST, _WIDEST = 0.4, 1.5  # m, half widths
_CELL, _AROUND = 0.2, 1.0  # m: of the grid that foam is sampled on, and about its thickest place
_CENTRED = 3  # rounds in which a patch finds its middle
_LEAST_FOAM = 0.1  # m²
_BEHIND = 0.1  # weight of what is behind the camera
_NEAREST = 2.0  # m
_EDGE = 2.0  # standard deviations of a blob at its outline
_SUNK = 0.3  # of its depth that the middle of a plume lies below the surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Patch:
    """Foam about a place."""

    #: m.
    x: float
    y: float
    area: float  #: Of the sea that it covers, m².
    #: Half widths along and across it, m.
    long: float = _NARROWEST
    short: float = _NARROWEST
    turn: float = 0.0  #: Of its length from +x towards +y, rad.


def patches(waves: RaisedWaves, middle: Sequence[float], radius: float) -> list[Patch]:
    """Find the foam within a radius, m, of a place."""
    side = np.arange(-radius, radius, _CELL) + 0.5 * _CELL
    x, y = np.meshgrid(middle[0] + side, middle[1] + side)
    foam = waves.foam_fraction(x, y)
    foam[np.hypot(x - middle[0], y - middle[1]) > radius] = 0.0
    found = []
    # The thickest places first, each with what is about it.
    while foam.any():
        i, j = divmod(int(np.argmax(foam)), len(side))
        place, part = (x[i, j], y[i, j]), foam
        for _ in range(_CENTRED):
            part = foam * (np.hypot(x - place[0], y - place[1]) < _AROUND)
            place = (part * x).sum() / part.sum(), (part * y).sum() / part.sum()
        foam = foam - part
        area = _CELL**2 * float(np.count_nonzero(part))
        if area >= _LEAST_FOAM:
            found.append(_patch(x - place[0], y - place[1], part / part.sum(), place, area))
    return found


def _patch(x: Array, y: Array, fraction: Array, place: tuple[float, float], area: float) -> Patch:
    """Return foam with so much of it at ways from its middle."""
    away = np.stack([x, y])
    spread, axes = np.linalg.eigh(np.einsum("ij,aij,bij->ab", fraction, away, away))
    # A disc of the radius r has the variance r²/4.
    short, long = np.clip(2.0 * np.sqrt(np.maximum(spread, 0.0)), _NARROWEST, _WIDEST).tolist()
    turn = math.atan2(axes[1, 1], axes[0, 1])
    return Patch(float(place[0]), float(place[1]), area, long, short, turn)


def largest(
    found: Sequence[Patch], count: int, middle: Sequence[float], ahead: Sequence[float]
) -> list[Patch]:
    """Choose the patches that count most: large, near, and before a camera.

    ``middle`` is where the camera is, m, and ``ahead`` where it looks, horizontally.
    """

    def weight(patch: Patch) -> float:
        to = patch.x - middle[0], patch.y - middle[1]
        before = to[0] * ahead[0] + to[1] * ahead[1] >= 0.0
        return patch.area * (1.0 if before else _BEHIND) / max(math.hypot(*to), _NEAREST) ** 2

    return sorted(found, key=weight, reverse=True)[:count]


def plume_depth(significant_height: float) -> float:
    """Half axis down of plumes in waves of a significant height, where density is e^-2, m."""
    return max(_DEEPEST_FRACTION * min(significant_height, _HIGHEST_BREAKER), _SHALLOWEST)


def plume_middle(depth: float, elevation: float) -> float:
    """Height of the middle of a plume of a depth, below a surface of an elevation, m.

    It is below the mean level, as nothing is drawn of clouds above it.
    """
    return min(elevation - _SUNK * depth, -0.05)


def plume_air(patch: Patch, depth: float, age: float) -> float:
    """Litres of air in a m³ where a plume of a depth, m, and age, s, is densest.

    A blob of this width and depth holds, below its middle, the air below its foam; but it is drawn
    with :data:`MOST` at most.
    """
    if not 0.0 <= age < LASTS:
        return 0.0
    across = 2.0 * math.pi * patch.long * patch.short / _EDGE**2
    down = math.sqrt(math.pi / 2.0) * depth / _EDGE
    air = 1e3 * AIR_COLUMN * patch.area / (across * down) * math.exp(-age / FADES)
    return min(air, MOST)
