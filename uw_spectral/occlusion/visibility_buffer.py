"""What of a view objects cover, and what is seen of them there.

Light that is scattered forward by a few degrees comes from behind an object, which blocks it: see
:mod:`.point_spread`. What is covered is drawn without regard to what hides what.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .grid import Array
from .triangles import quartered
from .view_map import SIZE, ViewMap, view_map

_MOST_SPLITS = 6
_AT_ONCE = 50_000  # triangles that are drawn together, about
_LARGE, _SMALL = 8.0, 1.2
"""Texels that triangles reach from their middle: larger ones are filled, smaller ones added."""
_LEAST = 1e-12
_FADE = 0.25  # m over a floor of the water: lower objects are like it
_NEARER = 4  # power of nearness that makes objects show before those behind
_BEHIND = 2.5  # angle from the middle of what may be on either side of the picture, rad
_STANDS = 0.5  # share above the floor from which on an object counts as one
_MOST = 0.5  # of a texel: what covers less before the floor is not what is seen there
_LEVEL = 0.01  # downward cosine of a ray to a floor that is out of sight
_BEFORE = 0.97  # of the distance of faces to the camera: faces that look away and are nearer show


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of an object."""

    corners: NDArray[np.floating]  #: m; counter-clockwise from outside, (t, 3, 3).
    colours: NDArray[np.floating]  #: What they reflect, linear Rec.709, (t, 3).
    each: float = 1.0  #: How many triangles each stands for.


@dataclass(frozen=True, eq=False)
class VisibilityBuffer:
    """What of a view objects cover."""

    view: ViewMap
    #: Fraction of each texel that objects cover, rows upwards; and that they and the floor do,
    #: (SIZE, SIZE).
    covered: Array
    with_floor: Array
    #: Where there are surfaces, what follows is 0 elsewhere; and where the floor is what is seen:
    #: the level one of the water itself, or surfaces that lie on it, (SIZE, SIZE).
    seen: NDArray[np.bool_]
    floor: NDArray[np.bool_]
    distance: Array  #: From the camera, m, (SIZE, SIZE).
    #: Towards the camera's side; what they reflect, (SIZE, SIZE, 3).
    normal: Array
    colour: Array
    #: Distance of the level floor, m, infinite without; and where it is what is seen, (SIZE, SIZE).
    level: Array
    plane: NDArray[np.bool_]


class VisibilityCache:
    """What objects that stayed as they were have covered of a view that did."""

    def __init__(self) -> None:
        self._of: tuple[ViewMap, float] | None = None
        self._base: _Picture | None = None
        self._drawn: frozenset[bytes] = frozenset()
        self._last: frozenset[bytes] = frozenset()

    def buffer(
        self,
        view: ViewMap,
        surfaces: Mapping[bytes, Callable[[], Surface]],
        others: Iterable[Surface] = (),
        floor_depth: float = math.inf,
    ) -> VisibilityBuffer:
        """Look at what objects cover, as :func:`visibility_buffer` does.

        ``surfaces`` make the surface of each by a key that differs where it does; of ``others``
        nothing is known.
        """
        keys = frozenset(surfaces)
        if self._of != (view, floor_depth):
            self._of, self._base, self._last = (view, floor_depth), None, frozenset()
        stayed = keys & self._last
        if self._base is None or not self._drawn <= keys or self._drawn < stayed:
            self._base, self._drawn = _Picture(view, floor_depth), stayed
            self._base.add_all(make() for key, make in surfaces.items() if key in stayed)
        picture, self._last = copy.deepcopy(self._base), keys
        picture.add_all(make() for key, make in surfaces.items() if key not in self._drawn)
        picture.add_all(others)
        return picture.drawn()


def empty_buffer() -> VisibilityBuffer:
    """Return the cover of a view with nothing in it, or of one that has no centre."""
    return visibility_buffer(view_map((0.0, 0.0, 0.0), np.eye(3), 1.0), ())


def visibility_buffer(
    view: ViewMap, surfaces: Iterable[Surface], floor_depth: float = math.inf
) -> VisibilityBuffer:
    """Look at what objects cover; what lies on the water's floor is part of it."""
    picture = _Picture(view, floor_depth)
    picture.add_all(surfaces)
    return picture.drawn()


def _batches(surfaces: Iterable[Surface]) -> Iterator[list[Surface]]:
    """Return objects together, for each costs more than its triangles; not too many at once."""
    some: list[Surface] = []
    for surface in surfaces:
        some.append(surface)
        if sum(len(each.corners) for each in some) > _AT_ONCE:
            yield some
            some = []
    if some:
        yield some


