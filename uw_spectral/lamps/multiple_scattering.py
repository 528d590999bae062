"""Lamp light that is scattered more than once, from the moments of the phase function.

Along the ray stands for it what stands for light scattered once, with the angular
distribution after any number of scatterings in place of b p:

    L = ∫ I Φ'(θ) K(Θ, l) e^{-a l} / r² ds,   K = Σ (2n + 1)/4π Q(b l, χn) Pn(cos Θ) / l,

Q(x, χ) = e^{-x (1 - χ)} - e^{-x} (1 + x χ), l the path from the lamp over the place to the camera,
Θ the deflection there, Φ' the profile blurred by the scatterings on both legs
(:mod:`.angular_spread`). A path that ends after P takes what comes from the whole ray, less what
comes from beyond as it is seen from its end: light scattered far ahead is scattered again nearby.
A thing at the end keeps that away.

What comes from outside the beam of a lamp had left it inside, and was bent by the angle δ between
besides, across Θ as often as along it: cos Θ cos δ stands in place of cos Θ there.

It counts that scattered light goes a longer way no further than by one bend. Near a lamp, within a
transport length 1/(b (1 - g)), that is nothing; docs/measured/lamp_light.md has the errors.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..water.phase import BandPhase, Mixture
from .angular_spread import (
    LENGTHS,
    PROFILE_LENGTHS,
    Lookup,
    Spread,
    WaterSpread,
    deflection_place,
    length_place,
    profile_place,
)
from .lamp import Lamp, RayPastLamp
from .lamp_path import NODES, Quadrature, gauss_sum, lit_part, path_node

MORE_NODES, BEYOND_NODES = 16, 8
"""Of the integral up to the end of a path, and beyond."""
_REACH = 8.0  # of scattered light, in decay lengths
# Path to the camera over that to the lamp. A place that is displaced by more than its distance
# from the lamp is mostly farther away, not on another side.
_MOST_BLURRED = 2.0


@dataclass(frozen=True, eq=False)
class LampWater:
    """Water as the light of lamps meets it, of n bands; make it with :func:`lamp_water`.

    Attributes
    ----------
    a, b, c : array
        Absorption, scattering and extinction, 1/m.
    phase : Mixture
        Phase function.
    spread : Spread
        Tables of light that is scattered more often.
    reach : float
        Distance from the camera, or beyond the lamp, from which no scattered light is counted, m.
    """

    a: Operand
    b: Operand
    c: Operand
    phase: Mixture
    spread: Spread
    reach: Operand

    def of_bands(self, indices: ArrayLike) -> LampWater:
        """Return the water in some of the bands."""
        chosen = np.asarray(indices, dtype=int)
        phase = BandPhase(self.phase.components, np.asarray(self.phase.weights)[:, chosen])
        return lamp_water(self.a[chosen], self.b[chosen], phase)

    def astype(self, dtype: DTypeLike) -> LampWater:
        """Return the numbers in another floating-point precision."""
        cast = np.dtype(dtype).type
        phase = dataclasses.replace(self.phase, weights=np.asarray(self.phase.weights, dtype))
        numbers = {name: cast(getattr(self, name)) for name in ("a", "b", "c", "reach")}
        return LampWater(**numbers, phase=phase, spread=self.spread)


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
    >>> water.c.round(3), round(water.reach, 1)
    (array([0.3]), 25.8)
    """
    absorption, scattering = np.broadcast_arrays(
        np.atleast_1d(a).astype(np.float64), np.atleast_1d(b).astype(np.float64)
    )
    for name, values in (("absorption", absorption), ("scattering", scattering)):
        if not (np.all(np.isfinite(values)) and np.all(values >= 0)):
            raise InputError(
                f"lamp: the {name} must be finite and not negative, got {values.tolist()} 1/m"
            )
    transport = absorption + scattering * (1.0 - phase.chi1)
    diffuse = np.sqrt(3.0 * absorption * transport)
    return LampWater(
        absorption,
        scattering,
        absorption + scattering,
        phase,
        WaterSpread(scattering, phase),
        _REACH / max(float((transport + diffuse).min()), 1e-3),
    )


