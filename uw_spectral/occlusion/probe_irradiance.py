"""Light of the water with objects in it, over that of the water without them.

At each probe the light from all sides is what the path to the first surface brings and
what that surface sends, both from the light that the probes have found before; where nothing
is met, the unoccluded light of beyond the box. Repeated, light that the water scatters
and light that surfaces reflect comes round corners, more than once. The direct sun keeps its
own shadows; the light that its forward peak scatters goes with it.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..transfer.radiance_table import OCCLUSION_STREAMS
from ..transfer.solved_field import SolvedField
from .changed_voxels import ChangedVoxels
from .grid import Array, Grid
from .probe_rows import Light, Rows, as_slice, by_band, flat, product_of_rows
from .probes import MIRROR, RAYS, SETS, Rays, directions, set_of
from .unoccluded_field import UnoccludedField
from .view_directions import AXES, COUNT, NORMALS, around

_ON_WAY = ((0.1127, 5 / 18), (0.5, 8 / 18), (0.8873, 5 / 18))
"""Fractions of what arrives along a ray where the light is looked at, and weights: Gauss's."""
_FLOOR_CELLS = 1.0  # from the floor within which what is met beyond the box is the floor
_MEAN_COSINE = 0.25  # of a beam on surfaces of all slopes, their dark sides too
_LEVEL = 1e-9  # cosine of a ray that gets nowhere
_NONE = np.float32(1e-30)  # that divides
_MOST = 1e3  # times the unoccluded light; what a white wall sends into the dark has no bound
FADE = 2.0
"""Cells beyond the box after which half of the way to the light there is gone."""
_AT_ONCE = 128  # probes, of whose light a processor's cache holds all
MOST_KEPT = 14_000  # probes of a frame that others may start from; some 35 kB each
WATERS = 2  # that are kept


@dataclass(frozen=True, eq=False)
class ProbeIrradiance:
    """Light at probes over the unoccluded light, of n bands."""

    grid: Grid  #: Of the p probes.
    #: Which stand for water; the others have the light of one close by, (p,).
    valid: NDArray[np.bool_]
    #: Ratio of the irradiance, without the beam of the sun, on patches that face
    #: :data:`.view_directions.NORMALS`, (p, COUNT, n).
    irradiance: Light
    #: Ratio of the light, without the beam, that the water scatters against the view directions of
    #: :mod:`.view_directions`, (p, COUNT, n).
    scattered: Light
    sunlit: Array  #: Fraction of the sun's beam, (p,).
    #: Rate with depth, 1/m, at which light of the sun that goes straight by
    #: :data:`.OCCLUSION_STREAMS` turns, (n,).
    forward_scattering: Array
    slope: float  #: How much more of the unoccluded light is from above than below, -1 to 1.
    solution: Solution | None = None  #: What the light of another frame may start from.

    @property
    def serves(self) -> bool:
        """Whether the light of other frames may start from it: it was solved for itself."""
        return self.solution is not None and len(self.solution.parts) > 0


class KnownWater:
    """The unoccluded light between two depths, and sums over it."""

    def __init__(self, field: SolvedField, ends: tuple[float, float]) -> None:
        self.field, self.ends = field, ends
        self.unoccluded_field = UnoccludedField(field, ends)
        # Sets are turned against each other: within each light scatters alike.
        ways = self.unoccluded_field.phase_weights(0, directions()[0])
        self.kernels = [_Kernel(self.unoccluded_field, kind, ways) for kind in range(SETS)]
        self.nearest = [
            np.stack([other.nearest(kernel) for other in self.kernels]) for kernel in self.kernels
        ]
        """By set: direction of each set that is closest to each of its own."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The light of all probes of a frame, in the order of a :class:`KnownLight`, and its ratios."""

    known: KnownLight
    light: LightOfProbes
    irradiance: Light
    scattered: Light
    parts: Sequence[PartOfProbes] = ()

    @property
    def tables(self) -> tuple[Light, Light]:
        """Ratios by probe."""
        return self.irradiance, self.scattered

    def goes_on(self, other: Solution) -> bool:
        """Whether it started from another, or may have done: its first probes are the same."""
        count = len(other.known.order)
        order = self.known.order[:count]
        return self.known.water is other.known.water and np.array_equal(order, other.known.order)

    def serves(self, water: KnownWater, rays: Rays) -> bool:
        """Whether it is about the same places in the same water."""
        known = self.known
        same = known.water is water and known.rays.grid == rays.grid
        return same and known.rays.voxels.grid == rays.voxels.grid and len(self.parts) > 0


