"""The colours of a few rays of a camera, by the light and the formulas that EEVEE draws with.

They come in parts that add up, so that what a part is worth can be read off.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.cloud_numbers import Veil
from ..uw_spectral.clouds.cloud_shadow import daylit_fractions
from ..uw_spectral.clouds.solved_cloud import Cloud, clouds_in
from ..uw_spectral.clouds.veiled_pixel import surroundings, veiled
from ..uw_spectral.imaging.band_selection import FittedViewpoint
from ..uw_spectral.imaging.excitation import Excitation
from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.wave_patterns import WavePatterns, least_pattern, sunlight_factor
from ..uw_spectral.transfer.band_spectra import OcclusionSpectra
from ..uw_spectral.transfer.channel_pixel import ChannelWater, along_rays
from ..uw_spectral.transfer.channel_tables import SPECTRA, ChannelTables
from ..uw_spectral.transfer.channels import Channels, channels_of
from ..uw_spectral.transfer.foam_light import FoamAhead, foam_light
from ..uw_spectral.transfer.pixel_parts import (
    COLOURS,
    NO_OCCLUSION,
    Around,
    OcclusionFactor,
    OcclusionOnPath,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
)
from ..uw_spectral.transfer.projection import project
from ..uw_spectral.transfer.radiance_field import Ripples, distance_in_water
from ..uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, TABLE_STREAMS
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.sun_beam import half_angle2
from ..uw_spectral.transfer.sunlit_water import SunlitWater
from ..uw_spectral.transfer.water_column import WaterColumn
from .seen_points import SeenPoints
from .terms import DIFFUSE_SHADOWS, FLOOR_LIGHT, INELASTIC, SHAFTS, SINGLE

Array = NDArray[np.float64]
_Changes = tuple[tuple[str, object], ...]
"""Fields of the water column, instead of its own."""
_PLAIN, _OCCLUDED, _CHANGED = "plain", "shaded", "changed wavelength"
"""Which light: all, what objects occlude of it, or with light of changed wavelength."""


@dataclass(frozen=True, eq=False)
class Optics:
    """Water and camera on some bands.

    The depth of ``view`` is replaced by that of the rays; ``excitation`` changes the wavelength of
    light; ``waves`` are the moving surface, where the column has waves; ``caustics`` is the
    strength of the sunlight's pattern under them; ``clouds`` are on the same bands.
    """

    view: Viewpoint
    excitation: Excitation | None = None
    waves: WavePatterns | None = None
    caustics: float = 1.0
    clouds: tuple[Cloud, ...] = ()


@dataclass(frozen=True, eq=False)
class Picture:
    """Scene-linear Rec.709 of the rays, in parts that add up, shape (m, 3) each.

    ``plain`` has neither shadows in the water nor diffuse shadows
    nor inelastic light; ``parts`` holds what each of these adds (shadows: take away).
    ``single`` is sunlight that the water on the way scatters once, which ``plain`` has.
    """

    plain: Array
    parts: dict[str, Array]
    single: Array

    def without(self, *names: str) -> Array:
        """Return the colours without some parts."""
        return self.plain + sum(
            (value for name, value in self.parts.items() if name not in names),
            np.zeros_like(self.plain),
        )


def picture(optics: Optics, seen: SeenPoints, *, without: str = "", **column: object) -> Picture:
    """Colours of the rays.

    ``without`` is one of :data:`.LIGHTS`, by name, that is left out of ``plain``; ``column`` are
    fields of the water column, instead of its own. Waves need ``optics.waves``.
    """
    dark = without == FLOOR_LIGHT
    water = functools.partial(_folded_water, optics, seen.depth, tuple(column.items()), dark)
    drawn = water(_PLAIN)
    rays = _Rays(optics, seen, drawn.view.column.floor_depth)
    plain, single = rays.radiance(drawn), rays.single_scattering(drawn)
    parts = {}
    if not seen.is_free:
        # In the shade other light counts as unscattered, which alone changes nothing.
        split = water(_OCCLUDED)
        change = rays.radiance(split, occluded=True) - rays.radiance(split, sunlit=True)
        parts[DIFFUSE_SHADOWS] = change - (plain - rays.radiance(drawn, sunlit=True))
    shadows = drawn.waves is not None or not seen.path_sunlit.all()
    if shadows and not drawn.field.layered:
        parts[SHAFTS] = -rays.missing_light(drawn)
    if optics.excitation is not None:
        parts[INELASTIC] = rays.radiance(water(_CHANGED)) - plain
    return Picture(plain - single if without == SINGLE else plain, parts, single)


@dataclass(frozen=True, eq=False)
class _FoldedWater:
    """Folded light, what it is folded from, and its waves.

    Sunlight does not fall below the ``least`` of their pattern.
    """

    view: Viewpoint
    channels: Channels
    field: SolvedField
    light: ChannelTables
    waves: WavePatterns | None
    least: float

    def developed(self, seen: Operand) -> Array:
        """Return the colours of channels, which are the sensor's, shape (..., 3)."""
        reduction = self.view.reduction
        return np.asarray(seen) @ (reduction.weights @ np.linalg.pinv(reduction.response)).T


