"""Surfaces of objects as voxels, and rays through them.

A voxel that any surface crosses is full: thin walls hold, and openings narrower than a voxel
close. Each has two sides, so that a wall thinner than a voxel is bright on one side and dark on the
other, and the inner face of a wall is not as bright as the reveal of a window.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .grid import Array, Grid
from .walls import RAYS, hidden_rays

_FARTHEST_STEP = 12  # voxels that a ray skips at once, at most
_WITHIN = 0.5  # of a voxel: step close to surfaces
_AT_ONCE = 1 << 17  # rays
_NEAR_PLANE = 1.5  # voxels from where a ray is to where it crosses a plane, at most
_ONE_SIDE = 0.5  # of the samples of a wall, more on one side than on the other
_PLANE = 0.95  # of the length of normals is that of their mean, or more, in a plane
_FACE = 0.1  # of the samples of the larger face of an edge that the other has, or more
_HIDDEN = 0.25  # of the directions upwards: water to which objects beside it close more is walled
_WALLED = 1.5  # m that such water is deep: about small objects it matters to few pixels
_DEEPEST, _UNDER = 0.01, 0.1  # of the ground below it is left out; of a voxel, that is below it
_OFF_SURFACE = 1.5  # voxels from a point close to a surface into the water before it
_BETWEEN = (0.25, 0.5, 0.75)  # places between two points where a surface would keep them apart

Indices = NDArray[np.int32]
Reals = NDArray[np.floating]
_Value = TypeVar("_Value", bound=np.generic)


@dataclass(frozen=True, eq=False)
class SurfaceVoxels:
    """Voxels that surfaces cross."""

    grid: Grid
    number: Indices  #: Of the surface in a voxel, -1 in free ones, (nx, ny, nz).
    middle: Array  #: Of the sides of a surface, m, (k, 2, 3).
    #: Unit normals of its sides: one way and the other, or those of two faces, (k, 2, 3).
    facing: Array
    colour: Array  #: Mean base colour, linear Rec.709, (k, 3).
    #: How far it fills its voxel before and behind the plane through its centre, m; infinite where
    #: it may fill all of it, (k, 2).
    extent: Array
    #: Height, m, below which the lowest surface of a column is the ground: a seabed is a sheet, but
    #: there is no water under it.
    ground_below: float = -math.inf

    def __len__(self) -> int:
        return len(self.middle)

    @property
    def centre(self) -> Array:
        """Middle of a surface, m, (k, 3)."""
        return self.middle.mean(axis=1)

    @property
    def normal(self) -> Array:
        """Unit normal of the first side, (k, 3)."""
        return self.facing[:, 0]

    def side_met(self, number: NDArray[np.integer], origin: Array, heading: Array) -> Indices:
        """Return the sides that rays meet: twice the number of the surface, or one more."""
        facing, middle = self.facing[number], self.middle[number]
        along = (facing * heading[:, None]).sum(axis=2)
        height = ((middle - origin[:, None]) * facing).sum(axis=2)
        farther = height[:, 1] * along[:, 0] > height[:, 0] * along[:, 1]
        # A ray is in a solid behind both faces of an edge, and behind one of those of a corner.
        either = (along < 0).all(axis=1)
        second = np.where(either, farther == self._is_edge[number], along[:, 1] < along[:, 0])
        return (2 * number + second).astype(np.int32)

    @functools.cached_property
    def _is_edge(self) -> NDArray[np.bool_]:
        return _meet_apart(self.middle, self.facing)

    def equals(self, other: SurfaceVoxels) -> bool:
        """Whether all of another's voxels are the same, to the bit."""
        same = self.grid == other.grid and self.ground_below == other.ground_below
        return same and all(
            np.array_equal(getattr(self, name), getattr(other, name))
            for name in ("number", "middle", "facing", "colour", "extent")
        )

    @functools.cached_property
    def _free(self) -> NDArray[np.int8]:
        """Whole voxels around each within which all are free, in the largest of three axes."""
        full = np.pad(self.number >= 0, 1)
        distance = np.zeros(full.shape, np.int8)
        for _ in range(_FARTHEST_STEP):
            distance += ~full
            full = grown(full)
        return distance[1:-1, 1:-1, 1:-1]

    @functools.cached_property
    def _padded(self) -> tuple[Indices, NDArray[np.float32]]:
        """Surfaces, and voxels that can be crossed from each, flat, with free ones around."""
        # With k free voxels around, k - 1 of them can be crossed from anywhere in it.
        crossed = np.maximum(self._free - 1, 0).astype(np.float32)
        return np.pad(self.number, 1, constant_values=-1).ravel(), np.pad(crossed, 1).ravel()

    @functools.cached_property
    def _water(self) -> NDArray[np.bool_]:
        """Voxels that are free, and not in the ground."""
        lowest = self.lowest[..., None]
        in_ground = (self._heights < lowest) & (lowest < self.ground_below)
        return (self.number < 0) & ~in_ground

    @property
    def _heights(self) -> Array:
        steps = np.arange(self.grid.shape[2], dtype=np.float64) + 0.5
        return self.grid.lower[2] + steps * self.grid.cell

    @functools.cached_property
    def lowest(self) -> Array:
        """Height of the lowest full voxel of each column, m, infinite without, shape (nx, ny)."""
        full = self.number >= 0
        return np.where(full.any(axis=2), self._heights[full.argmax(axis=2)], np.inf)

    @functools.cached_property
    def roofed(self) -> NDArray[np.bool_]:
        """Voxels that are full, or have a full one above."""
        full = np.flip(self.number >= 0, axis=2)
        return np.flip(np.logical_or.accumulate(full, axis=2), axis=2)

    def trace(
        self, origin: ArrayLike, direction: ArrayLike, start: float = 0.0
    ) -> tuple[Array, Indices]:
        """Return how far rays get, m, and the number of the surface that they meet, each (m,).

        It is -1 at the side of the box. Directions are unit vectors; voxels are skipped for
        ``start`` of them.
        """
        origin, direction = np.broadcast_arrays(
            np.asarray(origin, np.float64), np.asarray(direction, np.float64)
        )
        distance, number = np.empty(len(origin)), np.empty(len(origin), np.int32)
        for first in range(0, len(origin), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            distance[some], number[some] = self._trace(origin[some], direction[some], start)
        return distance, number

    def _trace(self, origin: Array, direction: Array, start: float) -> tuple[Array, Indices]:
        cell_size = self.grid.cell
        end = (self.grid.exit_distance(origin, direction) / cell_size).astype(np.float32)
        # In cells of the box with one more around it, for rays may end beside the box.
        at = ((origin - self.grid.lower) / cell_size + 1.0).astype(np.float32)
        heading = direction.astype(np.float32)
        # Whole numbers of short steps: a ray looks at the same places whatever it skips, so that
        # what it does not pass does not change what it meets.
        per_cell = (1.0 / _WITHIN) / np.abs(heading).max(axis=1)
        found = np.full(len(origin), -1, np.int32)
        distance = np.full(len(origin), start, np.float32)
        number, crossed = self._padded
        _, ny, nz = (n + 2 for n in self.grid.shape)
        plane = bool(np.isfinite(self.extent).any())
        rays = np.flatnonzero(distance < end)
        x, y, z, u, v, w, per, until, t = (
            part[rays] for part in (*at.T, *heading.T, per_cell, end, distance)
        )
        while len(rays):
            place = (x + u * t).astype(np.int32) * (ny * nz)
            place += (y + v * t).astype(np.int32) * nz
            place += (z + w * t).astype(np.int32)
            hit = number.take(place)
            if plane and len(met := np.flatnonzero(hit >= 0)):
                ways = ((x[met], y[met], z[met]), (u[met], v[met], w[met]))
                hit[met[self._passed(hit[met], ways, t[met])]] = -1
            going = hit < 0
            steps = np.floor(crossed.take(place) * per)
            np.maximum(steps, 1.0, out=steps)
            steps *= _WITHIN * going
            t += steps
            going &= t < until
            if not going.all():
                ended, left = np.flatnonzero(~going), np.flatnonzero(going)
                distance[rays[ended]], found[rays[ended]] = t[ended], hit[ended]
                rays = rays[left]
                x, y, z, u, v, w, per, until, t = (
                    part.take(left) for part in (x, y, z, u, v, w, per, until, t)
                )
        return np.minimum(distance, end).astype(np.float64) * cell_size, found

    def _passed(
        self, number: Indices, rays: tuple[Sequence[Reals], Sequence[Reals]], t: Reals
    ) -> NDArray[np.bool_]:
        """Whether rays (m,) in the voxels of surfaces go past what is smaller than these.

        Else walls would have steps that close what is seen along them, and openings in sheets be
        the narrower, the more obliquely one looks through. Origins and directions are in cells of
        the padded box, by axis. What crosses the side of a wall where a full voxel is meets it.
        """
        (origin, heading), (full, _) = rays, self._padded
        _, ny, nz = (n + 2 for n in self.grid.shape)
        normal, offset, before, behind = (part[number] for part in self._planes)
        along = sum(d * n for d, n in zip(heading, normal.T, strict=True))
        height = sum(o * n for o, n in zip(origin, normal.T, strict=True)) - offset
        now = height + t * along
        met = (now <= before) & (now >= -behind)
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = [(side - height) / along for side in (before, -behind)]
        for s in sides:
            near = np.flatnonzero(np.abs(s - t) < _NEAR_PLANE)
            x, y, z = (
                np.clip(o[near] + d[near] * s[near], 0, n + 1).astype(np.int32)
                for o, d, n in zip(origin, heading, self.grid.shape, strict=True)
            )
            met[near] |= full.take(x * (ny * nz) + y * nz + z) >= 0
        edges = np.flatnonzero(self._is_edge[number])
        at = np.stack(
            [o[edges] + d[edges] * t[edges] for o, d in zip(origin, heading, strict=True)], axis=1
        )
        apart = at[:, None] - self._middles[number[edges]]
        met[edges] = ((apart * self.facing[number[edges]]).sum(axis=2) <= 0).all(axis=1)
        return ~met

    @functools.cached_property
    def _middles(self) -> Array:
        """Middles of sides in padded cells."""
        return (self.middle - self.grid.lower) / self.grid.cell + 1.0

    @functools.cached_property
    def _planes(self) -> tuple[Reals, ...]:
        """Normals, heights of planes over the origin along them, and extents, in padded cells."""
        centre = (self.centre - self.grid.lower) / self.grid.cell + 1.0
        offset, extent = (centre * self.normal).sum(axis=1), self.extent / self.grid.cell
        return tuple(x.astype(np.float32) for x in (self.normal, offset, *extent.T))

    def free_between(
        self, start: Array, end: Array, between: Sequence[float] = _BETWEEN
    ) -> NDArray[np.bool_]:
        """Whether the voxels at a few places between points (..., 3), the ends aside, are free."""
        number = self.number.ravel()
        places = (start + fraction * (end - start) for fraction in between)
        free = [number[self.grid.index(place)] < 0 for place in places]
        return np.logical_and.reduce(free)

    def roofed_below(self, beyond: SurfaceVoxels) -> NDArray[np.bool_]:
        """The same, where objects above the box count that a larger box has."""
        top = self.grid.centres().reshape(*self.grid.shape, 3)[:, :, -1]
        top = top + np.array([0.0, 0.0, self.grid.cell / 2.0])
        next_above = top + np.array([0.0, 0.0, beyond.grid.cell])
        above = beyond.roofed.ravel()[beyond.grid.index(next_above)]
        above &= beyond.grid.inside(next_above)
        if len(beyond):
            # What is in the voxel at the top may lie below it or above, as a solid's upper side.
            number = beyond.number.ravel()[beyond.grid.index(top)]
            higher = beyond.centre[number, 2] > self.grid.upper[2]
            above |= (number >= 0) & higher & beyond.grid.inside(top)
        return self.roofed | above[..., None]

    def reachable_from(self, beyond: SurfaceVoxels, points: ArrayLike) -> NDArray[np.bool_]:
        """What is :meth:`reachable` where a larger box says what is so at the sides of this."""
        grid, side = self.grid, np.zeros(self.grid.shape, bool)
        side[[0, -1]] = side[:, [0, -1]] = side[:, :, [0, -1]] = True
        at = grid.centres()[side.ravel()]
        known = beyond.grid.inside(at)
        from_there = beyond.reachable(points).ravel()[beyond.grid.index(at)] & known
        open_sky = ~self.roofed_below(beyond)
        open_sky[side] |= from_there
        return self._joined(open_sky, points)

    def under_objects(self, points: ArrayLike) -> tuple[Array, Array]:
        """Box around the water that something overhangs, m; its corners meet if there is none.

        Points (m, 3) are in open water; so is what lies under open sky.
        """
        return self._box(self.reachable(points) & self.roofed)

    def between_objects(self, points: ArrayLike) -> tuple[Array, Array]:
        """Box around the water that is walled, as :meth:`under_objects`.

        That is where objects beside it close a quarter and more of a few directions, which a long
        wall does as far off as it is high, in columns of 1.5 m and more: between hulls, in a
        canyon, at the foot of a cliff. What it stands on is in the box.
        """
        reached = self.reachable(points)
        hidden = hidden_rays(self.number >= 0) >= math.ceil(_HIDDEN * RAYS)
        walled = reached & hidden & ~self.roofed
        if math.isfinite(self.ground_below):
            # Beyond the border of a seabed, the water below it is of no account.
            walled &= (self.lowest < self.ground_below)[..., None]
        walled &= (walled.sum(axis=2) * self.grid.cell >= _WALLED)[..., None]
        low, high = self._box(walled)
        ground = self.number[:, :, :-1][walled[:, :, 1:]]
        if (ground >= 0).any():
            heights = self.centre[ground[ground >= 0], 2]
            below = float(np.quantile(heights, _DEEPEST)) - _UNDER * self.grid.cell
            low[2] = min(low[2], below)
            # It ends within its highest voxels; a row of open cells above costs accuracy.
            high[2] -= self.grid.cell / 2.0
        return low, high

    def _box(self, water: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Box around voxels, m; its corners meet if there are none."""
        found = np.argwhere(water)
        if not len(found):
            nowhere = np.asarray(self.grid.lower, dtype=np.float64)
            return nowhere, nowhere
        low, high = found.min(axis=0), found.max(axis=0) + 1
        corner = np.asarray(self.grid.lower, dtype=np.float64)
        low, high = low.astype(np.float64), high.astype(np.float64)
        return corner + low * self.grid.cell, corner + high * self.grid.cell

    def reachable(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Water that is joined with what is under open sky, or with points, (nx, ny, nz)."""
        return self._joined(~self.roofed, points)

    def _off_surfaces(self, points: Array) -> Array:
        """Move points (m, 3) in the voxels of surfaces away from these, on their side of them."""
        if not len(self):
            return points
        number = self.number.ravel()[self.grid.index(points)]
        apart = ((points[:, None] - self.middle[number]) * self.facing[number]).sum(axis=2)
        way = self.facing[number, apart.argmax(axis=1)] * (number >= 0)[:, None]
        return points + _OFF_SURFACE * self.grid.cell * way

    def _joined(self, reached: NDArray[np.bool_], points: ArrayLike) -> NDArray[np.bool_]:
        """Water that is joined with some that is reached, which is changed, or with points."""
        points = self._off_surfaces(np.asarray(points, np.float64).reshape(-1, 3))
        reached.ravel()[self.grid.index(points[self.grid.inside(points)])] = True
        free = self._water
        reached &= free
        # From the water that is reached step by step to what has not been, with a margin around.
        unreached = np.pad(free & ~reached, 1)
        border = unreached & np.pad(_beside(reached), 1)
        flat, steps = unreached.ravel(), _steps(unreached.shape)
        now = np.flatnonzero(border)
        while len(now):
            flat[now] = False
            near = (now + steps[:, None]).ravel()
            near = near[flat[near]]
            flat[near] = False
            now = near
            # Each may have been found from several sides.
            if len(now) > 1:
                now = np.unique(now)
        return free & ~unreached[1:-1, 1:-1, 1:-1]


def voxelise(
    grid: Grid,
    points: Array,
    normals: Array,
    colours: Array,
    cells: NDArray[np.intp] | None = None,
    thin: NDArray[np.bool_] | None = None,
) -> SurfaceVoxels:
    """Fill the voxels that samples of surfaces lie in, or those given for them, (m,).

    Samples of surfaces, no farther apart than a voxel, (m, 3): m, unit vectors to either side,
    linear Rec.709. ``thin`` tells which of them are of something thinner than a voxel, (m,).
    """
    inside = grid.inside(points)
    if not inside.any():
        none, sides = np.full(grid.shape, -1, np.int32), np.zeros((0, 2, 3))
        return SurfaceVoxels(grid, none, sides, sides, np.zeros((0, 3)), np.zeros((0, 2)))
    points, normals, colours = points[inside], normals[inside], colours[inside]
    cells = cells_of(grid, points) if cells is None else cells[inside]
    voxels, which, counts = np.unique(cells, return_inverse=True, return_counts=True)
    number = np.full(grid.count, -1, np.int32)
    number[voxels] = np.arange(len(voxels))
    number = number.reshape(grid.shape)
    # Samples of both sides of a wall: turn them as the first one of their voxel.
    first = np.zeros((len(voxels), 3))
    first[which[::-1]] = normals[::-1]
    turned = normals * np.where((normals * first[which]).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    normal = _means(turned, which, counts)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 1e-6, normal / np.maximum(length, 1e-6), first)
    centre, extent = _means(points, which, counts), np.full((len(voxels), 2), np.inf)
    middle, facing = np.stack([centre, centre], axis=1), np.stack([normal, -normal], axis=1)
    if thin is not None:
        off = ((points - centre[which]) * normal[which]).sum(axis=1)
        plane = length[:, 0] > _PLANE
        extent[plane] = (np.bincount(which, np.abs(off), len(voxels)) / counts)[plane, None]
        of_thin = np.bincount(which, thin[inside], len(voxels))
        extent[of_thin == 0, 1] = np.inf
        # Where walls meet there may be little but the outer side of one.
        one_side = np.bincount(which, (normals * first[which]).sum(axis=1), len(voxels)) / counts
        extent[(of_thin > 0) & ((of_thin < counts) | (np.abs(one_side) > _ONE_SIDE))] = np.inf
        few = ~(plane | (of_thin > 0))[which]
        _part_faces(middle, facing, points[few], normals[few], which[few])
        _bury_edges(number, middle, facing)
    return SurfaceVoxels(grid, number, middle, facing, _means(colours, which, counts), extent)


def _bury_edges(number: NDArray[np.int32], middle: Array, facing: Array) -> None:
    """Take those faces from edges that lie in another solid, as a roof's in the wall below it."""
    edges = np.flatnonzero(_meet_apart(middle, facing))
    full = np.pad(number >= 0, 1)
    place = np.argwhere(number >= 0)[edges] + 1
    for side in (0, 1):
        axis, back = np.divmod(ways_of(facing[edges, side]), 2)
        beside = place.copy()
        beside[np.arange(len(edges)), axis] += 1 - 2 * back
        buried = edges[full[tuple(beside.T)]]
        middle[buried, side] = middle[buried, 1 - side]
        facing[buried, side] = -facing[buried, 1 - side]


def _meet_apart(middle: Array, facing: Array) -> NDArray[np.bool_]:
    """Where two faces of a solid meet that do not see each other, (k,)."""
    found: NDArray[np.bool_] = ((middle[:, 1] - middle[:, 0]) * facing[:, 0]).sum(axis=1) < 0
    return found


def _part_faces(
    middle: Array, facing: Array, points: Array, normals: Array, which: NDArray[np.intp]
) -> None:
    """Give voxels in which two faces of a solid meet these as sides."""
    way = ways_of(normals)
    size = np.bincount(6 * which + way, minlength=6 * len(facing)).reshape(-1, 6)
    each = np.arange(len(facing))
    one = size.argmax(axis=1)
    others = size.copy()
    others[each, one] = others[each, one ^ 1] = 0
    other = others.argmax(axis=1)
    few = np.maximum(_FACE * size[each, one], 1.0)
    # What has two sides each way is a wall, seen from one of them or the other.
    met = (size[each, other] >= few) & (
        np.maximum(size[each, one ^ 1], size[each, other ^ 1]) < few
    )
    for side, ways in enumerate((one, other)):
        some = (way == ways[which]) & met[which]
        faces = which[some]
        middle[met, side] = _means(points[some], faces, size[each, ways])[met]
        mean = _means(normals[some], faces, size[each, ways])[met]
        facing[met, side] = mean / np.linalg.norm(mean, axis=1, keepdims=True)


def ways_of(normals: Array) -> NDArray[np.intp]:
    """Way that each normal (m, 3) is closest to: twice the axis, or one more for its other way."""
    axis = np.abs(normals).argmax(axis=1)
    return 2 * axis + (normals[np.arange(len(axis)), axis] < 0)


def cells_of(grid: Grid, points: Array) -> NDArray[np.intp]:
    """Voxel of each point (m, 3) in a box."""
    cells = np.floor((points - grid.lower) / grid.cell).astype(np.intp)
    return grid.flat(np.clip(cells, 0, np.asarray(grid.shape) - 1))


def _means(values: Array, which: NDArray[np.intp], counts: NDArray[np.intp]) -> Array:
    sums = [np.bincount(which, values[:, axis], len(counts)) for axis in range(3)]
    return np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]


def grown(values: NDArray[_Value]) -> NDArray[_Value]:
    """Largest value, as of full voxels, of each and all its neighbours, across corners too."""
    largest = np.bitwise_or if values.dtype == np.bool_ else np.maximum  # the one is much faster
    for axis in range(3):
        lines = np.moveaxis(values, axis, 0)
        wider = lines.copy()
        largest(wider[1:], lines[:-1], out=wider[1:])
        largest(wider[:-1], lines[1:], out=wider[:-1])
        values = np.moveaxis(wider, 0, axis)
    return values


def _beside(full: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels that share a side with a full one."""
    found = np.zeros_like(full)
    for axis in range(3):
        lines, beside = np.moveaxis(full, axis, 0), np.moveaxis(found, axis, 0)
        beside[1:] |= lines[:-1]
        beside[:-1] |= lines[1:]
    return found


def _steps(shape: tuple[int, ...]) -> NDArray[np.intp]:
    """From a cell of a flat array to its neighbours across sides."""
    _, ny, nz = shape
    return np.array([ny * nz, -ny * nz, nz, -nz, 1, -1])
