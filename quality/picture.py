"""The colours that the solved field gives to what a camera sees.

They come in parts that add up, so that what a part is worth can be read off. The formulas
are those of the renderers; there is none of its own here.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.imaging.band_selection import FittedViewpoint
from ..uw_spectral.imaging.optics import Excitation
from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.surface.wave_patterns import (
    LAYERS,
    WavePatterns,
    interp,
    layer_position,
    pattern_at,
    sunlight_factor,
    under_waves,
)
from ..uw_spectral.transfer.pixel import Pixel, surface_light
from ..uw_spectral.transfer.radiance_field import Ripples
from ..uw_spectral.transfer.radiance_table import SHADED_STREAMS, TABLE_STREAMS
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.solved_ray import UNSHADED, PathShade, past_things
from ..uw_spectral.transfer.sunlit_water import SunlitWater
from ..uw_spectral.transfer.tabulated_water import TabulatedWater, tabulated_water
from ..uw_spectral.transfer.water_column import WaterColumn
from .seen_points import SeenPoints
from .terms import (
    DIFFUSE_SHADOWS,
    FLOOR_LIGHT,
    INELASTIC,
    SHAFTS,
    SINGLE,
)


@dataclass(frozen=True, eq=False)
class Optics:
    """Water and camera on some bands.

    Parameters
    ----------
    view : Viewpoint
        Its depth is replaced by that of the rays.
    excitation : Excitation, optional
        What changes the wavelength of light.
    waves : WavePatterns, optional
        The moving surface, where the column has waves.
    """

    view: Viewpoint
    excitation: Excitation | None = None
    waves: WavePatterns | None = None


@dataclass(frozen=True, eq=False)
class Picture:
    """Scene-linear Rec.709 of the rays, in parts that add up, shape (m, 3) each.

    ``plain`` has neither shadows in the water nor diffuse shadows
    nor inelastic light; ``parts`` holds what each of these adds (shadows: take away).
    """

    plain: NDArray[np.float64]
    parts: dict[str, NDArray[np.float64]]

    def without(self, *names: str) -> NDArray[np.float64]:
        """Return the colours without some parts."""
        return self.plain + sum(
            (value for name, value in self.parts.items() if name not in names),
            np.zeros_like(self.plain),
        )


def picture(
    optics: Optics,
    seen: SeenPoints,
    *,
    without: str = "",
    **column: object,
) -> Picture:
    """Colours of the rays.

    Parameters
    ----------
    without : str
        One of :data:`.LIGHTS`, by name: leave that light out.
    **column : object
        Fields of the water column, instead of its own. Waves need ``optics.waves``.
    """
    view = _view(optics.view, seen.depth, column)
    develop = view.reduction.apply
    waves = optics.waves if view.column.surface == "waves" else None
    ray = _Rays(view, seen, waves, without)
    water = _water(view, without)
    plain = develop(ray.radiance(water))
    parts = {}
    if not seen.is_free:
        # Of the same split between what is scattered and what goes on ahead as the shade.
        few = _water(view, without, streams=SHADED_STREAMS)
        parts[DIFFUSE_SHADOWS] = develop(ray.radiance(few, shaded=True) - ray.radiance(few))
    if not seen.path_sunlit.all() or waves is not None:
        parts[SHAFTS] = -develop(ray.missing_light())
    if optics.excitation is not None:
        exciting = dataclasses.replace(optics.excitation.column, **column)
        excitation = dataclasses.replace(optics.excitation, column=exciting)
        parts[INELASTIC] = develop(ray.radiance(_water(view, without, excitation))) - plain
    return Picture(plain, parts)


def _water(
    view: Viewpoint,
    without: str,
    excitation: Excitation | None = None,
    streams: int = TABLE_STREAMS,
) -> TabulatedWater:
    """The water without things, as EEVEE looks it up; what is to be left out is dark."""
    column = view.column
    index = column.refractive_index if column.reflects else None
    beam = column.sun_beam(view.phase)
    field = _field(view, without, excitation, streams)
    return tabulated_water(field, beam, column.skylight, index)


def _field(
    view: Viewpoint,
    without: str,
    excitation: Excitation | None = None,
    streams: int = TABLE_STREAMS,
) -> SolvedField:
    """Its field, with light of changed wavelength if anything changes it."""
    column, emission = _lit(view.column, without), None
    if excitation is not None:
        lit = dataclasses.replace(excitation, column=_lit(excitation.column, without))
        emission = lit.emission(column.bands, streams)
    return column.solved_field(view.phase, streams, emission)


def _lit(column: WaterColumn, without: str) -> WaterColumn:
    """The water to solve: its waves are flat on average, and so solved once with the flat one."""
    dark = {"floor_reflectance": 0.0} if without == FLOOR_LIGHT else {}
    calm = {"surface": "flat"} if column.reflects else {}
    return dataclasses.replace(column, **dark, **calm)


def _view(view: Viewpoint, depth: float, changed: Mapping[str, object]) -> Viewpoint:
    column = dataclasses.replace(view.column, **changed)
    changes: dict[str, object] = {"column": column, "depth": min(depth, column.floor_depth)}
    if isinstance(view, FittedViewpoint):
        changes["reference"] = _view(view.reference, depth, changed)
    return dataclasses.replace(view, **changes)


class _Rays:
    """The rays of a camera, their ends and how these are lit; shapes (m, 1) and (m, n)."""

    def __init__(
        self,
        view: Viewpoint,
        seen: SeenPoints,
        waves: WavePatterns | None,
        without: str,
    ) -> None:
        self.view, self.seen, self.waves, self.leave_out = view, seen, waves, without
        self.w = tuple(seen.direction.T[..., None])
        gone = seen.on_floor & np.isinf(view.column.floor_depth)
        self.hit = (np.isfinite(seen.distance) & ~gone)[:, None]
        self.P = np.where(self.hit, seen.distance[:, None], 0.0)
        floor = view.column.floor_depth
        self.y_o = np.clip(-seen.origin[:, 2, None], 0.0, floor)
        self.y = np.clip(self.y_o - self.w[2] * self.P, 0.0, floor)
        self.up = seen.normal[:, 2, None]
        self.reflectance = np.where(
            seen.on_floor[:, None],
            view.column.floor_reflectance,
            seen.colour @ uplift_basis(view.column.bands).T,
        )
        self.contrast = None
        if waves is not None:
            self.contrast = waves.contrast(SunlitWater(_field(view, without)))

    def radiance(
        self,
        water: TabulatedWater,
        *,
        shaded: bool = False,
    ) -> NDArray[np.float64]:
        """Radiance with unshadowed water, shape (m, n)."""
        sun = np.asarray(self.view.column.sun_direction)
        cosine = -(self.seen.normal @ sun)[:, None]
        response = self.reflectance / math.pi * np.maximum(cosine, 0.0)
        openness, shade = 1.0, UNSHADED
        if shaded:
            openness, shade = self.seen.openness[:, None], self._shade(water)
        patch = water.patch_light(self.y, tuple(self.seen.normal.T[..., None]))
        light = surface_light(
            patch, self.y, self.up, openness=openness, sunlight=self.sunlight(self.P)
        )
        L = light.reflected(response * self.seen.sunlit[:, None], self.reflectance, cosine)
        on_surface = water.surface(self.y_o, self.y, self.w, self.P, L, shade)
        in_open = water.open_water(self.y_o, self.w, self.ripples(), shade)
        return self._seen(on_surface, in_open)

    def _shade(self, water: TabulatedWater) -> PathShade:
        """What things leave of the light of the paths."""
        past: NDArray[np.float64] | float = 1.0
        blocked = self.seen.blocked(self.view.phase)
        if blocked is not None:
            past = np.asarray(past_things(water.beam, self.P, blocked))
        return PathShade(self.seen.path_openness[:, None], beyond=past)

    def _seen(self, on_surface: Pixel, in_open: Pixel) -> NDArray[np.float64]:
        """Light of the rays that hit something, and of those that do not."""
        seen = [on_surface.total, in_open.total]
        if self.leave_out == SINGLE:
            seen = [
                np.maximum(total - pixel.single_scattering, 0.0)
                for total, pixel in zip(seen, (on_surface, in_open), strict=True)
            ]
        return np.where(self.hit, *seen)

    def missing_light(self) -> NDArray[np.float64]:
        """Single scattering that shadows and waves take from the paths; negative: they add."""
        single = self.view.column.sun_beam(self.view.phase).scattered_once
        steps = self.seen.path_sunlit.shape[1]
        ends = self.seen.reached[:, None] * np.linspace(0.0, 1.0, steps + 1)
        total = [single(self.y_o, self.w, ends[:, :1])]
        lost = 0.0
        for k in range(steps):
            total.append(single(self.y_o, self.w, ends[:, k + 1, None]))
            middle = (ends[:, k] + ends[:, k + 1])[:, None] / 2
            light = self.seen.path_sunlit[:, k, None] * self.sunlight(middle)
            lost = lost + (1.0 - light) * (total[-1] - total[-2])
        return np.asarray(lost)

    def sunlight(self, distance: NDArray[np.float64]) -> NDArray[np.float64] | float:
        """Factor of the waves on the sunlight at distances along the rays, shape (m, n)."""
        if self.waves is None or self.contrast is None:
            return 1.0
        point = self.seen.origin + self.seen.direction * distance
        layers, depth = self.waves.layers, np.maximum(-point[:, 2], 1e-6)
        x, y = under_waves(point[:, 0], point[:, 1], depth, list(self.view.column.sun_direction))
        first, last = layers.depths[[0, -1]]
        per_log = (LAYERS - 1) / math.log(last / first)
        position = layer_position(depth, math.log(first), per_log)
        images = [_look_up(image, layers.tile, x, y) for image in layers.images]
        pattern = pattern_at(depth, position, images)
        contrast = interp((2.0 * position)[:, None], list(self.contrast))
        return sunlight_factor(pattern[:, None], contrast)

    def ripples(self) -> Ripples | None:
        """The moving surface where the rays would meet it."""
        if self.waves is None or not self.view.column.reflects:
            return None
        waves, origin, w = self.waves, self.seen.origin, self.seen.direction
        along = -origin[:, 2] / np.maximum(w[:, 2], 1e-3)
        x, y = (origin[:, i] + w[:, i] * along for i in (0, 1))
        slopes = (
            _look_up(waves.slope_x, waves.layers.tile, x, y)[:, None],
            _look_up(waves.slope_y, waves.layers.tile, x, y)[:, None],
        )
        column = self.view.column
        width = waves.glitter_width(column.refractive_index)
        return Ripples(slopes, width, column.glitter, column.skylight.sun)


def _look_up(image: NDArray, tile: float, x: NDArray, y: NDArray) -> NDArray[np.float64]:
    cells = len(image)
    scale = cells / tile
    return image[np.floor(y * scale).astype(int) % cells, np.floor(x * scale).astype(int) % cells]
