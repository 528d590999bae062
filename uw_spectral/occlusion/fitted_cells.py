"""Cells of a table beside walls, fitted to what is looked up in them.

A place is looked up among eight cells, and some of them may lie behind a wall, where the light is
another. What such a cell holds is of use only to the places that read it: it is chosen so that they
find the light of the probes that they see. Front and back of a wall read different tiles; where
both sides read the same, the darker counts, for errors are relative.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import view_directions as views
from .grid import Array
from .probe_rows import Light
from .probes import ON_SIGHT, Rays, around

NUMBERS = 4
"""Of an entry; the first is the mean light."""
_LEAST, _DARK_OUTSIDE = 1e-3, 0.3
"""Of the light of open water, below which errors are not relative: seen from within, and not."""
_APART = 0.05  # of the light: cells that differ less are not looked at
_UNSEEN = 0.002  # of what is read: so much of cells that are not seen does not count
_STEADY = 0.1  # weight of no change across a cell
_MOST_CHANGE = 0.4  # of the light, from the probes to a wall
_UNLIT = 1e-12
_FAR = 1e-6  # of one close by, for one farther off that alone is seen
_ROUNDS = 6
_TOWARDS, _STRAIGHT = 0.2, 0.97  # cosines with an axis of surfaces that are oblique to it
_LITTLE = 0.02  # of what is read: so much of a tile does not count
_INTO_CORNERS = 2  # voxels that oblique surfaces go on into those of others, at most
_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))

Cells = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _Readers:
    """Places that are looked up in a table."""

    water: Cells  #: Voxels from which probes are seen, (m,).
    place: Array  #: Where their light is wanted, m, (m, 3).
    cells: Cells  #: That are read, (m, 8).
    fractions: Light  #: Of each of them, (m, 8).

    def some(self, which: NDArray) -> _Readers:
        return _Readers(
            self.water[which], self.place[which], self.cells[which], self.fractions[which]
        )

    def read(self, values: Light) -> Light:
        """Look values of cells (c, q) up, shape (m, q)."""
        found = np.zeros((len(self.cells), values.shape[1]), np.float32)
        for cell, fraction in zip(self.cells.T, self.fractions.T, strict=True):
            found += values[cell] * fraction[:, None]
        return found


@dataclass(frozen=True, eq=False)
class _Sights:
    """What readers see of the probes around them."""

    hidden: NDArray[np.bool_]  #: Cells that are read whose probes are not seen, (m, 8).
    known: NDArray[np.bool_]  #: Whether any probe is seen, (m,).
    probes: Cells  #: Around the reader, (m, k).
    mean: Light  #: What each is of the mean light, (m, k).
    there: Light  #: And of the light at the reader's place, (m, k).

    def some(self, which: NDArray) -> _Sights:
        return _Sights(
            self.hidden[which], self.known[which], self.probes[which], self.mean[which],
            self.there[which],
        )  # fmt: skip

    def light(self, tiles: Light) -> Light:
        """Light of probes (p, q) at the places, (m, q)."""
        mean, there = np.zeros((2, len(self.probes), tiles.shape[1]), np.float32)
        for probe, of_mean, of_there in zip(self.probes.T, self.mean.T, self.there.T, strict=True):
            light = tiles[probe]
            mean += of_mean[:, None] * light
            there += of_there[:, None] * light
        level, change = (np.abs(part[:, ::NUMBERS].mean(axis=1)) for part in (mean, there - mean))
        part = _MOST_CHANGE * level / np.maximum(change, _MOST_CHANGE * level + _UNLIT)
        return (mean + part[:, None] * (there - mean)).astype(np.float32, copy=False)


class FittedCells:
    """Fits cells of atlases (t, nx + 2, ny + 2, nz + 2, NUMBERS) over the grid of rays.

    Those of their border, which stand for what lies beyond the grid, stay.
    """

    def __init__(self, rays: Rays, *, enclosed: bool = True) -> None:
        self._rays, self._points = rays, rays.voxels.grid.centres()
        stand_in = rays.stand_in.reshape(rays.grid.shape)
        self._probe = np.pad(stand_in, 1, constant_values=-1).ravel()
        """Whose light a cell has, -1 on the border."""
        # Within a thing that is seen from outside, light may be wrong rather than beside it.
        self._dark = _LEAST if enclosed else _DARK_OUTSIDE

    def fit_faces(self, atlas: Array, tiles: Array, off: float) -> None:
        """Fit tiles, which surfaces that face alike look up ``off`` m before them.

        ``tiles`` (p, COUNT, NUMBERS) are what probes have.
        """
        surface, normal, water = _faces(self._rays)
        readers = self._readers(water, surface, surface + off * normal)
        values, flat = _by_cell(atlas), tiles.astype(np.float32)
        level = values.reshape(len(values), -1, NUMBERS)[..., 0]
        read = np.zeros((len(water), tiles.shape[1]), bool)
        for tile, fraction in views.around([*normal.T]):
            some = np.flatnonzero(fraction > _LITTLE)
            read[some, views.FIRST[np.asarray(tile, np.intp)[some]]] = True
        uneven = np.zeros_like(read)
        for rows, odd, light in zip(read.T, uneven.T, level.T, strict=True):
            odd[rows] = _uneven(readers.some(rows), light)
        some = np.flatnonzero(uneven.any(axis=1))
        sights = self._sights(readers.some(some))
        place = np.zeros(len(water), np.intp)
        place[some] = np.arange(len(some))
        for tile in np.unique(views.FIRST):
            part = slice(NUMBERS * tile, NUMBERS * (tile + 1))
            rows = np.flatnonzero(read[:, tile])
            odd = np.flatnonzero(uneven[rows, tile])
            seen = sights.some(place[rows[odd]])
            odd, seen = odd[seen.known], seen.some(seen.known)
            some, wanted, light = readers.some(rows), seen.light(flat[:, tile]), values[:, part]
            wrong = seen.hidden | _astray(some.some(odd), light, wanted)[:, None]
            values[:, part] = self._fit(light, some, odd, wanted, wrong, seen.hidden)
        _put(atlas, values)
        atlas[:] = atlas[views.FIRST]

    def fit_water(self, atlas: Array, tiles: Array) -> None:
        """Fit tiles (p, t, NUMBERS) that are looked up in the water."""
        place = np.stack(np.unravel_index(np.arange(len(self._points)), self._rays.reached.shape))
        some = np.flatnonzero(self._rays.reached.ravel() & (place.sum(axis=0) % 2 == 0))
        readers = self._readers(some, *[self._points[some]] * 2)
        values = _by_cell(atlas)
        odd = np.flatnonzero(_uneven(readers, values[:, ::NUMBERS].mean(axis=1)))
        seen = self._sights(readers.some(odd))
        known = seen.known & seen.hidden.any(axis=1)
        odd, seen = odd[known], seen.some(known)
        wanted = seen.light(tiles.reshape(len(tiles), -1).astype(np.float32))
        _put(atlas, self._fit(values, readers, odd, wanted, seen.hidden, seen.hidden))

    def _readers(self, water: Cells, wanted: Array, place: Array) -> _Readers:
        grid, shape = self._rays.grid, np.add(self._rays.grid.shape, 2)
        position = np.clip(grid.position(place), 0.0, np.subtract(grid.shape, 1.0)) + 1.0
        low = np.minimum(np.floor(position).astype(np.intp), shape - 2)
        part = (position - low)[:, None]
        fractions = np.where(_CORNERS, part, 1.0 - part).prod(axis=2).astype(np.float32)
        corner = low[:, None] + _CORNERS
        cells = (corner[..., 0] * shape[1] + corner[..., 1]) * shape[2] + corner[..., 2]
        return _Readers(water, wanted, cells, fractions)

    def _fit(
        self,
        values: Light,
        readers: _Readers,
        odd: Cells,
        wanted: Light,
        wrong: NDArray[np.bool_],
        hidden: NDArray[np.bool_],
    ) -> Light:
        """Fit values of cells (c, q) to what ``odd`` readers want, (m, q).

        Of the cells that these read those change that are ``wrong``, (m, 8); what is ``hidden``
        does not count.
        """
        some = readers.cells[odd]
        level = values[:, ::NUMBERS].mean(axis=1)
        fitted, replaced = np.zeros((2, len(level)), bool)
        fitted[some[wrong & (readers.fractions[odd] > _UNSEEN)]] = True
        replaced[some[hidden]] = True
        fitted, replaced = fitted & (self._probe >= 0), replaced & (self._probe >= 0)
        if not fitted.any():
            return values
        concerned = fitted[readers.cells].any(axis=1)
        place = np.cumsum(concerned) - 1
        readers = readers.some(concerned)
        targets = readers.read(values)
        there = concerned[odd]
        targets[place[odd[there]]] = wanted[there]
        dark = self._dark * level.max()
        counts = (np.maximum(targets[:, ::NUMBERS].mean(axis=1), 0.0) + dark) ** -2.0
        return _approached(values, fitted, replaced, readers, targets, counts)

    def _sights(self, readers: _Readers) -> _Sights:
        """Look from the points of readers at the probes around them."""
        grid, rays = self._rays.grid, self._rays
        water, which = np.unique(readers.water, return_inverse=True)
        at = self._points[water]
        probes, seen, places, usable = [], [], [], []
        for cell, inside in around(grid, at):
            point, apart = rays.point[rays.stand_in[cell]], np.ones((len(at), 4))
            sees = rays.voxels.free_between(at, point, ON_SIGHT)
            apart[:, 1:] = (point - at) / grid.cell
            usable.append(inside & rays.valid[cell] & sees)
            probes.append(cell)
            seen.append(sees | ~inside)
            places.append(apart)
        mean, linear = _linear(np.stack(places, axis=1), np.stack(usable, axis=1))
        place = np.ones((len(which), 4), np.float32)
        place[:, 1:] = (readers.place - at[which]) / grid.cell
        hidden = self._hidden(readers, at[which], np.stack(seen, axis=1)[which])
        return _Sights(
            hidden, mean.any(axis=1)[which], np.stack(probes, axis=1)[which], mean[which],
            np.einsum("mi,mik->mk", place, linear[which]),
        )  # fmt: skip

    def _hidden(self, readers: _Readers, at: Array, seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which cells that are read have probes that are not seen from points, (m, 8).

        ``seen`` tells it of those around, (m, 27).
        """
        grid, rays = self._rays.grid, self._rays
        step = np.stack(np.unravel_index(readers.cells, np.add(grid.shape, 2)), axis=2) - 1
        step -= np.rint(grid.position(at)).astype(np.intp)[:, None]
        close = (np.abs(step) <= 1).all(axis=2)
        number = np.where(close, (step + 1) @ [9, 3, 1], 0)
        hidden = ~np.take_along_axis(seen, number, axis=1)
        row, corner = np.nonzero(~close & (readers.fractions > _UNSEEN))
        stand_in = self._probe[readers.cells[row, corner]]
        sees = rays.voxels.free_between(at[row], rays.point[stand_in], ON_SIGHT)
        hidden[row, corner] = ~sees & (stand_in >= 0)
        hidden &= readers.fractions > _UNSEEN
        return hidden


