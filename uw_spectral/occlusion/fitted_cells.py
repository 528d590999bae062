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
        level, change = (np.abs(part[:, ::3].mean(axis=1)) for part in (mean, there - mean))
        part = _MOST_CHANGE * level / np.maximum(change, _MOST_CHANGE * level + _UNLIT)
        return (mean + part[:, None] * (there - mean)).astype(np.float32, copy=False)


class FittedCells:
    """Fits cells of atlases (t, nx + 2, ny + 2, nz + 2, 3) over the grid of rays.

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

        ``tiles`` (p, COUNT, 3) are what probes have.
        """
        surface, normal, water = _faces(self._rays)
        readers = self._readers(water, surface, surface + off * normal)
        values, flat = _by_cell(atlas), tiles.astype(np.float32)
        level = values.reshape(len(values), -1, 3)[..., 0]
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
            part = slice(3 * tile, 3 * tile + 3)
            rows = np.flatnonzero(read[:, tile])
            odd = np.flatnonzero(uneven[rows, tile])
            seen, some = sights.some(place[rows[odd]]), readers.some(rows)
            values[:, part] = self._fit(values[:, part], flat[:, tile], some, odd, seen, moved=True)
        _put(atlas, values)
        atlas[:] = atlas[views.FIRST]

    def fit_water(self, atlas: Array, tiles: Array) -> None:
        """Fit tiles (p, t, 3) that are looked up in the water."""
        place = np.stack(np.unravel_index(np.arange(len(self._points)), self._rays.reached.shape))
        some = np.flatnonzero(self._rays.reached.ravel() & (place.sum(axis=0) % 2 == 0))
        readers = self._readers(some, *[self._points[some]] * 2)
        values = _by_cell(atlas)
        odd = np.flatnonzero(_uneven(readers, values[:, ::3].mean(axis=1)))
        seen = self._sights(readers.some(odd))
        flat = tiles.reshape(len(tiles), -1).astype(np.float32)
        _put(atlas, self._fit(values, flat, readers, odd, seen, moved=False))

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
        self, values: Light, tiles: Light, readers: _Readers, odd: Cells, seen: _Sights, *,
        moved: bool,
    ) -> Light:  # fmt: skip
        """Fit values of cells (c, q) to those of probes (p, q), which ``odd`` readers see.

        ``moved`` tells that places are looked up beside the points of readers.
        """
        level = values[:, ::3].mean(axis=1)
        least = _LEAST * level.max()
        known = seen.known if moved else seen.known & seen.hidden.any(axis=1)
        odd, seen = odd[known], seen.some(known)
        wanted, some = seen.light(tiles), readers.some(odd)
        hidden = wrong = seen.hidden
        if moved:
            light = wanted[:, ::3].mean(axis=1)
            off = np.abs(some.read(level[:, None])[:, 0] - light) > _APART * light + least
            wrong = wrong | off[:, None] & (some.fractions > _UNSEEN)
        fitted, replaced = np.zeros((2, len(level)), bool)
        fitted[some.cells[wrong]] = True
        replaced[some.cells[hidden]] = True
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
        counts = (np.maximum(targets[:, ::3].mean(axis=1), 0.0) + dark) ** -2.0
        return _approached(values, fitted, replaced, readers, targets, counts)

    def _sights(self, readers: _Readers) -> _Sights:
        """Look from the points of readers at the probes around them.

        Light changes on the way from these to a wall, the more the nearer what lights it: what is
        linear in the place is told.
        """
        grid, rays = self._rays.grid, self._rays
        water, which = np.unique(readers.water, return_inverse=True)
        at = self._points[water]
        probes, seen, places, weights = [], [], [], []
        for cell, inside in around(grid, at):
            point, apart = rays.point[rays.stand_in[cell]], np.ones((len(at), 4))
            sees = rays.voxels.free_between(at, point, ON_SIGHT)
            apart[:, 1:] = (point - at) / grid.cell
            usable = inside & rays.valid[cell] & sees
            near = np.exp(1.0 - (apart**2).sum(axis=1))
            probes.append(cell)
            seen.append(sees | ~inside)
            places.append(apart)
            weights.append(np.where(usable, near + _FAR, 0.0))
        x, weight = np.stack(places, axis=1), np.stack(weights, axis=1)
        weight /= np.maximum(weight.sum(axis=1, keepdims=True), _FAR)
        gram = np.einsum("mk,mki,mkj->mij", weight, x, x) + np.diag([_FAR, *[_STEADY] * 3])
        # By probe: what it adds to the light at the voxel, and to its change along the axes.
        linear = np.linalg.solve(gram, np.moveaxis(x * weight[..., None], 1, 2))
        place = np.ones((len(which), 4))
        place[:, 1:] = (readers.place - at[which]) / grid.cell
        there = np.einsum("mi,mik->mk", place.astype(np.float32), linear.astype(np.float32)[which])
        step = np.stack(np.unravel_index(readers.cells, np.add(grid.shape, 2)), axis=2) - 1
        step -= np.rint(grid.position(at)).astype(np.intp)[which][:, None]
        close = (np.abs(step) <= 1).all(axis=2)
        number = np.where(close, (step + 1) @ [9, 3, 1], 0)
        hidden = ~np.stack(seen, axis=1)[which[:, None], number]
        row, corner = np.nonzero(~close & (readers.fractions > _UNSEEN))
        stand_in = self._probe[readers.cells[row, corner]]
        sees = rays.voxels.free_between(at[which[row]], rays.point[stand_in], ON_SIGHT)
        hidden[row, corner] = ~sees & (stand_in >= 0)
        hidden &= readers.fractions > _UNSEEN
        return _Sights(
            hidden, weight.any(axis=1)[which], np.stack(probes, axis=1)[which],
            weight.astype(np.float32)[which], there,
        )  # fmt: skip


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
        straight = voxels.centre[which], np.tile(way.astype(float), (len(which), 1)), beside
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
        for k in range(1, 2 * far + 1):
            here &= full[tuple((beside + (k + 1) // 2 * step + _INTO_CORNERS).T)]
            n = normal[here]
            along = 0.5 * k * cell * (step - (n @ step)[:, None] * n)
            yield surface[here] + along, n, beside[here]


def _by_cell(atlas: Array) -> Light:
    """Values of an atlas (t, nx, ny, nz, 3) by cell, (c, 3 t)."""
    return np.moveaxis(atlas, 0, 3).reshape(-1, 3 * len(atlas)).astype(np.float32)


def _put(atlas: Array, values: Light) -> None:
    changed = values.reshape(*atlas.shape[1:4], len(atlas), 3)
    atlas[...] = np.moveaxis(changed, 3, 0)


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
        dark = values[:, ::3]
        np.maximum(dark, 0.0, out=dark)
    return values
