"""The pixel of one ray in bands, from what it looks up in the tables of the solved field.

With M(y, w) the light scattered in the unoccluded water, sunlight scattered once apart,
and I(w) the radiance of the boundary that lies ahead, surface or floor, the radiance is

    L(y, w) = once(y, w) + M(y, w) + e^{-cp P_b} I(w)

where ``once`` and the boundary are dimmed by the extinction cp without the forward peak, as
in the solution; ``once`` has the factor of the sun's aureole at the camera. The path to an object
at distance P is L(y_o) - e^{-cP} L(y_e), exactly but for that factor, which at y_e is another.
In layered water c is the mean extinction of the path, and ``once`` is looked up too.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.transfer.radiance_field import (
    FARTHEST,
    Ripples,
    sun_image,
)
from ..uw_spectral.transfer.sky import BLACK, Sky
from .closed_form.paths import under_surface
from .closed_form.pixel import Pixel


class SunOnPath(Protocol):
    """The direct sun along a path, such as :class:`.SunBeam`, which says what its numbers are."""

    @property
    def c(self) -> Operand: ...  # noqa: D102
    @property
    def cp(self) -> Operand: ...  # noqa: D102
    @property
    def E(self) -> Operand: ...  # noqa: D102
    @property
    def sun(self) -> Sequence[Operand]: ...  # noqa: D102
    @property
    def mu_s(self) -> Operand: ...  # noqa: D102

    def boundary(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Distance from depth y along w to the surface or the floor, m."""
        ...

    def single_scattering(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
        *,
        without_peak: bool = False,
    ) -> Operand:
        """Radiance of sunlight scattered once between depth y_o and distance P."""
        ...


@dataclass(frozen=True, eq=False)
class PathOcclusion:
    """What objects leave of the light that a path gathers, and of what surrounds its end.

    ``scattered`` and ``once`` are the fraction of M, and of sunlight scattered once; ``beyond`` is
    as of :class:`SolvedPixel`.
    """

    scattered: Operand = 1.0
    once: Operand = 1.0
    beyond: Operand = 1.0


UNOCCLUDED = PathOcclusion()


