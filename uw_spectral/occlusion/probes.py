"""Where light is gathered, and the rays that gather it."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .changed_voxels import ChangedVoxels
from .grid import Array, Grid
from .voxels import SurfaceVoxels

RAYS = 64
"""Directions from each probe."""
SETS = 8
"""Sets of directions; eight probes around a point have different ones."""
MIRROR = np.array([1.0, 1.0, -1.0], np.float32)
"""What the surface of the water makes of directions."""
ENCLOSED = 0.25
"""Of a probe's rays that leave: light that comes by fewer is found by chance."""
_COARSE_START = 1.0  # voxels of a larger box that rays skip as they enter it
_GRAZING = 0.2
_HIGH_SUN = 0.7  # cosine of the sun on a surface
_BEFORE_HIT = 1.5  # voxels
_OFF_SIDE = (1.8, 3.0, 4.2)  # the same to the probe that stands for it
_OFF_WALL = 1.8  # voxels from a surface's middle to a point beside it, along its normal
ON_SIGHT = tuple((k + 0.5) / 8 for k in range(8))
"""Places between two points of neighbouring cells where a surface would hide one."""
_ABOUT_END = 7.0  # voxels from the end of a ray within which all lies that decides what it meets
_AT_SURFACE = 0.1  # voxels from the surface of the water
_MOST_PLACES = 48  # that have changed, or all is cast anew


def spiral(count: int) -> Array:
    """Unit vectors spread evenly over the sphere, shape (count, 3)."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    side, turn = np.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * i
    return np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)


@functools.lru_cache(maxsize=1)
def directions() -> Array:
    """Unit vectors spread evenly over the sphere, (SETS, RAYS, 3), so that each set is too."""
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
    """What the probes see; geometry alone, whatever the water."""

    grid: Grid  #: Of the p probes.
    voxels: SurfaceVoxels
    point: Array  #: Where each probe gathers: free water in its cell, m, (p, 3).
    valid: NDArray[np.bool_]  #: Whether there is any, (p,).
    #: Along each of its :func:`directions`, to a surface or the side of the box, m, (p, r).
    distance: Array
    #: Side of a surface that is seen: twice its number, one more for the side away from its normal;
    #: -1 for none, (p, r).
    hit: NDArray[np.int32]
    #: Of rays that leave the box, from there to a surface or to where they are not followed, m,
    #: (p, r).
    further: Array
    #: Whether there is a surface; or one in the box of which it is not clear how it is lit, (p, r).
    blocked: NDArray[np.bool_]
    #: Of rays that leave the box through the surface of the water: side that is seen mirrored in
    #: it, as in ``hit``, and how far from there, m, or to the side of the box, (p, r).
    mirrored: NDArray[np.int32]
    to_mirrored: Array
    probe_of_side: NDArray[np.intp]  #: Valid probe next to each side of each surface, (2 k,).
    sunlit: Array  #: Fraction of the sun that reaches a probe's surroundings, (p,).
    side_sunlit: Array  #: Fraction of each side of each surface that the sun reaches, (2 k,).
    beyond: SurfaceVoxels  #: Surfaces in a larger box.
    to_sun: Array  #: Shape (3,).
    reached: NDArray[np.bool_]  #: Voxels of water, (nx, ny, nz).
    lit: NDArray[np.bool_]  #: Which of them the sun reaches.

    @property
    def open_water(self) -> NDArray[np.bool_]:
        """Which rays leave the box, shape (p, r)."""
        return self.leaves(slice(None))

    def leaves(self, probes: NDArray[np.intp] | slice) -> NDArray[np.bool_]:
        """Which rays of some probes leave the box."""
        return (self.hit[probes] < 0) & ~(self.blocked[probes] & (self.further[probes] == 0))

    def enclosed(self, points: Array) -> bool:
        """Whether from any of some points (m, 3) in the grid little of the open is seen."""
        return bool(self.in_enclosed(self.nearest(points[self.grid.inside(points)])).any())

    def in_enclosed(self, probes: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether from some probes little of the open is seen."""
        return self.leaves(probes).mean(axis=1) < ENCLOSED

    def nearest(self, points: Array) -> NDArray[np.intp]:
        """Valid probe close to each of the points (..., 3)."""
        return self.stand_in[self.grid.index(points)]

    def along(self, probes: NDArray[np.intp], sets: NDArray[np.intp]) -> Rays:
        """Return what some probes see in other sets of directions; other rays stay."""
        origin = np.repeat(self.point[probes], RAYS, axis=0)
        heading = directions()[sets].reshape(-1, 3)
        found = _seen(self.voxels, self.beyond, _beside(self.voxels)[0], origin, heading)
        values = {name: getattr(self, name).copy() for name in found}
        for name, of_rays in found.items():
            values[name][probes] = of_rays.reshape(-1, RAYS)
        return dataclasses.replace(self, **values)

    def in_sight(
        self, cells: NDArray[np.intp], points: Array, otherwise: NDArray[np.intp]
    ) -> NDArray[np.intp]:
        """Probes close to points (..., 3) in cells with no surface between, or others (...)."""
        found = self.stand_in[cells]
        seen = self.voxels.free_between(points, self.point[found])
        return np.where(seen, found, otherwise)

    def other_sights(self, before: Rays, changed: ChangedVoxels) -> NDArray[np.bool_]:
        """Cells in which :meth:`in_sight` may find another probe than before."""
        at, cell = self.point[self.stand_in], self.grid.centres()
        half = self.grid.cell / 2.0
        low, high = np.minimum(at, cell - half), np.maximum(at, cell + half)
        other = (self.stand_in != before.stand_in) | (at != before.point[before.stand_in]).any(1)
        return other | changed.between(low, high)

    @functools.cached_property
    def stand_in(self) -> NDArray[np.intp]:
        """For each probe itself, or a valid one close by."""
        return stand_ins(self.grid, self.valid)