class LampSpectrum(Protocol):
    """The light of a lamp over wavelengths, as sums along rays take it.

    Its own bands, or a few functionals of them.
    """

    @property
    def water(self) -> LampWater:
        """Water of the bands that the angles of scattered light are computed for."""
        ...

    def once(self, s2: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return its light scattered once over a length, by the squared sine of half the angle."""
        ...

    def arriving(self, bands: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return what absorption over a length leaves of its light, of which bands have so much."""
        ...


@dataclass(frozen=True, eq=False)
class BandLight:
    """The light of a lamp band by band.

    Attributes
    ----------
    intensity : array, shape (n,)
    water : LampWater
        Of n bands.
    """

    intensity: Operand
    water: LampWater

    def once(self, s2: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the light scattered once, in each band."""
        water = self.water
        passed = self.intensity * water.b * m.exp(-water.c * length)
        return passed * water.phase.per_steradian(s2, m)

    def arriving(self, bands: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the light that absorption leaves, in each band."""
        return self.intensity * m.exp(-self.water.a * length) * bands


def lamp_light(lamp: Lamp, ray: RayPastLamp, water: LampWater) -> tuple[Operand, Operand]:
    """Radiance of a lamp's light in the water along a ray, band by band.

    Parameters
    ----------
    lamp : Lamp
    ray : RayPastLamp
        Arrays need a last axis of 1 for the bands.
    water : LampWater

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
    [0.0451, 0.0266]
    """
    once, more = light_along(lamp, ray, BandLight(lamp.intensity, water))
    # A difference of large numbers may end below zero.
    return once, np.maximum(more, 0.0)


def light_along(
    lamp: Lamp,
    ray: RayPastLamp,
    light: LampSpectrum,
    m: Mathematics = NUMPY,
    integrate: Quadrature = gauss_sum,
) -> tuple[Operand, Operand]:
    """Radiance of a lamp's light along a ray: scattered once, and more often.

    Parameters
    ----------
    lamp : Lamp
        Its intensity is not read.
    ray : RayPastLamp
    light : LampSpectrum
    m : Mathematics
        Elementary functions.
    integrate : callable
        Adds up the terms of the quadratures; a shader has a loop for it.
    """
    part = lit_part(lamp, ray, m)

    def of_place(place: Operand, share: Operand) -> tuple[Operand]:
        node = path_node(lamp, ray, part, place, share, m)
        return (light.once(node.s2, node.length, m) * node.weight,)

    return integrate(NODES, of_place)[0], scattered_more(lamp, ray, light, m, integrate)


def scattered_more(
    lamp: Lamp,
    ray: RayPastLamp,
    light: LampSpectrum,
    m: Mathematics = NUMPY,
    integrate: Quadrature = gauss_sum,
) -> Operand:
    """Radiance of a lamp's light that is scattered more than once; see :func:`light_along`.

    The integrals are taken over u = asinh(s/h), s from the point nearest to the lamp: half the
    deflection is then atan(e^u), and ds/r² is du/r.
    """
    water = light.water
    profile, P = water.spread.profile(lamp.profile), ray.far - ray.near
    beam = lamp.profile.beam
    end = m.maximum(ray.near, 0.0) + water.reach
    last = m.maximum(m.minimum(ray.far, m.maximum(end, ray.near)), ray.first)
    beyond = m.maximum(end, last)
    # Absorption up to the end is part of that over the whole length.
    passed = m.exp(-water.b * P)

    def before_the_end(place: Operand, share: Operand) -> tuple[Operand]:
        node = _node(lamp, ray, beam, ray.first, last, place, share, m)
        here = node.scattered(profile, water, 0.0, m) * node.weight
        return (light.arriving(here, node.length, m),)

    def beyond_the_end(place: Operand, share: Operand) -> tuple[Operand]:
        node = _node(lamp, ray, beam, last, beyond, place, share, m)
        here, there = (node.scattered(profile, water, start, m) for start in (0.0, P))
        return (light.arriving((here - passed * there) * node.weight, node.length, m),)

    near = integrate(MORE_NODES, before_the_end)[0]
    if ray.before_thing:
        return near
    return near + integrate(BEYOND_NODES, beyond_the_end)[0]


@dataclass(frozen=True, eq=False)
class BendingNode:
    """A place on the ray where light is bent that is scattered more than once.

    Attributes
    ----------
    half : float or array
        Half its deflection, rad.
    r, t : float or array
        Distances from the lamp and, along the ray, from the camera, m.
    cosine : float or array
        From the axis of the lamp.
    weight : float or array
        Share of the place in the integral, 1/m.
    wet : float or array, optional
        Of the distance from the lamp what is in the water, where not all of it is.
    """

    half: Operand
    r: Operand
    t: Operand
    cosine: Operand
    weight: Operand = 1.0
    wet: Operand | None = None

    @property
    def length(self) -> Operand:
        """Length of the path from the lamp over the place to the camera, m; in the water."""
        return self.leg + self.t

    @property
    def leg(self) -> Operand:
        """Length of the lamp's part of it."""
        return self.r if self.wet is None else self.wet

    def scattered(
        self, profile: Lookup, water: LampWater, start: Operand, m: Mathematics
    ) -> Operand:
        """Share of the light that it sends to a place on the ray, absorption and 1/r² apart."""
        t = m.maximum(self.t - start, 0.0)
        aside = m.minimum(t / self.r, _MOST_BLURRED)
        # Scatterings on either leg blur the profile: seen from the lamp by t/r on the camera's.
        row = length_place(self.leg + t * aside * aside, PROFILE_LENGTHS, m)
        intensity = profile.at(profile_place(self.cosine, m), row)
        place = deflection_place(self.half, m), length_place(self.leg + t, LENGTHS, m)
        return intensity * m.exp(water.spread.deflection.at(*place))


def _node(
    lamp: Lamp,
    ray: RayPastLamp,
    beam: Operand,
    start: Operand,
    end: Operand,
    place: Operand,
    share: Operand,
    m: Mathematics,
) -> BendingNode:
    first, stop = (_asinh(s, ray.h, m) for s in (start, end))
    width = m.maximum(stop - first, 0.0)
    grown = m.exp(first + width * place)
    s, r = ray.h * (grown - 1.0 / grown) / 2.0, ray.h * (grown + 1.0 / grown) / 2.0
    cosine = (ray.across * ray.h + ray.along * s) / r
    t = m.maximum(ray.t0 + s, 0.0)
    half = _half_deflection(grown * grown, cosine, beam, m)
    where = ray.place(s)
    weight = width * share / r * lamp.lit(where, m)
    return BendingNode(half, r, t, cosine, weight, lamp.wet(r, where[2], m))


def _half_deflection(tangent2: Operand, cosine: Operand, beam: Operand, m: Mathematics) -> Operand:
    """Half the deflection, from its squared tangent without that from the beam to a direction."""
    c2 = 1.0 / (1.0 + tangent2)
    s2 = tangent2 * c2
    sines = m.maximum(1.0 - cosine * cosine, 0.0) * m.maximum(1.0 - beam * beam, 0.0)
    off = m.maximum(cosine * beam + m.sqrt(sines), 0.0)
    more = (1.0 - m.select(m.less(cosine, beam), off, 1.0)) * (c2 - s2) / 2.0
    return m.arctan2(m.sqrt(m.maximum(s2 + more, 0.0)), m.sqrt(m.maximum(c2 - more, 0.0)))


def _asinh(s: Operand, h: Operand, m: Mathematics) -> Operand:
    size = m.log((m.absolute(s) + m.sqrt(s * s + h * h)) / h)
    return m.select(m.less(s, 0.0), 0.0 - size, size)
