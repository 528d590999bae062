"""What people left on the reef: anchor, chain, dive lamp, glass float on its rope."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .detail import Detail
from .shapes import Shape, box, icosphere, joined, normalised, revolved, rotation_to, torus, tube

ANCHOR_RING = np.array([0.0, 0.0, 1.30])
"""Top of the anchor's ring in its own space."""


def anchor(detail: Detail) -> Shape:
    """Admiralty anchor 1.3 m long; crown at the origin, shank along +z, arms in the xz plane."""
    sides = 2 * detail.sides
    shank = tube([(0, 0, -0.02), (0, 0, 0.6), (0, 0, 1.14)], [0.045, 0.036, 0.03], sides)
    angle = np.linspace(-1.15, 1.15, 9 if detail.sides > 4 else 5)
    arc = np.stack([0.55 * np.sin(angle), 0 * angle, 0.5 - 0.55 * np.cos(angle)], axis=1)
    thickness = 0.042 - 0.014 * np.abs(angle) / 1.15
    parts = [shank, tube(arc, thickness, sides)]
    for sign in (-1, 1):
        tip, heading = arc[-1 if sign > 0 else 0], np.array([sign * 0.41, 0, 0.91])
        fluke = np.array([[0, -0.15], [0.095, -0.02], [0.0, 0.17], [-0.095, -0.02]])
        front = tip + fluke[:, 1:] * heading + fluke[:, :1] * (0, 1, 0)
        inward = np.array([-sign * 0.91, 0, 0.41]) * 0.035
        corners = np.concatenate([front + inward * 0.2, front + inward])
        faces = [(0, 1, 2), (0, 2, 3), (4, 6, 5), (4, 7, 6)]
        for i in range(4):
            j = (i + 1) % 4
            faces += [(i, i + 4, j + 4), (i, j + 4, j)]
        parts.append(Shape(corners, np.array(faces)))
    parts.append(tube([(0, -0.48, 1.02), (0, 0, 1.02), (0, 0.48, 1.02)], [0.02, 0.03, 0.02], sides))
    for sign in (-1, 1):
        parts.append(
            icosphere(2 if detail.sides > 4 else 1).moved((0, sign * 0.48, 1.02), scale=0.042)
        )
    upright = rotation_to((1, 0, 0))
    ring = torus(0.085, 0.016, 4 * detail.sides, detail.sides)
    parts.append(ring.moved((0, 0, 1.21), upright))
    return joined(parts)


LINK_PITCH = 0.076
"""Distance from link to link of the chain, m."""


def chain_link(detail: Detail) -> Shape:
    """Oval link 14 cm long in the xy plane, along x."""
    return torus(0.039, 0.0115, 3 * detail.sides, detail.sides).moved(scale=(1.35, 0.95, 1))


def lamp(detail: Detail) -> Shape:
    """Dive lamp 0.24 m long along +x from the origin; slot 0 metal, slot 1 bulb."""
    sides = 4 * detail.sides
    profile = [(0.001, -0.01), (0.022, -0.01), (0.024, 0.0), (0.024, 0.13), (0.042, 0.165)]
    profile += [(0.042, 0.228), (0.037, 0.230), (0.034, 0.205), (0.001, 0.195)]
    turn = rotation_to((1, 0, 0))
    bulb = icosphere(2 if detail.sides > 4 else 1).moved((0, 0, 0.203), scale=(0.026, 0.026, 0.02))
    return joined([revolved(profile, sides), bulb.with_material(1)]).moved(rotation=turn)


def glass_float(detail: Detail) -> Shape:
    """Hollow glass ball of 0.26 m in a net of rope; slot 0 glass, slot 1 rope."""
    level = 4 if detail.sides > 4 else 1
    outer = icosphere(level).moved(scale=0.13)
    inner = icosphere(level).moved(scale=0.122)
    inner = Shape(inner.vertices, inner.triangles[:, ::-1])
    parts = [outer, inner]
    segments = 6 * detail.sides if detail.sides > 4 else 12
    for number in range(4):
        turn = rotation_to((np.cos(number * np.pi / 4), np.sin(number * np.pi / 4), 0))
        parts.append(torus(0.134, 0.005, segments, 5).moved(rotation=turn).with_material(1))
    parts.append(torus(0.134, 0.005, segments, 5).with_material(1))
    parts.append(tube([(0, 0, -0.19), (0, 0, -0.16), (0, 0, -0.13)], 0.014, 6).with_material(1))
    return joined(parts)


def rope(start: ArrayLike, end: ArrayLike, detail: Detail) -> Shape:
    """Rope between two points, with a slight bow from the current."""
    t = np.linspace(0, 1, 6 * detail.sides)[:, None]
    start, end = np.asarray(start, float), np.asarray(end, float)
    line = start + (end - start) * t + np.array([0.06, 0.02, 0]) * np.sin(np.pi * t)
    return tube(line, 0.008, 6)


def crate() -> Shape:
    """Crate of 0.8 m on the origin, with battens; "uv" for planks."""
    parts = [box((0.74, 0.74, 0.74), (0, 0, 0.4))]
    for i in (-0.365, 0.365):
        for j in (-0.365, 0.365):
            parts.append(box((0.07, 0.07, 0.8), (i, j, 0.4)))
            parts.append(box((0.8, 0.07, 0.07), (0, i, j + 0.4)))
            parts.append(box((0.07, 0.8, 0.07), (i, 0, j + 0.4)))
    whole = joined(parts)
    v = whole.vertices
    return whole.with_attributes(uv=np.stack([v[:, 0] + v[:, 1], v[:, 2]], axis=1))


def barrel(detail: Detail) -> Shape:
    """Steel drum of 0.9 m on the origin, with two ribs."""
    rows = [(0.001, 0.02), (0.27, 0.02), (0.29, 0.0), (0.28, 0.04), (0.28, 0.29), (0.30, 0.31)]
    rows += [(0.28, 0.33), (0.28, 0.57), (0.30, 0.59), (0.28, 0.61), (0.28, 0.86), (0.29, 0.90)]
    rows += [(0.27, 0.88), (0.001, 0.88)]
    return revolved(rows, 4 * detail.sides)


def board_strut(top: ArrayLike, foot: ArrayLike) -> Shape:
    """Flat bar between two points."""
    top, foot = np.asarray(top, float), np.asarray(foot, float)
    length = float(np.linalg.norm(top - foot))
    turn = rotation_to(normalised(top - foot))
    return box((0.025, 0.01, length)).moved((top + foot) / 2, turn)