def cast(
    voxels: SurfaceVoxels,
    grid: Grid,
    to_sun: ArrayLike,
    inside: ArrayLike = (),
    beyond: SurfaceVoxels | None = None,
    before: Rays | None = None,
) -> Rays:
    """Look around from every probe.

    Parameters
    ----------
    voxels : SurfaceVoxels
        In a grid whose cells divide those of the probes.
    to_sun : array_like, shape (3,)
        Unit vector from the water to the sun.
    inside : array_like, shape (m, 3)
        Points that are in open water, such as the camera's; so is what lies under open sky.
    beyond : SurfaceVoxels, optional
        Surfaces in a larger box, in which rays are followed that leave this one.
    before : Rays, optional
        Of another frame: what has not changed since is taken from it, and is the same as if it
        had been cast anew.
    """
    beyond = beyond or voxels
    sun = np.asarray(to_sun, np.float64)
    if before is not None and not _comparable(before, voxels, grid, sun, beyond):
        before = None
    changes = None if before is None else _changes(before, voxels, beyond)
    reached = voxels.reachable_from(beyond, inside)
    below = voxels.roofed_below(beyond)
    if before is not None and changes is not None and not any(changes):
        was_below = before.voxels.roofed_below(before.beyond)
        if np.array_equal(reached, before.reached) and np.array_equal(below, was_below):
            return dataclasses.replace(before, voxels=voxels, beyond=beyond)
    inner = _inner(grid, voxels, reached, below)
    point, valid = _places(voxels, grid, inner)
    sides, facing = _beside(voxels)
    new = np.broadcast_to(valid[:, None], (grid.count, RAYS))
    if before is not None and changes is not None:
        new = new & _concerned(before, point, valid, changes)
    kept = ~new & valid[:, None]
    which, ray = new.nonzero()
    ways = point[which], directions()[set_of(grid)[which], ray]
    looked = {}
    for name, of_new in _seen(voxels, beyond, sides, *ways).items():
        is_side = name in ("hit", "mirrored")
        looked[name] = np.full(new.shape, -1 if is_side else 0, of_new.dtype)
        looked[name][new] = of_new
        if before is not None and changes is not None:
            was = getattr(before, name)[kept]
            looked[name][kept] = _renumbered(was, changes[0]) if is_side else was
    beside = _probes_beside(voxels, grid, valid, point, sides, facing)
    lit = _lit(voxels, beyond, reached, sun, before, changes)
    clear = _sides_lit(voxels, beyond, sun, before, changes)
    return Rays(
        grid, voxels, point, valid, **looked, probe_of_side=beside,
        sunlit=_fraction_lit(voxels, grid, lit, inner, point), side_sunlit=clear,
        beyond=beyond, to_sun=sun, reached=reached, lit=lit,
    )  # fmt: skip


