"""The sky above the water: its radiance by direction, per band."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..surface.refraction import fresnel_reflectance

# a, b, c, d, e of the standard general sky, CIE S 011 (ISO 15469:2004), by name.
_CIE_SKIES = {
    "uniform": (0.0, -1.0, 0.0, -1.0, 0.0),
    "overcast": (4.0, -0.70, 0.0, -1.0, 0.0),
    "clear": (-1.0, -0.32, 10.0, -3.0, 0.45),
}
SKIES = tuple(_CIE_SKIES)
"""Distributions of the sky's radiance: CIE types 5 (uniform), 1 (overcast), 12 (clear)."""

_AZIMUTHS = 64
_LOWEST = 0.02  # cosine of the zenith angle below which the horizon's radiance is held


@dataclass(frozen=True, eq=False)
class Sky:
    """Radiance of the sky in air; make it with :meth:`standard`.

    Parameters
    ----------
    level : array, shape (n,)
        Factor per band on the relative distribution.
    shape : tuple of five floats
        a to e of the CIE standard general sky.
    sun_cosine : float
        Cosine of the sun's zenith angle in air.
    """

    level: NDArray[np.float64]
    shape: tuple[float, float, float, float, float]
    sun_cosine: float

    @classmethod
    def dark(cls, bands: int) -> Sky:
        """Return a black sky."""
        return cls(np.zeros(bands), _CIE_SKIES["uniform"], 1.0)

    @classmethod
    def standard(cls, kind: str, irradiance: ArrayLike, sun_zenith: float = 0.0) -> Sky:
        """Return a sky of one of the CIE's distributions that brings an irradiance.

        Parameters
        ----------
        kind : {"uniform", "overcast", "clear"}
        irradiance : array_like, shape (n,)
            Horizontal irradiance of the sky, in air.
        sun_zenith : float
            Zenith angle of the sun in air, degrees; the clear sky is brighter around it.

        Raises
        ------
        InputError
            If the kind is unknown or the irradiance negative or not finite.

        References
        ----------
        CIE S 011/E:2003, Spatial distribution of daylight: CIE standard general sky.

        Examples
        --------
        >>> sky = Sky.standard("uniform", [1.0])
        >>> sky.radiance(np.array([0.5]), np.array([0.0])).round(4)
        array([[0.3183]])
        """
        if kind not in _CIE_SKIES:
            raise unknown_name("kind of sky", kind, SKIES)
        E = np.atleast_1d(np.asarray(irradiance, dtype=np.float64))
        if not np.all(np.isfinite(E) & (E >= 0)):
            raise InputError("irradiance of the sky must be finite and not negative")
        sky = cls(np.ones(1), _CIE_SKIES[kind], math.cos(math.radians(sun_zenith)))
        nodes, weights = np.polynomial.legendre.leggauss(64)
        cosine, turn = (nodes + 1) / 2, 2 * math.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS
        L = sky.radiance(*np.broadcast_arrays(cosine[:, None], turn))[..., 0].mean(axis=1)
        total = 2 * math.pi * float(weights / 2 @ (L * cosine))
        return cls(E / total, sky.shape, sky.sun_cosine)

    def radiance(self, cosine: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray:
        """Radiance of light that comes down at a zenith angle, shape (..., n).

        Parameters
        ----------
        cosine : array
            Of the zenith angle in air, 0 to 1.
        turn : array
            Azimuth between the travel of this light and of the sun's, rad.
        """
        a, b, c, d, e = self.shape
        cosine = np.clip(cosine, _LOWEST, 1.0)
        across = np.sqrt(1.0 - cosine**2) * math.sqrt(1.0 - self.sun_cosine**2)
        from_sun = np.clip(cosine * self.sun_cosine + across * np.cos(turn), -1.0, 1.0)
        angle = np.arccos(from_sun)
        indicatrix = 1.0 + c * (np.exp(d * angle) - math.exp(d * math.pi / 2)) + e * from_sun**2
        relative = indicatrix * (1.0 + a * np.exp(b / cosine))
        return relative[..., None] * self.level

    def modes(
        self, mu: NDArray[np.float64], modes: int, refractive_index: float | None
    ) -> NDArray[np.float64]:
        """Cosine terms in azimuth of the radiance just below a flat surface.

        Parameters
        ----------
        mu : array, shape (q,)
            Cosines of travel in the water, positive.
        modes : int
        refractive_index : float or None
            Of the water against air; None for a surface that lets all light through.

        Returns
        -------
        array, shape (modes, n, q)
        """
        enters, in_air = np.ones_like(mu), mu
        if refractive_index is not None:
            square = 1.0 - refractive_index**2 * (1.0 - mu**2)
            in_air = np.sqrt(np.maximum(square, 0.0))
            reflected = fresnel_reflectance(mu, 1.0 / refractive_index)
            enters = np.where(square > 0, (1.0 - reflected) * refractive_index**2, 0.0)
        turn = 2 * math.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS
        L = self.radiance(*np.broadcast_arrays(in_air[:, None], turn))
        waves = np.cos(np.arange(modes)[:, None] * turn) * 2.0 / _AZIMUTHS
        waves[0] /= 2.0
        return np.einsum("mt,qtn->mnq", waves, L) * enters
