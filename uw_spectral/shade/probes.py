"""Where light is gathered, and the rays that gather it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .grid import Array, Grid
from .voxels import SurfaceVoxels

RAYS = 64
"""Directions from each probe."""
SETS = 4
"""Sets of directions; probes side by side have different ones."""
_COARSE_START = 1.0  # voxels of a larger box that rays skip as they enter it
_OFF_WALL = 1.8  # voxels from a surface's middle to a point beside it, along its normal


@functools.lru_cache(maxsize=1)
def directions() -> Array:
    """Unit vectors spread evenly over the sphere, shape (SETS, RAYS, 3), so that each set is too.

    Examples
    --------
    >>> bool(np.abs(directions().mean(axis=1)).max() < 0.02)
    True
    """
    count = SETS * RAYS
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    side, turn = np.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * i
    w = np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)
    w = np.swapaxes(w.reshape(RAYS, SETS, 3), 0, 1)
    w.flags.writeable = False
    return w


def set_of(grid: Grid) -> NDArray[np.intp]:
    """Set of directions of each probe, shape (p,): every two of eight neighbours share one."""
    x, y, z = np.unravel_index(np.arange(grid.count), grid.shape)
    return (x + 2 * y + 3 * z) % SETS


@dataclass(frozen=True, eq=False)
class Rays:
    """What the probes see; geometry alone, whatever the water.

    Attributes
    ----------
    grid : Grid
        Of the p probes.
    voxels : SurfaceVoxels
    point : array, shape (p, 3)
        Where each probe gathers: free water in its cell, m.
    valid : array of bool, shape (p,)
        Whether there is any.
    distance : array, shape (p, r)
        Along each of its :func:`directions`, to a surface or the side of the box, m.
    hit : array of int, shape (p, r)
        Side of a surface that is seen: twice its number, one more for the side away from its
        normal; -1 for none.
    further : array, shape (p, r)
        Of rays that leave the box, from there to a surface or to where they are not followed, m.
    blocked : array of bool, shape (p, r)
        Whether there is a surface.
    probe_of_side : array of int, shape (2 k,)
        Valid probe next to each side of each surface.
    sunlit : array, shape (p,)
        Share of the sun that reaches a probe's surroundings.
    side_sunlit : array, shape (2 k,)
        Whether the sun reaches each side of each surface.
    """

    grid: Grid
    voxels: SurfaceVoxels
    point: Array
    valid: NDArray[np.bool_]
    distance: Array
    hit: NDArray[np.int32]
    further: Array
    blocked: NDArray[np.bool_]
    probe_of_side: NDArray[np.intp]
    sunlit: Array
    side_sunlit: Array

    def nearest(self, points: Array) -> NDArray[np.intp]:
        """Valid probe close to each of the points (..., 3)."""
        return self._stand_in[self.grid.index(points)]

    @functools.cached_property
    def _stand_in(self) -> NDArray[np.intp]:
        """For each probe itself, or a valid one close by."""
        return stand_ins(self.grid, self.valid)


def cast(
    voxels: SurfaceVoxels,
    grid: Grid,
    to_sun: ArrayLike,
    inside: ArrayLike = (),
    beyond: SurfaceVoxels | None = None,
) -> Rays:
    """Look around from every probe.

    Parameters
    ----------
    voxels : SurfaceVoxels
        In a grid whose cells divide those of the probes.
    grid : Grid
        Of the probes.
    to_sun : array_like, shape (3,)
        Unit vector from the water to the sun.
    inside : array_like, shape (m, 3)
        Points that are in open water, such as the camera's; so is what lies under open sky.
    beyond : SurfaceVoxels, optional
        Surfaces in a larger box, in which rays are followed that leave this one.
    """
    beyond = beyond or voxels
    reached = voxels.reachable(inside)
    point, valid = _places(voxels, grid, reached)
    origin = np.repeat(point[valid], RAYS, axis=0)
    heading = directions()[set_of(grid)[valid]].reshape(-1, 3)
    t, number = voxels.trace(origin, heading)
    met = number >= 0
    side = np.full(len(t), -1, np.int32)
    side[met] = 2 * number[met]
    side[met] += (voxels.normal[number[met]] * heading[met]).sum(axis=1) > 0
    distance, hit = np.zeros((grid.count, RAYS)), np.full((grid.count, RAYS), -1, np.int32)
    distance[valid], hit[valid] = t.reshape(-1, RAYS), side.reshape(-1, RAYS)
    further, blocked = np.zeros(distance.shape), np.zeros(distance.shape, bool)
    leaving = hit[valid] < 0
    ways = (origin + heading * t[:, None])[~met], heading[~met]
    further[valid], blocked[valid] = _put(leaving, *_follow(beyond, *ways))
    sun = np.asarray(to_sun, np.float64)
    sides, facing = _beside(voxels)
    clear = _sunlit(voxels, beyond, sides, sun) * (facing @ sun > 0)
    stand_in = stand_ins(grid, valid)
    return Rays(
        grid, voxels, point, valid, distance, hit, further, blocked,
        stand_in[grid.index(sides)], _sun_at(voxels, beyond, grid, reached, sun), clear,
    )  # fmt: skip


def _put(
    where: NDArray[np.bool_], distance: Array, blocked: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_]]:
    far, hit = np.zeros(where.shape), np.zeros(where.shape, bool)
    far[where], hit[where] = distance, blocked
    return far, hit


def _follow(
    beyond: SurfaceVoxels, origin: Array, direction: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """How far rays get in a larger box, and whether they meet a surface there."""
    distance, blocked = np.zeros(len(origin)), np.zeros(len(origin), bool)
    inside = beyond.grid.inside(origin)
    # Where they come from may be full there, being coarse.
    t, number = beyond.trace(origin[inside], direction[inside], _COARSE_START)
    distance[inside], blocked[inside] = t, number >= 0
    return distance, blocked


def stand_ins(grid: Grid, valid: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Of each probe itself, or of one that is not valid a valid one close by."""
    found = np.where(valid, np.arange(grid.count), -1).reshape(grid.shape)
    if not valid.any():
        return np.zeros(grid.count, np.intp)
    while (found < 0).any():
        wider = np.pad(found, 1, constant_values=-1)
        for axis in range(3):
            for step in (1, -1):
                other = np.roll(wider, step, axis)[1:-1, 1:-1, 1:-1]
                found = np.where(found < 0, other, found)
    return found.ravel().astype(np.intp)


