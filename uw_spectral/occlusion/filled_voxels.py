"""Voxels that the samples of many surfaces fill, again where some of them have changed."""

from __future__ import annotations

import collections
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..last_used import LastUsed
from .covered_voxels import covered_by_walls, full_enough, left_free
from .grid import Array, Grid
from .sunk_samples import gaps, out_of_edges, sunk
from .voxels import SurfaceVoxels, cells_of, grown, voxelise


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on surfaces, unit normals and base colours, (m, 3)."""

    points: Array
    normals: Array
    colours: Array
    areas: Array  #: That they stand for, m².
    extents: Array  #: Of these areas along the axes, m; infinite where only some are drawn, (m, 3).
    coverage: Array  #: Fraction of light that what they stand for stops, (m,).

    def some(self, which: NDArray[Any]) -> Samples:
        """Return some of them."""
        return Samples(*(getattr(self, field.name)[which] for field in fields(self)))


_NOTHING = np.empty((0, 3))
NO_SAMPLES = Samples(_NOTHING, _NOTHING, _NOTHING, np.empty(0), _NOTHING, np.empty(0))


def _joined(parts: Sequence[Samples]) -> Samples:
    every = [NO_SAMPLES, *parts]
    return Samples(*(np.concatenate([getattr(x, f.name) for x in every]) for f in fields(Samples)))


@dataclass(frozen=True, eq=False)
class Filling:
    """What fills voxels: samples of objects, which of them are small, and what tells them apart.

    Of a small object there must be so many samples that they cover a voxel; else a fish would cover
    as much as a rock. With ``to_edges`` voxels in which surfaces end are full as far as they are
    covered, else all of them are.
    """

    keys: Sequence[bytes]
    samples: Sequence[Samples]
    small: Sequence[bool]
    to_edges: bool = False


class FilledVoxels(LastUsed[tuple[Grid, bool], "_Filled"]):
    """Voxels of the grids of the last frame, of which only those are filled anew that changed."""

    def of(self, grid: Grid, filling: Filling) -> SurfaceVoxels:
        """Return the voxels of a grid, the same as if there was nothing that is kept."""
        key = grid, filling.to_edges
        return self.put(key, _Filled(grid, filling, self.last(key))).voxels


class _Filled:
    def __init__(self, grid: Grid, filling: Filling, before: _Filled | None) -> None:
        known = {} if before is None else before.places
        self.keys = filling.keys
        self.places = {
            key: known.get(key) or _Places(grid, samples)
            for key, samples in zip(filling.keys, filling.samples, strict=True)
        }
        if before is not None and self.keys == before.keys:
            self.voxels = before.voxels
            return
        touched = None if before is None else self._touched(grid, before)
        if before is None or touched is None:
            parts = [np.arange(len(samples.areas)) for samples in filling.samples]
            self.voxels = _fill(grid, filling, parts)
            return
        # On a border the closest voxel is another than the one that a sample lies in, it may fill
        # one beside it, and other sides, gaps and the ends of surfaces are looked for beside it.
        concerned = grown(grown(grown(grown(touched.reshape(grid.shape)))))
        around = grown(grown(grown(grown(concerned)))).ravel()
        parts = [self.places[key].among(around) for key in self.keys]
        self.voxels = _merged(before.voxels, _fill(grid, filling, parts), concerned.ravel())

    def _touched(self, grid: Grid, before: _Filled) -> NDArray[np.bool_] | None:
        """Voxels in which there is or was what has changed; None if all may have."""
        now, then = collections.Counter(self.keys), collections.Counter(before.keys)
        same = now & then
        # What is left must be in the same order, for the first sample of a voxel counts.
        if not same or _only(self.keys, same) != _only(before.keys, same):
            return None
        touched = np.zeros(grid.count, bool)
        for places, others in ((self.places, now - then), (before.places, then - now)):
            for key in others:
                places[key].mark(touched)
        return touched


def _only(keys: Sequence[bytes], some: collections.Counter[bytes]) -> list[bytes]:
    """Those of some keys, in their order; more of a kind than there are in both are left out."""
    left, found = some.copy(), []
    for key in keys:
        if left[key] > 0:
            left[key] -= 1
            found.append(key)
    return found


class _Places:
    """In which voxels samples lie, and which are closest to them."""

    def __init__(self, grid: Grid, samples: Samples) -> None:
        inside = grid.inside(samples.points)
        self._nearest = grid.index(samples.points).astype(np.int32)
        self._cells = np.where(inside, cells_of(grid, samples.points), self._nearest)
        self._cells = self._cells.astype(np.int32)

    def mark(self, touched: NDArray[np.bool_]) -> None:
        """Mark them in ``touched``."""
        touched[self._cells] = touched[self._nearest] = True

    def among(self, touched: NDArray[np.bool_]) -> NDArray[np.intp]:
        """Return which samples lie in, or close to, voxels that are marked."""
        return np.flatnonzero(touched[self._cells] | touched[self._nearest])


def _fill(grid: Grid, filling: Filling, parts: Sequence[NDArray[np.intp]]) -> SurfaceVoxels:
    """Fill the voxels of a grid with parts of the samples."""
    some = [x for x in zip(filling.samples, filling.small, parts, strict=True) if len(x[2])]
    samples = _joined([x.some(part) for x, _, part in some])
    small = np.repeat([is_small for _, is_small, _ in some], [len(part) for _, _, part in some])
    small = small.astype(bool)
    keep = ~small
    which = grid.index(samples.points[small])
    keep[small] = (np.bincount(which, samples.areas[small], grid.count) >= grid.cell**2)[which]
    keep &= full_enough(grid, samples.points, samples.coverage)
    if filling.to_edges:
        return _to_edges(grid, samples.some(keep & grid.inside(samples.points)))
    return voxelise(grid, samples.points[keep], samples.normals[keep], samples.colours[keep])


def _to_edges(grid: Grid, samples: Samples) -> SurfaceVoxels:
    """Fill voxels so that solids, walls and openings are as large as they are."""
    points, normals, areas = samples.points, samples.normals, samples.areas
    own = cells_of(grid, points)
    places, thin, rim = sunk(grid, own, points, normals, areas)
    covered = covered_by_walls(
        grid, places[thin], normals[thin], areas[thin], samples.extents[thin]
    )
    cells = cells_of(grid, places)
    solid = np.flatnonzero(~(rim | thin))
    out = out_of_edges(grid, own[solid], cells[solid], points[solid], normals[solid], areas[solid])
    rim[solid[out]] = True
    some = np.flatnonzero(~rim)
    own, cells = own[some], cells[some]
    there_too = gaps(grid, cells, own).ravel()[own]
    some = np.concatenate([some, some[there_too]])
    cells = np.concatenate([cells, own[there_too]])
    free = left_free(grid, cells, normals[some], areas[some], thin[some], covered)
    full = ~np.isin(cells, free)
    some, cells = some[full], cells[full]
    return voxelise(grid, points[some], normals[some], samples.colours[some], cells, thin[some])


def _merged(before: SurfaceVoxels, now: SurfaceVoxels, touched: NDArray[np.bool_]) -> SurfaceVoxels:
    """Voxels of before, but those of now where they are touched."""
    grid = before.grid
    ways = []
    for voxels, wanted in ((before, ~touched), (now, touched)):
        cells = np.flatnonzero(voxels.number.ravel() >= 0)
        keep = wanted[cells]
        ways.append(
            (
                cells[keep],
                *(x[keep] for x in (voxels.middle, voxels.facing, voxels.colour, voxels.extent)),
            )
        )
    cells, middle, facing, colour, extent = (np.concatenate(x) for x in zip(*ways, strict=True))
    order = np.argsort(cells)
    number = np.full(grid.count, -1, np.int32)
    number[cells[order]] = np.arange(len(cells))
    number = number.reshape(grid.shape)
    return SurfaceVoxels(grid, number, middle[order], facing[order], colour[order], extent[order])
