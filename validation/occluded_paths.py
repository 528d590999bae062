"""Light about a box in water over a matt floor, by paths from where it arrives.

Independent of the probes: the box is exact, directions are not sorted, and nothing but the sun's
forward peak counts as unscattered. The water does not differ with depth, and the surface is flat.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.occlusion.unoccluded_field import peak_cosine
from ..uw_spectral.surface.refraction import fresnel_reflectance
from ..uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, TABLE_STREAMS
from ..uw_spectral.transfer.solved_field import SolvedField

_ANGLES, _LEAST = 4000, 1e-7  # squared sines of half an angle of a phase function
_MOST_EVENTS, _FAINT, _GONE = 200, 0.3, 1e-6
_OFF = 1e-6  # m from a surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BoxScene:
    """A box, from its lower corner to its upper one, over a floor at a height z, m."""

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    floor: float = -1e4
    reflectance: float = 0.0  #: Of the box.
    floor_reflectance: float = 0.0


class OccludedPaths:
    """Light of one band of a field's water, with a box or without one."""

    def __init__(self, field: SolvedField, band: int, scene: BoxScene, *, empty: bool) -> None:
        self._field, self._band, self._scene = field, band, scene
        self._empty, self._random = empty, np.random.default_rng(1)
        self._c = float(field.extinction[band])
        b = float(field.scattering_at([1.0])[0, band] * (1.0 - field.peak_at(1.0)[band]))
        self._albedo = b / self._c
        self._to_sun, self._E = -np.asarray(field.sun), float(field.light.E[band])
        self._phase = _Peakless(field, band, TABLE_STREAMS)

    def radiance(self, x: Array, w: Array) -> Array:
        """Radiance along unit vectors (m, 3) from places (m, 3), the sun's beam apart, (m,)."""
        found, left, which = np.zeros(len(x)), np.ones(len(x)), np.arange(len(x))
        for event in range(_MOST_EVENTS):
            ends, side = self._ends(x, w)
            kind = ends.argmin(axis=0)
            x, new = x + w * ends.min(axis=0)[:, None], w.copy()
            out = np.zeros(len(x), bool)
            for place, meet in enumerate((self._scatter, self._surface, self._floor, self._box)):
                here = np.flatnonzero(kind == place)
                light, left[here], new[here], x[here], out[here] = meet(
                    x[here], w[here], left[here], side[here]
                )
                found[which[here]] += light
            if event > 3:
                chance = np.clip(left / _FAINT, 0.05, 1.0)
                out |= self._random.random(len(left)) > chance
                left = left / chance
            on = ~out & (left > _GONE)
            x, w, left, which = x[on], new[on], left[on], which[on]
            if not len(which):
                break
        return found

    def irradiance(self, x: Array, count: int) -> float:
        """Mean irradiance on level patches at places (m, 3), without the beam."""
        x = np.repeat(x, count, axis=0)
        up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
        return float(np.pi * self.radiance(x, self._matt(up)).mean())

    def source(self, x: Array, w: Array, count: int) -> float:
        """Radiance that is scattered against w at x, but for what hardly turns."""
        phase = _Peakless(self._field, self._band, OCCLUSION_STREAMS)
        ways = phase.turned(np.tile(w, (count, 1)), self._random)
        return float(self.radiance(np.tile(x, (count, 1)), ways).mean())

    def _ends(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distances to what is met: water, surface, floor, box, (4, m); normals of the box."""
        with np.errstate(divide="ignore"):
            level = np.stack([-x[:, 2], self._scene.floor - x[:, 2]]) / w[:, 2]
            sides = np.stack([np.subtract(end, x) / w for end in self._corners])
        level[level <= 0] = np.inf
        near, far = sides.min(axis=0), sides.max(axis=0)
        axis, t = near.argmax(axis=1), near.max(axis=1)
        missed = self._empty | (t <= 0) | (far.min(axis=1) <= t)
        normal = -np.sign(w) * (np.arange(3) == axis[:, None])
        free = -np.log(1.0 - self._random.random(len(x))) / self._c
        return np.stack([free, *level, np.where(missed, np.inf, t)]), normal

    @property
    def _corners(self) -> tuple[tuple[float, ...], ...]:
        return self._scene.lower, self._scene.upper

    def _scatter(self, x: Array, w: Array, left: Array, _: Array) -> tuple[Array, ...]:
        left = left * self._albedo
        light = left * self._beam(x) * self._phase(0.5 - 0.5 * w @ self._to_sun)
        return light, left, self._phase.turned(w, self._random), x, np.zeros(len(x), bool)

    def _surface(self, x: Array, w: Array, left: Array, _: Array) -> tuple[Array, ...]:
        # Without a surface all goes through.
        n, sky = self._field.light.index or 1.0, self._field.light.sky
        mirrored = self._random.random(len(x)) < fresnel_reflectance(w[:, 2], 1.0 / n)
        L = np.nan_to_num(np.asarray(sky.seen_through([*w.T[..., None]], n)))[:, self._band]
        light = np.where(mirrored, 0.0, left * L * n**2)
        return light, left, w * (1.0, 1.0, -1.0), x - (0.0, 0.0, _OFF), ~mirrored

    def _floor(self, x: Array, w: Array, left: Array, _: Array) -> tuple[Array, ...]:
        return self._reflect(x, np.tile([0.0, 0.0, 1.0], (len(w), 1)), left, floor=True)

    def _box(self, x: Array, _: Array, left: Array, normal: Array) -> tuple[Array, ...]:
        return self._reflect(x, normal, left, floor=False)

    def _reflect(self, x: Array, normal: Array, left: Array, *, floor: bool) -> tuple[Array, ...]:
        rho = self._scene.floor_reflectance if floor else self._scene.reflectance
        x, left = x + normal * _OFF, left * rho
        light = left * self._beam(x) * np.maximum(normal @ self._to_sun, 0.0) / np.pi
        return light, left, self._matt(normal), x, np.full(len(x), rho == 0.0)

    def _matt(self, normal: Array) -> Array:
        cosine = np.sqrt(self._random.random(len(normal)))
        return _turned(normal, 0.5 - 0.5 * cosine, self._random)

    def _beam(self, x: Array) -> Array:
        """Normal irradiance of the sun, (m,)."""
        hidden = np.isfinite(self._ends(x, np.tile(self._to_sun, (len(x), 1)))[0][3])
        mu = self._field.light.mu_s
        return np.where(hidden, 0.0, self._E / mu * np.exp(self._c * x[:, 2] / mu))


class _Peakless:
    """The phase function of a band without the forward peak of so many streams."""

    def __init__(self, field: SolvedField, band: int, streams: int) -> None:
        phase = field.phase_at(1.0)
        self._parts = [
            (weight, part, 0.5 - 0.5 * peak_cosine(part, streams))
            for weight, part in zip(phase.weights[:, band], phase.components, strict=True)
        ]
        self._s2 = np.concatenate([[0.0], np.geomspace(_LEAST, 1.0, _ANGLES)])
        self._size = 1.0
        middle = (self._s2[1:] + self._s2[:-1]) / 2.0
        share = (4.0 * np.pi * self(middle) * np.diff(self._s2)).cumsum()
        self._cumulated, self._size = np.concatenate([[0.0], share / share[-1]]), share[-1]

    def __call__(self, s2: Array) -> Array:
        s2 = np.clip(s2, _LEAST, 1.0)
        parts = (
            weight * np.where(s2 > least, part.per_steradian(s2), 0.0)
            for weight, part, least in self._parts
        )
        return np.sum(list(parts), axis=0) / self._size

    def turned(self, w: Array, random: np.random.Generator) -> Array:
        s2 = np.interp(random.random(len(w)), self._cumulated, self._s2)
        return _turned(w, s2, random)


def _turned(w: Array, s2: Array, random: np.random.Generator) -> Array:
    """Unit vectors (m, 3) turned by angles, whose halves have squared sines, any way round."""
    side = np.cross(w, np.eye(3)[np.abs(w).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    around = 2.0 * np.pi * random.random((len(w), 1))
    across = np.cos(around) * side + np.sin(around) * np.cross(w, side)
    sine = 2.0 * np.sqrt(np.maximum(s2 * (1.0 - s2), 0.0))
    return (1.0 - 2.0 * s2)[:, None] * w + sine[:, None] * across
