"""Lamp light that is scattered more than once: an approximation, fitted to photons.

Two parts stand for it along a ray. Light that was turned by small angles before, or after,
follows the path of light scattered once but is lost more slowly, c - κ b instead of c; its
phase function is blurred, the more the longer the path. And light without direction fills the
water round the lamp as diffusion from a point has it,

    E0 = 3 A b' W e^{-K r} / (4π r),   K = √(3 a (a + b')),   b' = b (1 - g),

W being the power of the lamp. κ, A and the blur are one number each for all phase functions of
water. docs/lamp_light.md says how far it holds: HG 0.8 to 0.924 and sea particles, albedo 0.3 to
0.9, up to 6/c from the lamp.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..water.phase import BandPhase, Mixture, henyey_greenstein
from .lamp import Lamp, RayPastLamp
from .lamp_path import NODES, PathNode, Quadrature, gauss_sum, lit_part, path_node

SLOWED = 0.54
"""κ: share of b that does not attenuate light scattered more than once."""
BLUR = 0.15
"""By how much of χ2's exponent a scattering blurs the phase function."""
HALO = 1.2
"""A: diffuse light over that of diffusion from a point."""
HALO_ON_SURFACES = 0.4
"""The same for patches, where the light scattered forward holds the rest."""
HALO_NODES = 8

_LARGEST_EXPONENT = 50.0
_SMALLEST_CHI2 = 1e-3
_SMALLEST = 1e-9  # 1/m
_REACH = 8.0  # of the halo, in decay lengths


@dataclass(frozen=True, eq=False)
class LampWater:
    """Water as the light of lamps meets it, of n bands; make it with :func:`lamp_water`.

    Attributes
    ----------
    b, c : array
        Scattering and extinction, 1/m.
    bp, cp : array
        The same without what is scattered forward: b (1 - g) and a + b (1 - g), 1/m.
    K : array
        Decay of diffuse light far from its source, 1/m.
    chi2 : array
        Second Legendre moment of the phase function.
    phase : Mixture
        Phase function.
    reach : float
        Distance from the camera beyond which there is no diffuse light to count, m.
    """

    b: Operand
    c: Operand
    bp: Operand
    cp: Operand
    K: Operand
    chi2: Operand
    phase: Mixture
    reach: Operand

    def astype(self, dtype: DTypeLike) -> LampWater:
        """Return the numbers in another floating-point precision."""
        cast = np.dtype(dtype).type
        names = [field.name for field in dataclasses.fields(self) if field.name != "phase"]
        phase = dataclasses.replace(self.phase, weights=np.asarray(self.phase.weights, dtype))
        return LampWater(**{name: cast(getattr(self, name)) for name in names}, phase=phase)


def lamp_water(a: ArrayLike, b: ArrayLike, phase: BandPhase) -> LampWater:
    """Return the water of n bands.

    Parameters
    ----------
    a, b : array_like, shape (n,)
        Absorption and scattering, 1/m.
    phase : BandPhase
        Phase function of the bands.

    Raises
    ------
    InputError
        If a coefficient is negative or not finite.

    Examples
    --------
    >>> from ..water.phase import parse_phase
    >>> water = lamp_water([0.1], [0.2], parse_phase("hg:0.9").for_bands([0.2]))
    >>> water.cp.round(3), water.K.round(3)
    (array([0.12]), array([0.19]))
    """
    absorption, scattering = np.broadcast_arrays(
        np.atleast_1d(a).astype(np.float64), np.atleast_1d(b).astype(np.float64)
    )
    for name, values in (("absorption", absorption), ("scattering", scattering)):
        if not (np.all(np.isfinite(values)) and np.all(values >= 0)):
            raise InputError(
                f"lamp: the {name} must be finite and not negative, got {values.tolist()} 1/m"
            )
    bp = scattering * (1.0 - phase.chi1)
    cp = absorption + bp
    K = np.sqrt(3.0 * absorption * cp)
    return LampWater(
        scattering,
        absorption + scattering,
        bp,
        cp,
        K,
        np.clip(phase.chi2, _SMALLEST_CHI2, 1.0 - _SMALLEST_CHI2),
        phase,
        _REACH / max(float((K + cp).min()), 1e-3),
    )


