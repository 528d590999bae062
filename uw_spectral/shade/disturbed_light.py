"""Light of the water with things in it, over that of the water without them.

At each probe the light from all sides is what the path to the first surface brings and
what that surface sends, both from the light that the probes have found before; where nothing
is met, the undisturbed light of beyond the box. Repeated, light that the water scatters
and light that surfaces reflect comes round corners, more than once. The direct sun keeps its
own shadows; the light that its forward peak scatters goes with it.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..octahedron import lattice
from ..transfer.radiance_table import SHADED_STREAMS
from ..transfer.solved_field import SolvedField
from .grid import Array, Grid
from .probes import RAYS, SETS, Rays, directions, set_of
from .undisturbed_light import AXES, UndisturbedLight
from .view_directions import SIDE

_ROUNDS = 16
_SETTLED, _MOSTLY = 0.01, 0.98  # change of a round that is none, in that share of the probes
_ON_WAY = ((0.1127, 5 / 18), (0.5, 8 / 18), (0.8873, 5 / 18))
"""Places along a ray where the light is looked at, and their weights: Gauss's."""
_FLOOR_CELLS = 1.0  # from the floor within which what is met beyond the box is the floor
_MEAN_COSINE = 0.25  # of a beam on surfaces of all slopes, their dark sides too
_LEVEL = 1e-9  # cosine of a ray that gets nowhere
_MOST = 1e3  # times the undisturbed light; what a white wall sends into the dark has no bound
FADE = 2.0
"""Cells beyond the box after which half of the way to the light there is gone."""
_AT_ONCE = 128  # probes, of whose light a processor's cache holds all

Light = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class DisturbedLight:
    """Light at probes over the undisturbed light, of n bands.

    Attributes
    ----------
    grid : Grid
        Of the p probes.
    valid : array of bool, shape (p,)
        Which stand for water; the others have the light of one close by.
    irradiance : array, shape (p, 6, n)
        Ratio of the irradiance, without the beam of the sun, on patches that face
        :data:`.AXES`.
    scattered : array, shape (p, COUNT, n)
        Ratio of the light, without the beam, that the water scatters against the view directions
        of :mod:`.view_directions`.
    sunlit : array, shape (p,)
        Share of the sun's beam.
    behind : array, shape (p, 6)
        Share of what lies behind patches that is open water, by the cosine.
    weight : array, shape (6,)
        Mean undisturbed irradiance on each of them, over the sum of the six.
    """

    grid: Grid
    valid: NDArray[np.bool_]
    irradiance: Light
    scattered: Light
    sunlit: Array
    behind: Light
    weight: Array


def disturbed_light(water: SolvedField, rays: Rays, reflectance: Array) -> DisturbedLight:
    """Compute the light at the probes.

    Parameters
    ----------
    water : SolvedField
        Of the undisturbed water, n bands.
    rays : Rays
        What the probes see.
    reflectance : array, shape (k, n)
        Of each surface.
    """
    known = _Known(UndisturbedLight(water, rays.grid), rays)
    # Sets are turned against each other: within each light scatters alike.
    ways = known.undisturbed.phase_weights(0, directions()[0])
    kernels = [_Kernel(known.undisturbed, kind, ways) for kind in range(SETS)]
    sides = _Sides(rays, reflectance, known.undisturbed)
    mean = reflectance.sum(axis=0) / max(len(reflectance), 1) / math.pi
    by_set = [_split(known, kernel, kernels) for kernel in kernels]
    parts = [part for some in by_set for part in some]
    count = len(known.order)
    with ThreadPoolExecutor(os.process_cpu_count()) as pool:
        started = list(pool.map(_Part.prepare, parts))
        now = _Light(*(_joined(started, count, k) for k in range(3)))
        for _ in range(_ROUNDS):
            # What lies beyond the box is lit as its side is.
            now.sent = ((now.E.mean(axis=1) + now.beam) * mean).astype(np.float32)
            now.of_sides = sides.radiance(now.E[known.place[rays.probe_of_side]])
            before = now.E.mean(axis=(1, 2))
            for some in by_set:
                found = list(pool.map(functools.partial(_Part.round, now=now), some))
                for part, (E, J) in zip(some, found, strict=True):
                    now.E[part.rows], now.J[part.rows] = E, J
            after = now.E.mean(axis=(1, 2))
            if (np.abs(after - before) <= _SETTLED * after).mean() >= _MOSTLY:
                break
        ended = list(pool.map(functools.partial(_Part.ratios, now=now), parts))
    everywhere = known.place[rays.nearest(rays.grid.centres())]
    irradiance, scattered, behind = (_joined(ended, count, k)[everywhere] for k in range(3))
    weight = np.sum([part.undisturbed for part in parts], axis=0)
    return DisturbedLight(
        rays.grid, rays.valid, irradiance, scattered, rays.sunlit[known.order][everywhere], behind,
        weight / weight.sum(),
    )  # fmt: skip


