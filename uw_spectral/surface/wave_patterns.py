"""What a renderer needs of the moving surface at one moment: caustic layers and slopes.

Four caustic patterns fit the four channels of one image. The formulas that read
it run on numpy arrays and build shader nodes, as everything per pixel does.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from .caustics import SUN_RADIUS, CausticLayers, PatternCarrier, bake_layers
from .raised_waves import (
    FAR_RESOLUTION,
    NO_SWELL,
    RaisedWaves,
    Swell,
    far_waves,
    height_tile,
    image_of,
)
from .wave_components import WaveComponents
from .waves import LONGEST_FETCH, WaveSpectrum
from .whitecaps import Foam, breaking, foam_of, whitecap_cover_Monahan1980

LAYERS = 4
"""Patterns of a frame, one per channel of an image."""
KNOTS = 2 * LAYERS - 1
"""Depths with a contrast per band: the layers and the middles between them."""

_FINEST = 0.016  # cell of an image over the depth that it still resolves
_DEEPEST = 32.0  # m; beyond, the tile limits the pattern
_LEAST_SPAN = 4.0  # of the depths of the layers
_FLAT = 1e-9  # contrast of no pattern
_CRESTS = 4.5  # standard deviations that hardly any crest exceeds
_FADES = 0.1  # m; ripples focus from about there on


@dataclass(frozen=True)
class Sea:
    """Waves on a tile, by their causes.

    Wind speeds are 0 to 40 m/s; fetch, depth and tile in m.

    A value out of its range raises :class:`InputError` when the sea is computed.
    """

    wind_speed: float
    wind_direction: float = 0.0  #: The wind blows *to* it, degrees from +x towards +y.
    fetch: float = LONGEST_FETCH  #: m.
    depth: float = math.inf
    seed: int = 0
    tile: float = 10.0  #: Side of the square after which the waves repeat, m.
    resolution: int = 512
    loop_seconds: float | None = None  #: Time after which the motion repeats.
    #: Whether the surface has heights and sharp crests; else it is a plane with slopes.
    raised: bool = False
    swell: Swell = NO_SWELL  #: That runs under the wind's waves, if they are raised.
    foam: bool = False  #: Whether they leave foam where they break, if they are raised.

    @property
    def spectrum(self) -> WaveSpectrum:
        """Spectrum of all its waves, on the tile or not."""
        return WaveSpectrum(self.wind_speed, self.wind_direction, self.fetch, self.depth)

    def components(self) -> WaveComponents:
        """Return the realised waves."""
        return _components(self)

    def highest_crest(self) -> float:
        """Height over the mean level that crests hardly ever exceed, m; 0 of a plane."""
        return _CRESTS * self._deviation() if self.raised else 0.0

    def raised_at(self, t: float) -> RaisedWaves | None:
        """Return the heights at a moment in s; None of a plane."""
        return _raised(self, t) if self.raised else None

    def significant_height(self) -> float:
        """Four standard deviations of the elevation, m."""
        return 4.0 * self._deviation()

    def _deviation(self) -> float:
        parts = self.components(), _far_components(self)
        return math.sqrt(sum(part.elevation_variance for part in parts))

    def elevation(self, x: ArrayLike, y: ArrayLike, t: float) -> NDArray[np.float64]:
        """Height of a raised surface over the mean level, to first order in its steepness, m."""
        return self.components().elevation(x, y, t) + _far_components(self).elevation(x, y, t)

    def layer_depths(self, floor_depth: float = math.inf) -> NDArray[np.float64]:
        """Depths of the layers, m: from what the images resolve to the floor, or to 32 m.

        Examples
        --------
        >>> Sea(5.0).layer_depths(8.0).round(1).tolist()
        [1.2, 2.3, 4.3, 8.0]
        """
        first = self.tile / self.resolution / _FINEST
        last = max(min(floor_depth, _DEEPEST), _LEAST_SPAN * first)
        return np.geomspace(first, last, LAYERS)

    def at(
        self,
        t: float,
        sun_direction: ArrayLike,
        refractive_index: float,
        floor_depth: float = math.inf,
        *,
        sun_radius: float = SUN_RADIUS,
    ) -> WavePatterns:
        """Compute one moment; it depends on the time only, never on other moments.

        Sunlight travels in the ``sun_direction`` (3,) in the water; the radius is that of the sun
        in air, rad, 0 where the renderer's own sun has a disc.
        """
        waves, depths = self.components(), self.layer_depths(floor_depth)
        layers = bake_layers(
            waves,
            sun_direction,
            depths,
            t,
            self.resolution,
            refractive_index=refractive_index,
            sun_radius=sun_radius,
            choppiness=float(self.raised),
        )
        raised = self.raised_at(t)
        if raised is None:
            slopes = waves.on_grid(self.resolution, t)[1:]
        else:
            slopes = raised.near.slope_x, raised.near.slope_y
        return WavePatterns(layers, *slopes, float(waves.shorter.sum()), raised)


@functools.lru_cache(maxsize=4)
def _components(sea: Sea) -> WaveComponents:
    return sea.spectrum.realise(sea.tile, sea.resolution, sea.seed, loop_seconds=sea.loop_seconds)


@functools.lru_cache(maxsize=4)
def _far_components(sea: Sea) -> WaveComponents:
    return far_waves(sea.spectrum, sea.tile, sea.seed, sea.swell, sea.loop_seconds)


@functools.lru_cache(maxsize=2)
def _raised(sea: Sea, t: float) -> RaisedWaves:
    breaks = _breaking(sea) if sea.foam else (None, None)
    return RaisedWaves(
        height_tile(sea.components(), sea.resolution, t, breaks[0]),
        height_tile(_far_components(sea), FAR_RESOLUTION, t, breaks[1]),
        _foam(sea) if sea.foam else None,
    )


@functools.lru_cache(maxsize=4)
def _breaking(sea: Sea) -> tuple[WaveComponents, WaveComponents]:
    # A swell does not break, or it would be none.
    far = _far_components(replace(sea, swell=NO_SWELL))
    return breaking(sea.components(), sea.resolution), breaking(far, FAR_RESOLUTION)


@functools.lru_cache(maxsize=4)
def _foam(sea: Sea) -> Foam:
    return foam_of(_breaking(sea), whitecap_cover_Monahan1980(sea.wind_speed))


@dataclass(frozen=True, eq=False)
class WavePatterns:
    """Waves at one moment."""

    layers: CausticLayers  #: Relative sunlight at the four depths.
    #: Slopes of the surface; row i, column j is y = i tile/N, x = j tile/N, (N, N).
    slope_x: NDArray[np.float64]
    slope_y: NDArray[np.float64]
    finer: float  #: Slope variance of the waves too short for them.
    raised: RaisedWaves | None = None

    def glitter_width(self, refractive_index: float) -> float:
        """Mean squared angle over which the finer waves and its disc spread the sun, rad².

        A facet turned by a small angle turns the ray in air by n - 1 of it.
        """
        return SUN_RADIUS**2 + (refractive_index - 1) ** 2 * self.finer

    def contrast(self, water: PatternCarrier) -> NDArray[np.float64]:
        """Factor per band on the pattern at the knots, shape (KNOTS, n)."""
        return np.stack([self.layers.contrast(water, depth) for depth in self.knot_depths()])

    def knot_depths(self) -> list[float]:
        """Depths of the knots, m."""
        first, last = self.layers.depths[[0, -1]]
        return np.geomspace(first, last, KNOTS).tolist()

    def position(self, depth: ArrayLike) -> NDArray[np.float64]:
        """Position of depths in m among the layers, see :func:`layer_position`."""
        first, last = self.layers.depths[[0, -1]]
        per_log = (LAYERS - 1) / math.log(last / first)
        return np.asarray(layer_position(np.asarray(depth), math.log(first), per_log))

    def contrast_at(self, knots: NDArray, depths: NDArray) -> NDArray[np.float64]:
        """Interpolate a contrast at the knots (KNOTS, n) at depths (d,), shape (d, n)."""
        return np.asarray(interp(2.0 * self.position(depths)[:, None], list(knots)))

    def sunlight_at(
        self, x: NDArray, y: NDArray, depth: NDArray, sun: Sequence[float]
    ) -> NDArray[np.float64]:
        """Relative sunlight of the nearest samples at places, m, for its direction in the water."""
        x, y = under_waves(x, y, depth, sun)
        images = [_nearest(image, self.layers.tile, x, y) for image in self.layers.images]
        return np.asarray(pattern_at(depth, self.position(depth), images))

    def slopes_at(self, x: NDArray, y: NDArray) -> tuple[NDArray, NDArray]:
        """Slopes of the nearest samples of the surface at places, m."""
        near = [_nearest(image, self.layers.tile, x, y) for image in (self.slope_x, self.slope_y)]
        if self.raised is None:
            return near[0], near[1]
        far = self.raised.far
        of_long = far.at(x, y, far.slope_x, far.slope_y)
        return near[0] + of_long[0], near[1] + of_long[1]

    def caustics_image(self) -> NDArray[np.float32]:
        """One layer per channel, shape (N, N, 4); the first row is y = 0."""
        return np.ascontiguousarray(np.moveaxis(self.layers.images, 0, -1), dtype=np.float32)

    def slopes_image(self) -> NDArray[np.float32]:
        """Slopes along x and y in the first two channels, shape (N, N, 4).

        With heights, the elevation is in the third.
        """
        if self.raised is not None:
            return self.raised.near.image()
        return image_of(self.slope_x, self.slope_y, np.zeros_like(self.slope_x))


def _nearest(image: NDArray, tile: float, x: NDArray, y: NDArray) -> NDArray:
    at = [np.floor(along * len(image) / tile).astype(int) % len(image) for along in (y, x)]
    return image[*at]


def least_pattern(knots: NDArray) -> float:
    """Pattern below which the band of the most contrast (KNOTS, n) would have no sunlight."""
    return 1.0 - 1.0 / max(float(knots.max()), _FLAT)


def under_waves(
    x: Operand,
    y: Operand,
    depth: Operand,
    sun: Sequence[Operand],
) -> tuple[Operand, Operand]:
    """Where the sunlight of a point would meet the flat surface, x and y.

    ``depth`` is positive down; ``sun`` is the direction of sunlight in the water.
    """
    back = depth / sun[2]
    return x + back * sun[0], y + back * sun[1]


def layer_position(
    depth: Operand,
    log_first: Operand,
    per_log: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Position among the layers, 0 at the first, ``LAYERS - 1`` at the last.

    ``log_first`` is the natural logarithm of the first layer's depth in m, ``per_log`` layers per
    unit of it.
    """
    return (m.log(m.maximum(depth, 1e-6)) - log_first) * per_log


def interp(position: Operand, values: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
    """Interpolate values at the positions 0, 1, 2 …, constant beyond the ends."""
    total = values[0]
    for index, (low, high) in enumerate(itertools.pairwise(values)):
        total = total + (high - low) * m.clamp(position - float(index), 0.0, 1.0)
    return total


def pattern_at(
    depth: Operand,
    position: Operand,
    layers: Sequence[Operand],
    m: Mathematics = NUMPY,
) -> Operand:
    """Relative sunlight at a depth, blended from the layers; it fades to 1 at the surface.

    ``layers`` are the patterns where the sunlight of the point meets the surface, ``position`` is
    from :func:`layer_position`.
    """
    fade = m.minimum(depth * (1.0 / _FADES), 1.0)
    return 1.0 + fade * (interp(position, layers, m) - 1.0)


def sunlight_factor(pattern: Operand, contrast: Operand, m: Mathematics = NUMPY) -> Operand:
    """Factor on the sunlight of a band: its contrast times the pattern, not below 0."""
    return m.maximum(1.0 + contrast * (pattern - 1.0), 0.0)
