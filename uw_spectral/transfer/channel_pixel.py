"""What a pixel contains in channels: the sum of :mod:`.pixel`, from light that was projected.

The same components, over three channels for all bands: light on the way, light of the object
that arrives, and light from beyond it that is scattered forward into the pixel. Formulas run on
arrays, with channels along the last axis, and build shader nodes, with channels as vectors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..mathematics import NUMPY, Mathematics, Operand, sum_of
from ..surface.refraction import direction_in_air, fresnel_reflectance
from ..surface.whitecaps import seen_with_foam
from .channel_tables import (
    ON_PATCH,
    ON_PATH,
    RATES,
    ChannelNumbers,
    ChannelTables,
    path_unit,
)
from .pixel_parts import (
    COLOURS,
    UNOCCLUDED,
    Around,
    ChannelPixel,
    OcclusionFactor,
    OcclusionOnPath,
    ReflectedRadiance,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
    Tables,
)
from .radiance_field import (
    distance_in_water,
    mirrored_ray,
    sun_image,
    surface_normal,
)
from .radiance_table import azimuth
from .sky import Sky
from .sun_beam import half_angle2

_BESIDE_SUN = 0.067  # squared sine of half of 30°
_LEAST = 1e-30
_DEEP = 1e4  # m; below every table


@dataclass(frozen=True, eq=False)
class ChannelWater:
    """Solved water in channels, as one ray sees it."""

    tables: Tables
    numbers: ChannelNumbers
    sun: Sequence[Operand]  #: Unit direction that sunlight travels to in the water.
    parts: Sequence[Operand]  #: Of the phase function for sunlight that turns against the ray.
    layered: bool = False  #: Whether the water differs with depth.
    fastest: Operand = 0.0  #: Of :func:`.path_unit`; only for layered water.
    m: Mathematics = NUMPY

    def unit(self, y: Operand) -> Operand:
        """What tables of depth and direction are divided by."""
        return self.numbers.scale * self.m.exp(-self.numbers.decay * y)

    def transmittance(self, y: Operand, P: Operand) -> Operand:
        """What tables over a distance to depth y are divided by."""
        return self.m.exp(-self._rate("extinction", y) * P)

    def transmittance_with_peak(self, y: Operand, P: Operand) -> Operand:
        """The same where light that the forward peak scatters counts as unscattered."""
        return self.m.exp((self._rate("peak", y) - self._rate("extinction", y)) * P)

    def transmittance_within(self, y: Operand, P: Operand, fraction: Operand) -> Operand:
        """The same where a fraction of all scattering counts as unscattered."""
        b = self._rate("scattering", y)
        return self.m.exp((b * fraction - self._rate("extinction", y)) * P)

    def transmittance_past(self, y: Operand, P: Operand, around: Around | None) -> Operand:
        """Fraction of an object's light that is left, and of light from behind it that it blocks.

        Of what ``around`` blocks more than the forward peak is the occlusion's business.
        """
        if around is None:
            return self.transmittance(y, P)
        return self.m.minimum(
            self.transmittance_within(y, P, around.blocked), self.transmittance_with_peak(y, P)
        )

    def transmittance_of_own(self, y: Operand, P: Operand, around: Around | None) -> Operand:
        """Fraction of an object's light that is left of what the pixel itself shows."""
        direct = self.transmittance(y, P)
        if around is None:
            return direct
        return direct + (self.transmittance_past(y, P, around) - direct) * around.own

    def _rate(self, name: str, y: Operand) -> Operand:
        if not self.layered:
            return getattr(self.numbers, name)
        return self.tables.at("rates", rate=RATES.index(name), depth=y)

    def falling_off(self, y: Operand, w: Sequence[Operand]) -> tuple[Operand, Operand]:
        """Rates at which light of a path to depth y falls off, scattered often and once, 1/m.

        Both by what it brings to the camera from along it.
        """
        rate = self._rate("mean_extinction", y)
        return rate - self.numbers.decay * w[2], rate * (1.0 - w[2] / self.numbers.mu_s)

    def scattered(self, y: Operand, w: Sequence[Operand]) -> Operand:
        """Radiance M(y, w)."""
        return self._directed("scattered", y, w)

    def ahead(self, y: Operand, w: Sequence[Operand]) -> tuple[Operand, Operand]:
        """Radiance M(y, w), and the rest of what is ahead."""
        return self._directed("scattered", y, w), self._directed("beyond", y, w)

    def irradiance(self, y: Operand, normal: Sequence[Operand]) -> Operand:
        """Irradiance on a patch, the direct sun apart."""
        return self._directed("irradiance", y, normal)

    def sunlight(
        self, y: Operand, P: Operand, column: Operand, pattern: Operand | None = None
    ) -> Operand:
        """Normal irradiance of the sun at depth y on a colour, as it is seen from P.

        ``pattern`` is that of the waves, if there are any.
        """
        lit = self.tables.at("sunlit", colour=column, depth=y, length=P)
        if pattern is not None:
            lit = lit + (pattern - 1.0) * self.tables.at(
                "caustics", colour=column, depth=y, length=P
            )
        return lit * self.m.exp(-self._rate("sun_decay", y) * y)

    def scaled_single_scattering(
        self, y_o: Operand, y_e: Operand, w: Sequence[Operand], P: Operand
    ) -> Operand:
        """Sunlight scattered once between the camera and P, the peak counted as unscattered."""
        if self.layered:
            found = self._of_parts("single", up=w[2], length=P)
            # The last entry of the table holds from there on, in its own unit.
            return found * path_unit(self.numbers.lengths.held(P, self.m), self.fastest)
        return self._integrated("single", self.numbers.single_decay, y_o, y_e, P)

    def single_scattering(
        self, y_o: Operand, y_e: Operand, w: Sequence[Operand], P: Operand
    ) -> Operand:
        """Sunlight scattered once, unshadowed, with the whole extinction if that is known."""
        if self.layered:
            return self.scaled_single_scattering(y_o, y_e, w, P)
        return self._integrated("drawn", self.numbers.single_decay, y_o, y_e, P)

    def single_scattering_at(self, y: Operand, v: Operand) -> Operand:
        """Integrand of :meth:`single_scattering` at depth y and distance v, per metre."""
        x = y / self.numbers.mu_s + v
        return self._of_parts("drawn_at", length=x) * self.m.exp(-self.numbers.single_decay * x)

    def _integrated(
        self, table: str, decay: Operand, y_o: Operand, y_e: Operand, P: Operand
    ) -> Operand:
        """Difference of an integral between two optical paths, however close they are."""
        m = self.m
        near, far = y_o / self.numbers.mu_s, y_e / self.numbers.mu_s + P
        middle = 0.5 * (near + far)
        least = 0.5 * self.numbers.lengths.step(middle)
        # The ends themselves, for they may be far apart: a middle would lose the digits of one.
        first = m.maximum(m.minimum(m.minimum(near, far), middle - least), 0.0)
        last = m.maximum(m.maximum(near, far), middle + least)
        at_first, at_last = (
            self._of_parts(table, length=x) * m.exp(-decay * x) for x in (first, last)
        )
        return (at_first - at_last) * (P / (last - first))

    def aureole(self, y: Operand, w: Sequence[Operand]) -> Operand:
        """Factor of the sun's aureole on sunlight scattered once against w."""
        return self.tables.at("aureole", depth=y, s2=half_angle2(w, self.sun, self.m))

    def occluded(
        self, light: Operand, factor: OcclusionFactor, y: Operand, first: int = ON_PATH
    ) -> Operand:
        """Return what objects leave of light at depth y, along a ray or on a patch."""
        left = light * factor.mean
        for number, fraction in enumerate(factor.fractions, first):
            turned = self._of_light("occlusion_matrices", light, spectrum=number, depth=y)
            left = left + turned * fraction
        return left

    def leaving(
        self, surface: SurfaceMaterial, y: Operand, normal: Sequence[Operand], P: Operand
    ) -> Operand:
        """Light of an object at depth y that is left after P, over :meth:`transmittance`."""
        rest = self.reflected_light(surface, y, normal, P)
        return self.reflected_sun(surface, y, P) + rest if surface.response else rest

    def reflected_sun(self, surface: SurfaceMaterial, y: Operand, P: Operand) -> Operand:
        """The direct sun's part of :meth:`leaving`."""
        columns = zip(surface.columns, surface.response, strict=True)
        return sum_of([lit * self.sunlight(y, P, k, surface.pattern) for k, lit in columns])

    def reflected_light(
        self, surface: SurfaceMaterial, y: Operand, normal: Sequence[Operand], P: Operand
    ) -> Operand:
        """Rest of :meth:`leaving`: light from many sides, mirrored light, light of its own."""
        split = self.tables.split
        E = self.occluded(self.irradiance(y, normal), surface.occlusion, y, ON_PATCH)
        if surface.behind is not None:
            back = self.irradiance(y, [-part for part in normal])
            back = self.occluded(back, surface.occlusion_behind, y, ON_PATCH)
            E = E + (back - E) * surface.behind
        E = split(E * (1.0 / math.pi))
        L = split(surface.L_mirrored) if surface.mirrored else None
        total: Operand = 0.0
        for place, k in enumerate(surface.columns):
            base = surface.base[place]
            matte = self.tables.at("matte", colour=k, depth=y, length=P)
            for j, transmittance in enumerate(matte):
                light = base * E[j]
                if L is not None:
                    fraction = surface.mirrored[place]
                    light = (base - fraction) * E[j] + fraction * L[j]
                total = transmittance * light + total
        glow = self.glow(surface, y, P)
        return total if glow is None else glow + total

    def glow(self, surface: SurfaceMaterial, y: Operand, P: Operand) -> Operand | None:
        """The emitted part of :meth:`leaving`, if it emits."""
        parts = [
            radiance * self.tables.at("glowing", colour=k, depth=y, length=P)
            for first, emitted in ((0, surface.emitted), (len(COLOURS), surface.fluorescing))
            for k, radiance in enumerate(emitted, first)
        ]
        return sum_of(parts) if parts else None

    def surface(
        self,
        y_o: Operand,
        y_e: Operand,
        w: Sequence[Operand],
        P: Operand,
        seen: SeenObject,
        *,
        occlusion: OcclusionOnPath = UNOCCLUDED,
        around: Around | None = None,
    ) -> ChannelPixel:
        """Pixel of an object at depth y_e and distance P, m.

        ``w`` is a unit vector away from the camera, z up.
        """
        m, leaving, coverage = self.m, seen.leaving, seen.coverage
        M_near, (M_far, beyond) = self.scattered(y_o, w), self.ahead(y_e, w)
        far, rest = (self.dimmed(light, y_e, P) for light in (M_far, beyond))
        direct, peaked = self.transmittance(y_e, P), self.transmittance_with_peak(y_e, P)
        transmittance_past = self.transmittance_past(y_e, P, around)
        # Of what lies behind all that reaches the camera with the peak, less what is blocked.
        past = peaked - transmittance_past
        boundary = self.boundary(y_o, w) * (past / m.maximum(peaked, _LEAST))
        single = self.scaled_single_scattering(y_o, y_e, w, P) * self.aureole(y_o, w)
        blocks = transmittance_past * far
        own = (transmittance_past - direct) * leaving
        if around is not None:
            own = (transmittance_past - direct) * (around.own * leaving + around.beside * coverage)
            # Between both, each with its spectrum.
            fraction = (transmittance_past - direct) / m.maximum(peaked - direct, _LEAST)
            with_peak = self.peaked(M_far, y_e, P)
            blocks = direct * far + fraction * (peaked * with_peak - direct * far)
        if seen.glow is not None:
            own, leaving = own + (transmittance_past - direct) * seen.glow, leaving + seen.glow
        path = self._occluded_path(single, M_near - blocks, y_o, w, occlusion)
        surroundings = self.occluded(past * rest + boundary, occlusion.scattered, y_o) * coverage
        if seen.tint is not None:
            behind = peaked * (far + rest) + self.boundary(y_o, w) * (direct / peaked)
            behind = self.occluded(behind, occlusion.scattered, y_o)
            surroundings = surroundings + behind * seen.tint
        return ChannelPixel(path * coverage, direct * leaving, surroundings + own)

    def boundary(self, y_o: Operand, w: Sequence[Operand]) -> Operand:
        """Radiance of the surface or floor ahead that reaches depth y_o, the peak included."""
        m = self.m
        R = distance_in_water(y_o, -w[2], self.numbers.y_f, m)
        up = m.less(0.0, w[2])
        image, floor = self.tables.at("image", **self._direction(w)), 1.0 - up
        left = self.tables.at("image_transmittance", boundary=floor, length=R)
        return image * left * self.transmittance_with_peak(floor * _DEEP, R)

    def open_water(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        surface: SurfaceAbove,
        occlusion: OcclusionOnPath = UNOCCLUDED,
    ) -> ChannelPixel:
        """Pixel of open water with the surface or the floor behind."""
        m, n = self.m, self.numbers
        P = distance_in_water(y_o, -w[2], n.y_f, m)
        y_e = m.maximum(y_o - w[2] * P, 0.0)
        single = self.scaled_single_scattering(y_o, y_e, w, P) * self.aureole(y_o, w)
        path = self._occluded_path(single, self.scattered(y_o, w), y_o, w, occlusion)
        up = m.less(0.0, w[2])
        below = self._floor_after(P)
        end = m.select(up, self.from_surface(w, P, surface), below)
        return ChannelPixel(path, end, 0.0, end)

    def _occluded_path(
        self,
        single: Operand,
        often: Operand,
        y_o: Operand,
        w: Sequence[Operand],
        occlusion: OcclusionOnPath,
    ) -> Operand:
        """Light of a path that objects leave, of what was scattered once and often."""
        if occlusion.turned is not None:
            # What hides the sun from a view close to it hides what has turned, too.
            beside = self.m.minimum(half_angle2(w, self.sun, self.m) * (1.0 / _BESIDE_SUN), 1.0)
            turned = occlusion.turned * (beside * beside)
            often = often + single * turned
            single = single * (1.0 - turned)
        return single * occlusion.single + self.occluded(often, occlusion.scattered, y_o)

    def from_surface(self, w: Sequence[Operand], P: Operand, surface: SurfaceAbove) -> Operand:
        """Radiance that comes down from the surface against w and is left after P."""
        m, sky, index, ripples = self.m, surface.sky, surface.index, surface.ripples
        peaked = self.transmittance_with_peak(0.0 * P, P)
        if index is None:
            return self._skylight(sky.radiance(w, m), P, peaked)
        slopes = None if ripples is None else ripples.slopes
        seen, mirrored, down = under_surface_fractions(w, sky, index, m, slopes)
        M, rest = self.ahead(0.0 * w[2], down)
        to_floor = distance_in_water(0.0 * w[2], -down[2], self.numbers.y_f, m)
        risen = peaked * self._risen(M + rest, P)
        floor = self._floor_mirrored(P, to_floor, 2)
        total = self._skylight(seen, P, peaked) + mirrored * (risen + floor)
        if surface.picture is not None:
            rising = M + rest + self._floor_mirrored(P, to_floor, 1)
            total = total + mirrored * self._brought(surface.picture(down), rising, P)
        free: Operand = 1.0
        if surface.window is not None:
            normal = (0.0, 0.0, 1.0) if slopes is None else surface_normal(*slopes, m)
            surfaces = surface.window(direction_in_air(w, normal, index, m))
            through = (1.0 - mirrored) * (index * index)
            behind = self._skylight(seen, 0.0 * P)
            total = total + self._differing(
                through * surfaces.radiance - surfaces.covered * behind, P
            )
            free = 1.0 - surfaces.covered
        if ripples is not None:
            image = sun_image(self.sun, w, index, ripples, m)
            image = image if surface.window is None else free * image
            total = total + image * self.tables.at("glitter", length=P) * self.transmittance(
                0.0 * P, P
            )
        if (foam := surface.foam) is not None:
            matte = peaked * self.peaked(foam.radiance, 0.0 * P, P)
            total = seen_with_foam(total, matte, foam.fraction)
        return total

    def _skylight(self, relative: Operand, P: Operand, factor: Operand = 1.0) -> Operand:
        """Radiance of the sky that is left after P, of the relative one of each of its spectra."""
        spectra = self.tables.at("sky", length=P)
        parts = self.tables.split(relative) if len(spectra) > 1 else [relative]
        return sum_of([one * factor * part for one, part in zip(spectra, parts, strict=True)])

    def _floor_after(self, P: Operand) -> Operand:
        """Radiance of the floor that is left after P."""
        return self.tables.at("floor", length=P) * self.transmittance_with_peak(0.0 * P + _DEEP, P)

    def _floor_mirrored(self, P: Operand, to_floor: Operand, times: int) -> Operand:
        """Radiance of the floor seen from the surface, past the water above the camera so often."""
        if not self.layered:
            return self._floor_after(to_floor if times == 1 else P + to_floor)
        # What is above the camera is other water than what lies between it and the floor.
        below = self._floor_after(self.m.maximum(to_floor - P, 0.0))
        above = P * times
        return self._risen(below, above) * self.transmittance_with_peak(0.0 * P, above)

    def _risen(self, light: Operand, P: Operand) -> Operand:
        """Light of the colours of what rises to the surface after P, but for the slowest rate."""
        return self._of_light("mirrored", light, length=P)

    def _brought(self, surfaces: ReflectedRadiance, rising: Operand, P: Operand) -> Operand:
        """What objects bring, or keep away, of light that rises to the surface, left after P.

        What differs from open water is that of objects, and is seen without the forward peak.
        """
        return self._differing((surfaces.radiance - rising) * surfaces.known, P)

    def _differing(self, radiance: Operand, P: Operand) -> Operand:
        """What is left after P of what the surface sends otherwise than under open water."""
        y = 0.0 * P
        return self.transmittance(y, P) * self.dimmed(radiance, y, P)

    def dimmed(self, light: Operand, y: Operand, P: Operand) -> Operand:
        """What is left of light at depth y after P, over :meth:`transmittance`."""
        return self._of_light("dimmed", light, depth=y, length=P)

    def peaked(self, light: Operand, y: Operand, P: Operand) -> Operand:
        """Return the same over :meth:`transmittance_with_peak`, the forward peak included."""
        return self._of_light("peaked", light, depth=y, length=P)

    def _of_light(self, table: str, light: Operand, **coordinates: Operand) -> Operand:
        """Return what a table makes of each channel of light."""
        columns = zip(self.tables.at(table, **coordinates), self.tables.split(light), strict=True)
        return sum_of([column * part for column, part in columns])

    def _of_parts(self, table: str, **coordinates: Operand) -> Operand:
        """Return the sum of a table over the parts of the phase function."""
        found = zip(self.parts, self.tables.at(table, **coordinates), strict=True)
        return sum_of([part * value for part, value in found])

    def _directed(self, table: str, y: Operand, w: Sequence[Operand]) -> Operand:
        return self.tables.at(table, depth=y, **self._direction(w)) * self.unit(y)

    def _direction(self, w: Sequence[Operand]) -> dict[str, Operand]:
        return {"up": w[2], "azimuth": azimuth(w, self.sun, self.m)}


def along_rays(light: ChannelTables, sun: Sequence[float], w: Sequence[Operand]) -> ChannelWater:
    """Return the water along rays in numpy; components of directions of shape (..., 1)."""
    s2 = half_angle2(w, sun)
    parts = [part.per_steradian(s2) for part in light.components]
    return ChannelWater(light, light.numbers, sun, parts, light.layered, light.fastest)


def under_surface_fractions(
    w: Sequence[Operand],
    sky: Sky,
    index: Operand,
    m: Mathematics,
    slopes: tuple[Operand, Operand] | None,
) -> tuple[Operand, Operand, tuple[Operand, Operand, Operand]]:
    """Fractions of the sky's level and of mirrored water along w, and where that comes from."""
    cosine, down = mirrored_ray(w, m, slopes)
    R = fresnel_reflectance(cosine, 1.0 / index, m)
    seen = (1.0 - R) * (index * index) * sky.seen_through(w, index, m, slopes)
    return seen, R, down
