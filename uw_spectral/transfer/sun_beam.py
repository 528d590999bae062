"""The direct sun in the water, and its light that is scattered once on the way to a camera.

Directions, depth and shapes are those of :mod:`.radiance_field`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ..mathematics import NUMPY, Mathematics, Operand
from ..surface.caustics import SUN_RADIUS
from ..surface.refraction import REFRACTIVE_INDEX
from .path_integral import attenuated_path
from .radiance_field import distance_in_water, end_of_path

SUN_DISC = (0.42 * SUN_RADIUS / REFRACTIVE_INDEX / 2.0) ** 2
"""Squared sine of half the angle at which the forward peak of sea particles is its mean over
the sun's disc in the water."""


def half_angle2(w: Sequence[Operand], sun: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
    """Squared sine of half the angle by which sunlight turns to travel against w.

    It is held at the sun's disc, where the phase functions of particles have no bound.
    """
    x, y, z = (w[i] + sun[i] for i in range(3))
    return m.clamp((x * x + y * y + z * z) / 4.0, SUN_DISC, 1.0)


class Scattering(Protocol):
    """A phase function per band."""

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Value at s2 = sin²(angle / 2), 1/sr."""
        ...


@dataclass(frozen=True, eq=False)
class SunBeam:
    """The direct sun of n bands.

    Attributes
    ----------
    b, c : array
        Scattering and extinction, 1/m.
    cp : array
        Extinction without the forward peak of the phase function, 1/m.
    E : array
        Downwelling (horizontal) irradiance just below the surface.
    mu_s, y_f : float
        Cosine of the in-water zenith angle; depth of the floor, m.
    phase : Scattering
        Phase function.
    sun : sequence of 3
        Unit direction the sunlight travels to in the water.
    p : float or array, optional
        Phase function towards the camera, 1/sr, where it is known; it holds along one ray.
    """

    b: Operand
    c: Operand
    cp: Operand
    E: Operand
    mu_s: Operand
    y_f: Operand
    phase: Scattering
    sun: Sequence[Operand]
    p: Operand = None

    def source(self, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Sunlight scattered once against w, per metre, before any attenuation."""
        p = self.p
        if p is None:
            p = self.phase.per_steradian(half_angle2(w, self.sun, m), m)
        return self.b * p * self.E / self.mu_s

    def boundary(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Distance from depth y along w to the surface or the floor, m."""
        return distance_in_water(y, -w[2], self.y_f, m)

    def scattered_once(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
        *,
        without_peak: bool = False,
    ) -> Operand:
        """Radiance of sunlight scattered once between depth y_o and distance P, unshadowed.

        ``without_peak`` counts light that only the forward peak has scattered as
        unscattered, before and after.
        """
        P, y_e = end_of_path(y_o, w, P, self.y_f, m)
        c = self.cp if without_peak else self.c
        cs = c / self.mu_s
        return self.source(w, m) * attenuated_path(
            -cs * y_o, -cs * y_e - c * P, (c + cs * -w[2]) * P, P, m
        )  # fmt: skip

    def scattered_once_at(
        self, y: Operand, w: Sequence[Operand], v: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Integrand of :meth:`scattered_once` at depth y and distance v, per metre."""
        return self.source(w, m) * m.exp(-self.c * (y / self.mu_s + v))
