"""What waves do to light on average: reflection and transmission by a surface of facets.

The surface is a crowd of small mirrors whose slopes are normal and the same to all sides
(C. Cox & W. Munk, J. Opt. Soc. Am. 44, 838 (1954)); each reflects and refracts by Fresnel
and Snell. A ray meets facets in proportion to the area that they turn to it, and none that
turns away: so many as the mean surface has area, which is the masking of B. G. Smith, IEEE
Trans. Antennas Propag. 15, 668 (1967). What a facet sends towards other waves meets them once more.

The mean surface is seen from below along upward directions, or from above, mirrored, alike:
``cosine`` is that of the ray with the vertical.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import constant
from ..surface.refraction import direction_in_air, fresnel_reflectance
from .radiance_field import surface_normal, tilted_mirror

_STEEPEST = 3.3  # slope over its root mean square beyond which there is 2e-5 of the surface
_RINGS, _AROUND = 24, 64  # slopes of the facets: sizes and azimuths
_COSINES = 48  # of beams in air
_BALANCE = 1000  # steps at most until what comes is what goes
_EVEN = 1e-12
_OVERHEAD = 1e-12  # horizontal component of a beam that has no azimuth
_FLATTEST = 0.05  # cosine of light that enters

Array = NDArray[np.float64]


def facet_slopes(slope_variance: float, rings: int, around: int) -> tuple[Array, Array, Array]:
    """Return slopes along x and y of facets and their fractions of the surface, (rings * around,).

    ``slope_variance`` is of both axes together; azimuths lie to both sides of the x axis alike.
    """
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    size = _STEEPEST * (nodes + 1.0) / 2.0
    weights = weights * size * np.exp(-(size**2))
    weights /= weights.sum()
    size *= np.sqrt(slope_variance / (weights @ size**2))
    size, turn = size[:, None], 2.0 * math.pi * (np.arange(around) + 0.5) / around
    fraction = np.repeat(weights / around, around)
    return (size * np.cos(turn)).ravel(), (size * np.sin(turn)).ravel(), fraction


@dataclass(frozen=True)
class WaterSurface:
    """A water surface: flat, or of isotropic normal slopes."""

    refractive_index: float  #: Of the water against air, n.
    slope_variance: float = 0.0  #: Mean square slope, of both axes together; 0 is flat.

    def reflectance(self, cosine: ArrayLike) -> Array:
        """Fraction of a beam in air, at the cosine of a zenith angle, that the surface reflects."""
        if not self.slope_variance:
            return np.asarray(fresnel_reflectance(cosine, self.refractive_index))
        return _reflectance(self, _flat(cosine)).reshape(np.shape(cosine))

    def beam_below(self, sun: Sequence[float]) -> Array:
        """Direction in the water of a beam that travels along a unit vector in air, shape (3,).

        Below waves that of :meth:`entering_cosine`.

        Examples
        --------
        >>> WaterSurface(1.34, 0.04).beam_below((0.6, 0.0, -0.8)).round(3)
        array([ 0.452,  0.   , -0.892])
        """
        if not self.slope_variance:
            return np.array(direction_in_air(sun, (0.0, 0.0, -1.0), 1.0 / self.refractive_index))
        cosine = float(self.entering_cosine(-sun[2]))
        across = math.sqrt(1.0 - cosine**2) / max(math.hypot(sun[0], sun[1]), _OVERHEAD)
        return np.array([across * sun[0], across * sun[1], -cosine])

    def entering_cosine(self, cosine: ArrayLike) -> Array:
        """Cosine in the water of a beam that comes from air, as a mean over the facets.

        Facets that face a low sun take in most of it, and send it on flatter than a level
        surface would. The harmonic mean, by the light that enters, keeps Ed and E0; it is
        taken over that of a beam from the zenith, which is spread, but not tilted.
        """
        *found, zenith = _entering_cosine(self, (*_flat(cosine), 1.0))
        return np.reshape(found, np.shape(cosine)) / zenith

    def passing(self, cosine: ArrayLike) -> Array:
        """Fraction of the light between a facet and the sky that other waves let pass or mirror.

        Below the horizon it is as at it.
        """
        nodes, once, unhidden = _beams(self)
        return np.interp(np.asarray(cosine, np.float64), nodes, unhidden + (1.0 - unhidden) * once)

    @functools.cached_property
    def sky_transmittance(self) -> float:
        """Fraction of the irradiance of a uniform sky that enters the water through waves."""
        nodes, weights = np.polynomial.legendre.leggauss(_COSINES)
        cosine = (nodes + 1.0) / 2.0
        return float(weights * cosine @ (1.0 - self.reflectance(cosine)))


@dataclass(frozen=True, eq=False)
class Exchange:
    """Light that comes down from the waves along streams, per cosine mode of azimuth."""

    #: Of the radiance that rises along the streams of the last axis, (modes, N, N).
    reflected: Array
    #: Of the sky's radiance in air around the zenith angles of the last axis, (modes, N, k).
    entering: Array


@functools.lru_cache(maxsize=16)
def exchange(
    surface: WaterSurface,
    mu: tuple[float, ...],
    weights: tuple[float, ...],
    sky: tuple[float, ...],
    modes: int,
) -> Exchange:
    """Return what the waves reflect and let in, along streams.

    Radiance between streams, and between zenith angles of the sky, is linear in the cosine. A
    ray that is mirrored up becomes a level one; one from below the horizon sees the horizon.
    What one stream sees in another is not quite what that one sees in it, where waves hide each
    other: both are averaged, and scaled until as much light comes along each as goes, and a
    uniform sky brings :attr:`WaterSurface.sky_transmittance`. So light is neither lost nor made,
    the exchange is reciprocal, and water of n² under a uniform sky of 1 stays so.

    ``mu`` and ``weights`` are the quadrature on (0, 1) of the N streams, ``sky`` k increasing
    cosines of the zenith angle.
    """
    n2, cosines = surface.refractive_index**2, np.array(mu)
    met = _meet(surface, cosines, 1.0 / surface.refractive_index)
    through = direction_in_air(met.w, met.normal, surface.refractive_index)
    enters = met.fraction * (1.0 - met.reflectance) * surface.passing(through[2])
    goes = met.fraction - enters
    x, y, z = met.mirrored
    reflected = _modes(goes, -z, np.arctan2(y, x), mu, modes)
    entering = n2 * _modes(enters, through[2], np.arctan2(through[1], through[0]), sky, modes)
    flux = np.array(weights) * cosines
    both = flux[:, None] * reflected
    both = (both + both.mT) / 2.0
    from_sky, wanted = flux * enters.sum(axis=1), surface.sky_transmittance / (2.0 * n2)
    scale, bright = np.ones_like(flux), 1.0
    for _ in range(_BALANCE):
        bright = wanted / (scale @ from_sky)
        ratio = flux / (scale * (both[0] @ scale + bright * from_sky))
        scale *= np.sqrt(ratio)
        if np.abs(ratio - 1.0).max() < _EVEN:
            break
    reflected = scale[:, None] * both * scale / flux[:, None]
    return Exchange(constant(reflected), constant(bright * scale[:, None] * entering))


@dataclass(frozen=True, eq=False)
class _Meeting:
    """Rays (q,) and the facets (f,) that they meet, each of shape (q, f).

    Shares add up to 1 for each ray; ``area`` (q,) is what all facets turn to it.
    """

    fraction: Array
    w: tuple[Array, Array, Array]
    normal: tuple[Array, Array, Array]
    mirrored: tuple[Array, Array, Array]
    reflectance: Array
    area: Array


def _meet(surface: WaterSurface, cosine: Array, relative_index: float) -> _Meeting:
    x, y, fraction = facet_slopes(surface.slope_variance, _RINGS, _AROUND)
    up = np.broadcast_to(cosine[:, None], (len(cosine), len(x)))
    w = np.sqrt(1.0 - up * up), np.zeros_like(up), up
    normal = surface_normal(x, y)
    met, mirrored = tilted_mirror(w, normal)
    seen = fraction * met / normal[2]
    area = seen.sum(axis=1)
    R = fresnel_reflectance(met, relative_index)
    return _Meeting(seen / area[:, None], w, normal, mirrored, R, area)


def _flat(cosine: ArrayLike) -> tuple[float, ...]:
    return tuple(np.ravel(np.asarray(cosine, np.float64)).tolist())


# Frames of an animation share a surface, where the water below it changes.
@functools.lru_cache(maxsize=64)
def _reflectance(surface: WaterSurface, cosines: tuple[float, ...]) -> Array:
    """See :meth:`WaterSurface.reflectance`."""
    met = _meet(surface, np.array(cosines), surface.refractive_index)
    nodes, once, _ = _beams(surface)
    # What a facet sends on down meets the waves again.
    again = np.where(met.mirrored[2] > 0, np.interp(met.mirrored[2], nodes, once), 1.0)
    return constant((met.fraction * met.reflectance * again).sum(axis=1))


@functools.lru_cache(maxsize=64)
def _entering_cosine(surface: WaterSurface, cosines: tuple[float, ...]) -> Array:
    """Harmonic mean over the facets, see :meth:`WaterSurface.entering_cosine`."""
    met = _meet(surface, np.array(cosines), surface.refractive_index)
    down = direction_in_air(
        [-part for part in met.w], [-part for part in met.normal], 1.0 / surface.refractive_index
    )[2]
    enters = met.fraction * (1.0 - met.reflectance)
    slant = enters / np.maximum(-down, _FLATTEST)
    return constant(enters.sum(axis=1) / slant.sum(axis=1))


@functools.lru_cache(maxsize=64)
def _beams(surface: WaterSurface) -> tuple[Array, Array, Array]:
    """Of beams in air: cosines, shares that facets reflect to whatever side, and see unhidden."""
    cosine = np.linspace(0.0, 1.0, _COSINES) ** 2
    met = _meet(surface, cosine, surface.refractive_index)
    return cosine, (met.fraction * met.reflectance).sum(axis=1), cosine / met.area


def _modes(
    fraction: Array, cosine: Array, turn: Array, nodes: tuple[float, ...], modes: int
) -> Array:
    """Cosine modes of light that goes along cosines (q, f), shared among nodes, (modes, q, k)."""
    at = np.clip(np.interp(cosine, nodes, np.arange(len(nodes))), 0.0, len(nodes) - 1.0)
    hats = np.maximum(1.0 - np.abs(at[..., None] - np.arange(len(nodes))), 0.0)
    waves = np.cos(np.arange(modes)[:, None, None] * turn)
    return np.matmul(np.swapaxes(waves * fraction, 0, 1), hats).swapaxes(0, 1)
