"""The sky above the water: its radiance by direction, per band."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..surface.refraction import direction_in_air, fresnel_reflectance
from .radiance_field import surface_normal
from .rough_surface import WaterSurface

UNIFORM, OVERCAST, CLEAR = "uniform", "overcast", "clear"
PICTURE = "picture"
"""What is none of them, but a picture."""
# a, b, c, d, e of the standard general sky, CIE S 011 (ISO 15469:2004), by name.
_CIE_SKIES = {
    UNIFORM: (0.0, -1.0, 0.0, -1.0, 0.0),
    OVERCAST: (4.0, -0.70, 0.0, -1.0, 0.0),
    CLEAR: (-1.0, -0.32, 10.0, -3.0, 0.45),
}
SKIES = tuple(_CIE_SKIES)
"""Distributions of the sky's radiance: CIE types 5 (uniform), 1 (overcast), 12 (clear)."""

_ELEVATIONS, _AZIMUTHS = 64, 64
_NODES, _RING_WEIGHTS = np.polynomial.legendre.leggauss(_ELEVATIONS)
RINGS = tuple(((_NODES + 1.0) / 2.0).tolist())
"""Cosines of zenith angles that stand for the sky."""
_LOWEST = 0.02  # cosine of the zenith angle below which the horizon's radiance is held
_LEVEL_SURFACE = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Sky:
    """Radiance of the sky in air; :meth:`standard` makes one of a known irradiance."""

    #: Factor per band on the relative distribution; the radiance of a uniform sky, (n,).
    level: Operand = 0.0
    kind: str = UNIFORM  #: One of :data:`SKIES`.
    #: Unit direction that sunlight travels to in air, z up; the clear sky is brighter around the
    #: sun.
    sun: Sequence[Operand] = (0.0, 0.0, -1.0)

    @classmethod
    def standard(
        cls, kind: str, irradiance: ArrayLike, sun: Sequence[float] = (0.0, 0.0, -1.0)
    ) -> Sky:
        """Return one of the CIE's skies that brings an irradiance in air, (n,), on a level plane.

        ``sun`` is the unit direction that sunlight travels to in air, z up.

        CIE S 011/E:2003, Spatial distribution of daylight: CIE standard general sky.

        Raises
        ------
        InputError
            If the kind is unknown or the irradiance negative or not finite.
        """
        if kind not in _CIE_SKIES:
            raise unknown_name("kind of sky", kind, SKIES)
        E = np.atleast_1d(np.asarray(irradiance, dtype=np.float64))
        if not np.all(np.isfinite(E) & (E >= 0)):
            raise InputError("irradiance of the sky must be finite and not negative")
        sky = cls(kind=kind, sun=sun)
        return replace(sky, level=E / sky._rings()[1].sum())

    def radiance(self, v: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance in air of the sky that is seen along a unit vector v, z up.

        Arrays have a last axis of 1. Below the horizon the sky is that of the horizon.
        """
        return self._relative(v, m) * self.level

    def _relative(self, v: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance per level, by the CIE's formula."""
        a, b, c, d, e = _CIE_SKIES[self.kind]
        relative = 1.0 + 0.0 * v[2]
        if a:
            relative = relative + a * m.exp(b / m.maximum(v[2], _LOWEST))
        if c:
            cosine = m.clamp(-dot(v, self.sun), -1.0, 1.0)
            near_sun = m.exp(d * m.arccos(cosine)) - math.exp(d * math.pi / 2)
            relative = relative * (1.0 + c * near_sun + e * cosine * cosine)
        return relative

    def is_even_about(self, azimuth: float) -> bool:
        """Whether the sky is the same to both sides of an azimuth that sunlight travels to, rad."""
        if self.kind != CLEAR:
            return True
        x, y = float(self.sun[0]), float(self.sun[1])
        return math.hypot(x, y) - (x * math.cos(azimuth) + y * math.sin(azimuth)) < 1e-6

    def as_even(self) -> Sky:
        """Return what the solved field has of it: the same to both sides of the sun's azimuth."""
        return self

    def seen_through(
        self,
        w: Sequence[Operand],
        relative_index: Operand,
        m: Mathematics = NUMPY,
        slopes: tuple[Operand, Operand] | None = None,
    ) -> Operand:
        """Radiance in air of the sky where a view ray along w, z > 0, leaves the water.

        ``slopes`` are those of the surface along x and y there; flat without.
        """
        if self.kind != UNIFORM:
            normal = _LEVEL_SURFACE if slopes is None else surface_normal(*slopes, m)
            w = direction_in_air(w, normal, relative_index, m)
        return self.radiance(w, m)

    def transmittance(self, surface: WaterSurface) -> float:
        """Fraction of the sky's irradiance that a surface lets through."""
        cosine, E = self._rings()
        return float(E @ (1.0 - surface.reflectance(cosine)) / E.sum())

    def modes(
        self, mu: NDArray[np.float64], modes: int, refractive_index: float | None
    ) -> NDArray[np.float64]:
        """Cosine terms in azimuth of the radiance just below a flat surface, (modes, n, q).

        ``mu`` (q,) are cosines of travel in the water, positive. Without an index the surface lets
        all light through.
        """
        enters, in_air = np.ones_like(mu), mu
        if refractive_index is not None:
            square = 1.0 - refractive_index**2 * (1.0 - mu**2)
            in_air = np.sqrt(np.maximum(square, 0.0))
            reflected = fresnel_reflectance(mu, 1.0 / refractive_index)
            enters = np.where(square > 0, (1.0 - reflected) * refractive_index**2, 0.0)
        return self._modes(in_air, modes, enters)

    def modes_in_air(self, modes: int) -> NDArray[np.float64]:
        """Cosine terms of the radiance in air around the cosines :data:`RINGS`, (modes, n, k)."""
        return self._modes(np.array(RINGS), modes, 1.0)

    def _modes(
        self, in_air: NDArray[np.float64], modes: int, factor: NDArray[np.float64] | float
    ) -> NDArray[np.float64]:
        turn = _turns()
        waves = np.cos(np.arange(modes)[:, None] * turn) * 2.0 / _AZIMUTHS
        waves[0] /= 2.0
        relative = waves @ self._around(in_air).T * factor
        return relative[:, None] * np.atleast_1d(self.level)[:, None]

    def _around(self, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
        """Radiance per level of light that travels at angles from the sun's, shape (q, t)."""
        azimuth = _turns() + math.atan2(self.sun[1], self.sun[0])
        up = cosine[:, None]
        across = -np.sqrt(1.0 - up**2)
        return self._relative(
            np.broadcast_arrays(across * np.cos(azimuth), across * np.sin(azimuth), up)
        )

    def _rings(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Cosines of zenith angles, and the irradiance per level from around each."""
        cosine = np.array(RINGS)
        return cosine, math.pi * _RING_WEIGHTS * cosine * self._around(cosine).mean(axis=1)


BLACK = Sky()
"""No sky."""


def _turns() -> NDArray[np.float64]:
    return 2.0 * math.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS
