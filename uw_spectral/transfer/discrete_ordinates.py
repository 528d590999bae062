"""The light field of layered water, solved by discrete ordinates for all bands at once.

Radiance is expanded in cosines of the azimuth to the sun and taken along 2 N quadrature
cosines, N of them downwards, split at the critical angle where the surface refracts.
Each layer then is a linear system of constant coefficients whose eigenvectors are real
(K. Stamnes, S.-C. Tsay, W. Wiscombe & K. Jayaweera, Appl. Opt. 27, 2502 (1988); here in
the symmetric form of T. Nakajima & M. Tanaka, JQSRT 35, 13 (1986)); boundaries couple the
layers. The forward peak of the phase function is taken out by delta-M scaling (Wiscombe,
J. Atmos. Sci. 34, 1408 (1977)), and sunlight scattered once is replaced by its exact value
(Nakajima & Tanaka, JQSRT 40, 51 (1988), the TMS correction). Between the quadrature cosines the
radiance is the integral of the source function along the ray, in closed form.

Depth is positive down; ``mu`` is the cosine of the direction light travels to, positive
down. Irradiances and radiances are in the units of E.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..content import ComparedByContent, constant
from ..errors import InputError
from ..surface.refraction import fresnel_reflectance
from ..water.phase import BandPhase
from .legendre import legendre_modes
from .path_integral import attenuated_path
from .radiance_field import FARTHEST
from .rough_surface import Exchange, WaterSurface, exchange
from .sky import BLACK, RINGS, Sky
from .solved_field import SolvedField
from .solved_layer import RESONANCE, Array, Boundaries, SolvedLayer

STREAMS = 32
"""Quadrature cosines, up and down together, that serve pictures."""

_LARGEST_ALBEDO = 1.0 - 1e-8
_SMALLEST_SUN_COSINE = 0.01
_LEAST = 1e-12  # extinction, 1/m
_SMALLEST_RATE = 1e-7
_FAINT = 1e-5  # fraction of the light in an azimuth mode below which it is left out


@dataclass(frozen=True, eq=False)
class Emission(ComparedByContent):
    """Light emitted in all directions alike, as a sum of j exponentials of depth."""

    #: 1/m: not negative of an exponential that falls from the top of its layer, negative of one
    #: that rises to its bottom, (j, n).
    rate: Array
    #: Emitted per volume where the exponential is 1; a single one may be negative, (j, n).
    power: Array

    def __post_init__(self) -> None:
        rate, power = (np.atleast_2d(constant(x)) for x in (self.rate, self.power))
        if rate.shape != power.shape or not np.isfinite([rate, power]).all():
            raise InputError("emission: give finite rates and powers of one shape")
        object.__setattr__(self, "rate", rate)
        object.__setattr__(self, "power", power)

    def at(self, depth: ArrayLike, thickness: float) -> Array:
        """Power per volume at depths (d,) below the top of a layer, shape (d, n)."""
        y = np.asarray(depth, np.float64)[:, None, None]
        y = np.where(self.rate < 0, y - min(thickness, FARTHEST), y)
        return (self.power * np.exp(-self.rate * y)).sum(axis=1)

    def mean(self, upper: ArrayLike, lower: ArrayLike, thickness: float) -> Array:
        """Mean of :meth:`at` between pairs of depths (d,), shape (d, n)."""
        upper, lower = (np.asarray(y, np.float64)[:, None, None] for y in (upper, lower))
        zero = np.where(self.rate < 0, min(thickness, FARTHEST), 0.0)
        near, far = (-self.rate * (y - zero) for y in (upper, lower))
        mean = attenuated_path(near, far, self.rate * (lower - upper), 1.0)
        return (self.power * mean).sum(axis=1)


@dataclass(frozen=True, eq=False)
class OpticalLayer:
    """Homogeneous water down to a depth."""

    bottom: float  #: Depth of its lower end, m; infinite for deep water.
    #: 1/m, per band, (n,).
    absorption: Array
    scattering: Array
    phase: BandPhase  #: On the same bands.
    emission: Emission | None = None  #: Light of other origin than sun and sky.


def solve_discrete_ordinates(
    layers: Sequence[OpticalLayer],
    E: ArrayLike,
    sun: Sequence[float],
    *,
    sky: Sky = BLACK,
    surface: WaterSurface | None = None,
    floor_reflectance: ArrayLike = 0.0,
    streams: int = STREAMS,
    modes: int | None = None,
) -> SolvedField:
    """Solve the light field of plane-parallel water.

    A finite last layer ends at the Lambertian floor. Without a surface all light passes.

    Parameters
    ----------
    E : array_like, shape (n,)
        Direct downwelling irradiance of the sun just below the surface.
    sun : sequence of 3
        Unit direction that sunlight travels to in the water, z up.
    sky : Sky, optional
        In air, its sun at the azimuth of that in the water; black by default.
    streams : int
        Quadrature cosines up and down together, even and at least 4.
    modes : int, optional
        Azimuth modes at most; 1 is enough for irradiances.

    Raises
    ------
    InputError
        If a quantity is negative, not finite or out of its bounds, or the sun of the sky has
        another azimuth.
    """
    mu_s = max(-float(sun[2]), _SMALLEST_SUN_COSINE)
    light = _checked(layers, E, mu_s, sun, sky, surface, floor_reflectance)
    if streams < 4 or streams % 2:
        raise InputError(f"discrete ordinates: streams must be even and at least 4, got {streams}")
    critical = 0.0 if light.index is None else math.sqrt(max(1.0 - light.index**-2, 0.0))
    mu, weights = _quadrature(streams // 2, critical)
    waves = None
    if light.waves is None:
        sky_modes = light.sky.modes(mu, streams, light.index)
    else:
        rays = tuple(mu.tolist()), tuple(weights.tolist())
        waves = exchange(light.waves, *rays, RINGS, streams)
        sky_modes = light.sky.modes_in_air(streams) @ waves.entering.mT
    sky_modes = np.broadcast_to(sky_modes, (streams, len(light.E), len(mu)))
    sun_legendre = _legendre(streams - 1, streams, (mu_s,))[..., 0]
    driven = np.maximum(_fractions(sun_legendre), _fractions(sky_modes))
    modes = min(1 + int(np.flatnonzero(driven > _FAINT)[-1]), modes or streams)
    legendre = _legendre(streams - 1, modes, tuple(mu.tolist()))
    solved, top, beam = [], 0.0, np.ones_like(light.E)
    for layer in layers:
        solved.append(
            _solve_layer(layer, top, mu, weights, legendre, sun_legendre[:modes], light, beam)
        )
        top, beam = layer.bottom, beam * np.exp(-solved[-1].depth / mu_s)
    joined = _join(solved, mu, weights, sky_modes[:modes], waves, light)
    return SolvedField(mu, weights, joined, light)


def _fractions(modes: Array) -> Array:
    """Largest value of each azimuth mode over that of the mean."""
    largest = np.abs(modes).max(axis=tuple(range(1, modes.ndim)))
    return largest / max(largest[0], np.finfo(float).tiny)


def _checked(
    layers: Sequence[OpticalLayer],
    E: ArrayLike,
    mu_s: float,
    sun: Sequence[float],
    sky: Sky,
    surface: WaterSurface | None,
    floor_reflectance: ArrayLike,
) -> Boundaries:
    if not layers:
        raise InputError("discrete ordinates: give at least one layer of water")
    n = len(layers[0].phase)
    quantities = {"sun irradiance": (E, math.inf), "floor reflectance": (floor_reflectance, 1.0)}
    top = 0.0
    for place, layer in enumerate(layers):
        quantities[f"absorption of layer {place}"] = layer.absorption, math.inf
        quantities[f"scattering of layer {place}"] = layer.scattering, math.inf
        last = place == len(layers) - 1
        if not layer.bottom > top or (math.isinf(layer.bottom) and not last):
            raise InputError(
                f"discrete ordinates: layer {place} ends at {layer.bottom:g} m and begins at "
                f"{top:g} m; depths must increase, and only the last may be infinite"
            )
        top = layer.bottom
        emission = layer.emission
        if emission is not None and emission.rate.shape[1] != n:
            raise InputError(f"discrete ordinates: emission of layer {place} has not {n} bands")
        if emission is not None and math.isinf(top) and np.any(emission.rate < 0):
            raise InputError("discrete ordinates: an emission cannot rise to an infinite depth")
    for name, (values, bound) in quantities.items():
        found = np.asarray(values, dtype=np.float64)
        if not np.all(np.isfinite(found) & (found >= 0) & (found <= bound)):
            limit = "not negative" if math.isinf(bound) else f"0 to {bound:g}"
            raise InputError(f"discrete ordinates: {name} must be finite and {limit}")
    index = None if surface is None else surface.refractive_index
    if index is not None and not 1.0 <= index < math.inf:
        raise InputError(f"discrete ordinates: refractive index must be at least 1, got {index:g}")
    if not sky.is_even_about(math.atan2(sun[1], sun[0])):
        raise InputError(
            "discrete ordinates: the sky is bright around a sun at another azimuth than the sun "
            "in the water; give both the same azimuth"
        )
    E, r = (np.broadcast_to(np.asarray(x, dtype=np.float64), n) for x in (E, floor_reflectance))
    if surface is not None and not 0.0 <= surface.slope_variance < math.inf:
        raise InputError(
            "discrete ordinates: slope variance must be finite and not negative, got "
            f"{surface.slope_variance:g}"
        )
    index = None if index == 1.0 else index
    waves = surface if surface is not None and index and surface.slope_variance else None
    return Boundaries(E, mu_s, sun, sky, index, r, waves)


@functools.lru_cache(maxsize=16)
def _quadrature(count: int, critical: float) -> tuple[Array, Array]:
    """Gauss-Legendre on both sides of the critical cosine: cosines and weights on (0, 1)."""
    below = count // 2 if critical > 0 else 0
    parts = []
    for number, low, high in ((below, 0.0, critical), (count - below, critical, 1.0)):
        if number:
            nodes, weights = np.polynomial.legendre.leggauss(number)
            parts.append((low + (high - low) * (nodes + 1) / 2, weights * (high - low) / 2))
    mu, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
    return constant(mu), constant(weights)


@functools.lru_cache(maxsize=32)
def _legendre(degree: int, modes: int, mu: tuple[float, ...]) -> Array:
    return constant(legendre_modes(degree, modes, np.array(mu)))


def _solve_layer(
    layer: OpticalLayer,
    top: float,
    mu: Array,
    weights: Array,
    legendre: Array,
    sun_legendre: Array,
    light: Boundaries,
    beam: Array,
) -> SolvedLayer:
    """Solutions that fall, those that rise, and those that sun and emission drive.

    The first two lack their constants. Deep water has none that rise. The sun's beam is
    given at the top.
    """
    modes, count = legendre.shape[:2]
    chi = np.vstack([np.ones(len(layer.phase)), layer.phase.moments(count)])
    f = chi[count]
    a, b = (np.broadcast_to(x, len(f)) for x in (layer.absorption, layer.scattering))
    scaled = np.maximum(a + b * (1.0 - f), _LEAST)
    albedo = np.minimum(b * (1.0 - f) / scaled, _LARGEST_ALBEDO)
    # Of the source function, by degree and band.
    terms = albedo * (np.arange(count) + 0.5)[:, None] * (chi[:count] - f) / (1.0 - f)
    even = 0.5 + 0.5 * (-1.0) ** np.add.outer(np.arange(modes), np.arange(count))
    sign = 2.0 * even - 1.0
    root, nodes = np.sqrt(weights * mu), legendre * np.sqrt(weights / mu)

    def symmetric(parity: Array) -> Array:
        rays = np.swapaxes(nodes * parity[..., None], 1, 2)[:, None]
        return np.diag(1.0 / mu) - rays @ (2.0 * terms.T[..., None] * nodes[:, None])

    of_sum = symmetric(even)
    # The nodes, split, do not add up the high degrees exactly: what is missing goes straight on.
    kept = (1.0 - albedo[:, None]) * root / mu
    of_sum[0] += ((kept - of_sum[0] @ root) / root)[..., None] * np.eye(len(mu))
    lower = np.linalg.cholesky(symmetric(1.0 - even))
    square, vectors = np.linalg.eigh(lower.mT @ of_sum @ lower)
    # What drives the light, per exponential of depth: first the sun's beam, scattered once.
    emission = layer.emission or Emission(np.zeros((0, len(f))), np.zeros((0, len(f))))
    driven = np.vstack([np.full(len(f), 1.0 / light.mu_s), emission.rate / scaled]).T
    strength = np.where(np.arange(modes) == 0, 1.0, 2.0)[:, None] * beam / (2.0 * math.pi)
    strength = (strength[:, None] * terms * (light.E / light.mu_s)).swapaxes(1, 2)
    into = [(strength * (s * sun_legendre)[:, None]) @ (legendre * root / mu) for s in (1.0, sign)]
    plus, minus = np.zeros((2, modes, len(f), len(mu), driven.shape[1]))
    plus[..., 0], minus[..., 0] = into[0] + into[1], into[0] - into[1]
    scattered = plus[0, ..., 0] @ root * 2.0 * math.pi
    wanted = albedo * light.E / light.mu_s * beam
    for part in (plus, minus):
        part[0, ..., 0] *= (wanted / np.where(scattered > 0, scattered, 1.0))[:, None]
    emitted = emission.power.T / (4.0 * math.pi * scaled[:, None])
    plus[0, ..., 1:] = (2.0 * root / mu)[:, None] * emitted[:, None]

    for each in (driven**2).T[..., None]:
        # What falls just as that which drives it cannot be told from it.
        close = np.abs(square - each) < RESONANCE * each
        square = np.where(close, (1.0 + RESONANCE) * each, square)
    rate = np.sqrt(np.maximum(square, _SMALLEST_RATE**2))
    of_total, of_net = lower @ vectors, np.linalg.solve(lower.mT, vectors)
    total, net = of_total / root[:, None], of_net * rate[..., None, :] / root[:, None]
    plus, minus = of_total.mT @ plus, of_net.mT @ minus
    q, r = driven[:, None], rate[..., None]
    detuning = r**2 - q**2
    both = total @ ((plus + q * minus) / detuning)
    apart = net @ ((minus + q * plus / r**2) * r / detuning)

    falls, rises = [(total + net) / 2], [(total - net) / 2]
    rates = [rate, -rate, np.broadcast_to(q[:, 0], (modes, *driven.shape))]
    down, up = [*falls, *rises, (both + apart) / 2], [*rises, *falls, (both - apart) / 2]
    if math.isinf(layer.bottom):
        del rates[1], down[1], up[1]
    down, up, rates = (np.concatenate(x, axis=-1) for x in (down, up, rates))
    nodes = legendre * weights
    source = nodes[:, None] @ down + sign[:, None, :, None] * (nodes[:, None] @ up)
    source *= terms.T[..., None]
    source[0, :, 0, source.shape[-1] - emitted.shape[1] :] += emitted
    c = np.maximum(a + b, _LEAST)
    return SolvedLayer(top, layer.bottom, c, scaled, b, layer.phase, rates, down, up, source)


def _join(
    layers: Sequence[SolvedLayer],
    mu: Array,
    weights: Array,
    sky: Array,
    waves: Exchange | None,
    light: Boundaries,
) -> list[SolvedLayer]:
    """Layers with the constants that the surface, the floor and each other ask for."""
    modes, n, N = sky.shape
    tops = [_streams(layer, np.zeros(n)) for layer in layers]
    bottoms = [_streams(layer, layer.depth) for layer in layers]
    # One block of rows each: the factors of the layers' solutions, and what they add up to.
    (down, up), nothing = tops[0], np.zeros((modes, n, N))
    if waves is None:
        R = np.zeros(N) if light.index is None else fresnel_reflectance(mu, 1.0 / light.index)
        mirrored = R[:, None] * up
    else:
        mirrored = waves.reflected[:modes, None] @ up
    rows: list[tuple[dict[int, Array], Array]] = [({0: down - mirrored}, sky)]
    for place, (above, below) in enumerate(zip(bottoms, tops[1:], strict=False)):
        for way in range(2):
            rows.append(({place: above[way], place + 1: -below[way]}, nothing))
    last = layers[-1]
    if not math.isinf(last.bottom):
        down, up = bottoms[-1]
        reflect, lit = np.zeros((modes, n, N, N)), nothing.copy()
        reflect[0] = 2.0 * light.floor_reflectance[:, None, None] * (weights * mu)
        direct = sum((layer.depth for layer in layers), np.zeros(n)) / light.mu_s
        lit[0] += (light.floor_reflectance / math.pi * light.E * np.exp(-direct))[:, None]
        rows.append(({len(layers) - 1: up - reflect @ down}, lit))

    free = [N if math.isinf(layer.bottom) else 2 * N for layer in layers]
    starts = np.cumsum([0, *free])
    system = np.zeros((modes, n, starts[-1], starts[-1]))
    right = np.concatenate([values for _, values in rows], axis=-1)
    for place, (blocks, _) in enumerate(rows):
        here = slice(place * N, (place + 1) * N)
        for index, block in blocks.items():
            system[..., here, starts[index] : starts[index + 1]] = block[..., : free[index]]
            right[..., here] -= block[..., free[index] :].sum(axis=-1)
    # A rising exponential is counted from the bottom of its layer, so nothing overflows.
    constants = np.linalg.solve(system, right[..., None])[..., 0]
    joined = []
    for index, layer in enumerate(layers):
        factor = np.ones((modes, n, 1, layer.rate.shape[-1]))
        factor[..., 0, : free[index]] = constants[..., starts[index] : starts[index + 1]]
        scaled = {name: getattr(layer, name) * factor for name in ("down", "up", "source")}
        joined.append(dataclasses.replace(layer, **scaled))
    return joined


def _streams(layer: SolvedLayer, t: Array) -> tuple[Array, Array]:
    """Solutions along the streams down and up at scaled optical depth t, (m, n, N, k) each."""
    exponentials = np.swapaxes(layer.exponentials(t[:, None]), 2, 3)
    return layer.down * exponentials, layer.up * exponentials
