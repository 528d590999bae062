"""The light of the unoccluded water as probes see it: along their directions, at their depths."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..surface.refraction import fresnel_reflectance
from ..transfer.radiance_table import tabulate
from ..transfer.solved_field import SolvedField
from ..water.phase import PhaseFunction
from .grid import Array, Grid
from .probes import RAYS, SETS, directions, spiral
from .view_directions import NORMALS

_LEVELS = 17  # depths at which the unoccluded light is computed
_MU = 0.02  # cosine of the most level ray
_FINE = 2048  # directions for sums over the phase function
_DARK = 1e-6  # of the brightest light
_DARKEST = 1e-30  # of the mean light, that divides
_WITHIN, _NARROWEST = 512, 1e-8  # steps to the angle of a peak, and squared sine of half the first
_CAP = 1.0 - 2.0 / _FINE  # cosine of what one of them stands for

Light = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class RayLight:
    """Radiance along directions (..., r, n): scattered, sunlight scattered once, the boundary."""

    scattered: Light
    single: Light
    image: Light


def depths_of(field: SolvedField, grid: Grid) -> tuple[float, float]:
    """Return the depths in m between which the probes of a grid lie in water."""
    top = max(-float(grid.upper[2]), 0.0)
    bottom = max(-float(grid.lower[2]), top + grid.cell)
    return top, max(min(bottom, field.floor_depth), top + grid.cell / 2.0)


class UnoccludedField:
    """The unoccluded light of n bands between two depths, m, see :func:`depths_of`."""

    def __init__(self, field: SolvedField, ends: tuple[float, float]) -> None:
        self._field = field
        top, bottom = ends
        self._depths = np.linspace(top, bottom, _LEVELS)
        w = _fine()
        # Level rays are as long as the water is wide; a slight slope does as well.
        z = np.where(np.abs(w[:, 2]) < _MU, np.copysign(_MU, w[:, 2]), w[:, 2])
        scattered = tabulate(field).scattered(self._depths[:, None], [*w.T], field.sun)
        parts = (
            np.maximum(scattered, 0.0),
            self._single_scattering_along(w, z),
            self._image_along(w, z),
        )
        total = parts[0] + parts[1] + parts[2]
        # Of each direction, at all depths alike; even where there is no light left.
        mean = total.mean(axis=1, keepdims=True)
        lit = mean > np.finfo(np.float64).tiny
        bright = np.where(lit, total / np.where(lit, mean, 1.0), 1.0).mean(axis=0)
        # Where water scatters nothing, none comes from below: of that any spread will do.
        self._bright = np.maximum(bright, _DARKEST)
        self._scalar = np.maximum(4.0 * math.pi * mean[:, 0], _DARKEST)
        every = np.concatenate(parts, axis=-1).astype(np.float32)
        # What a direction stands for counts, or few of them would miss the brightest.
        every = np.moveaxis(every, 1, 0)
        self._parts = [
            np.concatenate([_means(kind, every, narrow) for kind in range(SETS)])
            for narrow in (False, True)
        ]
        self._beam = field.beam(self._depths).T * field.light.E / field.light.mu_s

    @property
    def sun(self) -> Sequence[float]:
        """Unit direction that sunlight travels to."""
        return self._field.sun

    @property
    def floor_depth(self) -> float:
        """Depth of the floor, m; infinite without one."""
        return self._field.floor_depth

    @property
    def faintest(self) -> float:
        """What counts as light at all."""
        return max(_DARK * float(self._parts[False].max()), float(np.finfo(np.float32).tiny))

    def along(
        self, y: Array, kind: int, ways: NDArray[np.intp], *, narrow: bool = False
    ) -> RayLight:
        """Light along directions (..., ) of a set at depths y, m, that fit them.

        Means over what each stands for in its set; if that is ``narrow``, in all of them.
        """
        low, fraction = self._place(y)
        which = (kind * _LEVELS + low) * RAYS + ways
        fraction = np.broadcast_to(fraction.astype(np.float32), (*which.shape, 1))
        parts = self._parts[narrow]
        found, above = parts.take(which, axis=0), parts.take(which + RAYS, axis=0)
        above -= found
        above *= fraction
        found += above
        n = found.shape[-1] // 3
        return RayLight(found[..., :n], found[..., n : 2 * n], found[..., 2 * n :])

    def mirrored(self, kind: int, *, narrow: bool = False) -> Light:
        """Fraction of the light that rises to the surface which it sends down again, (RAYS,).

        By the direction that it comes from, of waves as if they were flat.
        """
        index, up = self._field.light.index, _fine()[:, 2:]
        if index is None:
            return np.zeros(RAYS, np.float32)
        fraction = np.where(up > 0, fresnel_reflectance(np.abs(up), 1.0 / index), 0.0)
        return _means(kind, fraction[:, None], narrow)[:, 0]

    def beam(self, y: Array) -> Array:
        """Normal irradiance of the sun's beam, forward peak included, at depths (...), (..., n)."""
        return self._between(self._beam, y)

    def scalar_irradiance(self, y: Array) -> Array:
        """Scalar irradiance without the sun's beam at depths (...), (..., n)."""
        return self._between(self._scalar, y)

    def forward_scattering(self, streams: int) -> Array:
        """Rate with depth, 1/m, at which what goes straight of sunlight by ``streams`` turns, (n,).

        The mean from the surface on.
        """
        field, y = self._field, float(self._depths.mean())
        peak = field.phase_at(y).moments(streams)[-1]
        b = field.scattering_between(0.0, y)
        return b * np.maximum(peak - self._peak, 0.0) / field.light.mu_s

    @functools.cached_property
    def rate(self) -> float:
        """Half the extinction of where light is, without the forward peak, 1/m.

        Light among objects falls off less than what arrives of it, for it grows towards the open.
        """
        c = self.extinction(self._depths[:1], self._depths[-1:]).ravel()
        return 0.5 * float(np.average(c, weights=self._scalar.mean(axis=0)))

    def irradiance(self, y: Array) -> Light:
        """Irradiance without the sun's beam on patches that face :data:`NORMALS`, (m, p, n)."""
        normal = [part[:, None] for part in NORMALS.T]
        E = tabulate(self._field).patch_irradiance(self._depths, normal, self.sun)
        return self._between(np.moveaxis(E, 1, 0), y).astype(np.float32)

    def extinction(self, y: Array, z: Array) -> Array:
        """Mean extinction between depths, without the forward peak, 1/m; the last axis has n."""
        if not self._field.layered:
            return self._field.extinction
        return self._field.extinction_between(y, z, scaled=True)

    def phase_weights(self, kind: int, towards: Array, streams: int | None = None) -> Light:
        """Fraction of light along each direction of a set that is scattered against others.

        Shape (n, RAYS, q), of view directions ``towards`` (q, 3) and ``streams`` whose forward peak
        counts as unscattered. Fractions add up to 1 over the set.
        """
        cosine = _fine() @ towards.T
        phase = self._field.phase_at(float(self._depths.mean()))
        peak, caps = self._peak, [_CAP] * len(phase.components)
        if streams is not None:
            peak = np.clip(phase.moments(streams)[-1], 0.0, 0.999)
            caps = [peak_cosine(part, streams) for part in phase.components]
        s2 = 0.5 - 0.5 * np.minimum(cosine, _CAP)
        sums = [
            _summed(kind, np.where(cosine < cap, part.per_steradian(s2), 0.0))
            for part, cap in zip(phase.components, caps, strict=True)
        ]
        fractions = np.asarray(phase.weights) / (1.0 - peak)
        weights = np.einsum("kn,krq->nrq", fractions, sums) * (4.0 * math.pi / _FINE)
        # What is left has hardly turned.
        straight = (directions()[kind] @ towards.T).argmax(axis=0)
        left = 1.0 - weights.sum(axis=1)
        weights[:, straight, np.arange(len(towards))] += np.maximum(left, 0.0)
        return (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)

    def patch_weights(self, kind: int, *, narrow: bool = False) -> tuple[Light, Light]:
        """Irradiance on patches that face :data:`NORMALS` per radiance along directions of a set.

        Of light that is spread as the unoccluded is within what a direction stands for, (n, RAYS,
        p), and of light that is the same throughout, (RAYS, p). If that is ``narrow``, the mean of
        all sets is an irradiance, not that of each.
        """
        cosine = np.maximum(_fine() @ NORMALS.T, 0.0)
        bright = self._bright[:, None, :]
        count = _count(kind, narrow)
        sums = _summed(kind, bright * cosine[..., None], narrow)
        spread = sums / np.maximum(_summed(kind, bright, narrow), _DARKEST)
        fraction = 4.0 * math.pi / _FINE * (SETS if narrow else 1)
        spread *= fraction * count
        return np.moveaxis(spread, 2, 0).astype(np.float32), (
            fraction * _summed(kind, cosine, narrow)
        ).astype(np.float32)

    @functools.cached_property
    def _peak(self) -> Array:
        """Fraction of the scattering that the forward peak is, shape (n,)."""
        return np.clip(self._field.peak_at(float(self._depths.mean())), 0.0, 0.999)

    def _single_scattering_along(self, w: Array, z: Array) -> Array:
        """Sunlight scattered once, the peak counted as unscattered, (levels, r, n)."""
        field = self._field
        s2 = np.clip((w + np.asarray(field.sun)) ** 2 @ np.ones(3) / 4.0, 0.5 - 0.5 * _CAP, 1.0)
        single = field.single_scattering_on_grid(self._depths, z)
        p = np.array([part.per_steradian(s2) for part in field.components])
        return np.einsum("kndr,kr->drn", single, p)

    def _image_along(self, w: Array, z: Array) -> Array:
        """Light of the surface and of the floor, (levels, r, n)."""
        field, up = self._field, w[:, 2] > 0
        image = tabulate(field).boundary_image([*w.T], field.sun)
        ends = np.where(up, 0.0, min(field.floor_depth, 1e6))
        c = field.extinction_between(self._depths[:, None], ends, scaled=True)
        P = np.abs(self._depths[:, None] - ends) / np.abs(z)
        return image * np.exp(-c * P[..., None])

    def _between(self, values: Array, y: Array) -> Array:
        """Values at the levels, (levels, ...), at depths between them."""
        low, fraction = self._place(y)
        fraction = fraction.reshape(*low.shape, *[1] * (values.ndim - 1))
        return values[low] * (1 - fraction) + values[low + 1] * fraction

    def _place(self, y: Array) -> tuple[NDArray[np.intp], Array]:
        first, step = self._depths[0], self._depths[1] - self._depths[0]
        at = np.clip((y - first) / step, 0.0, _LEVELS - 1.0)
        low = np.minimum(at.astype(np.intp), _LEVELS - 2)
        return low, (at - low)[..., None]