class _Picture:
    """What is covered, while objects are drawn."""

    def __init__(self, view: ViewMap, floor_depth: float) -> None:
        self._view, self._floor = view, floor_depth
        self._ways = view.ways().reshape(SIZE, SIZE, 3)
        # Faces to and from the view apart: of closed objects both cover the same. Above the floor,
        # and all.
        self._sides = np.zeros((2, 2, SIZE, SIZE))
        # Sums of weights, and of distances, normals, colours and shares above the floor by them.
        self._sums = np.zeros((2, 9, SIZE, SIZE))

    def drawn(self) -> VisibilityBuffer:
        """Return the picture."""
        total = self._sums[:, :1]
        away, seen = total[:, 0] > 0.0
        behind, means = self._sums[:, 1:] / np.where(total > 0.0, total, 1.0)
        # A closed object hides the faces that look away; a sheet, or what holds the camera, does
        # not.
        before = (behind[0] < _BEFORE * means[0]) & (self._sides[1, 0] > _MOST)
        means, seen = np.where(away & (before | ~seen), behind, means), seen | away
        normal = means[1:4] / np.maximum(np.linalg.norm(means[1:4], axis=0), _LEAST)
        level = self._to_floor()
        covered, with_floor = np.minimum(self._sides.max(axis=1), 1.0)
        stands = means[7] >= _STANDS
        hidden = (level < means[0] - _FADE) | (stands & (covered < _MOST))
        plane = np.isfinite(level) & (~seen | hidden)
        return VisibilityBuffer(
            self._view, covered, np.where(np.isfinite(level), 1.0, with_floor), seen,
            plane | (seen & ~stands), means[0], np.moveaxis(normal, 0, 2),
            np.moveaxis(means[4:7], 0, 2), level, plane,
        )  # fmt: skip

    def _to_floor(self) -> Array:
        """Distance to the floor of the water."""
        height = self._floor + self._view.centre[2]
        down = -self._ways[..., 2]
        ahead = (down > _LEVEL) & (height > 0.0)
        return np.where(ahead, height / np.where(ahead, down, 1.0), math.inf)

    def add_all(self, surfaces: Iterable[Surface]) -> None:
        """Draw objects."""
        for some in _batches(surfaces):
            self._add(some)

    def _add(self, surfaces: Sequence[Surface]) -> None:
        """Draw triangles."""
        corners = np.concatenate([np.asarray(surface.corners, np.float64) for surface in surfaces])
        now = corners - np.asarray(self._view.centre)
        weight = np.repeat([x.each for x in surfaces], [len(x.corners) for x in surfaces])
        colours = np.concatenate([np.asarray(surface.colours, np.float64) for surface in surfaces])
        for split in range(_MOST_SPLITS):
            seen, wide = self._within(now)
            now, weight, colours, wide = (x[seen] for x in (now, weight, colours, wide))
            if not split:
                large = wide > _LARGE
                self._fill(now[large], colours[large])
                now, weight, colours, wide = (x[~large] for x in (now, weight, colours, wide))
            small = (wide * np.sqrt(weight) < _SMALL) | (split == _MOST_SPLITS - 1)
            self._put(now[small], weight[small], colours[small])
            now, weight = quartered(now[~small]), np.tile(weight[~small], 4)
            colours = np.tile(colours[~small], (4, 1))
            if not len(now):
                return

    def _extents(self, triangles: Array) -> tuple[Array, Array, Array]:
        """Middles; how far each reaches from there, over its distance; angle to the view's middle.

        What reaches as far as the camera has no angle that holds it.
        """
        middle = triangles.mean(axis=1)
        distance = np.maximum(np.linalg.norm(middle, axis=1), _LEAST)
        around = np.sqrt(((triangles - middle[:, None]) ** 2).sum(axis=2).max(axis=1))
        cosine = np.clip(middle @ np.asarray(self._view.ahead) / distance, -1.0, 1.0)
        return middle, around / distance, np.arccos(cosine)

    def _within(self, corners: Array) -> tuple[NDArray[np.bool_], Array]:
        """Which may be in the picture; how far each reaches from its middle, texels."""
        _, around, off = self._extents(corners)
        wide = np.arcsin(np.minimum(around, 1.0))
        seen = (off - wide < self._view.corner) | (around >= 1.0)
        return seen, around * float(self._view.per_unit)

    def _fill(self, triangles: Array, colours: Array) -> None:
        """Draw large triangles, with soft edges of a texel."""
        one, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        normals = np.cross(one, other)
        out = (normals * triangles[:, 0]).sum(axis=1)
        shown = out != 0.0  # edge-on there is nothing to see
        triangles, colours, normals, out = (x[shown] for x in (triangles, colours, normals, out))
        sides = np.cross(triangles, np.roll(triangles, -1, axis=1))
        sides /= np.maximum(np.linalg.norm(sides, axis=2), _LEAST)[..., None]
        sides *= (np.sign(out) * float(self._view.per_unit))[:, None, None]
        facing = normals * -np.sign(out)[:, None]
        facing /= np.maximum(np.linalg.norm(normals, axis=1), _LEAST)[:, None]
        for k, (rows, columns) in enumerate(self._windows(triangles)):
            ways = self._ways[rows, columns]
            fraction = np.clip(0.5 + ways @ sides[k].T, 0.0, 1.0).prod(axis=-1)
            along = ways @ normals[k]
            distance = out[k] / np.where(np.abs(along) > _LEAST, along, math.inf)
            above = self._over_floor(self._view.centre[2] + distance * ways[..., 2])
            side = int(out[k] < 0.0)
            self._sides[0, side, rows, columns] += fraction * above
            self._sides[1, side, rows, columns] += fraction
            ahead = distance > _LEAST
            weight = np.where(ahead, fraction, 0.0) / np.where(ahead, distance, 1.0) ** _NEARER
            sums = self._sums[side][:, rows, columns]
            sums[0] += weight
            sums[1] += weight * distance
            sums[2:8] += np.concatenate([facing[k], colours[k]])[:, None, None] * weight
            sums[8] += weight * above

    def _windows(self, triangles: Array) -> Iterator[tuple[slice, slice]]:
        """Rows and columns that hold each triangle."""
        middle, around, off = self._extents(triangles)
        h, v = self._view.place(tuple((middle + np.asarray(self._view.centre)).T))
        wide = np.arcsin(np.minimum(around, 1.0))
        # Away from the middle the picture is stretched along its circles.
        farthest = np.minimum(off + wide, _BEHIND)
        texels = wide / np.cos(farthest / 2.0) * float(self._view.per_unit) + 2.0
        reach = np.where((around < 1.0) & (farthest < _BEHIND), texels, SIZE)
        for at, across, size in zip(v, h, reach, strict=True):
            yield (
                slice(max(int(at - size), 0), max(int(at + size) + 1, 0)),
                slice(max(int(across - size), 0), max(int(across + size) + 1, 0)),
            )

    def _over_floor(self, z: Array) -> Array:
        return np.clip((self._floor + z) / _FADE, 0.0, 1.0)

    def _put(self, corners: Array, weight: Array, colours: Array) -> None:
        """Add the solid angles of small triangles to texels."""
        view = self._view
        one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        middle, across = corners.mean(axis=1), np.cross(one, other)
        squared = np.maximum((middle**2).sum(axis=1), _LEAST)
        fraction = weight * (across * middle).sum(axis=1) / (2.0 * squared**1.5 * view.texel)
        h, v = view.place(tuple((middle + np.asarray(view.centre)).T))
        # What is held to the sides lies outside.
        inside = (h > 0) & (h < SIZE - 1) & (v > 0) & (v < SIZE - 1)
        h, v, fraction, middle = h[inside], v[inside], fraction[inside], middle[inside]
        nearest = (np.rint(v) * SIZE + np.rint(h)).astype(np.intp)
        turned = -np.sign(fraction)[:, None] * across[inside]
        above = self._over_floor(middle[:, 2] + view.centre[2])
        shown, distance = np.abs(fraction), np.sqrt(squared[inside])
        colours = colours[inside]
        for side, some in enumerate((fraction > 0.0, fraction < 0.0)):
            what = shown[some], distance[some], turned[some], colours[some], above[some]
            self._show(side, nearest[some], *what)
        left, low = np.floor(h), np.floor(v)
        for dh in (0, 1):
            for dv in (0, 1):
                part = fraction * np.abs(1 - dh - (h - left)) * np.abs(1 - dv - (v - low))
                place = ((low + dv) * SIZE + left + dh).astype(np.intp)
                for sides, counted in zip(self._sides, (part * above, part), strict=True):
                    for side, sign in zip(sides, (1.0, -1.0), strict=True):
                        side += _added(place, np.maximum(sign * counted, 0.0))

    def _show(
        self,
        side: int,
        place: NDArray[np.intp],
        fraction: Array,
        distance: Array,
        across: Array,
        colours: Array,
        above: Array,
    ) -> None:
        """Let surfaces be seen at texels, the nearer the more."""
        weight = fraction / distance**_NEARER
        normal = across / np.maximum(np.linalg.norm(across, axis=1), _LEAST)[:, None]
        values = [np.ones(len(place)), distance, *normal.T, *colours.T, above]
        for total, value in zip(self._sums[side], values, strict=True):
            total += _added(place, weight * value)


def _added(place: NDArray[np.intp], values: Array) -> Array:
    """Picture of the sums of values at texels."""
    return np.bincount(place, values, SIZE * SIZE).reshape(SIZE, SIZE)
