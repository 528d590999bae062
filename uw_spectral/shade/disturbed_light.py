"""Light of the water with things in it, over that of the water without them.

At each probe the light from all sides is what the path to the first surface brings and
what that surface sends, both from the light that the probes have found before; where nothing
is met, the undisturbed light of beyond the box. Repeated, light that the water scatters
and light that surfaces reflect comes round corners, more than once. The direct sun keeps its
own shadows; the light that its forward peak scatters goes with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..transfer.solved_field import SolvedField
from .grid import Array, Grid
from .probes import RAYS, SETS, Rays, directions, set_of
from .undisturbed_light import AXES, UndisturbedLight

_ROUNDS = 6
_ON_WAY = ((0.1127, 5 / 18), (0.5, 8 / 18), (0.8873, 5 / 18))
"""Places along a ray where the light is looked at, and their weights: Gauss's."""
_FLOOR_CELLS = 1.0  # from the floor within which what is met beyond the box is the floor
_MEAN_COSINE = 0.25  # of a beam on surfaces of all slopes, their dark sides too
_MOST = 1e3  # times the undisturbed light; what a white wall sends into the dark has no bound
_DARK = 1e-6  # of the brightest direction's light: what counts as light at all

Light = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class DisturbedLight:
    """Light at probes over the undisturbed light, of n bands.

    Attributes
    ----------
    grid : Grid
        Of the p probes.
    irradiance : array, shape (p, 6, n)
        Ratio of the irradiance, without the beam of the sun, on patches that face
        :data:`.AXES`.
    scattered : array, shape (p, 6, n)
        Ratio of the light, without the beam, that the water scatters against view directions
        along them.
    sunlit : array, shape (p,)
        Share of the sun's beam.
    behind : array, shape (p, 6)
        Share of what lies behind patches that is open water, by the cosine.
    weight : array, shape (2, 6)
        Mean undisturbed irradiance and scattered light of each of them, over the sum of the six.
    """

    grid: Grid
    irradiance: Light
    scattered: Light
    sunlit: Array
    behind: Array
    weight: Array