@functools.lru_cache(maxsize=16)
def peak_cosine(part: PhaseFunction, streams: int) -> float:
    """Cosine of the angle within which a phase function has the forward peak of streams."""
    s2 = np.concatenate([[0.0], np.geomspace(_NARROWEST, 1.0, _WITHIN)])
    p = part.per_steradian(np.maximum(s2, _NARROWEST / 2.0))
    within = np.concatenate([[0.0], (2.0 * math.pi * np.diff(s2) * (p[1:] + p[:-1])).cumsum()])
    peak = max(float(part.moments(streams)[-1]), 0.0)
    return min(1.0 - 2.0 * float(np.interp(peak, within, s2)), _CAP)


@functools.lru_cache(maxsize=1)
def _fine() -> Array:
    """Many directions."""
    return spiral(_FINE)


@functools.lru_cache(maxsize=2 * SETS)
def _groups(kind: int, narrow: bool) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Many directions by the one of a set that is closest, each's first, and how many it has.

    If that is narrow, closest of all sets': of a few there are none.
    """
    ways = directions() if narrow else directions()[kind : kind + 1]
    nearest = (_fine() @ ways.reshape(-1, 3).T).argmax(axis=1) - RAYS * kind * narrow
    order = np.argsort(nearest, kind="stable")
    order = order[(nearest[order] >= 0) & (nearest[order] < RAYS)]
    first = np.searchsorted(nearest[order], np.arange(RAYS))
    count = np.bincount(nearest[order], minlength=RAYS).astype(np.float64)
    return order, np.minimum(first, len(order) - 1), count


def _summed(kind: int, values: NDArray[np.floating], narrow: bool = False) -> Array:
    """Sums of values of many directions (:data:`_FINE`, ...) by those of a set, (RAYS, ...)."""
    order, first, _ = _groups(kind, narrow)
    found = np.add.reduceat(values[order], first, axis=0)
    return found * (_count(kind, narrow) > 0).reshape(-1, *(1,) * (found.ndim - 1))


def _means(kind: int, values: NDArray[np.floating], narrow: bool) -> Light:
    """Means of values of many directions (:data:`_FINE`, l, n), (l RAYS, n)."""
    found = _summed(kind, values, narrow) / np.maximum(_count(kind, narrow), 1.0)
    return np.moveaxis(found, 1, 0).reshape(-1, values.shape[-1]).astype(np.float32)


def _count(kind: int, narrow: bool = False) -> Array:
    """How many belong to each of a set, (RAYS, 1, 1)."""
    return _groups(kind, narrow)[2][:, None, None]