def _linear(places: Array, usable: NDArray[np.bool_]) -> tuple[Light, Light]:
    """Return what probes are of the mean light (m, k), and of what is linear in the place.

    Light changes on the way from them to a wall, the more the nearer what lights it. ``places``
    (m, k, 4) are 1 and how many cells a probe is off along the axes; of the light there, and of
    its change along them, (m, 4, k).
    """
    near = np.exp(1.0 - (places**2).sum(axis=2))
    weight = np.where(usable, near + _FAR, 0.0)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), _FAR)
    gram = np.einsum("mk,mki,mkj->mij", weight, places, places) + np.diag([_FAR, *[_STEADY] * 3])
    linear = np.linalg.solve(gram, np.moveaxis(places * weight[..., None], 1, 2))
    return weight.astype(np.float32), linear.astype(np.float32)


def _faces(rays: Rays) -> tuple[Array, Array, Cells]:
    """Surfaces with water beside them along an axis: places, m, normals, (m, 3), its voxels.

    Those that are oblique count as if they faced the axis, too, for other surfaces of their voxels.
    """
    voxels, axes = rays.voxels, views.NORMALS[views.AXES].astype(np.intp)
    full = np.pad(voxels.number >= 0, _INTO_CORNERS, constant_values=True)
    places = np.argwhere(voxels.number >= 0)
    found = []
    for axis, way in enumerate(axes):
        beside = places + way
        inside = ((beside >= 0) & (beside < voxels.grid.shape)).all(axis=1)
        place, beside = places[inside], beside[inside]
        wet = rays.reached[tuple(beside.T)]
        which, beside = voxels.number[tuple(place[wet].T)], beside[wet]
        sides = voxels.facing[which]
        normal = sides[np.arange(len(sides)), (sides @ way).argmax(axis=1)]
        along = normal @ way
        turned = (along > _TOWARDS) & (along < _STRAIGHT)
        steps = np.delete(axes, [axis, axis ^ 1], axis=0)
        upright = np.where(along[:, None] < _STRAIGHT, way, normal)
        straight = voxels.centre[which], upright, beside
        oblique = voxels.centre[which[turned]], normal[turned], beside[turned]
        for faces, far in ((straight, 1), (oblique, _INTO_CORNERS)):
            found += _continued(full, voxels.grid.cell, *faces, steps, far)
    surface, normal, beside = (np.concatenate(x) for x in zip(*found, strict=True))
    return surface, normal, voxels.grid.flat(beside)


