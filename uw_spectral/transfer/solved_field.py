"""The solved light field of layered water: irradiances, and radiance along any ray.

Every layer holds its light along the streams as a sum of exponentials of scaled optical
depth, for each cosine of azimuth. Between the quadrature cosines the radiance is the integral
of the source function along the ray, in closed form: at cosine μ an exponential
of rate r gives (e^{-rt} - e^{-r t0 - (t - t0)/μ}) / (1 - rμ), in which directions and depths
separate. A grid of them so takes two products of matrices. Sunlight scattered once is
exact (T. Nakajima & M. Tanaka, JQSRT 40, 51 (1988), the TMS correction); close to the sun it
stands for light scattered at small angles many times, by the factor of :mod:`.aureole`.

Depth is positive down; ``mu`` is the cosine of the direction light travels to, positive
down. Irradiances and radiances are in the units of E.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..water.phase import BandPhase, PhaseFunction
from .aureole import WIDEST, SpreadSun, spread_sun
from .legendre import legendre_modes
from .radiance_field import FARTHEST, mirrored_ray, sky_and_mirrored
from .solved_layer import (
    LEVEL,
    THIN,
    Array,
    Boundaries,
    SolvedLayer,
    across_layer,
    path_of,
    weight_of,
)
from .sun_beam import SUN_DISC
from .under_waves import UPWELLING_COSINES, UPWELLING_TURNS, UpwellingLight, under_waves


@dataclass(frozen=True, eq=False)
class SolvedField:
    """Light field of n bands; :func:`.solve_discrete_ordinates` makes it."""

    #: Quadrature cosines and weights, which add up to 1, of the streams down, mirrored by those up,
    #: (N,).
    mu: Array
    weights: Array
    layers: Sequence[SolvedLayer]  #: From the surface down.
    light: Boundaries

    @property
    def floor_depth(self) -> float:
        """Depth of the floor, m; infinite without one."""
        return self.layers[-1].bottom

    @property
    def sun(self) -> Sequence[float]:
        """Unit direction that sunlight travels to in the water, z up."""
        return self.light.sun

    @functools.cached_property
    def floor_radiance(self) -> Array:
        """Radiance of the Lambertian floor, shape (n,); 0 without one."""
        if math.isinf(self.floor_depth):
            return np.zeros_like(self.light.E)
        return self.light.floor_reflectance / math.pi * self.Ed(self.floor_depth)

    @property
    def extinction(self) -> Array:
        """Extinction c* without the forward peak, of the uppermost layer, 1/m, shape (n,)."""
        return self.layers[0].scaled

    @property
    def scattering(self) -> Array:
        """Scattering coefficient b of the uppermost layer, 1/m, shape (n,)."""
        return self.layers[0].b

    def phase_at(self, y: float) -> BandPhase:
        """Phase function of the water at a depth."""
        return self._layer_at(y).phase

    def scattering_at(self, depths: ArrayLike) -> Array:
        """Scattering coefficient b at depths (d,), 1/m, shape (d, n)."""
        return np.array([self.layers[place].b for place in self._places(np.asarray(depths))])

    def weight_at(self, y: float, part: PhaseFunction) -> Array:
        """Weight of a part in the phase function of the water at a depth, shape (n,)."""
        return weight_of(self.phase_at(y), part)

    def peak_at(self, y: float) -> Array:
        """Fraction of the scattering that counts as unscattered forward peak, shape (n,)."""
        layer = self._layer_at(y)
        return (layer.c - layer.scaled) / np.maximum(layer.b, np.finfo(np.float64).tiny)

    def _layer_at(self, y: float) -> SolvedLayer:
        return self.layers[int(self._places(np.array([y]))[0])]

    @property
    def layered(self) -> bool:
        """Whether the water differs with depth."""
        return len(self.layers) > 1

    @property
    def components(self) -> tuple[PhaseFunction, ...]:
        """Parts of the phase functions of all layers, each once."""
        parts = (part for layer in self.layers for part in layer.phase.components)
        return tuple(dict.fromkeys(parts))

    def changes(self, factor: float) -> list[float]:
        """Depths where the extinction c* changes by a factor in any band, m, most change first."""
        ratios = {
            lower.top: float(np.abs(np.log(lower.scaled / upper.scaled)).max())
            for upper, lower in itertools.pairwise(self.layers)
        }
        strong = [y for y, ratio in ratios.items() if ratio > math.log(factor)]
        return sorted(strong, key=lambda y: -ratios[y])

    def extinction_between(self, y: ArrayLike, z: ArrayLike, *, scaled: bool) -> Array:
        """Mean extinction of the water between depths y and z, 1/m, shape (..., n).

        It is that of a straight path between them. ``scaled`` leaves the forward peak out.
        """
        return self._mean_between(y, z, lambda layer: layer.scaled if scaled else layer.c)

    def scattering_between(self, y: ArrayLike, z: ArrayLike) -> Array:
        """Mean scattering coefficient b between depths y and z, 1/m, shape (..., n)."""
        return self._mean_between(y, z, lambda layer: layer.b)

    def _mean_between(
        self, y: ArrayLike, z: ArrayLike, of_layer: Callable[[SolvedLayer], Array]
    ) -> Array:
        y, z = np.broadcast_arrays(np.asarray(y, np.float64), np.asarray(z, np.float64))
        middle, half = (y + z) / 2.0, np.abs(y - z) / 2.0
        half = np.maximum(half, THIN * (1.0 + middle))
        low, high = np.maximum(middle - half, 0.0)[..., None], (middle + half)[..., None]
        total = 0.0
        for layer, below in itertools.zip_longest(self.layers, self.layers[1:]):
            bottom = math.inf if below is None else below.top
            inside = np.clip(high, layer.top, bottom) - np.clip(low, layer.top, bottom)
            total = total + inside * of_layer(layer)
        return total / (high - low)

    def beam(self, depths: ArrayLike) -> Array:
        """Fraction of the sun's beam, the forward peak included, left at depths, shape (n, d)."""
        return np.exp(-self._optical_depth(np.asarray(depths, np.float64)) / self.light.mu_s)

    def stream_modes(self, depths: ArrayLike, modes: int) -> tuple[Array, Array]:
        """Cosine terms in azimuth of the radiance along the streams, without :meth:`beam`.

        Down and up, of shape (modes, n, d, N), at depths (d,) in m; those that the field lacks are
        0.
        """
        depths, places = np.asarray(depths, np.float64), self._places(depths)
        shape = (2, modes, len(self.light.E), len(depths), len(self.mu))
        found = np.zeros(shape)
        for place, layer in enumerate(self.layers):
            here = places == place
            t = layer.scaled[:, None] * np.maximum(depths[here] - layer.top, 0.0)
            exponentials = layer.exponentials(t, modes)
            for way, streams in zip(found, (layer.down, layer.up), strict=True):
                radiance = streams[:modes] @ exponentials
                way[: len(radiance), :, here] = np.swapaxes(radiance, 2, 3)
        return found[0], found[1]

    def Ed(self, y: ArrayLike) -> Array:
        """Downwelling irradiance, direct sun included, at depths y, shape (..., n)."""
        return self._irradiance(y, self.weights * self.mu, 0.0, 1.0)

    def Eu(self, y: ArrayLike) -> Array:
        """Upwelling irradiance at depths y, shape (..., n)."""
        return self._irradiance(y, 0.0, self.weights * self.mu, 0.0)

    def scalar_irradiance(self, y: ArrayLike) -> Array:
        """Scalar irradiance E0, direct sun included, at depths y, shape (..., n)."""
        return self._irradiance(y, self.weights, self.weights, 1.0 / self.light.mu_s)

    def radiance(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """Radiance L(y, w) of everything that lies ahead of depths y along view directions w.

        The sun's own disc is left out. Unit vectors ``w`` point away from the camera, z up, and
        broadcast with ``y``; shape (..., n).
        """
        y, mu, turn, shape = self._rays(y, w)
        seen = self._scattered(y, mu, turn)
        seen = seen + self._single_spread(y, mu, turn)
        seen = seen + self._image(y, mu, turn)
        return seen.reshape(*shape, -1)

    def scattered(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """Radiance M(y, w): :meth:`radiance` without sunlight scattered once and the surface.

        What is left is smooth but for directions close to the sun: light scattered more
        than once, skylight, light of the floor. Arguments and result as :meth:`radiance`.
        """
        y, mu, turn, shape = self._rays(y, w)
        M = self._scattered(y, mu, turn) + self._single_spread(y, mu, turn)
        return (M - self._single(y, mu, turn, scaled=False)).reshape(*shape, -1)

    def single_scattering(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """Radiance of sunlight scattered once between depths y and the end of the water."""
        y, mu, turn, shape = self._rays(y, w)
        return self._single(y, mu, turn, scaled=False).reshape(*shape, -1)

    def images_and_single(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """What :meth:`scattered_on_grid` lacks of :meth:`radiance`, along rays that look down."""
        y, mu, turn, shape = self._rays(y, w)
        seen = self._single(y, mu, turn, scaled=True)
        if math.isfinite(self.floor_depth):
            depth = self._optical_depth(np.array([self.floor_depth])) - self._optical_depth(y)
            seen = seen + self.floor_radiance * np.exp(-depth / np.abs(mu)).T
        return seen.reshape(*shape, -1)

    def surface_radiance(self, w: Sequence[ArrayLike], mirrored: ArrayLike | None = None) -> Array:
        """Radiance just below the surface along upward view directions: sky, mirrored water.

        ``mirrored`` is M* of :meth:`scattered_on_grid` at the surface along the mirrored
        directions, if known, (..., n).
        """
        _, mu, turn, shape = self._rays(0.0, w)
        if mirrored is not None:
            mirrored = np.reshape(np.asarray(mirrored), (len(mu), -1))
        return self._under_surface(mu, turn, mirrored).reshape(*shape, -1)

    def _rays(
        self, y: ArrayLike, w: Sequence[ArrayLike]
    ) -> tuple[Array, Array, Array, tuple[int, ...]]:
        """Depth, cosine of travel and azimuth of travel to the sun's, of each ray in a row."""
        y, *w = np.broadcast_arrays(y, *w)
        shape = np.shape(y)
        x, along, mu = (np.ravel(part).astype(np.float64) for part in w)
        sx, sy = self.light.sun[:2]
        turn = np.arctan2(-along, -x) - math.atan2(sy, sx)
        mu = np.where(np.abs(mu) < LEVEL, LEVEL, mu)
        return np.ravel(y).astype(np.float64), mu, turn, shape

    def scattered_on_grid(self, depths: ArrayLike, mu: ArrayLike, turns: ArrayLike) -> Array:
        """Radiance M* at all depths and directions of a grid.

        It is the part of :meth:`radiance` that is smooth in direction: without sunlight
        scattered once by the exact phase function, and without the images of surface and floor.

        Shape (n, d, v, h): ``mu`` (v,) are cosines of travel, positive down, not 0; ``turns`` (h,)
        its azimuths against the sun's, rad.
        """
        depths, mu, turns = (np.asarray(x, np.float64) for x in (depths, mu, turns))
        found = self._scattered_modes(depths[:, None], mu, np.zeros_like(self.light.E))
        cosines = np.cos(np.arange(len(found))[:, None] * turns)
        return np.moveaxis(found, 0, -1) @ cosines

    def single_scattering_on_grid(self, depths: ArrayLike, mu: ArrayLike) -> Array:
        """Sunlight scattered once, per value of each part of the phase function.

        With the :attr:`components` p of the phase function towards a direction, Σ p times this
        is the light that :meth:`scattered_on_grid` leaves out, counted with :attr:`extinction`.

        An irradiance, of shape (k, n, d, v).
        """
        depths, mu = np.asarray(depths, np.float64), np.asarray(mu, np.float64)
        found = self.single_scattering_on_rays(np.repeat(depths, len(mu)), np.tile(mu, len(depths)))
        found = found.reshape(len(found), len(depths), len(mu), -1)
        return np.moveaxis(found, -1, 1)

    def single_scattering_on_rays(self, y: Array, mu: Array) -> Array:
        """Return :meth:`single_scattering_on_grid` of rays, y and mu (q,): (k, q, n)."""

        def of(part: PhaseFunction) -> Array:
            return self._single_scattering(
                y, mu, lambda layer, _: weight_of(layer.phase, part), scaled=True
            )

        return np.array([of(part) for part in self.components])

    def aureole(self, depths: ArrayLike, s2: ArrayLike) -> Array:
        """Factor on sunlight scattered once that makes it the sun's aureole, shape (n, d, t).

        It multiplies what :meth:`scattered_on_grid` leaves out, counted with :attr:`extinction`, at
        squared sines of half the angle to the sun, ``s2`` (t,); 1 further than 15° from it.
        """
        spread = _spread_sun(self, np.asarray(depths, np.float64).tobytes())
        return np.moveaxis(spread.factor(np.asarray(s2, np.float64)), 2, 0).swapaxes(1, 2)

    def spread_sun(self, y: Array) -> SpreadSun:
        """Return what spreads the sun's beam down to depths y (d, 1)."""
        water = [(x.phase, x.b * x.inside(y) / self.light.mu_s) for x in self.layers]
        return spread_sun(water, 2 * len(self.mu))

    def _irradiance(self, y: ArrayLike, down: ArrayLike, up: ArrayLike, beam: float) -> Array:
        """Streams and the sun's beam, weighted and added up at depths y, shape (..., n)."""
        depths = np.ravel(np.asarray(y, np.float64))
        falling, rising = (x[0] for x in self.stream_modes(depths, 1))
        total = 2 * math.pi * (falling * down + rising * up).sum(axis=-1)
        total += beam * self.light.E[:, None] * self.beam(depths)
        return total.T.reshape(*np.shape(y), -1)

    def _places(self, depths: ArrayLike) -> NDArray[np.intp]:
        """Index of the layer at each depth; what lies deeper is in the last."""
        return np.searchsorted([layer.bottom for layer in self.layers[:-1]], depths)

    def _optical_depth(self, y: Array, *, scaled: bool = True) -> Array:
        """Optical depth of depths y (d,), shape (n, d)."""
        c = [(layer.scaled if scaled else layer.c)[:, None] for layer in self.layers]
        parts = [c * layer.inside(y) for c, layer in zip(c, self.layers, strict=True)]
        return np.sum(parts, axis=0)

    def _orders(self, mu: Array) -> Iterator[tuple[NDArray[np.bool_], Sequence[SolvedLayer]]]:
        """Rays of light that goes down and up, and the layers in the order it meets them."""
        down = mu > 0
        for rays, order in ((down, self.layers), (~down, self.layers[::-1])):
            if rays.any():
                yield rays, order

    def _scattered(self, y: Array, mu: Array, turn: Array) -> Array:
        """Light of the streams' source function and of the floor along rays, shape (q, n)."""
        found = self._scattered_modes(y, mu, self.floor_radiance)
        cosines = np.cos(np.arange(len(found))[:, None] * turn)
        return np.einsum("mnq,mq->qn", found, cosines)

    def _scattered_modes(self, y: Array, mu: Array, floor_radiance: Array) -> Array:
        """Azimuth modes of that light over a floor; y (q,) as mu, or (d, 1) for all depths.

        Shape (m, n, q), or (m, n, d, q).
        """
        modes, n, degrees = self.layers[0].source.shape[:3]
        legendre = legendre_modes(degrees - 1, modes, mu)
        total = np.zeros((modes, n, *np.broadcast_shapes(y.shape, mu.shape)))
        # Where all rays are looked at in all depths, up and down have the same.
        depths = {x: x.exponentials(x.scaled_below(y)) for x in self.layers if y.ndim > 1}
        for rays, order in self._orders(mu):
            here = y if y.ndim > 1 else y[rays]
            seen = np.zeros_like(total[..., rays])
            if mu[rays][0] < 0:
                seen[0] += floor_radiance.reshape(n, *[1] * y.ndim)
            for layer in order:
                at_y = depths.get(layer)
                seen = across_layer(layer, seen, here, mu[rays], legendre[..., rays], at_y)
            total[..., rays] = seen
        return total

    def _length(self, layer: SolvedLayer, y: Array, mu: Array) -> tuple[Array, Array]:
        """Depth below the top of a layer at which a ray is last, and its length in it, m."""
        below = layer.inside(y)
        inside = np.where(mu > 0, below, np.minimum(layer.bottom - layer.top, FARTHEST) - below)
        return below, np.clip(inside / np.abs(mu), 0.0, FARTHEST)

    def _single_spread(self, y: Array, mu: Array, turn: Array) -> Array:
        """Sunlight scattered once, and at small angles more often, shape (q, n)."""
        light, s2 = self._single(y, mu, turn, scaled=True), self._half_angle2(mu, turn)
        close = s2 < WIDEST
        for depth in np.unique(y[close]):
            rays = close & (y == depth)
            light[rays] *= self.aureole([depth], s2[rays])[:, 0].T
        return light

    def _half_angle2(self, mu: Array, turn: Array) -> Array:
        """Squared sine of half the angle to the sun, as :func:`.sun_beam.half_angle2`."""
        mu_s = self.light.mu_s
        across = np.sqrt(np.maximum(1.0 - mu**2, 0.0)) * math.sqrt(1.0 - mu_s**2)
        return np.clip(0.5 - 0.5 * (mu * mu_s + across * np.cos(turn)), SUN_DISC, 1.0)

    def _single(self, y: Array, mu: Array, turn: Array, *, scaled: bool) -> Array:
        """Sunlight scattered once by the exact phase function, shape (q, n)."""
        s2 = self._half_angle2(mu, turn)[:, None]

        def phase(layer: SolvedLayer, rays: NDArray[np.bool_]) -> Array:
            return layer.phase.per_steradian(s2[rays])

        return self._single_scattering(y, mu, phase, scaled=scaled)

    def _single_scattering(
        self,
        y: Array,
        mu: Array,
        phase: Callable[[SolvedLayer, NDArray[np.bool_]], Array],
        *,
        scaled: bool,
    ) -> Array:
        """Sunlight that each layer scatters with a phase function for some of the rays, (q, n)."""
        light, total = self.light, np.zeros((len(mu), len(self.light.E)))
        for rays, order in self._orders(mu):
            for layer in order:
                extinction = (layer.scaled if scaled else layer.c)[:, None]
                t, P = self._length(layer, y[rays], mu[rays])
                depth = self._optical_depth(layer.top + t, scaled=scaled)
                P = extinction * P
                part = path_of(-depth / light.mu_s, 1.0 - mu[rays] / light.mu_s, P) / extinction
                source = layer.b * phase(layer, rays) * light.E / light.mu_s
                total[rays] = total[rays] * np.exp(-P.T) + source * part.T
        return total

    def _image(self, y: Array, mu: Array, turn: Array) -> Array:
        """The surface as it is seen from depths y along rays that come down from it."""
        total, down = np.zeros((len(mu), len(self.light.E))), mu > 0
        if down.any():
            image = self._under_surface(mu[down], turn[down])
            y, mu = y[down], mu[down]
            depth = sum(x.scaled[:, None] * self._length(x, y, mu)[1] for x in self.layers)
            total[down] = image * np.exp(-depth).T
        return total

    def _under_surface(self, mu: Array, turn: Array, mirrored: Array | None = None) -> Array:
        """Radiance that comes down from the surface along mu > 0, shape (q, n)."""
        light = self.light
        across = np.sqrt(1.0 - mu**2)
        turn = turn + math.atan2(light.sun[1], light.sun[0])
        w = [part[:, None] for part in (-across * np.cos(turn), -across * np.sin(turn), mu)]
        if light.index is None:
            return light.sky.radiance(w) + np.zeros_like(light.E)
        if light.waves is not None:
            return under_waves(light.waves, light.sky, self._upwelling, w)
        cosine, down = mirrored_ray(w)
        rays = 0.0 * mu, [part[:, 0] for part in down]
        if mirrored is None:
            mirrored = self.radiance(*rays)
        else:
            mirrored = mirrored + self.images_and_single(*rays)
        L_sky = light.sky.seen_through(w, light.index)
        return sky_and_mirrored(cosine, L_sky, mirrored, light.index)

    @functools.cached_property
    def _upwelling(self) -> UpwellingLight:
        """Radiance that rises to the surface."""
        up, turns = UPWELLING_COSINES, UPWELLING_TURNS
        across = np.sqrt(1.0 - up**2)
        around = turns + math.atan2(self.light.sun[1], self.light.sun[0])
        w = np.outer(-across, np.cos(around)), np.outer(-across, np.sin(around)), -up[:, None]
        scattered = self.scattered_on_grid([0.0], -up, turns)[:, 0]
        table = np.moveaxis(scattered, 0, -1) + self.images_and_single(0.0, w)
        return UpwellingLight(table, self.light.sun)


@functools.lru_cache(maxsize=2)
def _spread_sun(field: SolvedField, depths: bytes) -> SpreadSun:
    return field.spread_sun(np.frombuffer(depths)[:, None])
