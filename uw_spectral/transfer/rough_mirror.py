"""Rays that a rough mirror throws on: one for each sample, by chance as its facets stand."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..surface.refraction import mirrored_direction

Vector = Sequence[Operand]

_LEAST = 1e-4  # cosine to the eye


def facet_by_chance(
    n: Vector,
    to_eye: Vector,
    roughness: Operand,
    chance: Sequence[Operand],
    m: Mathematics = NUMPY,
) -> list[Operand]:
    """Return the normal of one of the facets that an eye sees of a rough mirror.

    Facets are GGX's, of the width that Blender's closures have, as often as they are seen.

    ``n`` and ``to_eye`` are unit vectors, the roughness is that of Blender's closures, ``chance``
    two numbers, even from 0 to 1.

    J. Dupuy & A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps", Computer Graphics
    Forum 42(8), 2023; the frame is that of T. Duff et al., JCGT 6(1), 2017.
    """
    width = roughness * roughness
    up = m.maximum(dot(n, to_eye), _LEAST)
    stretched = [width * (x - up * along) + up * along for x, along in zip(to_eye, n, strict=True)]
    stretched = _unit(stretched, m)
    high = dot(stretched, n)
    z = (1.0 - chance[1]) * (1.0 + high) - high
    aside = m.sqrt(m.maximum(1.0 - z * z, 0.0))
    turn = 2.0 * math.pi * chance[0]
    x, y = aside * m.sine(turn + 0.5 * math.pi), aside * m.sine(turn)
    half = [
        a * x + b * y + along * z + s
        for a, b, along, s in zip(*_beside(n, m), n, stretched, strict=True)
    ]
    high = m.maximum(dot(half, n), 0.0)
    return _unit(
        [width * (x - high * along) + high * along for x, along in zip(half, n, strict=True)], m
    )


def mirrored_by_chance(
    w: Vector,
    n: Vector,
    roughness: Operand,
    chance: Sequence[Operand],
    m: Mathematics = NUMPY,
) -> tuple[list[Operand], Operand]:
    """Direction in which a ray along w goes on from a facet of a rough mirror, and its weight.

    The weight is what other facets leave of the light: nothing of what comes from below the
    surface. Its mean is less than 1 by what is thrown from one facet to another
    (:meth:`.Facets.with_all_light`). Parameters are those of :func:`facet_by_chance`.
    """
    to_eye = [-x for x in w]
    r = mirrored_direction(w, facet_by_chance(n, to_eye, roughness, chance, m))
    width2 = roughness * roughness * roughness * roughness
    seen, lit = (m.maximum(dot(v, n), _LEAST) for v in (to_eye, r))

    def hidden(z: Operand) -> Operand:
        """1 + 2 Λ of Smith's shadowing."""
        return m.sqrt(1.0 + width2 * (1.0 / (z * z) - 1.0))

    left = (1.0 + hidden(seen)) / (hidden(seen) + hidden(lit))
    return r, left * m.less(0.0, dot(r, n))


def _beside(n: Vector, m: Mathematics) -> tuple[list[Operand], list[Operand]]:
    """Return two unit vectors at right angles to a third and to each other."""
    x, y, z = n
    side = m.select(m.less(z, 0.0), -1.0, 1.0)
    a = -1.0 / (side + z)
    b = x * y * a
    return [1.0 + side * x * x * a, side * b, -side * x], [b, side + y * y * a, -y]


def _unit(v: Vector, m: Mathematics) -> list[Operand]:
    length = m.maximum(m.sqrt(dot(v, v)), 1e-12)
    return [x / length for x in v]
