"""The light of all probes, solved by rounds, and started from what is known of it."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..transfer.radiance_table import OCCLUSION_STREAMS
from ..transfer.solved_field import SolvedField
from .changed_voxels import ChangedVoxels
from .grid import Array, Grid
from .probe_irradiance import (
    MOST_KEPT,
    WATERS,
    KnownLight,
    KnownWater,
    LightOfProbes,
    PartOfProbes,
    ProbeIrradiance,
    Solution,
    lengthened,
    ratios,
)
from .probe_rows import Light, joined
from .probes import SETS, Rays
from .unoccluded_field import depths_of
from .view_directions import AXES, COUNT

_ROUNDS = 40
_SETTLED = 0.001  # change of a round that is none, in every probe
_FAINT = 0.01  # of the unoccluded light: changes of less are those of this
_STEEPEST = 0.9  # of slopes, or ratios of patches that are lit by nothing count for nothing
_MOST_AGAIN = 0.5  # of the probes, or all are solved


class WaterCache:
    """What the light of waters is before there are objects, for the last few asked for."""

    def __init__(self) -> None:
        self._known: list[KnownWater] = []

    def of(self, field: SolvedField, grid: Grid) -> KnownWater:
        """Return the water that a field describes, at the depths of a grid."""
        ends = depths_of(field, grid)
        for water in self._known:
            if water.field is field and water.ends == ends:
                return water
        found = KnownWater(field, ends)
        self._known = [found, *self._known[: WATERS - 1]]
        return found


def probe_irradiance(
    field: SolvedField,
    rays: Rays,
    reflectance: Array,
    waters: WaterCache | None = None,
    before: ProbeIrradiance | None = None,
    near: ProbeIrradiance | None = None,
) -> ProbeIrradiance:
    """Compute the light at the probes.

    Parameters
    ----------
    before : ProbeIrradiance, optional
        That of another frame, itself solved without one, from which this one starts. It is solved
        until it is settled, so that it does not matter which frame that was.
    near : ProbeIrradiance, optional
        That of a frame which started from the same one, with light that is closer to this.
    """
    if not rays.valid.any():
        return _unoccluded(rays.grid, reflectance.shape[1])
    water = (waters or WaterCache()).of(field, rays.grid)
    if before is not None and before.solution and before.solution.serves(water, rays):
        found = _Again(water, rays, reflectance, before.solution).solved(near and near.solution)
        if found is not None:
            return _tabulated(found)
    return _tabulated(_solved(KnownLight(water, rays, reflectance)))


def _unoccluded(grid: Grid, bands: int) -> ProbeIrradiance:
    """Return the light where no place of the grid is in the water."""
    ones = np.ones((grid.count, COUNT, bands), np.float32)
    sunlit, none = np.ones(grid.count), np.zeros(bands)
    return ProbeIrradiance(grid, np.zeros(grid.count, bool), ones, ones, sunlit, none, 0.0)


def _processors() -> int | None:
    """Return how many processors there are for this process; before Python 3.13, in all."""
    count: Callable[[], int | None] = getattr(os, "process_cpu_count", os.cpu_count)
    return count()


def _solved(known: KnownLight) -> Solution:
    """Solve the light at all probes."""
    parts, count = known.parts(np.arange(len(known.order))), len(known.order)
    with ThreadPoolExecutor(_processors()) as pool:
        started = list(pool.map(PartOfProbes.prepare, parts))
        now = LightOfProbes(*joined(started))
        _settle(known, parts, now, pool)
        ended = _ratios(parts, now, pool)
    kept = parts if count <= MOST_KEPT else ()
    irradiance, scattered = joined(ended)
    return Solution(known, now, irradiance, scattered, kept)


def _gather(
    parts: Sequence[PartOfProbes], now: LightOfProbes, pool: ThreadPoolExecutor
) -> list[tuple[Light, ...]]:
    return list(pool.map(functools.partial(PartOfProbes.last_sums, now=now), parts))


def _ratios(
    parts: Sequence[PartOfProbes], now: LightOfProbes, pool: ThreadPoolExecutor
) -> list[tuple[Light, Light]]:
    return [ratios(sums) for sums in _gather(parts, now, pool)]


def _settle(
    known: KnownLight,
    parts: Sequence[PartOfProbes],
    now: LightOfProbes,
    pool: ThreadPoolExecutor,
    new: NDArray[np.bool_] | None = None,
) -> None:
    """Let light go on between probes until it does not change.

    ``new`` are those that parts of another frame do not know any more.
    """
    some = parts
    for _ in range(_ROUNDS):
        now.update(known)
        before = now.E.mean(axis=(1, 2))
        # What a set has found the next one uses already.
        for _, of_set in itertools.groupby(some, key=lambda part: part.kind):
            few = list(of_set)
            found = list(pool.map(functools.partial(PartOfProbes.round, now=now), few))
            for part, (E, J) in zip(few, found, strict=True):
                part.put(known, now.E, E, new)
                part.put(known, now.J, J, new)
        after = now.E.mean(axis=(1, 2))
        least = np.maximum(after, _FAINT * now.unoccluded)
        moving = np.abs(after - before) > _SETTLED * least
        left = [part for part in some if moving[part.rows].any()]
        if not left and len(some) == len(parts):
            break
        # Parts at rest wait until the others are; then all are looked at once more.
        some = left or parts


def _tabulated(found: Solution) -> ProbeIrradiance:
    known, rays = found.known, found.known.rays
    everywhere = known.place[rays.stand_in]
    there = rays.valid[known.order]
    up, down = found.light.on_patches[there][:, AXES[4:]].sum(axis=0, dtype=np.float64)
    slope = float((up - down) / max(up + down, np.finfo(np.float64).tiny))
    irradiance, scattered = _gathered(found)
    return ProbeIrradiance(
        rays.grid, rays.valid, irradiance[everywhere], scattered[everywhere],
        rays.sunlit[known.order][everywhere],
        known.unoccluded_field.forward_scattering(OCCLUSION_STREAMS),
        min(max(slope, -_STEEPEST), _STEEPEST), found,
    )  # fmt: skip


def _gathered(found: Solution) -> tuple[Light, Light]:
    """Return the ratios of a solution; where little of the open is seen, of all sets' directions.

    Few of one set's find a window, and the walls of a room would be blotched.
    """
    known, rays = found.known, found.known.rays
    rows = np.flatnonzero(rays.in_enclosed(known.order) & rays.valid[known.order])
    if not len(rows):
        return found.tables
    totals = [np.zeros_like(table) for table in 2 * found.tables]
    with ThreadPoolExecutor(_processors()) as pool:
        for by in range(SETS):
            parts = known.turned(rows, by).parts(rows)
            list(pool.map(PartOfProbes.prepare, parts))
            for part, values in zip(parts, _gather(parts, found.light, pool), strict=True):
                for total, value in zip(totals, values, strict=True):
                    total[part.rows] += value
    tables = [table.copy() for table in found.tables]
    for table, values in zip(tables, ratios([total[rows] for total in totals]), strict=True):
        table[rows] = values
    return tables[0], tables[1]


class _Again:
    """The light where something has changed since another frame, solved again.

    Probes that see other objects are prepared anew; all go on from the light that they had.
    """

    def __init__(self, water: KnownWater, rays: Rays, reflectance: Array, before: Solution) -> None:
        was = before.known
        changed = ChangedVoxels(was.rays.voxels, rays.voxels)
        self._before = before
        self._known = known = KnownLight(water, rays, reflectance, was, changed)
        self._now = before.light.longer(len(known.order), known.slots)
        self._new = known.differs(was, changed)
        self._parts = [part for part in before.parts if not self._new[part.rows].all()]

    def solved(self, near: Solution | None) -> Solution | None:
        """Return the light; None if too much has changed."""
        known, now, new = self._known, self._now, np.flatnonzero(self._new)
        if len(new) > _MOST_AGAIN * len(known.order):
            return None
        if not len(new) and known.sends_as(self._before.known):
            return dataclasses.replace(self._before, known=known, parts=())
        count = len(self._before.known.order)
        if near is not None and near.goes_on(self._before):
            now.E[:count], now.J[:count] = near.light.E[:count], near.light.J[:count]
        parts = known.parts(new)
        with ThreadPoolExecutor(_processors()) as pool:
            for part, start in zip(parts, pool.map(PartOfProbes.prepare, parts), strict=True):
                _, _, now.beam[part.rows], now.on_patches[part.rows] = start
            parts = sorted([*parts, *self._parts], key=lambda part: part.kind)
            _settle(known, parts, now, pool, self._new)
            ended = _ratios(parts, now, pool)
        before = self._before
        tables = [lengthened(x, len(known.order)) for x in before.tables]
        for part, values in zip(parts, ended, strict=True):
            for table, value in zip(tables, values, strict=True):
                part.put(known, table, value, self._new)
        irradiance, scattered = tables
        return Solution(known, now, irradiance, scattered)
