"""Places where light is kept away: some that are built here, and the example scenes with roofs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

from ._scenery import ball, block, ground, look_at, post

_SAND, _STONE, _RED = (0.35, 0.32, 0.26), (0.25, 0.25, 0.23), (0.5, 0.12, 0.08)
_WOOD, _TILES, _ICE = (0.3, 0.2, 0.11), (0.6, 0.7, 0.75), (0.8, 0.8, 0.8)


def slab(*, sand: bool = True) -> bpy.types.Object:
    """Fill a file with a slab of 8 m that hangs 4 m above sand, or nothing, and two balls."""
    block("slab", (0.0, 0.0, -4.15), (8.0, 8.0, 0.3), _STONE)
    if sand:
        ground(-8.0, _SAND)
    ball((0.5, 0.5, -6.5), 0.5, _RED)
    ball((-3.0, -5.2, -6.8), 0.5, _RED)
    return look_at((1.0, -9.5, -6.2), (0.0, 0.0, -6.0))


def pool() -> bpy.types.Object:
    """Fill a file with a pool of 5 × 10 m, 3 m deep, of white tiles, and a ball."""
    for side in (-1.0, 1.0):
        block(f"long {side}", (2.6 * side, 0.0, -1.4), (0.2, 10.4, 3.2), _TILES)
        block(f"short {side}", (0.0, 5.1 * side, -1.4), (5.0, 0.2, 3.2), _TILES)
    block("bottom", (0.0, 0.0, -3.1), (5.4, 10.4, 0.2), _TILES)
    ball((0.5, 1.0, -2.6), 0.4, _RED)
    return look_at((-1.0, -4.0, -1.6), (0.3, 1.0, -2.0))


def floe() -> bpy.types.Object:
    """Fill a file with a floe of 20 m, and a ball below; the water is deep."""
    block("floe", (0.0, 0.0, -0.2), (20.0, 20.0, 0.6), _ICE)
    ball((0.0, 10.0, -3.5), 0.5, _RED)
    return look_at((0.0, 5.0, -4.0), (0.0, 11.0, -3.0))


def box() -> bpy.types.Object:
    """Fill a file with a box of 4 × 5 × 3 m on sand, open to one side, and a ball inside."""
    for name, at, size in (
        ("back", (0.0, 2.6, -8.5), (4.4, 0.2, 3.0)),
        ("left", (-2.1, 0.0, -8.5), (0.2, 5.4, 3.0)),
        ("right", (2.1, 0.0, -8.5), (0.2, 5.4, 3.0)),
        ("roof", (0.0, 0.0, -6.9), (4.4, 5.4, 0.2)),
    ):
        block(name, at, size, _RED if name == "left" else _STONE)
    ground(-10.0, _SAND)
    ball((0.6, 0.8, -9.4), 0.6, _SAND)
    return look_at((-0.8, -5.6, -8.8), (0.1, 1.0, -8.5))


def tunnel(*, inside: bool) -> bpy.types.Object:
    """Fill a file with a tunnel of 3 × 8 m that bends, with a hole in its roof.

    The camera looks through it, or at one of its ends.
    """
    for name, x, y, turn in (("south", 0.0, -2.0, 0.0), ("north", 1.15, 2.1, -35.0)):
        parts = [
            ("left", (-1.7, 0.0, 1.2), (0.4, 5.0, 2.8), _STONE),
            ("right", (1.7, 0.0, 1.2), (0.4, 5.0, 2.8), _RED if name == "south" else _STONE),
        ]
        if name == "south":
            parts += [
                ("front", (0.0, -1.55, 2.75), (3.8, 1.9, 0.3), _STONE),
                ("back", (0.0, 1.55, 2.75), (3.8, 1.9, 0.3), _STONE),
                ("beside", (-1.25, 0.0, 2.75), (1.3, 1.2, 0.3), _STONE),
                ("across", (1.25, 0.0, 2.75), (1.3, 1.2, 0.3), _STONE),
            ]
        else:
            parts.append(("roof", (0.0, 0.0, 2.75), (3.8, 5.0, 0.3), _STONE))
        for part, at, size, colour in parts:
            block(f"{name} {part}", turned(at, turn, (x, y, -10.0)), size, colour, turn)
    ground(-10.0, _SAND)
    ball((0.5, -0.6, -9.6), 0.4, _SAND)
    ball((1.2, 2.6, -9.5), 0.5, _RED)
    if inside:
        return look_at((-0.4, -3.9, -8.6), (0.5, 1.0, -8.9))
    return look_at((-1.6, -9.5, -8.2), (0.2, -3.0, -8.7))


def jetty(*, inside: bool) -> bpy.types.Object:
    """Fill a file with a deck of planks on twelve piles; a boat and crates below.

    The camera is under it, or beside.
    """
    for k in range(17):
        block(f"plank {k}", (0.0, 0.75 * (k - 8), -0.45), (3.2, 0.5, 0.1), _WOOD)
    for side in (-1.0, 1.0):
        block(f"beam {side}", (1.4 * side, 0.0, -0.6), (0.2, 12.6, 0.2), _WOOD)
        for k in range(6):
            post((1.4 * side, 2.4 * (k - 2.5), -2.6), 0.16, 4.0, _STONE)
    ground(-4.5, _SAND)
    block("boat", (-0.3, 1.6, -4.15), (1.3, 3.2, 0.6), _RED, 25.0)
    for k, at in enumerate([(0.6, -1.6, -4.15), (0.5, -1.5, -3.5), (-0.7, -2.9, -4.15)]):
        block(f"crate {k}", at, (0.7, 0.7, 0.65), _WOOD, 20.0 * k)
    if inside:
        return look_at((0.2, -4.6, -3.0), (0.0, -1.5, -3.4))
    return look_at((-3.6, -4.4, -2.6), (-0.3, -1.6, -3.2))


def deck() -> bpy.types.Object:
    """Fill a file with a deck of 8 × 13 m close below the surface, over sand, and a ball."""
    block("deck", (0.0, 0.0, -0.45), (8.0, 12.6, 0.1), _WOOD)
    ground(-4.5, _SAND)
    ball((0.0, -2.4, -3.4), 0.35, _SAND)
    return look_at((0.2, -5.0, -3.0), (0.0, -1.5, -3.4))


def car(*, inside: bool) -> bpy.types.Object:
    """Fill a file with a hull as large as a car, of sheets with windows, on sand.

    The camera is behind its seats, or beside.
    """
    sill, top, end, half = 0.85, 1.5, 1.9, 0.9
    block("bottom", (0.0, 0.0, 0.25 - 7.0), (1.8, 4.4, 0.06), _RED)
    block("roof", (0.0, -0.3, top - 7.0), (1.8, 2.6, 0.06), _RED)
    block("bonnet", (0.0, end - 0.25, sill - 7.0), (1.8, 1.1, 0.06), _RED)
    for side in (-half, half):
        block(f"door {side}", (side, 0.0, 0.55 - 7.0), (0.06, 4.4, 0.6), _RED)
        for y in (-1.5, -0.2, 0.95):
            at = (side, y, (sill + top) / 2.0 - 7.0)
            block(f"pillar {side} {y}", at, (0.06, 0.14, top - sill), _RED)
    for y in (-2.2, 2.2):
        block(f"end {y}", (0.0, y, 0.55 - 7.0), (1.8, 0.06, 0.6), _RED)
    for x in (-0.42, 0.42):
        block(f"seat {x}", (x, 0.2, 0.5 - 7.0), (0.5, 0.5, 0.3), _STONE)
        block(f"back {x}", (x, -0.1, 0.85 - 7.0), (0.5, 0.14, 0.6), _STONE)
    ground(-7.0, _SAND)
    if inside:
        return look_at((0.1, -1.35, 1.05 - 7.0), (-0.05, 1.0, 0.75 - 7.0))
    return look_at((-3.4, -2.2, 1.5 - 7.0), (0.0, 0.0, 0.7 - 7.0))


def canyon(*, inside: bool) -> bpy.types.Object:
    """Fill a file with two walls of 7 × 16 m, 2 m apart, on sand.

    The camera is between them, or before them.
    """
    for side, colour in ((-1.0, _STONE), (1.0, _SAND)):
        block(f"wall {side}", (2.5 * side, 0.0, -8.5), (3.0, 16.0, 7.0), colour, 2.0 * side)
    ground(-12.0, _SAND)
    ball((0.3, -2.0, -11.5), 0.5, _RED)
    if inside:
        return look_at((-0.2, -6.0, -10.6), (0.1, 0.0, -10.4))
    return look_at((0.8, -12.5, -10.0), (0.0, -7.0, -10.0))


def of_file(path: Path) -> bpy.types.Object:
    """Open a file; its camera looks."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene.camera


def turned(at: Sequence[float], turn: float, origin: Sequence[float]) -> Vector:
    """Place of what is turned about z by degrees, and moved to an origin."""
    return Matrix.Rotation(math.radians(turn), 3, "Z") @ Vector(at) + Vector(origin)
