"""What a camera sees along a few of its rays, and the colours that the closed form gives it.

The colours come in parts that add up, so that what a part is worth can be read
off. The formulas are those of the renderers; there is none of its own here.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.band_selection import FittedViewpoint
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
from ..uw_spectral.transfer.aureole import Aureole
from ..uw_spectral.transfer.closed_form import ClosedForm
from ..uw_spectral.transfer.inelastic_light import InelasticLight
from ..uw_spectral.transfer.light_cone import LightCone
from ..uw_spectral.transfer.pixel import Pixel, UndisturbedWater, surface_light
from ..uw_spectral.transfer.radiance_field import Ripples
from ..uw_spectral.transfer.sunlit_water import SunlitWater
from .terms import (
    AUREOLE,
    DIFFUSE_SHADOWS,
    FLOOR_LIGHT,
    INELASTIC,
    INTERNAL_REFLECTION,
    SHAFTS,
    SINGLE,
)

_SHARPEST = Aureole(1.0, (0.0, 0.0, 0.0), (), ())
_WHOLE = 0.01  # share of a picture from which on something counts as much as what fills it
_SEED = 1


@dataclass(frozen=True, eq=False)
class SeenPoints:
    """What a camera sees at one moment along m rays; x, y horizontal, z up, z = 0 the surface.

    Parameters
    ----------
    origin : array, shape (m, 3)
        Where the rays leave the camera, m.
    direction : array, shape (m, 3)
        Unit view directions, away from the camera.
    distance : array, shape (m,)
        To what the ray meets, m; infinite for open water and the surface.
    normal : array, shape (m, 3)
        Unit normal there, towards the camera.
    colour : array, shape (m, 3)
        Base colour there, linear Rec.709.
    sunlit : array of bool, shape (m,)
        Whether nothing stands between the point and the sun.
    path_sunlit : array of bool, shape (m, k)
        The same in the middle of k equal steps along the ray.
    reach : float
        Distance up to which those steps go, at most up to the point, m.
    on_floor : array of bool, shape (m,)
        Whether the point lies on the floor of the water column.
    openness : array, shape (m,)
        Share of the light from above, the direct sun apart, that nothing keeps from the
        point: see :func:`openness`. 1 for open water.
    pixels : array, shape (m,)
        Share of the picture that each ray stands for; they add up to 1.

    Raises
    ------
    InputError
        If the camera is not under water, there is no ray, or shapes differ.
    """

    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    distance: NDArray[np.float64]
    normal: NDArray[np.float64]
    colour: NDArray[np.float64]
    sunlit: NDArray[np.bool_]
    path_sunlit: NDArray[np.bool_]
    reach: float
    on_floor: NDArray[np.bool_]
    openness: NDArray[np.float64]
    pixels: NDArray[np.float64]

    def __post_init__(self) -> None:
        count = len(self.direction)
        if not count:
            raise InputError("seen points: there is no ray; give at least one")
        if not self.depth > 0:
            raise InputError(
                f"seen points: the camera is {-self.depth:g} m above the water; the surface is "
                "z = 0, move the camera below it"
            )
        for name in self._per_ray():
            if len(getattr(self, name)) != count:
                raise InputError(
                    f"seen points: {name} has {len(getattr(self, name))} rows for {count} rays"
                )

    def __len__(self) -> int:
        return len(self.direction)

    @property
    def depth(self) -> float:
        """Mean depth of the camera's rays, m."""
        return -float(self.origin[:, 2].mean())

    @property
    def reached(self) -> NDArray[np.float64]:
        """How far each ray was looked at for shadows, m."""
        return np.minimum(self.distance, self.reach)

    @property
    def shaded_path(self) -> float:
        """Share of the paths that lies in shadow, mean over the picture."""
        return float(self.pixels @ (1.0 - self.path_sunlit.mean(axis=1)))

    @property
    def kind(self) -> NDArray[np.int64]:
        """What each ray meets: 0 open water or the surface, 1 the column's floor, 2 an object."""
        return np.where(self.on_floor, 1, np.where(np.isfinite(self.distance), 2, 0))

    @property
    def weight(self) -> NDArray[np.float64]:
        """Weights of the rays in the mean ΔE2000 of a picture, shape (m,); they add up to 1.

        Objects, floor and open water with the surface count equally, each by
        the mean over its pixels: a picture's subject may be small, the floor
        would drown it as the open water does. What fills less than 1 % of the
        picture counts in proportion, so that no single ray decides.
        """
        weight = np.zeros(len(self))
        for of in self._kinds():
            share = self.pixels[of].sum()
            weight[of] = min(share / _WHOLE, 1.0) * self.pixels[of] / share
        return weight / weight.sum()

    def subsample(self, count: int) -> SeenPoints:
        """Return about so many of the rays, spread over the picture and what they meet.

        Each kind gets as many, or all it has; :attr:`pixels` keeps its share of the picture.
        """
        if count >= len(self):
            return self
        random = np.random.default_rng(_SEED)
        left, chosen, pixels = count, [], np.zeros(len(self))
        kinds = sorted(self._kinds(), key=len)
        for index, of in enumerate(kinds):
            take = min(len(of), max(left // (len(kinds) - index), 1))
            left -= take
            # One of each stretch, at random: even steps could all fall into one column.
            edges = np.linspace(0, len(of), take + 1)
            which = of[(edges[:-1] + random.random(take) * np.diff(edges)).astype(int)]
            pixels[which] = self.pixels[of].sum() / take
            chosen.append(which)
        rows = np.sort(np.concatenate(chosen))
        values = {name: getattr(self, name)[rows] for name in self._per_ray()}
        return dataclasses.replace(self, **values | {"pixels": pixels[rows]})

    def _kinds(self) -> list[NDArray[np.int64]]:
        """Indices of the rays of each kind that is there."""
        kind = self.kind
        return [np.flatnonzero(kind == which) for which in np.unique(kind)]

    def _per_ray(self) -> list[str]:
        return [f.name for f in dataclasses.fields(self) if f.name != "reach"]


def cone_directions(cone: LightCone, count: int) -> NDArray[np.float64]:
    """Return unit directions from which the light of a cone comes, spread evenly.

    Shape (k, 3); those below the horizon are left out: no light comes from there.

    Examples
    --------
    >>> down = LightCone(np.array([0.0, 0.0, -1.0]), math.radians(60))
    >>> up = cone_directions(down, 8)[:, 2]
    >>> round(float(up.mean()), 6), bool(up.min() > 0.5)
    (0.75, True)
    """
    i = np.arange(count)
    z = 1.0 - (1.0 - math.cos(cone.half_angle)) * (i + 0.5) / count
    side, turn = np.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * i
    axis = -cone.direction
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.5 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    w = np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=-1)
    w = w @ np.stack([across, np.cross(axis, across), axis])
    return w[w[:, 2] > 0]


def openness(
    normal: NDArray[np.float64], directions: NDArray[np.float64], clear: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Share of the light of a cone that reaches surfaces.

    Parameters
    ----------
    normal : array, shape (m, 3)
        Unit normals.
    directions : array, shape (k, 3)
        Of :func:`cone_directions`.
    clear : array of bool, shape (m, k)
        Whether nothing stands between a surface and the water's surface in a direction.

    Returns
    -------
    array, shape (m,)
        By the cosine; 1 where the cone does not light the surface at all.
    """
    cosine = np.maximum(normal @ directions.T, 0.0)
    total = cosine.sum(axis=1)
    return np.where(total > 0, (cosine * clear).sum(axis=1) / np.where(total > 0, total, 1.0), 1.0)


@dataclass(frozen=True, eq=False)
class Optics:
    """Water and camera on some bands.

    Parameters
    ----------
    view : Viewpoint
        Its depth is replaced by that of the rays.
    inelastic : InelasticLight, optional
        On the same bands.
    waves : WavePatterns, optional
        The moving surface, where the column has waves.
    """

    view: Viewpoint
    inelastic: InelasticLight | None = None
    waves: WavePatterns | None = None


@dataclass(frozen=True, eq=False)
class Picture:
    """Scene-linear Rec.709 of the rays, in parts that add up, shape (m, 3) each.

    ``plain`` has neither aureole nor shadows in the water nor diffuse shadows
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
    optics : Optics
    seen : SeenPoints
    without : str
        One of :data:`.LIGHTS`, by name: leave that light out.
    **column : object
        Fields of the water column, instead of its own. Waves need ``optics.waves``.

    Returns
    -------
    Picture
    """
    view = _view(optics.view, seen.depth, column)
    develop = view.reduction.apply
    waves = optics.waves if view.column.surface == "waves" else None
    ray = _Rays(view, seen, waves, without)
    blurred = view.path_radiance
    if without == FLOOR_LIGHT:
        dark = dataclasses.replace(blurred.field, C2=0.0 * blurred.field.C2)
        blurred = dataclasses.replace(blurred, field=dark)
    sharp = dataclasses.replace(blurred, aureole=_SHARPEST)
    plain = develop(ray.radiance(sharp))
    bright = develop(ray.radiance(blurred))
    parts = {AUREOLE: bright - plain}
    if (seen.openness < 1).any():
        shaded = ray.radiance(blurred, seen.openness[:, None])
        parts[DIFFUSE_SHADOWS] = develop(shaded) - bright
    if not seen.path_sunlit.all() or waves is not None:
        parts[SHAFTS] = -develop(ray.missing_light(blurred))
    if optics.inelastic is not None:
        parts[INELASTIC] = develop(ray.inelastic(optics.inelastic))
    return Picture(plain, parts)


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
        self.y_o = np.clip(-seen.origin[:, 2, None], 0.0, view.field.y_f)
        self.y = np.clip(self.y_o - self.w[2] * self.P, 0.0, view.field.y_f)
        self.up = seen.normal[:, 2, None]
        self.reflectance = np.where(
            seen.on_floor[:, None],
            view.column.floor_reflectance,
            seen.colour @ uplift_basis(view.column.bands).T,
        )
        self.contrast = None
        if waves is not None:
            sun = np.asarray(view.column.sun_direction)
            self.contrast = waves.contrast(SunlitWater(view.field, view.phase, sun))

    def water(
        self, elastic: ClosedForm, inelastic: InelasticLight | None = None
    ) -> UndisturbedWater:
        """The water without things; what is to be left out is dark."""
        column = self.view.column
        index = column.refractive_index if column.reflects else None
        mirrors = self.leave_out != INTERNAL_REFLECTION
        return UndisturbedWater(elastic, column.sky_radiance, index, inelastic, mirrors)

    def radiance(
        self, elastic: ClosedForm, openness: NDArray[np.float64] | float = 1.0
    ) -> NDArray[np.float64]:
        """Elastic radiance with unshadowed water, shape (m, n)."""
        sun = np.asarray(self.view.column.sun_direction)
        cosine = -(self.seen.normal @ sun)[:, None]
        response = self.reflectance / math.pi * np.maximum(cosine, 0.0)
        light = surface_light(
            elastic.field, self.y, self.up, openness=openness, sunlight=self.sunlight(self.P)
        )
        L = light.reflected(response * self.seen.sunlit[:, None], self.reflectance, cosine)
        water = self.water(elastic)
        on_surface = water.surface(self.y_o, self.y, self.w, self.P, L)
        return self._seen(on_surface, water.open_water(self.y_o, self.w, ripples=self.ripples()))

    def inelastic(self, light: InelasticLight) -> NDArray[np.float64]:
        """Radiance of changed wavelength."""
        water = self.water(self.view.path_radiance, light)
        L = self.reflectance / math.pi * light.surface_irradiance(self.y, self.up)
        on_surface = water.surface(self.y_o, self.y, self.w, self.P, 0.0, L_inelastic=L)
        in_open = water.open_water(self.y_o, self.w)
        return np.where(self.hit, on_surface.inelastic, in_open.inelastic)

    def _seen(self, on_surface: Pixel, in_open: Pixel) -> NDArray[np.float64]:
        """Light of the rays that hit something, and of those that do not."""
        seen = [on_surface.total, in_open.total]
        if self.leave_out == SINGLE:
            seen = [
                np.maximum(total - pixel.single_scattering, 0.0)
                for total, pixel in zip(seen, (on_surface, in_open), strict=True)
            ]
        return np.where(self.hit, *seen)

    def missing_light(self, water: ClosedForm) -> NDArray[np.float64]:
        """Single scattering that shadows and waves take from the paths; negative: they add."""
        steps = self.seen.path_sunlit.shape[1]
        ends = self.seen.reached[:, None] * np.linspace(0.0, 1.0, steps + 1)
        total = [water.single_scattering(self.y_o, self.w, ends[:, :1])]
        lost = 0.0
        for k in range(steps):
            total.append(water.single_scattering(self.y_o, self.w, ends[:, k + 1, None]))
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
        return Ripples(slopes, waves.glitter_width(self.view.column.refractive_index))


def _look_up(image: NDArray, tile: float, x: NDArray, y: NDArray) -> NDArray[np.float64]:
    cells = len(image)
    scale = cells / tile
    return image[np.floor(y * scale).astype(int) % cells, np.floor(x * scale).astype(int) % cells]
