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

from .grid import Array
from .probe_rows import Light
from .probes import ON_SIGHT, Rays, around
from .unoccluded_field import AXES

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
_INTO_CORNERS = 2  # voxels that oblique surfaces go on into those of others, at most
_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))

Cells = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _Readers:
    """Places that are looked up in a table."""

    at: Array  #: Points of water from which probes are seen, m, (m, 3).
    place: Array  #: Where their light is wanted, m, (m, 3).
    cells: Cells  #: That are read, (m, 8).
    fractions: Light  #: Of each of them, (m, 8).

    def some(self, which: NDArray) -> _Readers:
        return _Readers(self.at[which], self.place[which], self.cells[which], self.fractions[which])

    def read(self, values: Light) -> Light:
        """Look values of cells (c, q) up, shape (m, q)."""
        found = np.zeros((len(self.at), values.shape[1]), np.float32)
        for cell, fraction in zip(self.cells.T, self.fractions.T, strict=True):
            found += values[cell] * fraction[:, None]
        return found


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
        """Fit tiles that face :data:`.AXES`, which surfaces look up ``off`` m before them.

        ``tiles`` (p, 6, 3) are what probes have.
        """
        for axis, (surface, normal, water) in enumerate(_faces(self._rays)):
            readers = self._readers(self._points[water], surface, surface + off * normal)
            self._fit(atlas[axis : axis + 1], tiles[:, axis : axis + 1], readers, moved=True)

    def fit_water(self, atlas: Array, tiles: Array) -> None:
        """Fit tiles (p, t, 3) that are looked up in the water."""
        place = np.stack(np.unravel_index(np.arange(len(self._points)), self._rays.reached.shape))
        some = self._rays.reached.ravel() & (place.sum(axis=0) % 2 == 0)
        self._fit(atlas, tiles, self._readers(*[self._points[some]] * 3), moved=False)

    def _readers(self, at: Array, wanted: Array, place: Array) -> _Readers:
        grid, shape = self._rays.grid, np.add(self._rays.grid.shape, 2)
        position = np.clip(grid.position(place), 0.0, np.subtract(grid.shape, 1.0)) + 1.0
        low = np.minimum(np.floor(position).astype(np.intp), shape - 2)
        part = (position - low)[:, None]
        fractions = np.where(_CORNERS, part, 1.0 - part).prod(axis=2).astype(np.float32)
        corner = low[:, None] + _CORNERS
        cells = (corner[..., 0] * shape[1] + corner[..., 1]) * shape[2] + corner[..., 2]
        return _Readers(at, wanted, cells, fractions)

    def _fit(self, atlas: Array, tiles: Array, readers: _Readers, *, moved: bool) -> None:
        """Fit tiles; ``moved`` tells that places are looked up beside the points of readers."""
        values = np.moveaxis(atlas, 0, 3).reshape(-1, 3 * len(atlas)).astype(np.float32)
        level = values[:, ::3].mean(axis=1)
        least = _LEAST * level.max()
        lights = level[readers.cells]
        uneven = lights.max(axis=1) > (1.0 + _APART) * lights.min(axis=1) + least
        some = np.flatnonzero(uneven)
        wrong = self._unseen(readers.some(some))
        if not moved:
            some, wrong = some[wrong.any(axis=1)], wrong[wrong.any(axis=1)]
        wanted, known = self._seen_light(readers.some(some), tiles)
        some, wanted, wrong = some[known], wanted[known], wrong[known]
        hidden = wrong.copy()
        found = readers.some(some).read(values)
        if moved:
            light = wanted[:, ::3].mean(axis=1)
            off = np.abs(found[:, ::3].mean(axis=1) - light) > _APART * light + least
            wrong |= off[:, None] & (readers.fractions[some] > _UNSEEN)
        fitted, replaced = np.zeros((2, len(level)), bool)
        fitted[readers.cells[some][wrong]] = True
        replaced[readers.cells[some][hidden]] = True
        fitted, replaced = fitted & (self._probe >= 0), replaced & (self._probe >= 0)
        if not fitted.any():
            return
        concerned = np.flatnonzero(fitted[readers.cells].any(axis=1))
        targets = readers.some(concerned).read(values)
        place = np.searchsorted(concerned, some)
        there = place < len(concerned)
        there[there] = concerned[place[there]] == some[there]
        targets[place[there]] = wanted[there]
        dark = self._dark * level.max()
        counts = (np.maximum(targets[:, ::3].mean(axis=1), 0.0) + dark) ** -2.0
        _approach(values, fitted, replaced, readers.some(concerned), targets, counts)
        changed = values.reshape(*atlas.shape[1:4], len(atlas), 3)
        atlas[...] = np.moveaxis(changed, 3, 0)

    def _unseen(self, readers: _Readers) -> NDArray[np.bool_]:
        """Cells that readers read whose probes they do not see, (m, 8)."""
        probe = self._probe[readers.cells]
        seen = self._sees(readers.at[:, None], self._rays.point[probe]) | (probe < 0)
        return ~seen & (readers.fractions > _UNSEEN)

    def _seen_light(self, readers: _Readers, tiles: Array) -> tuple[Light, NDArray[np.bool_]]:
        """Light of the probes that are seen, at places (m, 3 t), and whether there are any.

        It changes on the way from these to a wall, the more the nearer what lights it: what is
        linear in the place is told.
        """
        grid, rays, at = self._rays.grid, self._rays, readers.at
        flat = tiles.reshape(len(tiles), -1).astype(np.float32)
        gram, sums = np.zeros((len(at), 4, 4)), np.zeros((len(at), 4, flat.shape[1]))
        for probe, inside in around(grid, at):
            point, x = rays.point[probe], np.ones((len(at), 4))
            usable = inside & rays.valid[probe]
            usable[usable] = self._sees(at[usable], point[usable])
            near = ((point - at) ** 2).sum(axis=1) / grid.cell**2
            weight = np.where(usable, np.exp(-near) + _FAR, 0.0)
            x[:, 1:] = (point - readers.place) / grid.cell
            gram += np.einsum("m,mi,mj->mij", weight, x, x)
            sums += np.einsum("m,mi,mq->miq", weight, x, flat[probe])
        known, total = gram[:, 0, 0] > 0, np.maximum(gram[:, :1, :1], _FAR)
        gram, sums = gram / total + np.diag([_FAR, *[_STEADY] * 3]), sums / total
        mean, there = sums[:, 0], np.linalg.solve(gram, sums)[:, 0]
        level, change = (np.abs(part[:, ::3].mean(axis=1)) for part in (mean, there - mean))
        part = _MOST_CHANGE * level / np.maximum(change, _MOST_CHANGE * level + _UNLIT)
        return (mean + part[:, None] * (there - mean)).astype(np.float32), known

    def _sees(self, start: Array, end: Array) -> NDArray[np.bool_]:
        return self._rays.voxels.free_between(start, end, ON_SIGHT)