def lengthened(values: Light, count: int) -> Light:
    """Return a copy with more rows."""
    found = np.zeros((count, *values.shape[1:]), values.dtype)
    found[: len(values)] = values
    return found


@dataclass(eq=False)
class LightOfProbes:
    """The light of v probes, as far as it is known."""

    E: Light  #: Irradiance on patches, without the beam, (v, COUNT, n).
    J: Light  #: Light scattered against each direction, over the unoccluded, (v, RAYS, n).
    beam: Light  #: Irradiance of the sun's beam, mean over surfaces of all slopes, (v, n).
    on_patches: Light  #: Unoccluded irradiance on them, of all bands, (v, COUNT).
    #: Radiance of surfaces that are lit as a probe is, (v, n).
    sent: Light = field(default_factory=lambda: np.empty((0, 0), np.float32))
    #: Radiance of the sides of surfaces, (2 k, n).
    of_sides: Light = field(default_factory=lambda: np.empty((0, 0), np.float32))

    @property
    def unoccluded(self) -> Light:
        """Mean unoccluded irradiance, (v,)."""
        return self.on_patches.mean(axis=1) / max(self.E.shape[2], 1)

    def longer(self, count: int, slots: int) -> LightOfProbes:
        """Return a copy with room for more probes, and more sides of surfaces."""
        E, J, beam, on_patches = (
            lengthened(x, count) for x in (self.E, self.J, self.beam, self.on_patches)
        )
        return LightOfProbes(E, J, beam, on_patches, of_sides=lengthened(self.of_sides, slots))

    def update(self, known: KnownLight) -> None:
        """Compute what surfaces send."""
        # What lies beyond the box is lit as its side is.
        self.sent = ((self.E[:, AXES].mean(axis=1) + self.beam) * known.mean).astype(np.float32)
        if not len(self.of_sides):
            self.of_sides = np.zeros((known.slots, self.E.shape[2]), np.float32)
        self.of_sides[known.slot] = known.sides.radiance(self.E, known.beside)


