"""What closures that a renderer lacks throw back of a light, over a white matte surface.

A matte surface with this colour is as bright in the light, and has the renderer's shadows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..mathematics import NUMPY, Mathematics, Operand, dot

Vector = Sequence[Operand]

_LEAST = 1e-3
_ROUNDEST = 0.01  # of 1 - |anisotropy|
_SMOOTHEST = 1e-3


def stretched_highlight(
    n: Vector,
    tangent: Vector,
    to_eye: Vector,
    to_sun: Vector,
    roughness: Operand,
    anisotropy: Operand,
    rotation: Operand = 0.0,
    m: Mathematics = NUMPY,
) -> Operand:
    """Return that of a mirror whose roughness differs along and across a tangent.

    GGX with Smith's shadowing, with the widths of Blender's Glossy BSDF; what facets throw from
    one to another is left out.

    Directions are unit vectors; ``anisotropy`` is from -1 to 1, ``rotation`` of the tangent about
    the normal in whole turns.

    E. Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 3(2),
    2014.
    """
    narrow, wide = widths(roughness, anisotropy, m)
    back = m.less(anisotropy, 0.0)
    along, across = m.select(back, wide, narrow), m.select(back, narrow, wide)
    y = _unit(_cross(n, tangent), m)
    x = _cross(y, n)
    turn = 2.0 * math.pi * rotation
    sine, cosine = m.sine(turn), m.sine(turn + math.pi / 2.0)
    x, y = (
        [cosine * a + sine * b for a, b in zip(x, y, strict=True)],
        [cosine * b - sine * a for a, b in zip(x, y, strict=True)],
    )

    def seen(v: Vector) -> tuple[Operand, Operand, Operand]:
        return dot(v, x) * along, dot(v, y) * across, m.maximum(dot(v, n), _LEAST)

    half = halfway(to_eye, to_sun, m)
    hx, hy, hz = dot(half, x) / along, dot(half, y) / across, dot(half, n)
    (vx, vy, vz), (lx, ly, lz) = seen(to_eye), seen(to_sun)
    spread = hx * hx + hy * hy + hz * hz
    masked = lz * m.sqrt(vx * vx + vy * vy + vz * vz) + vz * m.sqrt(lx * lx + ly * ly + lz * lz)
    return _virtual_point_lights(along * across, spread, masked)


def round_highlight(
    n: Vector,
    to_eye: Vector,
    half: Vector,
    to_light: Vector,
    width2: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Return that of a mirror which is as rough along as across, for any light.

    Directions are unit vectors. ``width2`` is the square of the width of slopes: the fourth power
    of the roughness.
    """
    vz, lz = (m.maximum(dot(v, n), _LEAST) for v in (to_eye, to_light))
    hz = dot(half, n)
    spread = (1.0 - hz * hz) / width2 + hz * hz
    stretched = [m.sqrt(width2 + (1.0 - width2) * z * z) for z in (vz, lz)]
    return _virtual_point_lights(width2, spread, lz * stretched[0] + vz * stretched[1])


def halfway(one: Vector, other: Vector, m: Mathematics = NUMPY) -> list[Operand]:
    """Return the unit vector between two."""
    return _unit([a + b for a, b in zip(one, other, strict=True)], m)


def _virtual_point_lights(area: Operand, spread: Operand, masked: Operand) -> Operand:
    """Return D G / (4 cos cos), times pi."""
    return 0.5 / (area * spread * spread * masked)


def widths(
    roughness: Operand, anisotropy: Operand, m: Mathematics = NUMPY
) -> tuple[Operand, Operand]:
    """Return the smaller and the greater width of slopes of Blender's Glossy BSDF.

    Examples
    --------
    >>> [round(float(x), 3) for x in widths(0.3, -0.8)]
    [0.018, 0.45]
    """
    round_part = m.maximum(1.0 - m.absolute(anisotropy), _ROUNDEST)
    alpha = m.maximum(roughness * roughness, _SMOOTHEST)
    return alpha * round_part, alpha / round_part


def toon_highlight(
    n: Vector, to_sun: Vector, size: Operand, smooth: Operand, m: Mathematics = NUMPY
) -> Operand:
    """Return that of a diffuse toon, which is even in a cone about the normal.

    Directions are unit vectors; the size of the cone and of its soft border are over a right angle.
    """
    cosine = m.clamp(dot(n, to_sun), _LEAST, 1.0)
    angle, right = m.arccos(cosine), math.pi / 2.0
    border = m.maximum(smooth * right, _LEAST)
    even = m.clamp(1.0 - (angle - size * right) / border, 0.0, 1.0)
    cone = m.minimum((size + smooth) * right, right)
    return even * 0.5 / (m.maximum(1.0 - m.sine(right - cone), _LEAST) * cosine)


def _cross(a: Vector, b: Vector) -> list[Operand]:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def _unit(v: Vector, m: Mathematics) -> list[Operand]:
    length = m.sqrt(m.maximum(dot(v, v), _LEAST * _LEAST))
    return [part / length for part in v]
