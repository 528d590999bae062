"""What objects keep the light of a lamp from the water: how far it shines, by direction.

Directions are places of a square (:mod:`..octahedron`): linear in u / s, s the sum of the sizes of
its parts. So is the inverse of the distance of a plane, measured as such a sum: between its entries
the map is exact for planes. Where nothing is, beside objects, it is as much below zero as they are
above, so that they end halfway.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..octahedron import folded, lattice
from ..table import LOGARITHMIC, Axis, Lookup, Scale, Table

Array = NDArray[np.float64]

SIDE = 96
"""Entries of the map, each way."""
PART_SIDE = 8
"""Entries of the map of a part of lit objects, each way."""
SOFT_SIDE, DISTANCES = 20, 8
"""Entries of a map of scattered light, each way, and distances from the lamp."""
SOFT_DISTANCES = Scale(DISTANCES, 0.25, 16.0, LOGARITHMIC)
"""Them, m."""
SOFT = SOFT_DISTANCES.axis("distance"), Axis("row", SOFT_SIDE), Axis("column", SOFT_SIDE)
"""Axes of a :class:`.Lookup` of what reaches places, by their distance and direction: of two
fractions of a lamp's scattered light, as they are, and as if the lamp did not see them."""
_SOFT = 0.1  # fraction of the distance of an object, over which it grows dark behind
_SMALLEST = 1e-6  # m


def shadow_directions(side: int = SIDE) -> Array:
    """Unit vectors of the entries of a map, shape (side², 3).

    Examples
    --------
    >>> shadow_directions().shape, float(shadow_directions()[0, 2])
    ((9216, 3), -1.0)
    """
    return lattice(side)


def shadow_axes(side: int = SIDE) -> tuple[Axis, ...]:
    """Return the axes of a map, which are those of the square."""
    return Axis("row", side), Axis("column", side)


def shadow_map(distances: ArrayLike, side: int = SIDE) -> Table:
    """Return a map of the distances in m to the first object in each direction, infinite without.

    They have the shape (side²,), in the order of :func:`shadow_directions`.
    """
    summed = np.abs(shadow_directions(side)).sum(axis=-1) * np.asarray(distances, dtype=np.float64)
    inverse = (1.0 / np.maximum(summed, _SMALLEST)).reshape(side, side)
    values = np.where(inverse > 0, inverse, -highest_near(inverse))
    return Table(values[..., None], shadow_axes(side))


def highest_near(values: Array) -> Array:
    """Highest of each entry's neighbours, across the folds at the edges of the square too."""
    for _ in range(2):
        rows = np.concatenate([values[1:2, ::-1], values, values[-2:-1, ::-1]])
        values = np.max([rows[:-2], rows[1:-1], rows[2:]], axis=0).T
    return values


def lit(
    shadow: Lookup, place: Sequence[Operand], m: Mathematics = NUMPY, side: int = SIDE
) -> Operand:
    """Fraction of a lamp's light that reaches a place, 0 to 1, by a :func:`shadow_map`.

    The place is as the lamp sees it, m, in the axes of the world; the map has ``side`` entries each
    way.

    Examples
    --------
    >>> wall = np.where(shadow_directions()[:, 2] > 0, 2.0, np.inf)
    >>> [float(lit(shadow_map(wall), (0.0, 0.0, z))[0]) for z in (-5.0, 1.9, 2.5)]
    [1.0, 1.0, 0.0]
    """
    return lit_before(behind(shadow, place, m, side), m)


def lit_before(behind: Operand, m: Mathematics = NUMPY) -> Operand:
    """Fraction of a lamp's light that reaches a place so far :func:`behind` an object."""
    return m.clamp((1.0 + _SOFT - behind) / _SOFT, 0.0, 1.0)


def behind(
    shadow: Lookup, place: Sequence[Operand], m: Mathematics = NUMPY, side: int = SIDE
) -> Operand:
    """Distance of a place over that of the object in its direction; above 1 behind the object."""
    column, row, r = on_square(place, side, m)
    return r * shadow.at(row=row, column=column)


def scattered_lit(soft: Lookup, place: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
    """Fraction of a lamp's scattered light that reaches a place, 0 to 1; as of :func:`lit`."""
    return _looked_up(soft, place, m)[0]


def transmitted_in_shadow(
    soft: Lookup, place: Sequence[Operand], m: Mathematics = NUMPY
) -> Operand:
    """Fraction of a lamp's scattered light that reaches a place that the lamp does not see."""
    return _looked_up(soft, place, m)[1]


def _looked_up(soft: Lookup, place: Sequence[Operand], m: Mathematics) -> Sequence[Operand]:
    x, y, z = place
    distance = m.sqrt(x * x + y * y + z * z)
    column, row, _ = on_square(place, SOFT_SIDE, m)
    return soft.at(distance=distance, row=row, column=column)


def on_square(
    place: Sequence[Operand], side: int, m: Mathematics = NUMPY
) -> tuple[Operand, Operand, Operand]:
    """Column and row of a place's direction, and the sum of the sizes of its parts."""
    x, y, z = place
    r = m.absolute(x) + m.absolute(y) + m.absolute(z) + _SMALLEST
    h, v = folded(x / r, y / r, z, m)
    half = (side - 1.0) / 2.0
    return (h + 1.0) * half, (v + 1.0) * half, r