_Changes = tuple[ChangedVoxels, ChangedVoxels]
"""In a box, and in the larger one."""


def _comparable(
    before: Rays, voxels: SurfaceVoxels, grid: Grid, sun: Array, beyond: SurfaceVoxels
) -> bool:
    return (
        before.grid == grid
        and before.voxels.grid == voxels.grid
        and before.beyond.grid == beyond.grid
        and np.array_equal(before.to_sun, sun)
    )


def _changes(before: Rays, voxels: SurfaceVoxels, beyond: SurfaceVoxels) -> _Changes | None:
    """What has changed; None if it is too much."""
    found = ChangedVoxels(before.voxels, voxels), ChangedVoxels(before.beyond, beyond)
    return found if sum(changed.parts for changed in found) <= _MOST_PLACES else None


def _concerned(
    before: Rays, point: Array, valid: NDArray[np.bool_], changes: _Changes
) -> NDArray[np.bool_]:
    """Which rays (p, r) may meet something else than before."""
    near, far = changes
    moved = (valid != before.valid) | (point != before.point).any(axis=1)
    found = np.broadcast_to(moved[:, None], before.distance.shape).copy()
    kind, cell = set_of(before.grid), before.voxels.grid.cell
    for number in range(SETS):
        rows = np.flatnonzero((kind == number) & valid)
        w = directions()[number].astype(np.float32)
        origin, distance = point[rows, None], before.distance[rows].astype(np.float32)
        found[rows] |= near.crossed(origin, w, distance + 2.0 * cell, _ABOUT_END * cell)
        if before.to_mirrored.any():
            away = before.to_mirrored[rows].astype(np.float32)
            surface = origin + w * distance[..., None]
            crossed = near.crossed(surface, w * MIRROR, away + 2.0 * cell, _ABOUT_END * cell)
            found[rows] |= (away > 0) & crossed
        if far:
            leaving = before.hit[rows] < 0
            length = np.where(leaving, distance + before.further[rows], 0.0)
            wide = 2.0 * far.grid.cell
            found[rows] |= leaving & far.crossed(origin, w, length + wide)
    return found


def _renumbered(hit: NDArray[np.int32], changed: ChangedVoxels) -> NDArray[np.int32]:
    """The same sides of surfaces as they are numbered now."""
    number = changed.renumbered
    sides = np.stack([2 * number, 2 * number + 1], axis=1).ravel()
    return np.append(sides, -1).astype(np.int32)[hit]


def _seen(
    voxels: SurfaceVoxels, beyond: SurfaceVoxels, sides: Array, origin: Array, heading: Array
) -> dict[str, NDArray[Any]]:
    """Follow rays; return what :class:`Rays` has of each."""
    t, side, met = _meet(voxels, sides, origin, heading)
    end = origin + heading * t[:, None]
    far, blocked = np.zeros(len(t)), met & (side < 0)
    far[~met], blocked[~met] = _follow(beyond, end[~met], heading[~met])
    mirrored, away = np.full(len(t), -1, np.int32), np.zeros(len(t))
    up = np.flatnonzero(~met & (end[:, 2] > -_AT_SURFACE * voxels.grid.cell))
    away[up], mirrored[up], _ = _meet(voxels, sides, end[up], heading[up] * MIRROR)
    return {
        "distance": t, "hit": side, "further": far, "blocked": blocked,
        "mirrored": mirrored, "to_mirrored": away,
    }  # fmt: skip