def lamp_light(
    lamp: Lamp,
    ray: RayPastLamp,
    water: LampWater,
    m: Mathematics = NUMPY,
    integrate: Quadrature = gauss_sum,
) -> tuple[Operand, Operand]:
    """Radiance of a lamp's light in the water along a ray, unshadowed.

    Parameters
    ----------
    lamp : Lamp
    ray : RayPastLamp
        Arrays need a last axis of 1 for the bands.
    water : LampWater
    m : Mathematics
        Elementary functions.
    integrate : callable
        Adds up the terms of the quadratures; a shader has a loop for it.

    Returns
    -------
    tuple of array, shape (..., n)
        Scattered once, as :func:`.scattered_once` has it; scattered more often. In the unit of
        the intensity per m².

    Examples
    --------
    >>> from ..water.phase import parse_phase
    >>> from .lamp import ray_past_lamp
    >>> water = lamp_water([0.1], [0.2], parse_phase("hg:0.9").for_bands([0.2]))
    >>> lamp = Lamp((0.5, 0.0, 4.0), (0.0, 0.0, -1.0), np.array([1.0]))
    >>> ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0)
    >>> [float(L[0].round(4)) for L in lamp_light(lamp, ray, water)]
    [0.0451, 0.0277]
    """
    part = lit_part(lamp, ray, m)

    def light(place: Operand, share: Operand) -> tuple[Operand, Operand]:
        return _light_of_node(path_node(lamp, ray, part, place, share, m), water, m)

    once, more = integrate(NODES, light)
    strength = water.b * lamp.intensity
    return strength * once, strength * more + halo_radiance(lamp, ray, water, m, integrate)


def _light_of_node(node: PathNode, water: LampWater, m: Mathematics) -> tuple[Operand, Operand]:
    """Light that a place of the path sends to the camera, over b I: scattered once, and more."""
    passed = m.exp(-water.c * node.length)
    once = node.weight * water.phase.per_steradian(node.s2, m) * passed
    later = m.maximum(m.exp(-(water.c - SLOWED * water.b) * node.length) - passed, 0.0)
    exponent = m.minimum(1.0 + BLUR * SLOWED * water.b * node.length, _LARGEST_EXPONENT)
    blurred = henyey_greenstein(m.power(water.chi2, exponent), node.s2, m)
    return once, node.weight * blurred * later


def halo_radiance(
    lamp: Lamp,
    ray: RayPastLamp,
    water: LampWater,
    m: Mathematics = NUMPY,
    integrate: Quadrature = gauss_sum,
) -> Operand:
    """Radiance of the diffuse light round a lamp along a ray.

    The integral of E0 b'/4π e^{-(a + b') t}, taken over asinh(s/h), in which the pole 1/r is even.
    """
    last = m.minimum(ray.far, m.maximum(ray.near + water.reach, ray.near))
    start, end = (_asinh(s, ray.h, m) for s in (ray.near, last))
    width = m.maximum(end - start, 0.0)

    def light(place: Operand, share: Operand) -> tuple[Operand]:
        grown = m.exp(start + width * place)
        s, r = ray.h * (grown - 1.0 / grown) / 2.0, ray.h * (grown + 1.0 / grown) / 2.0
        t = m.maximum(ray.t0 + s, 0.0)
        return (share * m.exp(-water.K * r - water.cp * t),)

    power = lamp.intensity * (lamp.profile.solid_angle * 3.0 * HALO / (4.0 * math.pi) ** 2)
    return power * water.bp * water.bp * (integrate(HALO_NODES, light)[0] * width)


def halo_irradiance(
    lamp: Lamp, r: Operand, water: LampWater, m: Mathematics = NUMPY
) -> tuple[Operand, Operand]:
    """Scalar irradiance of the diffuse light at a distance from a lamp, and its net flux.

    The flux is that of diffusion, (K + 1/r) E0 / (3 (a + b')), at most E0/2: it then comes from
    one side only.
    """
    spread = lamp.profile.solid_angle * 3.0 * HALO_ON_SURFACES / (4.0 * math.pi)
    E0 = lamp.intensity * water.bp * m.exp(-water.K * r) * (spread / r)
    flux = (water.K + 1.0 / r) / (3.0 * water.cp + _SMALLEST)
    return E0, E0 * m.minimum(flux, 0.5)


def _asinh(s: Operand, h: Operand, m: Mathematics) -> Operand:
    size = m.log((m.absolute(s) + m.sqrt(s * s + h * h)) / h)
    return m.select(m.less(s, 0.0), 0.0 - size, size)