def _continued(
    full: NDArray[np.bool_],
    cell: float,
    surface: Array,
    normal: Array,
    beside: Cells,
    steps: Cells,
    far: int,
) -> Iterator[tuple[Array, Array, Cells]]:
    """Yield places of surfaces, and where they go on into the voxels of others, so many at most.

    For those are thicker than what they stand for, the more if both are oblique.
    """
    yield surface, normal, beside
    for step in steps:
        here = np.ones(len(beside), bool)
        for k in range(1, far + 1):
            here &= full[tuple((beside + k * step + _INTO_CORNERS).T)]
            n = normal[here]
            along = k * cell * (step - (n @ step)[:, None] * n)
            yield surface[here] + along, n, beside[here]


def _by_cell(atlas: Array) -> Light:
    """Values of an atlas (t, nx, ny, nz, NUMBERS) by cell, (c, t NUMBERS)."""
    return np.moveaxis(atlas, 0, 3).reshape(-1, NUMBERS * len(atlas)).astype(np.float32)


def _put(atlas: Array, values: Light) -> None:
    changed = values.reshape(*atlas.shape[1:4], len(atlas), NUMBERS)
    atlas[...] = np.moveaxis(changed, 3, 0)


def _astray(readers: _Readers, values: Light, wanted: Light) -> NDArray[np.bool_]:
    """Where readers find another light than what is wanted of these cells (c, q)."""
    level, light = values[:, ::NUMBERS].mean(axis=1), wanted[:, ::NUMBERS].mean(axis=1)
    off = np.abs(readers.read(level[:, None])[:, 0] - light)
    astray: NDArray[np.bool_] = off > _APART * light + _LEAST * level.max()
    return astray