def _meet(
    voxels: SurfaceVoxels, sides: Array, origin: Array, heading: Array
) -> tuple[Array, NDArray[np.int32], NDArray[np.bool_]]:
    """How far rays get, what side they meet, -1 if it is not clear, and whether there is one."""
    t, number = voxels.trace(origin, heading)
    met = number >= 0
    side = np.full(len(t), -1, np.int32)
    end = origin + heading * t[:, None]
    side[met] = voxels.side_met(number[met], origin[met], heading[met])
    side[met] = _in_sight(voxels, end[met], heading[met], side[met], sides)
    t[met] = _to_plane(voxels, origin[met], heading[met], t[met], side[met])
    return t, side, met


def _to_plane(
    voxels: SurfaceVoxels, origin: Array, heading: Array, t: Array, side: NDArray[np.int32]
) -> Array:
    """Distance to the plane of the side that is met, if that is about where it was."""
    normal = voxels.facing.reshape(-1, 3)[side]
    along = (heading * normal).sum(axis=1)
    along = np.where(np.abs(along) < _GRAZING, np.inf, along)
    plane = ((voxels.middle.reshape(-1, 3)[side] - origin) * normal).sum(axis=1) / along
    near = (side >= 0) & (np.abs(plane - t) < 2.0 * voxels.grid.cell) & (plane > 0)
    return np.where(near, plane, t)


def _in_sight(
    voxels: SurfaceVoxels, end: Array, heading: Array, side: NDArray[np.int32], sides: Array
) -> NDArray[np.int32]:
    """The sides that rays meet, -1 where what lies beside them is not where the rays come from.

    So are the edges of rooms, where one voxel has two walls, and what reaches under a wall.
    """
    before, beside = end - heading * (_BEFORE_HIT * voxels.grid.cell), sides[side]
    seen = voxels.free_between(before, beside)
    seen &= voxels.number.ravel()[voxels.grid.index(beside)] < 0
    return np.where(seen, side, -1).astype(np.int32)


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
    points = voxels.middle + voxels.facing * (_OFF_WALL * voxels.grid.cell)
    return points.reshape(-1, 3), voxels.facing.reshape(-1, 3)


def _probes_beside(
    voxels: SurfaceVoxels,
    grid: Grid,
    valid: NDArray[np.bool_],
    point: Array,
    sides: Array,
    facing: Array,
) -> NDArray[np.intp]:
    """Probe on each side of each surface, (2 k,): the closest that is not behind it.

    Nor behind another: where that one is hidden, the closest that is seen, if there is any.
    """
    centre, stand_in = voxels.middle.reshape(-1, 3), stand_ins(grid, valid)
    found = np.full(len(centre), -1, np.intp)
    for voxels_off in _OFF_SIDE:
        probe = stand_in[grid.index(centre + facing * (voxels_off * voxels.grid.cell))]
        before = ((point[probe] - centre) * facing).sum(axis=1) > 0
        found = np.where((found < 0) & (before | (voxels_off == _OFF_SIDE[-1])), probe, found)
    free = (voxels.number.ravel() < 0)[voxels.grid.index(sides)]
    hidden = np.flatnonzero(free & ~voxels.free_between(sides, point[found], ON_SIGHT))
    nearest = np.full(len(hidden), np.inf)
    at = sides[hidden]
    for probe, inside in around(grid, at):
        apart = ((point[probe] - at) ** 2).sum(axis=1)
        closer = inside & valid[probe] & (apart < nearest)
        closer[closer] = voxels.free_between(at[closer], point[probe[closer]], ON_SIGHT)
        nearest[closer], found[hidden[closer]] = apart[closer], probe[closer]
    return found


def around(grid: Grid, points: Array) -> Iterator[tuple[NDArray[np.intp], NDArray[np.bool_]]]:
    """Yield the cells about points (m, 3), one after another, and whether they are in the grid."""
    middle = np.rint(grid.position(points)).astype(np.intp)
    for step in itertools.product((-1, 0, 1), repeat=3):
        place = middle + step
        inside = ((place >= 0) & (place < grid.shape)).all(axis=1)
        yield grid.flat(np.where(inside[:, None], place, 0)), inside


def _places(
    voxels: SurfaceVoxels, grid: Grid, inner: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_]]:
    """Point of each probe among its voxels, nearest the middle of its cell."""
    offset = _offsets(voxels, inner.shape[1])
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