# Views from one depth have the same.
@functools.lru_cache(maxsize=8)
def _folded_water(
    optics: Optics, depth: float, changes: _Changes, dark: bool, light: str
) -> _FoldedWater:
    """The water without objects, as EEVEE looks it up; what is to be left out is dark."""
    view = _view(optics.view, depth, dict(changes))
    column, phase, bands = _lit(view.column, dark=dark), view.phase, view.column.bands
    emission = occlusions = contrast = None
    if light == _CHANGED and optics.excitation is not None:
        exciting = replace(optics.excitation.column, **dict(changes))
        excitation = replace(optics.excitation, column=_lit(exciting, dark=dark))
        emission = excitation.emission(bands, TABLE_STREAMS)
    field = column.solved_field(phase, TABLE_STREAMS, emission)
    if light == _OCCLUDED:
        straight = column.solved_field(phase, OCCLUSION_STREAMS)
        occlusions = OcclusionSpectra(
            np.zeros((SPECTRA, len(bands))), np.ones((1, len(bands))), straight
        )
    waves, least = optics.waves if view.column.surface == "waves" else None, 0.0
    if waves is not None:
        above = column.mixed_above(view.depth).solved_field(phase, TABLE_STREAMS)
        knots = optics.caustics * waves.contrast(SunlitWater(above))
        contrast, least = functools.partial(waves.contrast_at, knots), least_pattern(knots)
    channels = channels_of(bands, view.reduction.response)
    floor = [view.column.floor_reflectance]
    projected = project(
        field, channels, view.depth, column.skylight.level, floor, occlusions, contrast
    )
    return _FoldedWater(view, channels, field, projected, waves, least)


def _lit(column: WaterColumn, *, dark: bool) -> WaterColumn:
    """The water to solve: its waves are flat on average, and so solved once with the flat one."""
    floor = {"floor_reflectance": 0.0} if dark else {}
    calm = {"surface": "flat"} if column.reflects else {}
    return replace(column, **floor, **calm)


def _view(view: Viewpoint, depth: float, changed: Mapping[str, object]) -> Viewpoint:
    column = replace(view.column, **changed)
    changes: dict[str, object] = {"column": column, "depth": min(depth, column.floor_depth)}
    if isinstance(view, FittedViewpoint):
        changes["reference"] = _view(view.reference, depth, changed)
    return replace(view, **changes)


@dataclass(frozen=True, eq=False)
class _CloudsBefore:
    """What clouds do to rays, and fractions of light that they leave where these end."""

    veil: Veil
    sunlight: Array
    skylight: Array


