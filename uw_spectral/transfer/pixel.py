"""What a pixel contains: the one sum that every renderer and every estimate is made of.

With the radiance field L(y, w) of the undisturbed water, a camera at depth y_o that sees a
surface at distance P gets

    L = path + e^{-cP} L_end + (e^{-cp P} - e^{-cP}) L_beyond,

the water on the way, the surface itself, and the undisturbed light from beyond it that is
scattered forward into the pixel. Open water is the same with the water's own boundary at
its end. The components have names; a renderer draws those it is asked for, and pays for no others.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ..mathematics import NUMPY, Mathematics, Operand
from .radiance_field import (
    Beam,
    PathLight,
    Radiant,
    Ripples,
    sun_glitter,
    under_surface,
)
from .sky import Sky


def forward_scattered_share(water: PathLight, P: Operand, m: Mathematics = NUMPY) -> Operand:
    """Share of the background that reaches the camera scattered forward, over distance P."""
    return m.maximum(m.exp(-water.cp * P) - m.exp(-water.c * P), 0.0)


def transmittance(c: Operand, P: Operand, m: Mathematics = NUMPY) -> Operand:
    """Share e^{-cP} of light that passes a distance P unscattered, at extinction c."""
    return m.exp(-c * P)


@dataclass(frozen=True, eq=False)
class Pixel:
    """The light of a pixel in components that add up; each is computed when it is asked for.

    Parameters
    ----------
    water : PathLight
        The undisturbed water.
    y_o : float or array
        Depth of the camera, m.
    w : three floats or arrays
        Unit view direction, away from the camera, z up.
    P : float or array
        Distance of what is seen, m.
    L_end : float or array
        Radiance of what is seen.
    L_beyond : float or array
        Radiance of the undisturbed water from there on.
    m : Mathematics
        Elementary functions.
    coverage : float or array
        Share of the pixel that what is seen fills; ``L_end`` is multiplied by it already.
    beyond : float or array
        Share of what surrounds the thing that lies beyond it; the rest shines as the thing does.
    lamps : float or array
        Light of lamps that the water on the way scatters, share of the pixel included.
    L_carried : float or array
        Radiance of what is seen in the light of lamps, besides ``L_end``.
    carried_forward : float or array
        Share of that which arrives scattered forward.
    """

    water: PathLight
    y_o: Operand
    w: Sequence[Operand]
    P: Operand
    L_end: Operand
    L_beyond: Operand
    m: Mathematics = NUMPY
    coverage: Operand = 1.0
    beyond: Operand = 1.0
    lamps: Operand = 0.0
    L_carried: Operand = 0.0
    carried_forward: Operand = 0.0

    @functools.cached_property
    def transmittance(self) -> Operand:
        """Share e^{-cP} of the light of what is seen that arrives unscattered."""
        return transmittance(self.water.c, self.P, self.m)

    @functools.cached_property
    def path(self) -> Operand:
        """Light scattered by the water on the way, once and more often."""
        return self.water.path(self.y_o, self.w, self.P, self.m) * self.coverage

    @functools.cached_property
    def direct(self) -> Operand:
        """Unscattered light of what is seen."""
        return self.transmittance * (self.L_end + self.L_carried)

    @functools.cached_property
    def forward_scattered(self) -> Operand:
        """Light of the surroundings, blurred over what is seen by scattering at small angles."""
        share = forward_scattered_share(self.water, self.P, self.m)
        around = self.L_beyond * self.coverage * self.beyond + self.L_end * (1.0 - self.beyond)
        return share * around + self.carried_forward * self.L_carried

    @functools.cached_property
    def single_scattering(self) -> Operand:
        """Sunlight scattered once on the way, nothing in its way."""
        return self.water.single_scattering(self.y_o, self.w, self.P, self.m) * self.coverage

    @functools.cached_property
    def total(self) -> Operand:
        """Sum of the components."""
        return self.path + self.direct + self.forward_scattered + self.lamps


@dataclass(frozen=True, eq=False)
class SurfaceLight:
    """Irradiance on a patch: the two parts of the sun on a plane across it, and the rest."""

    direct: Operand
    forward: Operand
    diffuse: Operand

    def reflected(
        self,
        sun_response: Operand,
        albedo: Operand,
        sun_cosine: Operand,
        m: Mathematics = NUMPY,
        *,
        mirrored: Operand = 0.0,
        L_mirrored: Operand = 0.0,
    ) -> Operand:
        """Radiance that the patch reflects.

        Parameters
        ----------
        sun_response : float or array
            Its radiance per normal irradiance of the sun, shadows and cosine included:
            ``albedo / π max(sun_cosine, 0)`` of a sunlit Lambertian patch.
        albedo : float or array
            Its reflectance, for the light that comes from many sides.
        sun_cosine : float or array
            Cosine between its normal and the direction towards the in-water sun.
        m : Mathematics
            Elementary functions.
        mirrored : float or array
            Part of ``albedo`` that mirrors; the rest is Lambertian.
        L_mirrored : float or array
            Radiance that it mirrors, the direct sun's apart.
        """
        wide = m.maximum(sun_cosine, 0.0) * self.forward + self.diffuse
        matte = (albedo - mirrored) / math.pi * wide
        return sun_response * self.direct + matte + mirrored * L_mirrored


class PatchLight(Protocol):
    """What knows the irradiance on a patch."""

    def surface_irradiance(
        self,
        y: Operand,
        sun_cosine: Operand,
        up: Operand,
        m: Mathematics = NUMPY,
        openness: Operand = None,
    ) -> tuple[Operand, Operand, Operand]:
        """Irradiance: direct sun, sun scattered forward, the rest."""
        ...


def surface_light(
    light: PatchLight,
    y: Operand,
    up: Operand,
    m: Mathematics = NUMPY,
    *,
    openness: Operand | None = None,
    sunlight: Operand = 1.0,
) -> SurfaceLight:
    """Irradiance at depth y on a patch whose normal has the upward component ``up``.

    Parameters
    ----------
    m : Mathematics
        Elementary functions.
    openness : float or array, optional
        Share of the light from above, the direct sun apart, that nothing keeps away.
    sunlight : float or array
        Factor of the waves on the sunlight.
    """
    direct, forward, diffuse = light.surface_irradiance(y, 1.0, up, m, openness)
    return SurfaceLight(direct * sunlight, forward * sunlight, diffuse)


def light_from_surface(
    mirror: Radiant,
    beam: Beam,
    sky: Sky,
    index: Operand | None,
    y: Operand,
    w: Sequence[Operand],
    m: Mathematics = NUMPY,
    ripples: Ripples | None = None,
) -> Operand:
    """Radiance that comes down from the surface against w, seen from depth y.

    Parameters
    ----------
    mirror : Radiant
        The water that the surface mirrors.
    beam : Beam
        The sun in the water.
    sky : Sky
        In air.
    index : float or None
        Of the water against air; without one there is no surface that reflects.
    y, w, m, ripples
        As of :meth:`.SolvedWater.from_surface`.
    """
    if index is None:
        return sky.radiance(w, m)
    slopes = None if ripples is None else ripples.slopes
    L_sky = sky.seen_through(w, index, m, slopes)
    L = under_surface(mirror, w, L_sky, index, m, slopes)
    if ripples is not None:
        L = L + sun_glitter(beam, y, w, index, ripples, m)
    return L