def _faces(rays: Rays) -> Iterator[tuple[Array, Array, Cells]]:
    """Of surfaces with water beside them along each axis: places, m, normals, (m, 3), its voxels.

    Those that are oblique count as if they faced the axis, too, for other surfaces of their voxels.
    """
    voxels, axes = rays.voxels, AXES.astype(np.intp)
    full = np.pad(voxels.number >= 0, _INTO_CORNERS, constant_values=True)
    places = np.argwhere(voxels.number >= 0)
    for axis, way in enumerate(axes):
        beside = places + way
        inside = ((beside >= 0) & (beside < voxels.grid.shape)).all(axis=1)
        place, beside = places[inside], beside[inside]
        wet = rays.reached[tuple(beside.T)]
        which, beside = voxels.number[tuple(place[wet].T)], beside[wet]
        sides = voxels.facing[which]
        normal = sides[np.arange(len(sides)), (sides @ way).argmax(axis=1)]
        along = normal @ way
        turned = np.isfinite(voxels.extent[which, 0]) & (along > _TOWARDS) & (along < _STRAIGHT)
        steps = np.delete(axes, [axis, axis ^ 1], axis=0)
        straight = voxels.centre[which], np.tile(AXES[axis], (len(which), 1)), beside
        oblique = voxels.centre[which[turned]], normal[turned], beside[turned]
        found = []
        for faces, far in ((straight, 1), (oblique, _INTO_CORNERS)):
            found += _continued(full, voxels.grid.cell, *faces, steps, far)
        surface, normal, beside = (np.concatenate(x) for x in zip(*found, strict=True))
        yield surface, normal, voxels.grid.flat(beside)


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


def _approach(
    values: Light,
    fitted: NDArray[np.bool_],
    replaced: NDArray[np.bool_],
    readers: _Readers,
    wanted: Light,
    counts: NDArray[np.floating],
) -> None:
    """Change fitted cells (c,) of values (c, q) so that readers find what is wanted, (m, q).

    Those that are replaced begin as the mean of what their readers want. What is missed is spread
    again and again, as in the simultaneous iterative reconstruction of tomography (P. Gilbert,
    1972).
    """
    cells = readers.cells.ravel()
    weight = (readers.fractions**2 * counts[:, None]).astype(np.float32).ravel()
    order = np.flatnonzero(fitted[cells] & (weight > 0))
    order = order[np.argsort(cells[order], kind="stable")]
    which, first = np.unique(cells[order], return_index=True)
    reader, weight = order // readers.cells.shape[1], weight[order, None]
    total = np.add.reduceat(weight, first)

    def spread(light: Light) -> Light:
        sums: Light = np.add.reduceat(light[reader] * weight, first)
        sums /= total
        return sums

    values[which] = np.where(replaced[which, None], spread(wanted), values[which])
    for _ in range(_ROUNDS):
        values[which] += spread(wanted - readers.read(values))
        dark = values[:, ::3]
        np.maximum(dark, 0.0, out=dark)