@dataclass(eq=False)
class _Light:
    """The light of v probes, as far as it is known.

    Attributes
    ----------
    E : array, shape (v, 6, n)
        Irradiance on the axes, without the beam.
    J : array, shape (v, RAYS, n)
        Light scattered against each direction, over the undisturbed.
    beam : array, shape (v, n)
        Irradiance of the sun's beam, mean over surfaces of all slopes.
    sent : array, shape (v, n)
        Radiance of surfaces that are lit as a probe is.
    of_sides : array, shape (2 k, n)
        Radiance of the sides of surfaces.
    """

    E: Light
    J: Light
    beam: Light
    sent: Light = field(default_factory=lambda: np.empty((0, 0), np.float32))
    of_sides: Light = field(default_factory=lambda: np.empty((0, 0), np.float32))


class _Known:
    """What all parts of the probes share: probes of a set are side by side in ``order``."""

    def __init__(self, undisturbed: UndisturbedLight, rays: Rays) -> None:
        self.undisturbed, self.rays = undisturbed, rays
        kind = set_of(rays.grid)
        order = np.argsort(kind, kind="stable")
        self.order = order[rays.valid[order]]
        self.kind = kind[self.order]
        self.place = np.zeros(rays.grid.count, np.intp)
        self.place[self.order] = np.arange(len(self.order))
        self.sunlit = rays.sunlit[self.order].astype(np.float32)


def _split(known: _Known, kernel: _Kernel, kernels: Sequence[_Kernel]) -> list[_Part]:
    rows = np.flatnonzero(known.kind == kernel.kind)
    if not len(rows):
        return []
    first, end = int(rows[0]), int(rows[-1]) + 1
    ends = [*range(first, end, _AT_ONCE), end]
    nearest = np.stack([other.nearest(kernel) for other in kernels])
    return [_Part(slice(*pair), known, kernel, nearest) for pair in itertools.pairwise(ends)]


def _joined(found: Sequence[Sequence[Light]], count: int, which: int) -> Light:
    arrays = [parts[which] for parts in found]
    return np.concatenate(arrays) if count else np.empty((0, 6, 1), np.float32)