class KnownLight:
    """What all parts of the probes share: those of a set are side by side in ``order``.

    ``was`` is that of another frame: what both have keeps its row, and its slot among the sides.
    """

    def __init__(
        self,
        water: KnownWater,
        rays: Rays,
        reflectance: Array,
        was: KnownLight | None = None,
        changed: ChangedVoxels | None = None,
    ) -> None:
        self.water, self.rays = water, rays
        self.unoccluded_field = water.unoccluded_field
        self.mean = reflectance.sum(axis=0) / max(len(reflectance), 1) / math.pi
        self.sides = _Sides(rays, reflectance, water.unoccluded_field)
        kind, count = set_of(rays.grid), len(rays.probe_of_side)
        self.slot, self.slots = np.arange(count), count
        if was is None or changed is None:
            order = np.argsort(kind, kind="stable")
            self.order = order[rays.valid[order]]
        else:
            new = np.flatnonzero(rays.valid & ~was.rays.valid)
            self.order = np.concatenate([was.order, new])
            self._keep_slots(was, changed)
        self.kind = self.looks = kind[self.order]
        """Sets of directions of the light of probes, and of the rays along which they look."""
        self.narrow = False
        """Whether they look along all sets, one after another."""
        self.place = np.zeros(rays.grid.count, np.intp)
        self.place[self.order] = np.arange(len(self.order))
        self.beside = self.place[rays.probe_of_side]
        self.sunlit = rays.sunlit[self.order].astype(np.float32)
        shape = len(_ON_WAY), len(self.order), RAYS
        self.cells = np.zeros(shape, np.int32)
        """In which places on the way lie."""
        self.seen = np.zeros(shape, np.int32)
        """Rows of the probes that stand for them."""
        self.has_seen = np.zeros(len(self.order), bool)

    def turned(self, rows: NDArray[np.intp], by: int) -> KnownLight:
        """Return the same where some probes look along one of all sets."""
        found = copy.copy(self)
        found.narrow = True
        found.looks = (self.kind + by) % SETS
        found.rays = self.rays.along(self.order[rows], found.looks[rows])
        found.cells, found.seen = np.zeros_like(self.cells), np.zeros_like(self.seen)
        found.has_seen = np.zeros_like(self.has_seen)
        return found

    def _keep_slots(self, was: KnownLight, changed: ChangedVoxels) -> None:
        """Give sides that are as they were the slots that they had."""
        same = np.repeat(~changed.mask[self.rays.voxels.number >= 0], 2)
        then = np.repeat(~changed.mask[was.rays.voxels.number >= 0], 2)
        self.slot[same] = was.slot[then]
        others = int((~same).sum())
        self.slot[~same] = was.slots + np.arange(others)
        self.slots = was.slots + others

    def sends_as(self, other: KnownLight) -> bool:
        """Whether all surfaces are those of another, and as bright."""
        return self.slots == other.slots and self.sides.are(other.sides)

    @functools.cached_property
    def met(self) -> NDArray[np.intp]:
        """Slots of the sides that rays meet, and in the mirror, one more than all for none."""
        either = np.stack([self.rays.hit[self.order], self.rays.mirrored[self.order]], axis=1)
        return np.append(self.slot, self.slots)[either]

    def parts(self, rows: NDArray[np.intp]) -> list[PartOfProbes]:
        """Split some probes into parts."""
        found = []
        for kind in range(SETS):
            of_set = rows[self.looks[rows] == kind]
            found += [
                PartOfProbes(as_slice(of_set[k : k + _AT_ONCE]), self, kind)
                for k in range(0, len(of_set), _AT_ONCE)
            ]
        return found

    def length(self, rows: Rows) -> tuple[Array, Array]:
        """Length of rays, and depth of where they begin; no farther than the water's floor."""
        rays, probes = self.rays, self.order[rows]
        w = directions()[self.looks[rows]]
        depth = np.maximum(-rays.point[probes, 2:], 0.0)
        # Where the water has a floor, nothing comes from below it but what is met there.
        to_floor = np.maximum(self.unoccluded_field.floor_depth - depth, 0.0)
        to_floor = to_floor / np.maximum(-w[..., 2], _LEVEL)
        to_side = rays.distance[probes]
        # Not so rays that meet a surface, though it is not clear how it is lit.
        return np.where(rays.leaves(probes), np.minimum(to_side, to_floor), to_side), depth

    def on_way(self, distance: Array) -> list[Array]:
        """Lengths of rays at which the light is looked at, of all bands alike."""
        rate = self.unoccluded_field.rate
        return [-np.log1p(u * np.expm1(-rate * distance)) / rate for u, _ in _ON_WAY]

    def look(self, rows: Rows) -> None:
        """Find the probes on the way of rays."""
        distance, _ = self.length(rows)
        probes = self.order[rows]
        point, w = self.rays.point[probes], directions()[self.looks[rows]]
        for k, s in enumerate(self.on_way(distance)):
            points = point[:, None] + w * s[..., None]
            cells = self.rays.grid.index(points)
            self.cells[k, rows] = cells
            self.seen[k, rows] = self.place[self.rays.in_sight(cells, points, probes[:, None])]
        self.has_seen[rows] = True

    def differs(self, was: KnownLight, changed: ChangedVoxels) -> NDArray[np.bool_]:
        """Which probes are not as they were, or see others than they did.

        Those that a probe's rays see are taken from the other frame where they are the same.
        """
        rays, before, order, count = self.rays, was.rays, was.order, len(was.order)
        self.cells[:, :count], self.seen[:, :count] = was.cells, was.seen
        found = np.ones(len(self.order), bool)
        old = found[:count]
        np.any(rays.distance[order] != before.distance[order], axis=1, out=old)
        old |= (rays.point != before.point)[order].any(axis=1)
        old |= (rays.to_mirrored != before.to_mirrored)[order].any(axis=1)
        if (rays.stand_in != before.stand_in).any():
            old |= (rays.to_mirrored[order] > 0.0).any(axis=1)
        then = np.where(was.met == was.slots, self.slots, was.met)
        old |= (self.met[:count] != then).any(axis=(1, 2))
        look = found.copy()
        look[:count] |= rays.other_sights(before, changed)[self.cells[:, :count]].any(axis=(0, 2))
        self.has_seen[:] = True
        rows = np.flatnonzero(look & rays.valid[self.order])
        if len(rows):
            self.look(rows)
            old |= (self.seen[:, :count] != was.seen).any(axis=(0, 2))
        old |= (rays.further != before.further)[order].any(axis=1)
        old |= (rays.blocked != before.blocked)[order].any(axis=1)
        otherwise = self.sunlit != lengthened(was.sunlit, len(self.order))
        old |= otherwise[:count]
        if otherwise.any():
            old |= otherwise[self.seen[:, :count]].any(axis=(0, 2))
        return found & rays.valid[self.order]


