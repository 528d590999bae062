"""Directions as places on a square: the octahedron around the sphere, unfolded.

The upper half is the middle of the square, the lower half its corners, folded outwards
(Z. H. Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
JCGT 3 (2), 2014). A lattice on the square has the border's directions twice, so that what lies
between them never crosses it.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand

SIDE = 7
"""Points of the lattice along a side; odd, so that the six axes are among them."""
COUNT = SIDE * SIDE


@functools.lru_cache(maxsize=1)
def lattice() -> NDArray[np.float64]:
    """Unit vectors of the lattice, shape (COUNT, 3), the second coordinate changing fastest.

    Examples
    --------
    >>> lattice()[COUNT // 2].tolist()
    [0.0, 0.0, 1.0]
    """
    u, v = (x.ravel() for x in np.meshgrid(*[np.linspace(-1.0, 1.0, SIDE)] * 2, indexing="ij"))
    z = 1.0 - np.abs(u) - np.abs(v)
    w = np.stack([*_folded(u, v, z), z], axis=1)
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    w.flags.writeable = False
    return w


def around(w: Sequence[Operand], m: Mathematics = NUMPY) -> list[tuple[Operand, Operand]]:
    """Return the three points of the lattice around unit vectors, each with its share.

    Parameters
    ----------
    w : three floats or arrays
    m : Mathematics
        Elementary functions.

    Returns
    -------
    list of (number, share)
        Numbers are those of rows of :func:`lattice`; the shares add up to 1.
    """
    x, y, z = w
    size = 1.0 / (m.absolute(x) + m.absolute(y) + m.absolute(z))
    half = 0.5 * (SIDE - 1)
    (i, u), (j, v) = (_cell((t + 1.0) * half, m) for t in _folded(x * size, y * size, z, m))
    before = m.less(u + v, 1.0)
    corner = i * float(SIDE) + j
    beyond = SIDE + 1.0
    return [
        (corner + (1.0 - before) * beyond, m.absolute(1.0 - u - v)),
        (corner + float(SIDE), m.select(before, u, 1.0 - v)),
        (corner + 1.0, m.select(before, v, 1.0 - u)),
    ]


def _folded(u: Operand, v: Operand, z: Operand, m: Mathematics = NUMPY) -> tuple[Operand, Operand]:
    """Return what is above as it is, and what is below folded out, or back."""
    below = m.less(z, 0.0)
    out = [
        (1.0 - m.absolute(other)) * (1.0 - 2.0 * m.less(one, 0.0))
        for one, other in ((u, v), (v, u))
    ]
    return m.select(below, out[0], u), m.select(below, out[1], v)


def _cell(t: Operand, m: Mathematics) -> tuple[Operand, Operand]:
    """Return the last point of the lattice that has one behind it, and the way beyond it."""
    low = m.clamp(m.floor(t), 0.0, SIDE - 2.0)
    return low, t - low