class _Rays:
    """The rays of a camera and their ends; numbers of shape (m, 1)."""

    def __init__(self, optics: Optics, seen: SeenPoints, floor: float) -> None:
        self.seen, self._clouds = seen, optics.clouds
        self._floor, self._caustics = floor, optics.caustics
        self.origin, self.w = list(seen.origin.T[..., None]), list(seen.direction.T[..., None])
        gone = seen.on_floor & np.isinf(floor)
        self.hit = (np.isfinite(seen.distance) & ~gone)[:, None]
        self.y_o = np.clip(-self.origin[2], 0.0, floor)
        self.boundary = np.asarray(distance_in_water(self.y_o, -self.w[2], floor))
        self.P = np.where(self.hit, seen.distance[:, None], 0.0)
        self.y = self._depths(self.P)

    def _depths(self, P: Array) -> Array:
        return np.clip(self.y_o - self.w[2] * P, 0.0, self._floor)

    def radiance(
        self, water: _FoldedWater, *, occluded: bool = False, sunlit: bool = False
    ) -> Array:
        """Colours of the rays, shape (m, 3).

        ``occluded`` is whether objects occlude light from all sides, ``sunlit`` whether the sun
        shines on all of them.
        """
        seen, w, y_o, y, P = self.seen, self.w, self.y_o, self.y, self.P
        ray = along_rays(water.light, water.field.sun, w)
        sun = 1.0 * (seen.sunlit[:, None] | sunlit)
        left, scattered, single, around = NO_OCCLUSION, NO_OCCLUSION, 1.0, None
        if occluded:
            left, scattered = (
                OcclusionFactor(x[:, None]) for x in (seen.openness, seen.path_openness)
            )
            blocked = seen.blocked(water.light.components, water.light.parts)
            around = None if blocked is None else Around(blocked)
        clouds = self._cloudy(water, ray)
        if clouds is not None:
            sun = sun * clouds.sunlight
            left = OcclusionFactor(left.mean * clouds.skylight)
            scattered, single = (
                OcclusionFactor(scattered.mean * clouds.veil.daylit),
                clouds.veil.sunlit,
            )
        occlusion, normal = OcclusionOnPath(scattered, single), list(seen.normal.T[..., None])
        leaving = ray.leaving(self._item(water, sun, left), y, normal, P)
        on_surface = ray.surface(
            y_o, y, w, P, SeenObject(leaving), occlusion=occlusion, around=around
        )
        column = water.view.column
        surface = SurfaceAbove(
            replace(column.skylight, level=1.0),
            column.refractive_index if column.reflects else None,
            ripples=self._ripples(water),
            foam=self._foam(water),
        )
        in_open = ray.open_water(y_o, w, surface, occlusion)
        if clouds is not None:
            behind = surroundings(ray, y_o, y, w, P)
            on_surface = veiled(on_surface, clouds.veil, ray, y_o, w, around=behind)
            in_open = veiled(in_open, clouds.veil, ray, y_o, w)
        return water.developed(np.where(self.hit, on_surface.total, in_open.total))

    def single_scattering(self, water: _FoldedWater, P: Array | None = None) -> Array:
        """Sunlight that is scattered once on the way, nothing in its way, (m, 3) or (m, k, 3).

        It is that up to distances P, m, shape (m, k); that of all the way by default.
        """
        ends = np.where(self.hit, self.P, self.boundary) if P is None else P
        ends, w = np.minimum(ends, self.boundary)[..., None], [x[..., None] for x in self.w]
        ray = along_rays(water.light, water.field.sun, w)
        y = np.clip(self.y_o[..., None] - w[2] * ends, 0.0, self._floor)
        found = water.developed(ray.single_scattering(self.y_o[..., None], y, w, ends))
        return found[:, 0] if P is None else found

    def _item(self, water: _FoldedWater, sun: Operand, left: OcclusionFactor) -> SurfaceMaterial:
        """What the rays meet: colours, or the floor's reflectance, which is measured."""
        seen, on_floor = self.seen, 1.0 * self.seen.on_floor[:, None]
        facing = np.maximum(-(seen.normal @ np.asarray(water.field.sun)), 0.0) / math.pi
        base = [*((1.0 - on_floor) * seen.colour).T[..., None], on_floor]
        pattern = None
        if water.waves is not None:
            pattern = np.maximum(self._pattern(water, self.P), water.least)
        response = [part * facing[:, None] * sun for part in base]
        return SurfaceMaterial(
            (*COLOURS, len(COLOURS)), response, base, pattern=pattern, occlusion=left
        )

    def missing_light(self, water: _FoldedWater) -> Array:
        """Single scattering that shadows and waves take from the paths; negative: they add."""
        seen, steps = self.seen, self.seen.path_sunlit.shape[1]
        ends = seen.reached[:, None] * np.linspace(0.0, 1.0, steps + 1)
        total = self.single_scattering(water, ends)
        light = 1.0 * seen.path_sunlit
        if water.waves is not None:
            pattern = self._pattern(water, (ends[:, 1:] + ends[:, :-1]) / 2.0)
            light = light * sunlight_factor(pattern, self._caustics)
        return np.sum((1.0 - light)[..., None] * np.diff(total, axis=1), axis=1)

    def _pattern(self, water: _FoldedWater, P: Array) -> Array:
        """Relative sunlight under the waves at distances (m, k)."""
        assert water.waves is not None, "there is a pattern under waves only"
        x, y, z = (a + b * P for a, b in zip(self.origin, self.w, strict=True))
        return water.waves.sunlight_at(x, y, np.maximum(-z, 1e-6), water.field.sun)

    def _at_surface(self) -> tuple[Array, Array]:
        """Where the rays would meet the surface, x and y."""
        along = -self.origin[2] / np.maximum(self.w[2], 1e-3)
        x, y = (self.origin[i] + self.w[i] * along for i in (0, 1))
        return x, y

    def _ripples(self, water: _FoldedWater) -> Ripples | None:
        """The moving surface where the rays would meet it."""
        column = water.view.column
        if water.waves is None or not column.reflects:
            return None
        width = water.waves.glitter_width(column.refractive_index)
        slopes = water.waves.slopes_at(*self._at_surface())
        return Ripples(slopes, width, column.glitter, column.skylight.sun)

    def _foam(self, water: _FoldedWater) -> FoamAhead | None:
        """Foam on it."""
        raised = None if water.waves is None else water.waves.raised
        if raised is None or raised.foam is None:
            return None
        radiance = water.channels.project(foam_light(water.view.column).below)
        return FoamAhead(raised.foam_fraction(*self._at_surface()), radiance)

    def _cloudy(self, water: _FoldedWater, ray: ChannelWater) -> _CloudsBefore | None:
        if not self._clouds:
            return None
        P = np.where(self.hit, self.P, self.boundary)
        place, sun = self.seen.origin.mean(axis=0).tolist(), water.field.sun
        clouds = clouds_in(self._clouds, water.field, water.channels, place)
        points = [a + b * self.P for a, b in zip(self.origin, self.w, strict=True)]
        rate = np.mean(ray.falling_off(self._depths(P), self.w)[1], axis=-1, keepdims=True)
        single, scattered = daylit_fractions(clouds, self.origin, self.w, P, rate, 0.5)
        veil = clouds.veil(self.origin, self.w, P, half_angle2(self.w, sun))
        return _CloudsBefore(
            replace(veil, sunlit=single, daylit=scattered),
            clouds.sunlight_transmittance(points),
            clouds.skylight_transmittance(points),
        )


def single_scattering(optics: Optics, seen: SeenPoints, distances: Array) -> Array:
    """Colours of sunlight that is scattered once up to distances (m, k) along rays, (m, k, 3)."""
    water = _folded_water(optics, seen.depth, (), False, _PLAIN)
    return _Rays(optics, seen, water.view.column.floor_depth).single_scattering(water, distances)