class PartOfProbes:
    """Some probes of one set, few enough to stay in a processor's cache."""

    def __init__(self, rows: Rows, known: KnownLight, kind: int) -> None:
        self.rows, self.kind, self._known = rows, kind, known
        self._kernel, self._nearest = known.water.kernels[kind], known.water.nearest[kind]
        self._sums = functools.partial(self._kernel.sums, narrow=known.narrow)
        along = known.unoccluded_field.along
        self._along = functools.partial(along, kind=kind, narrow=known.narrow)

    def prepare(self) -> tuple[Light, Light, Light, Light]:
        """Compute what other probes do not change; return the start of the light."""
        rays, light = self._known.rays, self._known.unoccluded_field
        valid, kind, ways = self._known.order[self.rows], self.kind, np.arange(RAYS)
        w, hit = directions()[kind], rays.hit[valid]
        if not self._known.has_seen[self.rows].all():
            self._known.look(self.rows)
        to_side = rays.distance[valid]
        distance, depth = self._known.length(self.rows)
        at_floor = distance < to_side
        end_depth = np.maximum(depth - distance * w[:, 2], 0.0)
        T = _transmitted(light, depth, end_depth, distance)
        at, end = self._along(depth, ways=ways), self._along(end_depth, ways=ways)
        on_way = self._known.seen[:, self.rows]
        # Probes on the way have other directions; the closest stands for the ray's.
        self._on_way = [
            (p * RAYS + self._nearest[self._known.kind[p], ways]).ravel() for p in on_way
        ]
        of_scattered, of_single = self._arriving(depth, distance)
        sunlit = self._known.sunlit[on_way][..., None]
        L = (at.single - T * end.single) * (of_single * sunlit).sum(axis=0)
        of_scattered *= np.maximum(at.scattered - T * end.scattered, 0.0)
        self._scattered = [flat(part) for part in of_scattered]
        # Beyond the box occlusion is as at its side, the less the further, unless objects are
        # there.
        out = (hit < 0).nonzero()
        self._out, self._border = np.flatnonzero(hit < 0), on_way[-1][out]
        far = np.where(at_floor, 0.0, rays.further[valid])[out]
        T_out, z = T[out], end_depth[out]
        last_depth = np.maximum(z - far * w[out[1], 2], 0.0)
        T_last = _transmitted(light, z, last_depth, far)
        last = self._along(last_depth, ways=out[1])
        near = FADE * rays.grid.cell
        brought_from = 1.0 / (
            light.extinction(z, last_depth) + 2.0 / np.maximum(far, near)[:, None]
        )
        as_side = near / (near + brought_from)
        as_side = np.where(rays.blocked[valid][out][:, None], 1.0, as_side).astype(np.float32)
        further = T_out * (end.scattered[out] - T_last * last.scattered)
        self._further = as_side * further
        single = T_out * (end.single[out] - T_last * last.single)
        occluded = as_side * (1.0 - self._known.sunlit[self._border][:, None])
        L[out] += single * (1.0 - occluded) + (1.0 - as_side) * further
        # The floor of the unoccluded water is part of its light.
        on_floor = last_depth > light.floor_depth - _FLOOR_CELLS * rays.grid.cell
        blocked = (rays.blocked[valid] & ~at_floor)[out]
        blocked = (blocked & ~(on_floor & (far > 0)))[:, None]
        T_last *= T_out
        boundary = at.image[out]  # dimmed, of all that a direction stands for
        L[out] += (T_last * (last.scattered + last.single) + boundary) * ~blocked
        self._to_further = T_last * blocked
        met = np.flatnonzero(hit >= 0)
        shown, side, comes = self._mirrored(L, T, valid)
        self._known_light = flat(L.astype(np.float32, copy=False))
        self._met = np.concatenate([met, shown])
        self._to_met = np.concatenate([flat(T)[met], comes])
        self._side = self._known.slot[np.concatenate([hit.ravel()[met], side])]
        unoccluded, self._source, self._scattered0 = (
            np.maximum(x, light.faintest)
            for x in self._sums(flat(at.scattered + at.single + at.image), last=True)
        )
        # A sum over few directions is not an irradiance; over another such sum it is.
        irradiance = light.irradiance(depth[:, 0])
        self._unoccluded, self._exact = unoccluded, irradiance / unoccluded
        # To begin with light comes as far as rays do.
        free = rays.open_water[valid] | at_floor
        fraction = free.mean(axis=1, dtype=np.float32)[:, None, None]
        beam = light.beam(depth[:, 0]) * (_MEAN_COSINE * rays.sunlit[valid][:, None])
        J = np.broadcast_to(fraction, at.single.shape)
        return irradiance * fraction, J, beam.astype(np.float32), unoccluded.sum(axis=2)

    def _mirrored(
        self, L: NDArray[np.floating], T: Light, probes: NDArray[np.intp]
    ) -> tuple[NDArray[np.intp], NDArray[np.int32], Light]:
        """Rays that show sides in the surface of the water, which, and how much of their light.

        Takes from the light along rays what of the unoccluded water is mirrored instead of them,
        and of the water before them.
        """
        rays, light = self._known.rays, self._known.unoccluded_field
        row, ray = (rays.to_mirrored[probes] > 0.0).nonzero()
        probe = probes[row]
        w, t = directions()[self.kind][ray], rays.to_mirrored[probe, ray]
        mirror = self._kernel.mirror[ray]
        depth = t * w[:, 2]
        comes = T[row, ray] * self._kernel.mirrored[self._known.narrow][ray, None]
        passes = comes * _transmitted(light, np.zeros_like(depth), depth, t)
        first, last = (self._along(y, ways=mirror) for y in (np.zeros_like(depth), depth))
        self._on_mirrored = np.maximum(comes * first.scattered - passes * last.scattered, 0.0)
        L[row, ray] -= self._on_mirrored
        # The water halfway stands for all of it.
        at = rays.point[probe] + w * rays.distance[probe, ray][:, None]
        p = self._known.place[rays.nearest(at + w * MIRROR * (t / 2.0)[:, None])]
        self._halfway = p * RAYS + self._nearest[self._known.kind[p], mirror]
        self._up, side = row * RAYS + ray, rays.mirrored[probe, ray]
        shows = side >= 0
        behind = passes * (last.scattered + last.single + last.image)
        L[row[shows], ray[shows]] -= behind[shows]
        return self._up[shows], side[shows], passes[shows]

    def _arriving(self, depth: Array, distance: Array) -> tuple[Light, Light]:
        """What places on the way bring of light scattered often, and once, (places, m, RAYS, n)."""
        light, parts = self._known.unoccluded_field, []
        for (_, weight), s in zip(_ON_WAY, self._known.on_way(distance), strict=True):
            y = np.maximum(depth - s * directions()[self.kind][:, 2], 0.0)
            arrives = _transmitted(light, depth, y, s)
            arrives *= (weight * np.exp(light.rate * s)).astype(np.float32)[..., None]
            parts.append([arrives * part(y) for part in (light.scalar_irradiance, light.beam)])
        found = np.array(parts, np.float32)
        found /= np.maximum(found.sum(axis=0), _NONE)
        return found[:, 0], found[:, 1]

    def put(
        self, known: KnownLight, values: Light, some: Light, new: NDArray[np.bool_] | None
    ) -> None:
        """Put what was found of the probes in its place, but for those that it does not know."""
        if new is None or self._known is known or not (stale := new[self.rows]).any():
            values[self.rows] = some
        else:
            rows = np.arange(len(values))[self.rows][~stale]
            values[rows] = some[~stale]

    def round(self, now: LightOfProbes) -> tuple[Light, Light]:
        """Return irradiance and scattered light as all probes' light makes them."""
        E, J = self._sums(*self._radiance(now))
        E = (E * self._exact).astype(np.float32, copy=False)
        return E, np.minimum(J / self._source, _MOST)

    def last_sums(self, now: LightOfProbes) -> tuple[Light, ...]:
        """Return irradiance and scattered light, and what they would be without objects."""
        E, _, scattered = self._sums(*self._radiance(now), last=True)
        return E, scattered, self._unoccluded, self._scattered0

    def _radiance(self, now: LightOfProbes) -> tuple[Light, Light]:
        """Radiance along all rays, and what of it surfaces send, (m RAYS, n)."""
        J = flat(now.J)
        looked_up = [J.take(places, axis=0) for places in self._on_way]
        last = looked_up[-1][self._out]
        total, *others = looked_up
        total *= self._scattered[0]
        for found, brought in zip(others, self._scattered[1:], strict=True):
            found *= brought
            total += found
        total += self._known_light
        total[self._out] += self._further * last + self._to_further * now.sent[self._border]
        total[self._up] += self._on_mirrored * J.take(self._halfway, axis=0)
        sent = np.zeros_like(total)
        sent[self._met] = self._to_met * now.of_sides[self._side]
        total += sent
        # Means over directions are not quite the light of a path.
        return np.maximum(total, 0.0, out=total), sent