class _Part:
    """Some probes of one set, few enough to stay in a processor's cache."""

    def __init__(
        self, rows: slice, known: _Known, kernel: _Kernel, nearest: NDArray[np.intp]
    ) -> None:
        self.rows, self._known, self._kernel, self._nearest = rows, known, kernel, nearest
        self.undisturbed = np.zeros(6)
        """Irradiance on the axes, added up."""

    def prepare(self) -> tuple[Light, Light, Light]:
        """Compute what other probes do not change; return the start of the light."""
        rays, light = self._known.rays, self._known.undisturbed
        valid, kind, ways = self._known.order[self.rows], self._kernel.kind, np.arange(RAYS)
        w, hit, point = directions()[kind], rays.hit[valid], rays.point[valid]
        depth = np.maximum(-point[:, 2:], 0.0)
        # Where the water has a floor, nothing comes from below it but what is met there.
        to_floor = np.maximum(light.floor_depth - depth, 0.0) / np.maximum(-w[:, 2], _LEVEL)
        to_side = rays.distance[valid]
        distance = np.where(hit < 0, np.minimum(to_side, to_floor), to_side)
        at_floor = distance < to_side
        end_depth = np.maximum(depth - distance * w[:, 2], 0.0)
        T = _transmitted(light, depth, end_depth, distance)
        at, end = light.along(depth, kind, ways), light.along(end_depth, kind, ways)
        on_way = [
            self._known.place[
                rays.nearest_in_sight(
                    point[:, None] + w * (t * distance)[..., None], valid[:, None]
                )
            ]
            for t, _ in _ON_WAY
        ]
        # Probes on the way have other directions; the closest stands for the ray's.
        self._on_way = [
            (p * RAYS + self._nearest[self._known.kind[p], ways]).ravel() for p in on_way
        ]
        lit = np.zeros(distance.shape, np.float32)
        for probes, (_, weight) in zip(on_way, _ON_WAY, strict=True):
            lit += np.float32(weight) * self._known.sunlit[probes]
        L = (at.once - T * end.once) * lit[..., None]
        scattered = at.scattered - T * end.scattered
        self._scattered = _flat(scattered.astype(np.float32, copy=False))
        # Beyond the box shade is as at its side, the less the further, unless things are there.
        out = (hit < 0).nonzero()
        self._out, self._border = np.flatnonzero(hit < 0), on_way[-1][out]
        far = np.where(at_floor, 0.0, rays.further[valid])[out]
        T_out, z = T[out], end_depth[out]
        last_depth = np.maximum(z - far * w[out[1], 2], 0.0)
        T_last = _transmitted(light, z, last_depth, far)
        last = light.along(last_depth, kind, out[1])
        near = FADE * rays.grid.cell
        brought_from = 1.0 / (
            light.extinction(z, last_depth) + 2.0 / np.maximum(far, near)[:, None]
        )
        as_side = near / (near + brought_from)
        as_side = np.where(rays.blocked[valid][out][:, None], 1.0, as_side).astype(np.float32)
        further = T_out * (end.scattered[out] - T_last * last.scattered)
        self._further = as_side * further
        once = T_out * (end.once[out] - T_last * last.once)
        shaded = as_side * (1.0 - self._known.sunlit[self._border][:, None])
        L[out] += once * (1.0 - shaded) + (1.0 - as_side) * further
        # The floor of the undisturbed water is part of its light.
        on_floor = last_depth > light.floor_depth - _FLOOR_CELLS * rays.grid.cell
        blocked = (rays.blocked[valid] & ~at_floor)[out]
        blocked = (blocked & ~(on_floor & (far > 0)))[:, None]
        T_last *= T_out
        boundary = at.image[out]  # dimmed, of all that a direction stands for
        L[out] += (T_last * (last.scattered + last.once) + boundary) * ~blocked
        self._to_further = T_last * blocked
        self._known_light = _flat(L.astype(np.float32, copy=False))
        self._met = np.flatnonzero(hit >= 0)
        self._to_met, self._side = _flat(T)[self._met], hit.ravel()[self._met]
        unshaded, self._source, self._scattered0 = (
            np.maximum(x, light.faintest)
            for x in self._kernel.sums(_flat(at.scattered + at.once + at.image), last=True)
        )
        self.undisturbed = unshaded.sum(axis=(0, 2), dtype=np.float64)
        # A sum over few directions is not an irradiance; over another such sum it is.
        irradiance = light.irradiance(depth[:, 0])
        self._unshaded, self._exact = unshaded, irradiance / unshaded
        # To begin with light comes as far as rays do.
        free = rays.open_water[valid] | at_floor
        self._behind = self._kernel.behind(free)
        share = free.mean(axis=1, dtype=np.float32)[:, None, None]
        beam = light.beam(depth[:, 0]) * (_MEAN_COSINE * rays.sunlit[valid][:, None])
        J = np.broadcast_to(share, at.once.shape)
        return irradiance * share, J, beam.astype(np.float32)

    def round(self, now: _Light) -> tuple[Light, Light]:
        """Return irradiance and scattered light as all probes' light makes them."""
        E, J = self._kernel.sums(*self._radiance(now))
        E = (E * self._exact).astype(np.float32, copy=False)
        return E, np.minimum(J / self._source, _MOST)

    def ratios(self, now: _Light) -> tuple[Light, Light, Light]:
        """Return what :class:`DisturbedLight` has of irradiance, scattered light and open water."""
        E, _, scattered = self._kernel.sums(*self._radiance(now), last=True)
        irradiance = np.minimum(E / self._unshaded, _MOST)
        return irradiance, np.minimum(scattered / self._scattered0, _MOST), self._behind

    def _radiance(self, now: _Light) -> tuple[Light, Light]:
        """Radiance along all rays, and what of it surfaces send, (m RAYS, n)."""
        J = _flat(now.J)
        looked_up = [J.take(places, axis=0) for places in self._on_way]
        last = looked_up[-1][self._out]
        total, *others = looked_up
        total *= np.float32(_ON_WAY[0][1])
        for found, (_, weight) in zip(others, _ON_WAY[1:], strict=True):
            found *= np.float32(weight)
            total += found
        total *= self._scattered
        total += self._known_light
        total[self._out] += self._further * last + self._to_further * now.sent[self._border]
        sent = np.zeros_like(total)
        sent[self._met] = self._to_met * now.of_sides[self._side]
        total += sent
        # Means over directions are not quite the light of a path.
        return np.maximum(total, 0.0, out=total), sent


