"""Tables: values at the entries of named axes, and between them.

An axis tells where a coordinate lies among its entries, by formulas over a :class:`.Mathematics`:
numpy looks a :class:`Table` up, and shader nodes the same values in an image.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .mathematics import NUMPY, Mathematics, Operand

Array = NDArray[np.float64]
Place = Callable[[Operand, Mathematics], Operand]
"""Where a coordinate lies among entries, counted from 0."""


@dataclass(frozen=True)
class Spacing:
    """A monotone function of a coordinate in which entries are even, and its inverse."""

    of: Place
    inverse: Callable[[Array], Array]


EVEN = Spacing(lambda x, _: x, lambda u: u)
LOGARITHMIC = Spacing(lambda x, m: m.log(x), np.exp)


def root(power: float) -> Spacing:
    """Return what is even in a root of the coordinate, which begins at 0: fine there."""
    return Spacing(lambda x, m: m.power(x, 1.0 / power), lambda u: u**power)


def angular(power: float) -> Spacing:
    """Return the same of an angle whose coordinate is its cosine; the inverse is in rad."""
    return Spacing(lambda x, m: m.power(m.arccos(x), 1.0 / power), lambda u: u**power)


@dataclass(frozen=True)
class Scale:
    """Entries from one value of a coordinate to another; what lies outside is held.

    Examples
    --------
    >>> scale = Scale(4, 1.0, 1000.0, LOGARITHMIC)
    >>> float(scale.place(100.0)), scale.values().round(6).tolist()
    (2.0, [1.0, 10.0, 100.0, 1000.0])
    """

    count: int
    first: float
    last: float
    spacing: Spacing = EVEN
    beyond: float = 1.0  #: Times the last value, from which on it is held.
    unit: Operand = 1.0  #: What coordinates are multiplied with to be such values.

    def place(self, x: Operand, m: Mathematics = NUMPY) -> Operand:
        """Place of a coordinate among the entries."""
        low, high = sorted((self.first, self.beyond * self.last))
        first, last = self._ends
        along = self.spacing.of(m.clamp(x * self.unit, low, high), m) - first
        return along * ((self.count - 1.0) / (last - first))

    def values(self) -> Array:
        """Values of the entries."""
        (first, last), place = self._ends, np.arange(self.count)
        even = (first * place[::-1] + last * place) / (self.count - 1.0)
        return self.spacing.inverse(even) / self.unit

    @property
    def _ends(self) -> tuple[float, float]:
        first, last = (float(self.spacing.of(x, NUMPY)) for x in (self.first, self.last))
        return first, last

    def axis(self, name: str) -> Axis:
        """Return the axis of a coordinate."""
        return Axis(name, self.count, self.place)


@dataclass(frozen=True)
class Axis:
    """A coordinate of a table; without a scale it is a place among the entries."""

    name: str
    count: Operand
    place: Place = EVEN.of
    discrete: bool = False  #: Places are whole numbers: there is nothing between entries.


def discrete_axis(name: str, count: int) -> Axis:
    """Return an axis of entries that have nothing between them."""
    return Axis(name, count, discrete=True)


class Lookup(Protocol):
    """A table, of arrays or in a node tree."""

    def at(self, **coordinates: Operand) -> Operand:
        """Interpolate linearly at coordinates of the axes, by their names.

        Of a discrete axis that is left out all entries are found, as a list.
        """
        ...


@dataclass(frozen=True, eq=False)
class Table:
    """Values along axes, shape (entries of each, n); beyond its ends it goes on as it ends.

    Coordinates have shape (..., 1), or none; what is found has shape (..., n).

    Examples
    --------
    >>> table = Table(np.array([[0.0], [1.0], [3.0]]), (Axis("x", 3),))
    >>> table.at(x=0.5), table.at(x=np.array([[1.5], [3.0]])).tolist()
    (array([0.5]), [[2.0], [5.0]])
    """

    values: NDArray[np.floating]
    axes: tuple[Axis, ...]

    def at(self, **coordinates: Operand) -> Operand:
        """Return what :class:`Lookup` says."""
        listed = [i for i, axis in enumerate(self.axes) if axis.name not in coordinates]
        values = np.moveaxis(self.values, listed, range(-1 - len(listed), -1))
        ends = []
        given = (axis for axis in self.axes if axis.name in coordinates)
        for axis, count in zip(given, values.shape, strict=False):
            found = np.asarray(axis.place(np.asarray(coordinates[axis.name]), NUMPY), np.float64)
            at = found[..., 0] if found.ndim else found
            if axis.discrete:
                ends.append(((at.astype(np.intp), 1.0),))
                continue
            # Not clip, which takes many times as long on few numbers.
            low = np.minimum(np.maximum(np.floor(at).astype(np.intp), 0), max(count - 2, 0))
            fraction = (at - low)[(..., *(None,) * (1 + len(listed)))]
            ends.append(((low, 1.0 - fraction), (np.minimum(low + 1, count - 1), fraction)))
        total = np.zeros(values.shape[len(ends) :])
        for corner in itertools.product(*ends):
            index, fractions = zip(*corner, strict=True)
            total = total + values[index] * math.prod(fractions)
        return list(np.moveaxis(total, -2, 0)) if listed else total