class _Kernel:
    """Sums over the directions of a set."""

    def __init__(self, unoccluded_field: UnoccludedField, kind: int, ways: Light) -> None:
        self.kind = kind
        views = unoccluded_field.phase_weights(kind, NORMALS, OCCLUSION_STREAMS)
        self._weights: list[Light] = []  # of wide directions, and of narrow ones
        self._of_surfaces: list[Light] = []
        self.mirrored: list[Light] = []
        """Fractions that the surface of the water sends back, :meth:`.UnoccludedField.mirrored`."""
        w = directions()[kind]
        self.mirror = (w @ (w * MIRROR).T).argmax(axis=0)
        """Direction that is closest to each one's mirrored in that surface, (RAYS,)."""
        for narrow in (False, True):
            self.mirrored.append(unoccluded_field.mirrored(kind, narrow=narrow))
            patches, even = unoccluded_field.patch_weights(kind, narrow=narrow)
            self._weights.append(np.concatenate([patches, ways, views], axis=2))
            self._of_surfaces.append(even - patches)

    def nearest(self, other: _Kernel) -> NDArray[np.intp]:
        """Direction of this set that is closest to each of another, (RAYS,)."""
        return (directions()[self.kind] @ directions()[other.kind].T).argmax(axis=0)

    def sums(
        self,
        L: Light,
        of_surfaces: Light | None = None,
        *,
        last: bool = False,
        narrow: bool = False,
    ) -> list[Light]:
        """Sum radiances (m RAYS, n) into irradiances on patches, (m, COUNT, n).

        And into light scattered against each direction, (m, RAYS, n), in the ``last`` round also
        against those of :mod:`.view_directions`, (m, COUNT, n). What is ``narrow`` is to be added
        up over all sets.
        """
        weights = self._weights[narrow]
        weights = weights if last else weights[..., : COUNT + RAYS]
        found = product_of_rows(by_band(L), weights)
        if of_surfaces is not None:
            found[..., :COUNT] += product_of_rows(by_band(of_surfaces), self._of_surfaces[narrow])
        found = np.ascontiguousarray(found.transpose(1, 2, 0))
        return np.split(found, [COUNT, COUNT + RAYS] if last else [COUNT], axis=1)


