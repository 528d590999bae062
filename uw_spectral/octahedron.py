"""Directions as places on a square: the octahedron around the sphere, unfolded.

The upper half is the middle of the square, the lower half its corners, folded outwards
(Z. H. Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
JCGT 3 (2), 2014). A lattice on the square has the border's directions twice, so that what lies
between them never crosses it.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from .content import constant
from .mathematics import NUMPY, Mathematics, Operand


@functools.lru_cache(maxsize=4)
def lattice(side: int) -> NDArray[np.float64]:
    """Unit vectors of a lattice on the square, shape (side², 3), the first coordinate fastest.

    Examples
    --------
    >>> lattice(3)[4].tolist()
    [0.0, 0.0, 1.0]
    """
    at = np.linspace(-1.0, 1.0, side)
    u, v = (part.ravel() for part in np.meshgrid(at, at))
    z = 1.0 - np.abs(u) - np.abs(v)
    w = np.stack([*folded(u, v, z), z], axis=-1)
    return constant(w / np.linalg.norm(w, axis=-1, keepdims=True))


def folded(u: Operand, v: Operand, z: Operand, m: Mathematics = NUMPY) -> tuple[Operand, Operand]:
    """Return what is above (z ≥ 0) as it is, and what is below folded out, or back.

    ``u`` and ``v`` are the first two parts of directions whose parts' sizes add up to 1, or places
    of the square; ``z`` is the third, or what has its sign.
    """
    below = m.less(z, 0.0)
    out = [
        (1.0 - m.absolute(other)) * (1.0 - 2.0 * m.less(one, 0.0))
        for one, other in ((u, v), (v, u))
    ]
    return m.select(below, out[0], u), m.select(below, out[1], v)
