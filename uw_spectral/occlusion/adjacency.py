"""What objects in view block of the light behind them, and what they send in its place.

Of a pixel's path the fraction b (K * cover) of scattering stays within objects, see
:mod:`.point_spread`: the light behind them is lost with less than the extinction c, and that of
the objects comes instead. The fraction that is the pixel's own object's, or one like it, has the
pixel's light; what stands beside may be brighter or darker. Where the floor is seen, it counts as
an object: what is scattered forward before it comes from around there, which may lie in a shadow.

At an edge a texel holds several surfaces, and a pixel of any of them looks it up. There only the
fraction that is scattered within the texel has the pixel's light; the rest has that of all around.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..transfer.channel_pixel import ChannelWater, along_rays
from ..transfer.channel_tables import ChannelTables
from ..transfer.pixel_parts import COLOURS, OcclusionFactor, SurfaceMaterial
from .grid import Array
from .occlusion_table import OcclusionTable
from .point_spread import at_middle, spread
from .visibility_buffer import VisibilityBuffer

_LEAST = 1e-6
_ON_THIS_SIDE = 0.5  # cells before a surface where its light is looked up
_BRIGHTER = 1.25  # than the mean around: so much a texel may be
_EDGE = 0.2  # difference from which on surfaces are not one
_SIDES = 3.0  # added to normals: those of a crease then differ much, of round objects little
_AROUND_EDGE = 2  # texels: a look-up reaches one, and so do soft edges
_COLOUR_COUNT = len(COLOURS)


@dataclass(frozen=True, eq=False)
class Adjacency:
    """What objects in view do to light that is scattered forward, in channels."""

    blocked: Array  #: Fraction of scattering that stays within objects, (3, SIZE, SIZE).
    own: Array  #: Fraction of that which has the light of the pixel, (3, SIZE, SIZE).
    #: What the objects there send besides: their mean radiance, less that fraction of the one that
    #: is seen, (3, SIZE, SIZE).
    beside: Array


def adjacency(
    buffer: VisibilityBuffer,
    light: ChannelTables,
    sun: Sequence[float],
    occlusion: OcclusionTable,
    floor: int | Sequence[float] = (0.0, 0.0, 0.0),
) -> Adjacency:
    """Return what is blocked, and what comes instead.

    ``floor`` is the column of the measured reflectance of the water's floor, or its colour.
    """
    nothing = np.zeros((_COLOUR_COUNT, *buffer.covered.shape))
    if not buffer.covered.any():
        return Adjacency(nothing, nothing + 1.0, nothing)
    of_surfaces, of_floor = _radiances(buffer, light, sun, occlusion, floor)
    known = buffer.seen | buffer.plane
    blocked, mean = _spread(buffer.covered, buffer.covered * of_surfaces, buffer, light)
    L, covered = of_surfaces, buffer.covered
    if buffer.floor.any():
        around = buffer.covered * of_surfaces + (buffer.with_floor - buffer.covered) * of_floor
        on_floor = _spread(buffer.with_floor, around, buffer, light)
        (blocked, mean), L, covered = (
            np.where(buffer.floor, x, y)
            for x, y in (
                (np.stack(on_floor), np.stack([blocked, mean])),
                (of_floor, of_surfaces),
                (buffer.with_floor, buffer.covered),
            )
        )
    within = sum(
        part[:, None, None] * at_middle(phase, buffer.view)
        for part, phase in zip(light.parts, light.components, strict=True)
    )
    own = np.clip(within * covered / np.maximum(blocked, _LEAST), 0.0, 1.0)
    own += (1.0 - own) * _one_surface(buffer, of_floor, known)
    # Among what is darker, a dark pixel of a bright texel must not lose more than it sends.
    brighter = own * L > _BRIGHTER * np.maximum(mean, 0.0)
    own = np.where(brighter, np.maximum(mean, 0.0) / np.where(brighter, L, 1.0), own)
    blocks = known & (blocked > _LEAST)
    own, beside = np.where(blocks, own, 1.0), np.where(blocks, mean - own * L, 0.0)
    own = 1.0 + _extended(own - 1.0, known)
    return Adjacency(np.clip(blocked, 0.0, 1.0), own, _extended(beside, known))


def _one_surface(buffer: VisibilityBuffer, of_floor: Array, known: NDArray[np.bool_]) -> Array:
    """Whether texels and those about them show one surface: 1, down to 0 at its edges.

    Across a surface all changes steadily, at an edge something jumps: how much of a texel is
    covered, how near it is, its colour or side. How light falls on a round object is no edge, but
    shadows on the floor have some.
    """
    distance = np.where(buffer.plane, buffer.level, buffer.distance)
    near = 1.0 / np.where(known, distance, np.inf)
    normal = np.where(buffer.plane[..., None], (0.0, 0.0, 1.0), buffer.normal)
    colour = np.where(buffer.plane[..., None], 0.0, buffer.colour)
    signals = np.concatenate(
        [
            np.stack([buffer.covered, buffer.floor, near]),
            np.moveaxis(colour, 2, 0),
            np.moveaxis(normal + _SIDES, 2, 0),
            np.where(buffer.floor, of_floor, 0.0),
        ]
    )
    jump = np.zeros(known.shape)
    for across, up in itertools.product(range(-_AROUND_EDGE, _AROUND_EDGE + 1), repeat=2):
        sides = [
            np.where(
                np.roll(known, step, axis=(0, 1)), np.roll(signals, step, axis=(1, 2)), signals
            )
            for step in ((up, across), (-up, -across))
        ]
        highest = np.maximum.reduce([signals, *sides, np.full_like(signals, _LEAST)])
        bend = np.abs(sides[0] + sides[1] - 2.0 * signals)
        jump = np.maximum(jump, (bend / highest).max(axis=0))
    return np.clip(1.0 - jump / _EDGE, 0.0, 1.0)


def _spread(
    covered: Array, L: Array, buffer: VisibilityBuffer, light: ChannelTables
) -> tuple[Array, Array]:
    """Fraction of scattering that stays within what is covered, and its mean radiance."""
    pictures = np.concatenate([covered[None], L])
    blocked, adjacency = np.zeros_like(L), np.zeros_like(L)
    for part, phase in zip(light.parts, light.components, strict=True):
        of_buffer, *of_light = spread(pictures, phase, float(buffer.view.per_unit))
        blocked += part[:, None, None] * of_buffer
        adjacency += part[:, None, None] * np.stack(of_light)
    return blocked, adjacency / np.maximum(blocked, _LEAST)


def _radiances(
    buffer: VisibilityBuffer,
    light: ChannelTables,
    sun: Sequence[float],
    occlusion: OcclusionTable,
    floor: int | Sequence[float],
) -> tuple[Array, Array]:
    """Radiance of the objects in each texel, and of the floor there, (3, SIZE, SIZE) each."""
    seen, level = buffer.seen, np.isfinite(buffer.level)
    water = along_rays(light, sun, [np.zeros((1, 1))] * 3)
    of_seen = _radiance(
        buffer, seen, buffer.distance, buffer.normal[seen],
        COLOURS, list(buffer.colour[seen].T[..., None]), water, occlusion,
    )  # fmt: skip
    up = np.tile((0.0, 0.0, 1.0), (int(level.sum()), 1))
    columns, colour = (COLOURS, floor) if not isinstance(floor, int) else ((floor,), (1.0,))
    base = [np.full((len(up), 1), part) for part in colour]
    of_level = _radiance(buffer, level, buffer.level, up, columns, base, water, occlusion)
    on_floor = buffer.floor & ~buffer.plane
    of_surfaces = np.where(on_floor, _extended(of_seen, seen & ~on_floor), of_seen)
    return of_surfaces, np.where(on_floor, of_seen, of_level)


def _radiance(
    buffer: VisibilityBuffer,
    here: NDArray[np.bool_],
    distance: Array,
    normal: Array,
    columns: Sequence[int],
    base: Sequence[Array],
    water: ChannelWater,
    occlusion: OcclusionTable,
) -> Array:
    """Radiance of patches of mean colours in some texels, 0 elsewhere, (3, SIZE, SIZE)."""
    found = np.zeros((_COLOUR_COUNT, *here.shape))
    P = distance[here][:, None]
    # A texel at the foot of a wall has something of what lies behind that, too.
    near = np.maximum(P - _ON_THIS_SIDE * occlusion.grid.cell, 0.5 * P)
    points = buffer.view.ways().reshape(*here.shape, 3)[here] * near
    points += np.asarray(buffer.view.centre)
    mean, *fractions, sunlit = occlusion.on_patches(points, normal).T[..., None]
    facing = np.maximum(normal @ -np.asarray(water.sun, np.float64), 0.0) * sunlit[:, 0] / np.pi
    surface = SurfaceMaterial(
        columns,
        [colour * facing[:, None] for colour in base],
        base,
        occlusion=OcclusionFactor(mean, fractions),
    )
    y = np.maximum(-points[:, 2:], 0.0)
    found[:, here] = np.asarray(water.leaving(surface, y, list(normal.T[..., None]), P)).T
    return found


def _extended(values: Array, known: NDArray[np.bool_]) -> Array:
    """Give texels that are not known what those next to them have."""
    total, count = np.zeros_like(values), np.zeros(known.shape)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near = np.roll(known, (dy, dx), axis=(0, 1))
            total += np.roll(values, (dy, dx), axis=(1, 2)) * near
            count += near
    return np.where(known, values, total / np.maximum(count, 1.0))