def ratios(sums: Sequence[Light]) -> tuple[Light, Light]:
    """Return what :class:`ProbeIrradiance` has, from :meth:`PartOfProbes.last_sums`."""
    E, scattered, unoccluded, scattered0 = sums
    return np.minimum(E / unoccluded, _MOST), np.minimum(scattered / scattered0, _MOST)


def _transmitted(light: UnoccludedField, y: Array, z: Array, distance: Array) -> Light:
    """Fraction that gets from one depth to another along some distances (...), (..., n)."""
    thickness = light.extinction(y, z) * distance[..., None]
    return np.exp(-thickness.astype(np.float32))


class _Sides:
    """The sides of the surfaces: what light they send."""

    def __init__(self, rays: Rays, reflectance: Array, unoccluded_field: UnoccludedField) -> None:
        normal = rays.voxels.facing.reshape(-1, 3)
        of, fractions = zip(*around([*normal.T]), strict=True)
        self._patches = np.stack(of, axis=1).astype(np.intp)
        self._fractions = np.stack(fractions, axis=1).astype(np.float32)
        self._rho = (np.repeat(reflectance, 2, axis=0) / math.pi).astype(np.float32)
        facing = np.maximum(-normal @ np.asarray(unoccluded_field.sun), 0.0) * rays.side_sunlit
        depth = np.maximum(-rays.voxels.middle[..., 2].ravel(), 0.0)
        self._sun = (unoccluded_field.beam(depth) * facing[:, None]).astype(np.float32)

    def are(self, other: _Sides) -> bool:
        """Whether the sides are the same."""
        return all(np.array_equal(x, y) for x, y in zip(self._all, other._all, strict=True))

    @property
    def _all(self) -> tuple[NDArray, ...]:
        return self._patches, self._fractions, self._rho, self._sun

    def radiance(self, E: Light, beside: NDArray[np.intp]) -> Light:
        """Radiance of the sides (s, n) from irradiances (v, COUNT, n) of probes beside them."""
        around_it = E[beside[:, None], self._patches]
        return self._rho * (np.einsum("sf,sfn->sn", self._fractions, around_it) + self._sun)