def _lit(
    voxels: SurfaceVoxels,
    beyond: SurfaceVoxels,
    reached: NDArray[np.bool_],
    to_sun: Array,
    before: Rays | None,
    changes: _Changes | None,
) -> NDArray[np.bool_]:
    """Which voxels of water the sun reaches."""
    lit, new = np.zeros(reached.shape, bool), reached.copy()
    points = voxels.grid.centres()
    if before is not None and changes is not None:
        kept = reached & before.reached
        kept[kept] = ~_sun_crosses(points[kept.ravel()], to_sun, changes)
        lit[kept], new = before.lit[kept], reached & ~kept
    lit[new] = _sunlit(voxels, beyond, points[new.ravel()], to_sun)
    return lit


def _sides_lit(
    voxels: SurfaceVoxels,
    beyond: SurfaceVoxels,
    to_sun: Array,
    before: Rays | None,
    changes: _Changes | None,
) -> Array:
    """Fraction of each side of each surface that the sun reaches."""
    facing = voxels.facing.reshape(-1, 3)
    along = facing @ to_sun
    # Towards the sun, or the light on a floor would be found beside its place; under a low sun that
    # is too far off.
    high = along > _HIGH_SUN
    way = np.where(high[:, None], to_sun / np.where(high, along, 1.0)[:, None], facing)
    starts = voxels.middle.reshape(-1, 3) + _OFF_WALL * voxels.grid.cell * way
    clear, new = np.zeros(len(facing)), along > 0
    parts = [starts + part * voxels.grid.cell for part in _quarters(facing)]
    if before is not None and changes is not None:
        near = changes[0]
        same = np.repeat(~near.mask[voxels.number >= 0], 2)
        # Those of unchanged voxels follow one another as before.
        was = np.repeat(~near.mask[before.voxels.number >= 0], 2)
        clear[same] = before.side_sunlit[was]
        new &= ~same | np.any([_sun_crosses(part, to_sun, changes) for part in parts], axis=0)
    lit = [_sunlit(voxels, beyond, part[new], to_sun) for part in parts]
    clear[new] = np.mean(lit, axis=0)
    return clear


def _quarters(facing: Array) -> list[Array]:
    """Middles of the quarters of squares of size 1 that face some ways, (m, 3) each."""
    one = np.cross(facing, np.eye(3)[np.abs(facing).argmin(axis=1)])
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(facing, one)
    return [0.25 * (u * one + v * other) for u in (-1, 1) for v in (-1, 1)]


def _sun_crosses(points: Array, to_sun: Array, changes: _Changes) -> NDArray[np.bool_]:
    """Whether something has changed on the way from points to the sun."""
    found = np.zeros(len(points), bool)
    for changed in changes:
        found |= changed.crossed(points.astype(np.float32), to_sun.astype(np.float32), np.inf)
    return found


def _fraction_lit(
    voxels: SurfaceVoxels,
    grid: Grid,
    lit: NDArray[np.bool_],
    inner: NDArray[np.bool_],
    point: Array,
) -> Array:
    """Fraction of the voxels of each probe, and in its sight, that the sun reaches."""
    shines, count = _blocks(grid, lit) & inner, inner.sum(axis=1)
    some = np.flatnonzero(shines.any(axis=1) & (shines.sum(axis=1) < count))
    centres = grid.centres()[some, None] + _offsets(voxels, inner.shape[1])
    seen = inner[some] & voxels.free_between(centres, point[some, None], ON_SIGHT)
    count[some] = seen.sum(axis=1)
    shines[some] &= seen
    return np.where(count > 0, shines.sum(axis=1) / np.maximum(count, 1), 1.0)


def _offsets(voxels: SurfaceVoxels, count: int) -> Array:
    """Where so many voxels of a cell lie about its middle, m, (count, 3)."""
    parts = round(count ** (1 / 3))
    steps = np.stack(np.unravel_index(np.arange(parts**3), (parts,) * 3), axis=1)
    return (steps - (parts - 1) / 2.0) * voxels.grid.cell