class _Kernel:
    """Sums over the directions of a set."""

    def __init__(self, undisturbed: UndisturbedLight, kind: int, ways: Light) -> None:
        self.kind, w = kind, directions()[kind]
        patches, even = undisturbed.patch_weights(kind)
        self._of_surfaces = even - patches
        views = undisturbed.phase_weights(kind, lattice(SIDE), SHADED_STREAMS)
        self._weights = np.concatenate([patches, ways, views], axis=2)
        behind = np.maximum(-AXES @ w.T, 0.0)
        self._behind = (behind / behind.sum(axis=1, keepdims=True)).T

    def nearest(self, other: _Kernel) -> NDArray[np.intp]:
        """Direction of this set that is closest to each of another, (RAYS,)."""
        return (directions()[self.kind] @ directions()[other.kind].T).argmax(axis=0)

    def behind(self, free: NDArray[np.bool_]) -> Light:
        """Share of what patches that face the axes have behind them that is free, (m, 6)."""
        return (free @ self._behind).astype(np.float32)

    def sums(
        self, L: Light, of_surfaces: Light | None = None, *, last: bool = False
    ) -> list[Light]:
        """Sum radiances (m RAYS, n).

        Parameters
        ----------
        L : array
        of_surfaces : array, optional
            What of it surfaces send.
        last : bool
            Whether the light that is tabulated is wanted too.

        Returns
        -------
        list of arrays
            Irradiance on patches that face the axes, (m, 6, n); light scattered against each
            direction, (m, RAYS, n), and against those of :mod:`.view_directions`, (m, COUNT, n).
        """
        weights = self._weights if last else self._weights[..., : 6 + RAYS]
        found = np.matmul(_by_band(L), weights)
        if of_surfaces is not None:
            found[..., :6] += np.matmul(_by_band(of_surfaces), self._of_surfaces)
        found = np.ascontiguousarray(found.transpose(1, 2, 0))
        return np.split(found, [6, 6 + RAYS] if last else [6], axis=1)


def _flat(x: Light) -> Light:
    return x.reshape(-1, x.shape[-1])


def _by_band(x: Light) -> Light:
    return np.ascontiguousarray(x.T).reshape(x.shape[1], -1, RAYS)


def _transmitted(light: UndisturbedLight, y: Array, z: Array, distance: Array) -> Light:
    """Share that gets from one depth to another along some distances (...), (..., n)."""
    thickness = light.extinction(y, z) * distance[..., None]
    return np.exp(-thickness.astype(np.float32))


class _Sides:
    """The sides of the surfaces: what light they send."""

    def __init__(self, rays: Rays, reflectance: Array, undisturbed: UndisturbedLight) -> None:
        normal = np.stack([rays.voxels.normal, -rays.voxels.normal], axis=1).reshape(-1, 3)
        self._squared = np.where(normal[:, :, None] * [1, -1] > 0, normal[:, :, None] ** 2, 0.0)
        self._squared = self._squared.reshape(-1, 6).astype(np.float32)
        self._rho = (np.repeat(reflectance, 2, axis=0) / math.pi).astype(np.float32)
        facing = np.maximum(-normal @ np.asarray(undisturbed.sun), 0.0) * rays.side_sunlit
        depth = np.repeat(np.maximum(-rays.voxels.centre[:, 2], 0.0), 2)
        self._sun = (undisturbed.beam(depth) * facing[:, None]).astype(np.float32)

    def radiance(self, E: Light) -> Light:
        """Radiance of the sides (s, n) from the irradiance on the axes beside them, (s, 6, n)."""
        return self._rho * (np.einsum("sf,sfn->sn", self._squared, E) + self._sun)