def disturbed_light(field: SolvedField, rays: Rays, reflectance: Array) -> DisturbedLight:
    """Compute the light at the probes.

    Parameters
    ----------
    field : SolvedField
        Of the undisturbed water, n bands.
    rays : Rays
        What the probes see.
    reflectance : array, shape (k, n)
        Of each surface.
    """
    undisturbed, valid = UndisturbedLight(field, rays.grid), np.flatnonzero(rays.valid)
    kind, place = set_of(rays.grid)[valid], _places(rays, valid)
    kernels = _Kernels(undisturbed, [np.flatnonzero(kind == k) for k in range(SETS)])
    paths = _paths(undisturbed, rays, valid, kind, place)
    unshaded, source = kernels.irradiance(paths.before), kernels.all_ways(paths.before)
    unshaded, source = np.maximum(unshaded, _tiny(unshaded)), np.maximum(source, _tiny(source))
    # A sum over few directions is not an irradiance; over another such sum it is.
    exact = undisturbed.irradiance(np.maximum(-rays.point[valid, 2], 0.0)) / unshaded
    sides, side_place = _Sides(rays, reflectance, undisturbed), place[rays.probe_of_side]
    mean_reflectance = (reflectance.sum(axis=0) / max(len(reflectance), 1)).astype(np.float32)
    hit = rays.hit[valid]
    met = hit >= 0
    # Probes on the way have other directions; the closest stands for the ray's.
    along = [kernels.nearest[kind[p], kind[:, None], np.arange(RAYS)] for p in paths.on_way]
    L = paths.known + paths.scattered + paths.further
    for _ in range(_ROUNDS):
        E = (kernels.irradiance(L) * exact).astype(np.float32)
        J = np.minimum(kernels.all_ways(L) / source, _MOST)
        # What lies beyond the box is lit as its side is.
        sent = (E.mean(axis=1) + paths.beam) * (mean_reflectance / math.pi)
        L = paths.known.copy()
        for probe, ray, (_, weight) in zip(paths.on_way, along, _ON_WAY, strict=True):
            L += np.float32(weight) * paths.scattered * J[probe, ray]
        L += paths.further * J[paths.on_way[-1], along[-1]]
        L += paths.to_further * sent[paths.on_way[-1]]
        L[met] += paths.transmittance[met] * sides.radiance(E[side_place])[hit[met]]
    scattered0 = kernels.along_axes(paths.before)
    scattered0 = np.maximum(scattered0, _tiny(scattered0))
    everywhere = place[rays.nearest(rays.grid.centres())]
    ratios = kernels.irradiance(L) / unshaded, kernels.along_axes(L) / scattered0
    irradiance, scattered = (np.minimum(x, _MOST)[everywhere] for x in ratios)
    mean = np.stack([x.mean(axis=(0, 2)) for x in (unshaded, scattered0)]).astype(np.float64)
    return DisturbedLight(
        rays.grid, irradiance, scattered, rays.sunlit[valid][everywhere],
        kernels.behind(rays.open_water[valid])[everywhere], mean / mean.sum(axis=1, keepdims=True),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Paths:
    """The rays of v probes, with what the light of other probes does not change.

    Attributes
    ----------
    before : array, shape (v, RAYS, n)
        Undisturbed radiance.
    known : array, shape (v, RAYS, n)
        Sunlight scattered once on the way, shadows and all, and what comes from where rays are
        not followed.
    scattered : array, shape (v, RAYS, n)
        Other undisturbed light of the way.
    further : array, shape (v, RAYS, n)
        The same beyond the box.
    transmittance : array, shape (v, RAYS, n)
    to_further : array, shape (v, RAYS, n)
        That up to surfaces beyond the box; 0 for none.
    beam : array, shape (v, n)
        Irradiance of the sun's beam at the probe, mean over surfaces of all slopes.
    on_way : sequence of array of int, shape (v, RAYS)
        Probes at the places of :data:`_ON_WAY`.
    """

    before: Light
    known: Light
    scattered: Light
    further: Light
    transmittance: Light
    to_further: Light
    beam: Light
    on_way: Sequence[NDArray[np.intp]]


def _paths(
    undisturbed: UndisturbedLight,
    rays: Rays,
    valid: NDArray[np.intp],
    kind: NDArray[np.intp],
    place: NDArray[np.intp],
) -> _Paths:
    w, distance, hit = directions()[kind], rays.distance[valid], rays.hit[valid]
    point, sunlit = rays.point[valid], rays.sunlit[valid].astype(np.float32)
    depth = np.maximum(-point[:, 2:], 0.0)
    end_depth = np.maximum(depth - distance * w[..., 2], 0.0)
    thickness = undisturbed.extinction(depth, end_depth) * distance[..., None]
    T = np.exp(-thickness).astype(np.float32)
    at, end = undisturbed.along(depth, kind), undisturbed.along(end_depth, kind)
    on_way = [
        place[rays.nearest_in_sight(point[:, None] + w * (t * distance)[..., None], valid[:, None])]
        for t, _ in _ON_WAY
    ]
    lit = np.zeros(distance.shape, np.float32)
    for probes, (_, weight) in zip(on_way, _ON_WAY, strict=True):
        lit += np.float32(weight) * sunlit[probes]
    known = np.maximum(at.once - T * end.once, 0.0) * lit[..., None]
    scattered = np.maximum(at.scattered - T * end.scattered, 0.0)
    # Beyond the box shade is as at its side.
    leaves, far, border = (hit < 0)[..., None], rays.further[valid], on_way[-1]
    last_depth = np.maximum(end_depth - far * w[..., 2], 0.0)
    thickness = undisturbed.extinction(end_depth, last_depth) * far[..., None]
    T2, last = np.exp(-thickness).astype(np.float32), undisturbed.along(last_depth, kind)
    T_out = T * leaves
    further = T_out * np.maximum(end.scattered - T2 * last.scattered, 0.0)
    known += T_out * np.maximum(end.once - T2 * last.once, 0.0) * sunlit[border][..., None]
    # The floor of the undisturbed water is part of its light.
    on_floor = last_depth > undisturbed.floor_depth - _FLOOR_CELLS * rays.grid.cell
    blocked = (rays.blocked[valid] & ~(on_floor & (far > 0)))[..., None]
    known += T_out * T2 * (last.scattered + last.once + last.image) * ~blocked
    before = at.scattered + at.once + at.image
    beam = undisturbed.beam(depth[:, 0]) * (_MEAN_COSINE * rays.sunlit[valid][:, None])
    return _Paths(
        before, known, scattered, further, T, T_out * T2 * blocked, beam.astype(np.float32), on_way
    )


class _Kernels:
    """Sums over the directions of probes, those of each set apart."""

    def __init__(self, undisturbed: UndisturbedLight, members: list[NDArray[np.intp]]) -> None:
        w = directions()
        self._members = members
        facing = [np.maximum(AXES @ ways.T, 0.0) for ways in w]
        self._patches = [(f * (4.0 * math.pi / RAYS)).astype(np.float32) for f in facing]
        behind = [np.maximum(-AXES @ ways.T, 0.0) for ways in w]
        self._behind = [b / b.sum(axis=1, keepdims=True) for b in behind]
        self._phases = [undisturbed.phase_weights(k, w[k]) for k in range(SETS)]
        self._axes = [undisturbed.phase_weights(k, AXES) for k in range(SETS)]
        turned = np.einsum("kax,lbx->klab", w, w)
        self.nearest = np.swapaxes(turned, 2, 3).argmax(axis=3)
        """Of set k, the direction closest to each of set l, (k, l, RAYS)."""

    def irradiance(self, L: Light) -> Light:
        """On patches that face the axes, (p, 6, n)."""
        return self._each(L, 6, lambda k, light: np.matmul(self._patches[k], light))

    def behind(self, free: NDArray[np.bool_]) -> Array:
        """Share of what patches that face the axes have behind them that is free, (p, 6)."""
        found = np.empty((len(free), 6))
        for k, rows in enumerate(self._members):
            found[rows] = free[rows] @ self._behind[k].T
        return found

    def all_ways(self, L: Light) -> Light:
        """Light scattered against each direction of the probe, (p, RAYS, n)."""
        return self._each(L, RAYS, lambda k, light: _scatter(self._phases[k], light))

    def along_axes(self, L: Light) -> Light:
        """The same against the axes, (p, 6, n)."""
        return self._each(L, 6, lambda k, light: _scatter(self._axes[k], light))

    def _each(self, L: Light, count: int, sums: Callable[[int, Light], Light]) -> Light:
        found = np.empty((len(L), count, L.shape[-1]), np.float32)
        for k, rows in enumerate(self._members):
            found[rows] = sums(k, L[rows])
        return found


def _scatter(weights: Light, L: Light) -> Light:
    """Sum over directions r of light (p, r, n) by weights (n, r, q), shape (p, q, n)."""
    return np.stack([L[..., b] @ weights[b] for b in range(L.shape[-1])], axis=-1)


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


def _places(rays: Rays, valid: NDArray[np.intp]) -> NDArray[np.intp]:
    """Of each valid probe its place among the valid ones."""
    place = np.zeros(rays.grid.count, np.intp)
    place[valid] = np.arange(len(valid))
    return place


def _tiny(L: Light) -> float:
    return max(_DARK * float(L.max(initial=0.0)), float(np.finfo(np.float32).tiny))