@dataclass(frozen=True, eq=False)
class SolvedPath:
    """Light of the water along one ray, with M at the camera and at the end of the path."""

    beam: SunOnPath
    near: Operand
    far: Operand
    aureole: Operand = 1.0
    occlusion: PathOcclusion = UNOCCLUDED

    @property
    def c(self) -> Operand:
        """Extinction, 1/m."""
        return self.beam.c

    @property
    def cp(self) -> Operand:
        """Extinction without the forward peak of the phase function, 1/m."""
        return self.beam.cp

    def path(
        self, y_o: Operand, w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Radiance of the water between depth y_o and distance P along w."""
        once = self.beam.single_scattering(y_o, w, P, m, without_peak=True)
        once = once * self.aureole * self.occlusion.once
        # The forward peak's light comes from where there is open water behind an object.
        around = self.occlusion.beyond
        kept = m.exp(-self.c * P) * around + m.exp(-self.cp * P) * (1.0 - around)
        scattered = (self.near - kept * self.far) * self.occlusion.scattered
        return m.maximum(once + scattered, 0.0)

    def single_scattering(
        self, y_o: Operand, w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Sunlight scattered once, where it shines."""
        return self.beam.single_scattering(y_o, w, P, m) * self.occlusion.once


@dataclass(frozen=True, eq=False)
class SolvedPixel(Pixel):
    """A pixel among objects.

    ``beyond`` is the fraction of its surroundings that lies behind what is seen; the rest shines as
    that does.
    """

    water: SolvedPath
    beyond: Operand = 1.0

    @functools.cached_property
    def forward_scattered(self) -> Operand:
        """Light of the surroundings, blurred over what is seen."""
        own = self.L_end * (1.0 - self.beyond)
        return self.point_spread * (self.L_beyond * self.coverage * self.beyond + own)

    @functools.cached_property
    def single_scattering(self) -> Operand:
        """Sunlight scattered once on the way, nothing in its way."""
        return self.water.single_scattering(self.y_o, self.w, self.P, self.m) * self.coverage


@dataclass(frozen=True, eq=False)
class SolvedWater:
    """Unoccluded water as one ray sees it."""

    beam: SunOnPath  #: On the way to the end of the path.
    #: M at the camera, and at an object's depth; the second of :meth:`surface`.
    near: Operand
    far: Operand = 0.0
    #: Radiance of the boundary ahead, under the surface at rest or on average; of :meth:`surface`.
    image: Operand = 0.0
    #: From an object to the boundary, where it is another than ``beam``; of :meth:`surface`.
    beyond: SunOnPath | None = None
    #: M at the surface along :func:`.radiance_field.mirrored_ray`; of :meth:`open_water`.
    mirrored: Operand = 0.0
    #: From the surface along that ray, where it is another than ``beam``.
    below: SunOnPath | None = None
    floor: Operand = 0.0  #: Radiance of the floor.
    sky: Sky = BLACK  #: In air; black by default.
    #: Index of the water against air; without one there is no surface that reflects.
    index: Operand | None = None
    #: Factor of the sun's aureole on sunlight scattered once, at the camera.
    aureole: Operand = 1.0
    occlusion: PathOcclusion = UNOCCLUDED

    def surface(
        self,
        y_o: Operand,
        y_e: Operand,
        w: Sequence[Operand],
        P: Operand,
        L_surface: Operand,
        m: Mathematics = NUMPY,
        *,
        coverage: Operand = 1.0,
    ) -> SolvedPixel:
        """Pixel of a surface.

        Parameters
        ----------
        y_o, y_e : Operand
            Depths of the camera and of the surface, m.
        w : three Operands
            Unit view direction, away from the camera, z up.
        P : Operand
            Distance, m.
        L_surface : Operand
            Radiance of the surface.
        coverage : Operand
            Fraction of the pixel that the surface fills; its radiance is multiplied by it.
        """
        ahead = SolvedAhead(self.beyond or self.beam, 0.0, self.image, self.aureole)
        beyond = ahead.radiance(y_e, w, m) * self.occlusion.scattered
        water = SolvedPath(self.beam, self.near, self.far, self.aureole, self.occlusion)
        around = self.occlusion.beyond
        return SolvedPixel(water, y_o, w, P, L_surface, beyond, m, coverage, around)

    def open_water(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        ripples: Ripples | None = None,
    ) -> SolvedPixel:
        """Pixel of open water with the surface or the floor behind."""
        up = m.less(0.0, w[2])
        end = m.select(up, self.from_surface(y_o, w, m, ripples), self.floor)
        P = self.beam.boundary(y_o, w, m)
        water = SolvedPath(self.beam, self.near, 0.0, self.aureole, self.occlusion)
        return SolvedPixel(water, y_o, w, P, end, end, m)

    def from_surface(
        self,
        y: Operand,
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        ripples: Ripples | None = None,
    ) -> Operand:
        """Radiance that comes down from the surface against w, seen from depth y."""
        if self.index is None:
            return self.sky.radiance(w, m)
        mirror = _Mirrored(self.below or self.beam, self.mirrored, self.floor)
        slopes = None if ripples is None else ripples.slopes
        L_sky = self.sky.seen_through(w, self.index, m, slopes)
        L = under_surface(mirror, w, L_sky, self.index, m, slopes)
        if ripples is not None:
            # Seen through water that keeps e^{-cp P} of it, it comes out dimmed by e^{-c P}.
            P = m.minimum(y / m.maximum(w[2], 1e-4), FARTHEST)
            seen = self.beam.E * m.exp((self.beam.cp - self.beam.c) * P)
            L = L + sun_image(self.beam.sun, w, self.index, ripples, m) * seen
        return L


@dataclass(frozen=True, eq=False)
class SolvedAhead:
    """All that is ahead of a point in unoccluded water: ``near`` is M at the point.

    ``beam`` is from there to the boundary; ``image`` and ``aureole`` are as of
    :class:`SolvedWater`.
    """

    beam: SunOnPath
    near: Operand
    image: Operand
    aureole: Operand = 1.0

    def radiance(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance that arrives at depth y along w, the direct sun and its forward peak apart."""
        rest = self.beam.boundary(y, w, m)
        once = self.beam.single_scattering(y, w, rest, m, without_peak=True)
        return once * self.aureole + self.near + m.exp(-self.beam.cp * rest) * self.image


@dataclass(frozen=True, eq=False)
class _Mirrored:
    """The water below the surface along the one ray for which M is known."""

    beam: SunOnPath
    M: Operand
    floor: Operand

    def radiance(
        self,
        y: Operand,
        w: Sequence[Operand],
        L_surface: Operand = 0.0,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance L(y, w) of what rises to the surface."""
        del L_surface
        P = self.beam.boundary(y, w, m)
        once = self.beam.single_scattering(y, w, P, m, without_peak=True)
        return once + self.M + m.exp(-self.beam.cp * P) * self.floor


@dataclass(frozen=True, eq=False)
class SolvedPatchLight:
    """Light on a patch: of the direct sun, and the irradiance that was looked up.

    ``beam`` is from the surface to the patch; ``patch`` the irradiance without the sun and its
    forward peak.
    """

    beam: SunOnPath
    patch: Operand

    def surface_irradiance(
        self, y: Operand, sun_cosine: Operand, up: Operand, m: Mathematics = NUMPY
    ) -> tuple[Operand, Operand, Operand]:
        """Irradiance of the direct sun, its forward peak and the rest, at depth y.

        ``sun_cosine`` is between the patch's normal and the direction towards the in-water sun;
        below zero the patch faces away. ``up`` is the upward component of its normal, which
        ``patch`` knows.
        """
        del up
        beam = self.beam
        facing = m.maximum(sun_cosine, 0.0) / beam.mu_s * beam.E
        sharp = m.exp(-beam.c / beam.mu_s * y)
        forward = m.maximum(m.exp(-beam.cp / beam.mu_s * y) - sharp, 0.0)
        return facing * sharp, facing * forward, m.maximum(self.patch, 0.0)
