"""What a pixel contains, in bands, and the light on what it shows.

With the radiance field L(y, w) of the unoccluded water, a camera at depth y_o that sees a
surface at distance P gets

    L = path + e^{-cP} L_end + (e^{-cp P} - e^{-cP}) L_beyond,

the water on the way, the surface itself, and the unoccluded light from beyond it that is
scattered forward into the pixel. Open water is the same with the water's own boundary at
its end. EEVEE draws the same sum in channels, `uw_spectral.transfer.channel_pixel`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.path_integral import transmittance
from .paths import PathLight


def forward_scattered_fraction(water: PathLight, P: Operand, m: Mathematics = NUMPY) -> Operand:
    """Fraction of the background that reaches the camera scattered forward, over distance P."""
    return m.maximum(m.exp(-water.cp * P) - m.exp(-water.c * P), 0.0)


@dataclass(frozen=True, eq=False)
class Pixel:
    """The light of a pixel in components that add up; each is computed when it is asked for."""

    water: PathLight
    y_o: Operand  #: Depth of the camera, m.
    w: Sequence[Operand]  #: Unit view direction, away from the camera, z up.
    P: Operand  #: Distance of what is seen, m.
    L_end: Operand  #: Radiance of what is seen.
    L_beyond: Operand  #: Radiance of the unoccluded water from there on.
    m: Mathematics = NUMPY
    #: Fraction of the pixel that what is seen fills; ``L_end`` is multiplied by it already.
    coverage: Operand = 1.0

    @functools.cached_property
    def path(self) -> Operand:
        """Light scattered by the water on the way, once and more often."""
        return self.water.path(self.y_o, self.w, self.P, self.m) * self.coverage

    @functools.cached_property
    def direct(self) -> Operand:
        """Unscattered light of what is seen."""
        return transmittance(self.water.c, self.P, self.m) * self.L_end

    @functools.cached_property
    def forward_scattered(self) -> Operand:
        """Light of the surroundings, blurred over what is seen by scattering at small angles."""
        return self.point_spread * self.L_beyond * self.coverage

    @functools.cached_property
    def point_spread(self) -> Operand:
        """Fraction of :func:`forward_scattered_fraction`."""
        return forward_scattered_fraction(self.water, self.P, self.m)

    @functools.cached_property
    def total(self) -> Operand:
        """Sum of the components."""
        return self.path + self.direct + self.forward_scattered


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
    ) -> Operand:
        """Radiance that the patch reflects.

        ``sun_response`` is its radiance per normal irradiance of the sun, shadows and cosine
        included: ``albedo / π max(sun_cosine, 0)`` of a sunlit Lambertian patch.
        """
        wide = m.maximum(sun_cosine, 0.0) * self.forward + self.diffuse
        return sun_response * self.direct + albedo / math.pi * wide


class PatchLight(Protocol):
    """What knows the irradiance on a patch."""

    def surface_irradiance(
        self,
        y: Operand,
        sun_cosine: Operand,
        up: Operand,
        m: Mathematics = NUMPY,
    ) -> tuple[Operand, Operand, Operand]:
        """Irradiance: direct sun, sun scattered forward, the rest."""
        ...


def surface_light(
    light: PatchLight, y: Operand, up: Operand, m: Mathematics = NUMPY
) -> SurfaceLight:
    """Irradiance at depth y on a patch whose normal has the upward component ``up``."""
    return SurfaceLight(*light.surface_irradiance(y, 1.0, up, m))
