"""Directions that light is kept for, of patches and of views, and those around a unit vector."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..mathematics import NUMPY, Mathematics, Operand
from ..octahedron import folded, lattice

SIDE = 7
"""Points of the lattice (:func:`..octahedron.lattice`) along a side; odd, so that the six axes are
among them."""
COUNT = SIDE * SIDE
NORMALS = lattice(SIDE)
"""The directions, (COUNT, 3)."""
AXES = np.stack([NORMALS, -NORMALS], axis=2).argmax(axis=0).ravel()
"""Those along the axes: forth and back, x first."""
FIRST = (NORMALS @ NORMALS.T).round(9).argmax(axis=1)
"""The first of each direction, for the lattice has its border twice."""


def around(w: Sequence[Operand], m: Mathematics = NUMPY) -> list[tuple[Operand, Operand]]:
    """Return the three points of the lattice around unit vectors: (row, fraction) of each."""
    x, y, z = w
    size = _size(w, m)
    half = 0.5 * (SIDE - 1)
    (i, u), (j, v) = (_cell((t + 1.0) * half, m) for t in folded(x * size, y * size, z, m))
    # The horizon is a side of triangles everywhere, or it would be mixed from above and below it.
    other = m.less(x * y, 0.0)
    v = m.select(other, 1.0 - v, v)
    near, far = j + other, j + (1.0 - other)
    before = m.less(u + v, 1.0)
    corner, beyond = i + near * float(SIDE), i + 1.0 + far * float(SIDE)
    return [
        (m.select(before, corner, beyond), m.absolute(1.0 - u - v)),
        (corner + 1.0, m.select(before, u, 1.0 - v)),
        (beyond - 1.0, m.select(before, v, 1.0 - u)),
    ]


def height(w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
    """Height of unit vectors on the octahedron, which those around them have in the mean."""
    return w[2] * _size(w, m)


def _size(w: Sequence[Operand], m: Mathematics) -> Operand:
    x, y, z = w
    return 1.0 / (m.absolute(x) + m.absolute(y) + m.absolute(z))


def _cell(t: Operand, m: Mathematics) -> tuple[Operand, Operand]:
    """Return the last point of the lattice that has one behind it, and the way beyond it."""
    low = m.clamp(m.floor(t), 0.0, SIDE - 2.0)
    return low, t - low
