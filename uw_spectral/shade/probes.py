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
SETS = 8
"""Sets of directions; eight probes around a point have different ones."""
_COARSE_START = 1.0  # voxels of a larger box that rays skip as they enter it
_GRAZING = 0.2
_BEFORE_HIT = 1.5  # voxels
_OFF_SIDE = (1.8, 3.0, 4.2)  # the same to the probe that stands for it
_OFF_WALL = 1.8  # voxels from a surface's middle to a point beside it, along its normal


def spiral(count: int) -> Array:
    """Unit vectors spread evenly over the sphere, shape (count, 3)."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    side, turn = np.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * i
    return np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)


@functools.lru_cache(maxsize=1)
def directions() -> Array:
    """Unit vectors spread evenly over the sphere, shape (SETS, RAYS, 3), so that each set is too.

    Examples
    --------
    >>> bool(np.abs(directions().mean(axis=1)).max() < 0.02)
    True
    """
    w = np.einsum("sij,rj->sri", _turns(SETS), spiral(RAYS))
    w.flags.writeable = False
    return w


def _turns(count: int) -> Array:
    """Rotations spread evenly, as matrices (count, 3, 3).

    M. Alexa, "Super-Fibonacci Spirals", CVPR 2022.
    """
    s = np.arange(count) + 0.5
    inner, outer = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    one, other = (2.0 * math.pi * s / irrational for irrational in (math.sqrt(2.0), 1.533751168755))
    x, y = inner * np.sin(one), inner * np.cos(one)
    z, w = outer * np.sin(other), outer * np.cos(other)
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def set_of(grid: Grid) -> NDArray[np.intp]:
    """Set of directions of each probe, shape (p,): eight neighbours all have different ones.

    The same place has the same set in every grid of a lattice.
    """
    cells = np.unravel_index(np.arange(grid.count), grid.shape)
    x, y, z = (cell + first for cell, first in zip(cells, grid.first, strict=True))
    return (x + 2 * y + 4 * z) % SETS


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
        Whether there is a surface; or one in the box of which it is not clear how it is lit.
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

    @property
    def open_water(self) -> NDArray[np.bool_]:
        """Which rays leave the box, shape (p, r)."""
        return (self.hit < 0) & ~(self.blocked & (self.further == 0))

    def nearest(self, points: Array) -> NDArray[np.intp]:
        """Valid probe close to each of the points (..., 3)."""
        return self._stand_in[self.grid.index(points)]

    def nearest_in_sight(self, points: Array, otherwise: NDArray[np.intp]) -> NDArray[np.intp]:
        """Probe close to points (p, r, 3) with no surface between, or others (p, 1)."""
        found = self.nearest(points)
        seen = self.voxels.free_between(points, self.point[found])
        return np.where(seen, found, otherwise)

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
    reached = voxels.reachable_from(beyond, inside)
    inner = _inner(grid, voxels, reached, voxels.roofed_below(beyond))
    point, valid = _places(voxels, grid, inner)
    origin = np.repeat(point[valid], RAYS, axis=0)
    heading = directions()[set_of(grid)[valid]].reshape(-1, 3)
    t, number = voxels.trace(origin, heading)
    met = number >= 0
    side = np.full(len(t), -1, np.int32)
    side[met] = 2 * number[met]
    side[met] += (voxels.normal[number[met]] * heading[met]).sum(axis=1) > 0
    sides, facing = _beside(voxels)
    side[met] = _in_sight(
        voxels, (origin + heading * t[:, None])[met], heading[met], side[met], sides
    )
    t[met] = _to_plane(voxels, origin[met], heading[met], t[met], number[met])
    distance, hit = np.zeros((grid.count, RAYS)), np.full((grid.count, RAYS), -1, np.int32)
    distance[valid], hit[valid] = t.reshape(-1, RAYS), side.reshape(-1, RAYS)
    further, blocked = np.zeros(distance.shape), np.zeros(distance.shape, bool)
    leaving = ~met.reshape(-1, RAYS)
    ways = (origin + heading * t[:, None])[~met], heading[~met]
    further[valid], blocked[valid] = _put(leaving, *_follow(beyond, *ways))
    blocked[valid] |= (met & (side < 0)).reshape(-1, RAYS)
    sun = np.asarray(to_sun, np.float64)
    clear = _sunlit(voxels, beyond, sides, sun) * (facing @ sun > 0)
    stand_in = stand_ins(grid, valid)
    beside = _probes_beside(voxels, grid, stand_in, point, facing)
    return Rays(
        grid, voxels, point, valid, distance, hit, further, blocked,
        beside, _sun_at(voxels, beyond, grid, reached, inner, sun), clear,
    )  # fmt: skip


def _to_plane(
    voxels: SurfaceVoxels, origin: Array, heading: Array, t: Array, number: NDArray[np.int32]
) -> Array:
    """Distance to the mean plane of the surface in a voxel, if that is about where it was met."""
    normal = voxels.normal[number]
    along = (heading * normal).sum(axis=1)
    along = np.where(np.abs(along) < _GRAZING, np.inf, along)
    plane = ((voxels.centre[number] - origin) * normal).sum(axis=1) / along
    near = (np.abs(plane - t) < 2.0 * voxels.grid.cell) & (plane > 0)
    return np.where(near, plane, t)


def _in_sight(
    voxels: SurfaceVoxels, end: Array, heading: Array, side: NDArray[np.int32], sides: Array
) -> NDArray[np.int32]:
    """The sides that rays meet, -1 where what lies beside them is not where the rays come from.

    So are the edges of rooms, where one voxel has two walls.
    """
    before = end - heading * (_BEFORE_HIT * voxels.grid.cell)
    seen = voxels.free_between(before, sides[side])
    return np.where(seen, side, -1).astype(np.int32)


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


def _probes_beside(
    voxels: SurfaceVoxels, grid: Grid, stand_in: NDArray[np.intp], point: Array, facing: Array
) -> NDArray[np.intp]:
    """Probe on each side of each surface, (2 k,): the closest that is not behind it."""
    centre = np.repeat(voxels.centre, 2, axis=0)
    found = np.full(len(centre), -1, np.intp)
    for voxels_off in _OFF_SIDE:
        probe = stand_in[grid.index(centre + facing * (voxels_off * voxels.grid.cell))]
        before = ((point[probe] - centre) * facing).sum(axis=1) > 0
        found = np.where((found < 0) & (before | (voxels_off == _OFF_SIDE[-1])), probe, found)
    return found


def _places(
    voxels: SurfaceVoxels, grid: Grid, inner: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_]]:
    """Point of each probe among its voxels, nearest the middle of its cell."""
    parts = round(inner.shape[1] ** (1 / 3))
    steps = np.stack(np.unravel_index(np.arange(parts**3), (parts,) * 3), axis=1)
    offset = (steps - (parts - 1) / 2.0) * voxels.grid.cell
    cost = (offset**2).sum(axis=1) / voxels.grid.cell**2
    best = np.where(inner, cost, np.inf).argmin(axis=1)
    return grid.centres() + offset[best], inner.any(axis=1)


def _inner(
    grid: Grid,
    voxels: SurfaceVoxels,
    reached: NDArray[np.bool_],
    below: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Voxels that a probe stands for, (p, voxels in a cell).

    Of a cell with a wall these are the roofed ones: light that leaks out is seen less than light
    that leaks in.
    """
    blocks, roofed = _blocks(grid, reached), _blocks(grid, reached & below)
    walled = roofed.any(axis=1) & _blocks(grid, voxels.number >= 0).any(axis=1)
    return np.where(walled[:, None], roofed, blocks)


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
    inner: NDArray[np.bool_],
    to_sun: Array,
) -> Array:
    """Share of the voxels of each probe that the sun reaches."""
    lit = np.zeros(reached.size)
    points = voxels.grid.centres()
    free = np.flatnonzero(reached.ravel())
    lit[free] = _sunlit(voxels, beyond, points[free], to_sun)
    lit = _blocks(grid, lit.reshape(reached.shape)) * inner
    count = inner.sum(axis=1)
    return np.where(count > 0, lit.sum(axis=1) / np.maximum(count, 1), 1.0)
