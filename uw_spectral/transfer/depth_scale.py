"""Where depths lie among the slices of a table: dense where the light in water bends.

That is below the surface, above a floor, and to both sides of a depth where the water changes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..table import Axis

SLICES = 24
"""Slices of a scale of one zone."""
LAYERED_SLICES = 32
"""Slices of a scale of several zones."""


@dataclass(frozen=True)
class Zone:
    """Water between two depths."""

    #: m.
    top: Operand
    thickness: Operand
    inverse: Operand  #: Of the distance from an end within which slices are evenly spaced, 1/m.
    #: Slices per logarithm of the distance from the top and from the bottom, and where they start.
    above: Operand
    below: Operand
    start: Operand

    @classmethod
    def of(cls, top: float, bottom: float, inverse: float, count: int, *, ends: bool) -> Zone:
        """Return a zone of so many steps between slices; ``ends`` if they are dense below too."""
        log = math.log1p((bottom - top) * inverse)
        rate = count / (2 * log if ends else log)
        below = rate if ends else 0.0
        return cls(top, bottom - top, inverse, rate, below, below * log)

    def position(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Slices between the top and a depth, which is held inside."""
        y = m.clamp(y - self.top, 0.0, self.thickness)
        above = self.above * m.log(1.0 + self.inverse * y)
        return above - self.below * m.log(1.0 + self.inverse * (self.thickness - y)) + self.start


@dataclass(frozen=True)
class DepthScale:
    """Zones from the surface down, and the number of slices in all of them.

    Examples
    --------
    >>> scale = DepthScale.between([0.0, 5.0, 20.0], [1.0, 2.0], floor=True)
    >>> scale.slice(np.array([0.0, 5.0, 20.0])).round(6), scale.depths()[:3].round(3)
    (array([ 0., 16., 31.]), array([0.   , 0.208, 0.448]))
    """

    zones: tuple[Zone, ...]
    slices: int

    @classmethod
    def between(
        cls, depths: Sequence[float], inverse: Sequence[float], *, floor: bool
    ) -> DepthScale:
        """Return the scale of zones that meet at depths, m, from the surface, 0, to the deepest.

        ``inverse`` is as of :class:`Zone`, for each of them.
        """
        slices = SLICES if len(inverse) == 1 else LAYERED_SLICES
        ends = [-(-place * (slices - 1) // len(inverse)) for place in range(len(depths))]
        zones = tuple(
            Zone.of(
                depths[place],
                depths[place + 1],
                each,
                ends[place + 1] - ends[place],
                ends=floor or place < len(inverse) - 1,
            )
            for place, each in enumerate(inverse)
        )
        return cls(zones, slices)

    @property
    def deepest(self) -> Operand:
        """Depth of the last slice, m."""
        return self.zones[-1].top + self.zones[-1].thickness

    @property
    def axis(self) -> Axis:
        """Depth, as the axis of a table."""
        return Axis("depth", self.slices, self.slice)

    def slice(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Position of a depth among the slices, 0 to ``slices - 1``."""
        total: Operand = 0.0
        for zone in self.zones:
            total = zone.position(y, m) + total
        return m.clamp(total, 0.0, self.slices - 1.0)

    def depths(self) -> NDArray[np.float64]:
        """Depths of the slices, m."""
        return _depths(self)


@functools.lru_cache(maxsize=32)
def _depths(scale: DepthScale) -> NDArray[np.float64]:
    # The scale is monotone: halving finds each slice.
    low, high = np.zeros(scale.slices), np.full(scale.slices, float(scale.deepest))
    for _ in range(60):
        middle = (low + high) / 2
        beyond = scale.slice(middle) > np.arange(scale.slices)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    found = (low + high) / 2
    found[[0, -1]] = 0.0, scale.deepest
    found.flags.writeable = False
    return found