def _uneven(readers: _Readers, level: Light) -> NDArray[np.bool_]:
    """Where the cells that readers read differ."""
    lights = level[readers.cells]
    least = _LEAST * level.max()
    uneven: NDArray[np.bool_] = lights.max(axis=1) > (1.0 + _APART) * lights.min(axis=1) + least
    return uneven


def _approached(
    values: Light,
    fitted: NDArray[np.bool_],
    replaced: NDArray[np.bool_],
    readers: _Readers,
    wanted: Light,
    counts: NDArray[np.floating],
) -> Light:
    """Return values of cells (c, q), fitted ones so that readers find what is wanted, (m, q).

    Those that are replaced begin as the mean of what their readers want. What is missed is spread
    again and again, as in the simultaneous iterative reconstruction of tomography (P. Gilbert,
    1972).
    """
    cells = readers.cells.ravel()
    weight = (readers.fractions * counts[:, None]).astype(np.float32).ravel()
    order = np.flatnonzero(fitted[cells] & (weight > 0))
    order = order[np.argsort(cells[order], kind="stable")]
    which, first = np.unique(cells[order], return_index=True)
    reader, weight = order // readers.cells.shape[1], weight[order, None]
    total = np.add.reduceat(weight, first)

    def spread(light: Light) -> Light:
        sums: Light = np.add.reduceat(light[reader] * weight, first)
        sums /= total
        return sums

    values = values.copy()
    values[which] = np.where(replaced[which, None], spread(wanted), values[which])
    for _ in range(_ROUNDS):
        values[which] += spread(wanted - readers.read(values))
        dark = values[:, ::NUMBERS]
        np.maximum(dark, 0.0, out=dark)
    return values
