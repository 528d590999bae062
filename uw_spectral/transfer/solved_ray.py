"""The pixel of one ray from what it looks up in the tables of the solved field.

With M(y, w) the light scattered in the undisturbed water, sunlight scattered once apart,
and I(w) the radiance of the boundary that lies ahead, surface or floor, the radiance is

    L(y, w) = once(y, w) + M(y, w) + e^{-cp P_b} I(w)

where ``once`` and the boundary are dimmed by the extinction cp without the forward peak, as
in the solution; ``once`` has the factor of the sun's aureole at the camera. The path to a thing
at distance P is L(y_o) - e^{-cP} L(y_e), exactly but for that factor, which at y_e is another.
In layered water c is the mean extinction of the path, and ``once`` is looked up too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ..mathematics import NUMPY, Mathematics, Operand
from .pixel import Pixel, light_from_surface
from .radiance_field import Beam, Ripples
from .sky import BLACK, Sky
from .sun_beam import SunBeam

_LEAST = 1e-30


class SunOnPath(Beam, Protocol):
    """The direct sun along a path, such as :class:`.SunBeam`."""

    @property
    def mu_s(self) -> Operand: ...  # noqa: D102

    def boundary(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Distance from depth y along w to the surface or the floor, m."""
        ...

    def scattered_once(
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
class PathShade:
    """What things leave of the light that a path gathers, and of what surrounds its end.

    Attributes
    ----------
    scattered, once : float or array
        Share of M, and of sunlight scattered once.
    beyond : float or array
        As of :class:`.Pixel`.
    """

    scattered: Operand = 1.0
    once: Operand = 1.0
    beyond: Operand = 1.0


UNSHADED = PathShade()


def past_things(beam: SunBeam, P: Operand, blocked: Operand, m: Mathematics = NUMPY) -> Operand:
    """Share of the forward peak that passes things over a distance P.

    Parameters
    ----------
    beam : SunBeam
        Of homogeneous water.
    P : float or array
        m.
    blocked : float or array
        Share of all scattering that stays within things: its light is theirs, up to the peak's.
    m : Mathematics
        Elementary functions.
    """
    direct, peaked = m.exp(-beam.c * P), m.exp(-beam.cp * P)
    kept = m.minimum(m.exp((beam.b * blocked - beam.c) * P), peaked)
    return (peaked - kept) / m.maximum(peaked - direct, _LEAST)


@dataclass(frozen=True, eq=False)
class SolvedPath:
    """Light of the water along one ray, with M at the camera and at the end of the path."""

    beam: SunOnPath
    near: Operand
    far: Operand
    aureole: Operand = 1.0
    shade: PathShade = UNSHADED

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
        once = self.beam.scattered_once(y_o, w, P, m, without_peak=True)
        once = once * self.aureole * self.shade.once
        # The forward peak's light comes from where there is open water behind a thing.
        around = self.shade.beyond
        kept = m.exp(-self.c * P) * around + m.exp(-self.cp * P) * (1.0 - around)
        scattered = (self.near - kept * self.far) * self.shade.scattered
        return m.maximum(once + scattered, 0.0)

    def single_scattering(
        self, y_o: Operand, w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Sunlight scattered once, where it shines."""
        return self.beam.scattered_once(y_o, w, P, m) * self.shade.once


@dataclass(frozen=True, eq=False)
class SolvedWater:
    """Undisturbed water as one ray sees it.

    Attributes
    ----------
    beam : SunOnPath
        On the way to the end of the path.
    near : float or array
        M at the camera.
    far : float or array
        M at a thing's depth; of :meth:`surface`.
    image : float or array
        Radiance of the boundary ahead, under the surface at rest or on average; of :meth:`surface`.
    beyond : SunOnPath, optional
        From a thing to the boundary, where it is another than ``beam``; of :meth:`surface`.
    mirrored : float or array
        M at the surface along :func:`.radiance_field.mirrored_ray`; of :meth:`open_water`.
    below : SunOnPath, optional
        From the surface along that ray, where it is another than ``beam``.
    floor : float or array
        Radiance of the floor.
    sky : Sky
        The sky, in air; black by default.
    index : float, optional
        Index of the water against air; without one there is no surface that reflects.
    aureole : float or array
        Factor of the sun's aureole on sunlight scattered once, at the camera.
    shade : PathShade
        What things leave of the light of the path.
    """

    beam: SunOnPath
    near: Operand
    far: Operand = 0.0
    image: Operand = 0.0
    beyond: SunOnPath | None = None
    mirrored: Operand = 0.0
    below: SunOnPath | None = None
    floor: Operand = 0.0
    sky: Sky = BLACK
    index: Operand | None = None
    aureole: Operand = 1.0
    shade: PathShade = UNSHADED

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
    ) -> Pixel:
        """Pixel of a surface.

        Parameters
        ----------
        y_o, y_e : float or array
            Depths of the camera and of the surface, m.
        w : three floats or arrays
            Unit view direction, away from the camera, z up.
        P : float or array
            Distance, m.
        L_surface : float or array
            Radiance of the surface.
        m : Mathematics
            Elementary functions.
        coverage : float or array
            Share of the pixel that the surface fills; its radiance is multiplied by it.
        """
        ahead = SolvedAhead(self.beyond or self.beam, 0.0, self.image, self.aureole)
        beyond = ahead.radiance(y_e, w, m) * self.shade.scattered
        water = SolvedPath(self.beam, self.near, self.far, self.aureole, self.shade)
        around = self.shade.beyond
        return Pixel(water, y_o, w, P, L_surface, beyond, m, coverage=coverage, beyond=around)

    def open_water(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        ripples: Ripples | None = None,
    ) -> Pixel:
        """Pixel of open water with the surface or the floor behind."""
        up = m.less(0.0, w[2])
        end = m.select(up, self.from_surface(y_o, w, m, ripples), self.floor)
        P = self.beam.boundary(y_o, w, m)
        water = SolvedPath(self.beam, self.near, 0.0, self.aureole, self.shade)
        return Pixel(water, y_o, w, P, end, end, m)

    def from_surface(
        self,
        y: Operand,
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        ripples: Ripples | None = None,
    ) -> Operand:
        """Radiance that comes down from the surface against w, seen from depth y."""
        mirror = _Mirrored(self.below or self.beam, self.mirrored, self.floor)
        return light_from_surface(mirror, self.beam, self.sky, self.index, y, w, m, ripples)


@dataclass(frozen=True, eq=False)
class SolvedAhead:
    """All that is ahead of a point in undisturbed water.

    Attributes
    ----------
    beam : SunOnPath
        From there to the boundary.
    near : float or array
        M at the point.
    image, aureole : float or array
        As of :class:`SolvedWater`.
    """

    beam: SunOnPath
    near: Operand
    image: Operand
    aureole: Operand = 1.0

    def radiance(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance that arrives at depth y along w, the direct sun and its forward peak apart."""
        rest = self.beam.boundary(y, w, m)
        once = self.beam.scattered_once(y, w, rest, m, without_peak=True)
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
        once = self.beam.scattered_once(y, w, P, m, without_peak=True)
        return once + self.M + m.exp(-self.beam.cp * P) * self.floor


@dataclass(frozen=True, eq=False)
class SolvedPatchLight:
    """Light on a patch: of the direct sun, and the irradiance that was looked up.

    Attributes
    ----------
    beam : SunOnPath
        From the surface to the patch.
    patch : float or array
        Irradiance on it without the sun and its forward peak.
    from_above : float or array
        The same on a level patch that faces up; only for what things keep away.
    shade : float or array, optional
        Share of ``patch`` that things leave or bring; the light of the forward peak then has
        the direct sun's shadows.
    """

    beam: SunOnPath
    patch: Operand
    from_above: Operand = 0.0
    shade: Operand = None

    def surface_irradiance(
        self,
        y: Operand,
        sun_cosine: Operand,
        up: Operand,
        m: Mathematics = NUMPY,
        openness: Operand = None,
    ) -> tuple[Operand, Operand, Operand]:
        """Irradiance of the direct sun, its forward peak and the rest.

        Parameters
        ----------
        y : float or array
            Depth of the patch.
        sun_cosine : float or array
            Cosine between its normal and the direction towards the in-water
            sun; below zero the patch faces away.
        up : float or array
            Upward component of its normal (1 for a floor).
        m : Mathematics
            Elementary functions.
        openness : float or array, optional
            Share of the light from above, the direct sun apart, that nothing keeps away.
        """
        beam, diffuse = self.beam, self.patch
        facing = m.maximum(sun_cosine, 0.0) / beam.mu_s * beam.E
        sharp = m.exp(-beam.c / beam.mu_s * y)
        forward = m.maximum(m.exp(-beam.cp / beam.mu_s * y) - sharp, 0.0)
        if openness is not None:
            forward = forward * openness
            diffuse = diffuse - (1.0 - openness) * (0.5 + 0.5 * up) * self.from_above
        if self.shade is not None:
            return facing * (sharp + forward), 0.0 * facing, diffuse * self.shade
        return facing * sharp, facing * forward, m.maximum(diffuse, 0.0)