def _beside(voxels: SurfaceVoxels) -> tuple[Array, Array]:
    """Points beside both sides of each surface, and the ways the sides face, (2 k, 3)."""
    away = np.stack([voxels.normal, -voxels.normal], axis=1)
    points = voxels.centre[:, None] + away * (_OFF_WALL * voxels.grid.cell)
    return points.reshape(-1, 3), away.reshape(-1, 3)


def _places(
    voxels: SurfaceVoxels, grid: Grid, reached: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_]]:
    """Point of each probe in water that is reached, nearest the middle of its cell."""
    blocks = _blocks(grid, reached)
    parts = round(blocks.shape[1] ** (1 / 3))
    steps = np.stack(np.unravel_index(np.arange(parts**3), (parts,) * 3), axis=1)
    offset = (steps - (parts - 1) / 2.0) * voxels.grid.cell
    cost = (offset**2).sum(axis=1) / voxels.grid.cell**2
    best = np.where(blocks, cost, np.inf).argmin(axis=1)
    return grid.centres() + offset[best], blocks.any(axis=1)


def _blocks(grid: Grid, values: NDArray) -> NDArray:
    """Values of voxels by the probe in whose cell they lie, shape (p, voxels in a cell)."""
    parts = [n // m for n, m in zip(values.shape, grid.shape, strict=True)]
    split = [x for pair in zip(grid.shape, parts, strict=True) for x in pair]
    blocks = values.reshape(split).transpose(0, 2, 4, 1, 3, 5)
    return blocks.reshape(grid.count, -1)


def _sunlit(voxels: SurfaceVoxels, beyond: SurfaceVoxels, points: Array, to_sun: Array) -> Array:
    """Whether the sun reaches points; those outside the box are in it."""
    clear = np.ones(len(points), bool)
    inside = np.flatnonzero(voxels.grid.inside(points))
    way = np.broadcast_to(to_sun, (len(inside), 3))
    t, number = voxels.trace(points[inside], way)
    clear[inside] = number < 0
    left = number < 0
    ends = points[inside[left]] + t[left, None] * way[left]
    clear[inside[left]] = ~_follow(beyond, ends, way[left])[1]
    return clear.astype(np.float64)


def _sun_at(
    voxels: SurfaceVoxels,
    beyond: SurfaceVoxels,
    grid: Grid,
    reached: NDArray[np.bool_],
    to_sun: Array,
) -> Array:
    """Share of the free voxels of each probe's cell that the sun reaches."""
    lit = np.zeros(reached.size)
    points = voxels.grid.centres()
    free = np.flatnonzero(reached.ravel())
    lit[free] = _sunlit(voxels, beyond, points[free], to_sun)
    lit, water = (_blocks(grid, x.reshape(reached.shape)) for x in (lit, reached))
    count = water.sum(axis=1)
    return np.where(count > 0, lit.sum(axis=1) / np.maximum(count, 1), 1.0)
