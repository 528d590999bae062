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

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..surface.refraction import fresnel_reflectance
from ..water.phase import BandPhase
from .closed_form import attenuated_path
from .radiance_field import FARTHEST, under_surface
from .sky import Sky

STREAMS = 32
"""Quadrature cosines, up and down together, that serve pictures."""

_LARGEST_ALBEDO = 1.0 - 1e-8
_SMALLEST_SUN_COSINE = 0.01
_RESONANCE = 1e-6
_SMALLEST_RATE = 1e-7
_LEVEL = 1e-7  # |mu| of a ray that is level
_DEEP = 1e6  # optical depth that stands for infinity

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Layer:
    """Homogeneous water down to a depth.

    Parameters
    ----------
    bottom : float
        Depth of its lower end, m; infinite for deep water.
    absorption, scattering : array, shape (n,)
        1/m, per band.
    phase : BandPhase
        On the same bands.
    """

    bottom: float
    absorption: Array
    scattering: Array
    phase: BandPhase


@dataclass(frozen=True, eq=False)
class _Modes:
    """One layer solved up to its constants; shapes (m, n, N) and (m, n, N, N).

    ``rate`` are the eigenvalues per scaled optical depth; ``along`` and ``against`` the
    eigenvectors of a falling exponential in the light that goes down and up, which a
    rising one has the other way round; ``sun_down`` and ``sun_up`` the particular
    solution per beam at the top of the layer.
    """

    top: float
    bottom: float
    c: Array
    scaled: Array
    b: Array
    albedo: Array
    phase: BandPhase
    terms: Array
    rate: Array
    along: Array
    against: Array
    sun_down: Array
    sun_up: Array

    @property
    def depth(self) -> Array:
        """Scaled optical thickness per band, at most :data:`_DEEP`."""
        return np.minimum(self.scaled * min(self.bottom - self.top, FARTHEST), _DEEP)

    @property
    def across(self) -> Array:
        """What a falling exponential keeps from top to bottom, shape (m, n, N)."""
        return np.exp(-self.rate * self.depth[:, None])


class SolvedField:
    """Light field of n bands, solved; make it with :func:`solve_discrete_ordinates`."""

    def __init__(
        self,
        mu: Array,
        weights: Array,
        legendre: Array,
        layers: Sequence[_Modes],
        constants: Array,
        light: _Light,
    ) -> None:
        self._mu, self._weights, self._legendre = mu, weights, legendre
        self._layers, self._constants, self.light = layers, constants, light

    @property
    def floor_depth(self) -> float:
        """Depth of the floor, m; infinite without one."""
        return self._layers[-1].bottom

    @functools.cached_property
    def floor_radiance(self) -> Array:
        """Radiance of the Lambertian floor, shape (n,); 0 without one."""
        if math.isinf(self.floor_depth):
            return np.zeros_like(self.light.E)
        return self.light.floor_reflectance / math.pi * self.Ed(self.floor_depth)

    def Ed(self, y: ArrayLike) -> Array:
        """Downwelling irradiance, direct sun included, at depths y, shape (..., n)."""
        down, _, beam = self._streams(y)
        return 2 * math.pi * down @ (self._weights * self._mu) + self.light.E * beam

    def Eu(self, y: ArrayLike) -> Array:
        """Upwelling irradiance at depths y, shape (..., n)."""
        return 2 * math.pi * self._streams(y)[1] @ (self._weights * self._mu)

    def scalar_irradiance(self, y: ArrayLike) -> Array:
        """Scalar irradiance E0, direct sun included, at depths y, shape (..., n)."""
        down, up, beam = self._streams(y)
        beam = self.light.E / self.light.mu_s * beam
        return 2 * math.pi * (down + up) @ self._weights + beam

    def radiance(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """Radiance L(y, w) of everything that lies ahead of depths y along view directions w.

        Parameters
        ----------
        y : array_like
            Depths, m.
        w : three array_like
            Components of the unit view directions, away from the camera, z up; they
            broadcast with ``y``.

        Returns
        -------
        array, shape (..., n)
            The sun's own disc is left out.
        """
        y, mu, turn, shape = self._rays(y, w)
        seen = self._scattered(y, mu, turn)
        seen = seen + self._single(y, mu, turn, scaled=True)
        seen = seen + self._image(y, mu, turn)
        return seen.reshape(*shape, -1)

    def scattered(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """Radiance M(y, w): :meth:`radiance` without sunlight scattered once and the surface.

        What is left is smooth but for directions close to the sun: light scattered more
        than once, skylight, light of the floor. Arguments and result as :meth:`radiance`.
        """
        y, mu, turn, shape = self._rays(y, w)
        M = self._scattered(y, mu, turn) + self._single(y, mu, turn, scaled=True)
        return (M - self._single(y, mu, turn, scaled=False)).reshape(*shape, -1)

    def single_scattering(self, y: ArrayLike, w: Sequence[ArrayLike]) -> Array:
        """Radiance of sunlight scattered once between depths y and the end of the water."""
        y, mu, turn, shape = self._rays(y, w)
        return self._single(y, mu, turn, scaled=False).reshape(*shape, -1)

    def surface_radiance(self, w: Sequence[ArrayLike]) -> Array:
        """Radiance just below the surface along upward view directions: sky, mirrored water."""
        _, mu, turn, shape = self._rays(0.0, w)
        return self._under_surface(mu, turn).reshape(*shape, -1)

    def _rays(
        self, y: ArrayLike, w: Sequence[ArrayLike]
    ) -> tuple[Array, Array, Array, tuple[int, ...]]:
        """Depth, cosine of travel and azimuth of travel to the sun's, of each ray in a row."""
        y, *w = np.broadcast_arrays(y, *w)
        shape = np.shape(y)
        x, along, mu = (np.ravel(part).astype(np.float64) for part in w)
        sx, sy = self.light.sun[:2]
        turn = np.arctan2(-along, -x) - math.atan2(sy, sx)
        mu = np.where(np.abs(mu) < _LEVEL, _LEVEL, mu)
        return np.ravel(y).astype(np.float64), mu, turn, shape

    def _streams(self, y: ArrayLike) -> tuple[Array, Array, Array]:
        """Azimuthal mean along the streams down and up, (..., n, N), and the beam, (..., n)."""
        depths = np.ravel(np.asarray(y, dtype=np.float64))
        found = [self._at(depth) for depth in depths]
        shape = np.shape(y)
        down, up, beam = (np.stack(part) for part in zip(*found, strict=True))
        down, up = (part.reshape(*shape, *part.shape[1:]) for part in (down, up))
        return down, up, beam.reshape(*shape, -1)

    def _at(self, y: float) -> tuple[Array, Array, Array]:
        index = next((i for i, x in enumerate(self._layers) if y <= x.bottom), -1)
        layer, (falls, rises) = self._layers[index], self._constants[index][:, 0]
        t = layer.scaled * (y - layer.top)
        falls = falls * np.exp(-layer.rate[0] * t[:, None])
        rises = rises * np.exp(-layer.rate[0] * np.maximum(layer.depth - t, 0.0)[:, None])
        beam = np.exp(-self._beam_depth(index) - t / self.light.mu_s)
        along, against = layer.along[0], layer.against[0]
        down, up = (
            np.einsum("nij,nj->ni", one, falls)
            + np.einsum("nij,nj->ni", other, rises)
            + part[0] * beam[:, None]
            for one, other, part in (
                (along, against, layer.sun_down),
                (against, along, layer.sun_up),
            )
        )
        return down, up, beam

    def _beam_depth(self, index: int, *, scaled: bool = True) -> Array:
        """Exponent of the beam at the top of a layer, shape (n,)."""
        above = (
            (layer.scaled if scaled else layer.c) * (layer.bottom - layer.top)
            for layer in self._layers[:index]
        )
        return sum(above, np.zeros_like(self.light.E)) / self.light.mu_s

    def _orders(self, mu: Array) -> Iterator[tuple[NDArray[np.bool_], Sequence[int]]]:
        """Rays of light that goes down and up, and the layers in the order it meets them."""
        down, layers = mu > 0, range(len(self._layers))
        for rays, order in ((down, layers), (~down, layers[::-1])):
            if rays.any():
                yield rays, order

    def _scattered(self, y: Array, mu: Array, turn: Array) -> Array:
        """Light of the streams' source function and of the floor, shape (q, n)."""
        modes = len(self._legendre)
        legendre = legendre_modes(self._legendre.shape[1] - 1, modes, mu)
        cosines = np.cos(np.arange(modes)[:, None] * turn)
        total = np.zeros((len(self.light.E), len(mu)))
        for rays, order in self._orders(mu):
            seen = self.floor_radiance[:, None] * (mu[rays] < 0)
            for index in order:
                t, P = self._length(index, y[rays], mu[rays])
                part = self._segment(index, t, P, mu[rays], legendre[..., rays])
                seen = seen * np.exp(-P) + np.einsum("mnq,mq->nq", part, cosines[:, rays])
            total[:, rays] = seen
        return total.T

    def _length(self, index: int, y: Array, mu: Array) -> tuple[Array, Array]:
        """Scaled depth below the top of a layer at which a ray is last, and its length in it."""
        layer = self._layers[index]
        thickness = min(layer.bottom - layer.top, FARTHEST)
        below = np.clip(y - layer.top, 0.0, thickness)
        inside = np.where(mu > 0, below, thickness - below)
        length = np.minimum(inside / np.abs(mu), FARTHEST)
        return layer.scaled[:, None] * below, layer.scaled[:, None] * length

    def _segment(self, index: int, t: Array, P: Array, mu: Array, legendre: Array) -> Array:
        """Integral of the source function over the part P of rays in a layer, (m, n, q)."""
        layer, (falls, rises) = self._layers[index], self._constants[index]
        slope = -mu  # depth per backward length
        one, other = self._scattering_matrices(layer, legendre)
        grow = one @ layer.along + other @ layer.against
        fall = one @ layer.against + other @ layer.along
        beam = np.einsum("mnqj,mnj->mnq", one, layer.sun_down)
        beam = beam + np.einsum("mnqj,mnj->mnq", other, layer.sun_up)
        mu_s = self.light.mu_s
        near = -self._beam_depth(index)[:, None] - t / mu_s
        total = beam * _path(near, 1.0 + slope / mu_s, P)
        rate, depth = layer.rate, layer.depth[:, None]
        for k in range(rate.shape[-1]):
            r = rate[..., k, None]
            total += grow[..., k] * falls[..., k, None] * _path(-r * t, 1.0 + slope * r, P)
            if math.isinf(layer.bottom):
                continue
            left = np.maximum(depth - t, 0.0)
            total += fall[..., k] * rises[..., k, None] * _path(-r * left, 1.0 - slope * r, P)
        return total

    def _scattering_matrices(self, layer: _Modes, legendre: Array) -> tuple[Array, Array]:
        """What streams down and up scatter into rays, shape (m, n, q, N) each."""
        modes, count = self._legendre.shape[:2]
        sign = (-1.0) ** np.add.outer(np.arange(modes), np.arange(count))
        scale = 0.5 * layer.albedo[:, None, None] * self._weights
        one, other = (
            scale * _coupling(layer.terms, legendre, nodes)
            for nodes in (self._legendre, self._legendre * sign[..., None])
        )
        return one, other

    def _single(self, y: Array, mu: Array, turn: Array, *, scaled: bool) -> Array:
        """Sunlight scattered once by the exact phase function, shape (q, n)."""
        light = self.light
        across = np.sqrt(np.maximum(1.0 - mu**2, 0.0)) * math.sqrt(1.0 - light.mu_s**2)
        cosine = np.clip(mu * light.mu_s + across * np.cos(turn), -1.0, 1.0)
        s2 = np.maximum(0.5 - 0.5 * cosine, 1e-14)[:, None]
        total = np.zeros((len(mu), len(light.E)))
        for rays, order in self._orders(mu):
            for index in order:
                layer = self._layers[index]
                extinction = layer.scaled if scaled else layer.c
                ratio = (extinction / layer.scaled)[:, None]
                t, P = (part * ratio for part in self._length(index, y[rays], mu[rays]))
                near = -self._beam_depth(index, scaled=scaled)[:, None] - t / light.mu_s
                part = _path(near, 1.0 - mu[rays] / light.mu_s, P) / extinction[:, None]
                source = layer.b * layer.phase.per_steradian(s2[rays]) * light.E / light.mu_s
                total[rays] = total[rays] * np.exp(-P.T) + source * part.T
        return total

    def _image(self, y: Array, mu: Array, turn: Array) -> Array:
        """The surface as it is seen from depths y along rays that come down from it."""
        total, down = np.zeros((len(mu), len(self.light.E))), mu > 0
        if down.any():
            image = self._under_surface(mu[down], turn[down])
            for index in range(len(self._layers)):
                image = image * np.exp(-self._length(index, y[down], mu[down])[1]).T
            total[down] = image
        return total

    def _under_surface(self, mu: Array, turn: Array) -> Array:
        """Radiance that comes down from the surface along mu > 0, shape (q, n)."""
        light = self.light
        if light.index is None:
            return light.sky.radiance(mu, turn)
        n = light.index
        in_air = np.sqrt(np.maximum(1.0 - n**2 * (1.0 - mu**2), 0.0))
        across = np.sqrt(1.0 - mu**2)
        turn = turn + math.atan2(light.sun[1], light.sun[0])
        w = (-across * np.cos(turn), -across * np.sin(turn), mu)
        sky = light.sky.radiance(in_air, turn)
        return under_surface(_Mirror(self), [part[:, None] for part in w], sky, n)


class _Mirror:
    """The rising light that a surface mirrors, asked for along rays of shape (q, 1)."""

    def __init__(self, field: SolvedField) -> None:
        self._field = field

    def radiance(
        self,
        y: Array,
        w: Sequence[Array],
        L_surface: Operand = 0.0,
        m: Mathematics = NUMPY,
    ) -> Array:
        """Radiance that rises to depth y, against w."""
        del L_surface, m
        return self._field.radiance(y[:, 0], [part[:, 0] for part in w])


@dataclass(frozen=True, eq=False)
class _Light:
    """What comes in from above, and what the floor sends back."""

    E: Array
    mu_s: float
    sun: Sequence[float]
    sky: Sky
    index: float | None
    floor_reflectance: Array


def solve_discrete_ordinates(
    layers: Sequence[Layer],
    E: ArrayLike,
    sun: Sequence[float],
    *,
    sky: Sky | None = None,
    refractive_index: float | None = None,
    floor_reflectance: ArrayLike = 0.0,
    streams: int = STREAMS,
) -> SolvedField:
    """Solve the light field of plane-parallel water.

    Parameters
    ----------
    layers : sequence of Layer
        From the surface down; a finite last one ends at the floor.
    E : array_like, shape (n,)
        Direct downwelling irradiance of the sun just below the surface.
    sun : sequence of 3
        Unit direction that sunlight travels to in the water, z up.
    sky : Sky, optional
        Radiance of the sky, in air; none by default.
    refractive_index : float, optional
        Of the water against air; without one the surface lets all light through.
    floor_reflectance : array_like, shape (n,)
        Of the Lambertian floor.
    streams : int
        Quadrature cosines up and down together, even and at least 4.

    Returns
    -------
    SolvedField

    Raises
    ------
    InputError
        If a quantity is negative, not finite or out of its bounds.

    Examples
    --------
    >>> from ..water.phase import parse_phase
    >>> phase = parse_phase("hg:0.8").for_bands([0.1])
    >>> water = [Layer(9.0, np.array([0.05]), np.array([0.1]), phase)]
    >>> field = solve_discrete_ordinates(water, [1.0], (0.6, 0.0, -0.8), floor_reflectance=0.2)
    >>> field.Ed(4.0).round(4), field.Eu(4.0).round(4)
    (array([0.7427]), array([0.0816]))
    """
    mu_s = max(-float(sun[2]), _SMALLEST_SUN_COSINE)
    light = _checked(layers, E, mu_s, sun, sky, refractive_index, floor_reflectance)
    if streams < 4 or streams % 2:
        raise InputError(f"discrete ordinates: streams must be even and at least 4, got {streams}")
    critical = 0.0 if light.index is None else math.sqrt(max(1.0 - light.index**-2, 0.0))
    mu, weights = _quadrature(streams // 2, critical)
    legendre = legendre_modes(streams - 1, streams, mu)
    sun_legendre = legendre_modes(streams - 1, streams, np.array([mu_s]))[..., 0]
    solved, top = [], 0.0
    for layer in layers:
        solved.append(_solve_layer(layer, top, mu, weights, legendre, sun_legendre, light))
        top = layer.bottom
    constants = _join(solved, mu, weights, light)
    return SolvedField(mu, weights, legendre, solved, constants, light)


def legendre_modes(degree: int, modes: int, mu: Array) -> Array:
    """Normalised associated Legendre functions, sqrt((l-m)!/(l+m)!) P_l^m.

    Parameters
    ----------
    degree, modes : int
        Of l, the largest; of m, how many.
    mu : array, shape (q,)

    Returns
    -------
    array, shape (modes, degree + 1, q)
        0 where l < m.
    """
    out = np.zeros((modes, degree + 1, len(mu)))
    sine, start = np.sqrt(np.maximum(1.0 - mu * mu, 0.0)), np.ones_like(mu)
    for m in range(min(modes, degree + 1)):
        if m:
            start = start * sine * math.sqrt((2 * m - 1) / (2 * m))
        out[m, m] = start
        if m < degree:
            out[m, m + 1] = mu * math.sqrt(2 * m + 1) * start
        for l in range(m + 2, degree + 1):  # noqa: E741 - the degree
            before = math.sqrt((l - 1) ** 2 - m * m) * out[m, l - 2]
            out[m, l] = ((2 * l - 1) * mu * out[m, l - 1] - before) / math.sqrt(l * l - m * m)
    return out


def _checked(
    layers: Sequence[Layer],
    E: ArrayLike,
    mu_s: float,
    sun: Sequence[float],
    sky: Sky | None,
    index: float | None,
    floor_reflectance: ArrayLike,
) -> _Light:
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
    for name, (values, bound) in quantities.items():
        found = np.asarray(values, dtype=np.float64)
        if not np.all(np.isfinite(found) & (found >= 0) & (found <= bound)):
            limit = "not negative" if math.isinf(bound) else f"0 to {bound:g}"
            raise InputError(f"discrete ordinates: {name} must be finite and {limit}")
    if index is not None and not 1.0 <= index < math.inf:
        raise InputError(f"discrete ordinates: refractive index must be at least 1, got {index:g}")
    E, r = (np.broadcast_to(np.asarray(x, dtype=np.float64), n) for x in (E, floor_reflectance))
    index = None if index == 1.0 else index
    return _Light(E, mu_s, sun, sky or Sky.dark(n), index, r)


def _quadrature(count: int, critical: float) -> tuple[Array, Array]:
    """Gauss-Legendre on both sides of the critical cosine: cosines and weights on (0, 1)."""
    below = count // 2 if critical > 0 else 0
    parts = []
    for number, low, high in ((below, 0.0, critical), (count - below, critical, 1.0)):
        if number:
            nodes, weights = np.polynomial.legendre.leggauss(number)
            parts.append((low + (high - low) * (nodes + 1) / 2, weights * (high - low) / 2))
    mu, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
    return mu, weights


def _solve_layer(
    layer: Layer,
    top: float,
    mu: Array,
    weights: Array,
    legendre: Array,
    sun_legendre: Array,
    light: _Light,
) -> _Modes:
    modes, count = legendre.shape[:2]
    chi = np.vstack([np.ones(len(layer.phase)), layer.phase.moments(count)])
    f = chi[count]
    a, b = (np.broadcast_to(x, len(f)) for x in (layer.absorption, layer.scattering))
    c, scaled = a + b, np.maximum(a + b * (1.0 - f), 1e-12)
    albedo = np.minimum(b * (1.0 - f) / scaled, _LARGEST_ALBEDO)
    terms = (2 * np.arange(count) + 1)[:, None] * (chi[:count] - f) / (1.0 - f)
    even = 0.5 + 0.5 * (-1.0) ** np.add.outer(np.arange(modes), np.arange(count))
    root, size = np.sqrt(weights * mu), np.sqrt(weights / mu)

    def symmetric(parity: Array) -> Array:
        product = _coupling(terms, legendre * parity[..., None], legendre)
        matrix = -albedo[None, :, None, None] * size[:, None] * product * size
        matrix[..., range(len(mu)), range(len(mu))] += 1.0 / mu
        return matrix

    of_sum, of_difference = symmetric(even), symmetric(1.0 - even)
    lower = np.linalg.cholesky(of_difference)
    square, vectors = np.linalg.eigh(np.swapaxes(lower, -1, -2) @ of_sum @ lower)
    rate = np.sqrt(np.maximum(square, _SMALLEST_RATE**2))
    inverse = np.linalg.inv(lower)
    total = (lower @ vectors) / root[:, None]
    net = (np.swapaxes(inverse, -1, -2) @ vectors) * rate[..., None, :] / root[:, None]

    # The sun's beam, scattered once into the streams, drives a particular solution.
    strength = np.where(np.arange(modes) == 0, 1.0, 2.0)[:, None, None] / (4.0 * math.pi)
    beam = strength * (albedo * light.E / light.mu_s)[None, :, None]
    sign = 2.0 * even - 1.0
    into = [
        beam * np.einsum("ln,ml,mli->mni", terms, s * sun_legendre, legendre, optimize=True) / mu
        for s in (1.0, sign)
    ]
    plus, minus = into[0] + into[1], into[0] - into[1]

    def times(matrix: Array, vector: Array) -> Array:
        """(α ± β) v, of the unsymmetric system."""
        return -np.einsum("mnij,mnj->mni", matrix, vector * root) / root

    mu_s = light.mu_s
    driven = -times(of_difference, plus) + minus / mu_s
    driven = np.einsum("mnij,mnj->mni", inverse, driven * root)
    driven = np.einsum("mnji,mnj->mni", vectors, driven)
    detuning = rate**2 - mu_s**-2
    away = np.maximum(np.abs(detuning), _RESONANCE * mu_s**-2)
    both = np.einsum("mnij,mnj->mni", total, driven / np.where(detuning > 0, away, -away))
    apart = -mu_s * (times(of_sum, both) + plus)
    return _Modes(
        top, layer.bottom, c, scaled, b, albedo, layer.phase, terms, rate,
        (total + net) / 2, (total - net) / 2, (both + apart) / 2, (both - apart) / 2,
    )  # fmt: skip


def _coupling(terms: Array, rays: Array, nodes: Array) -> Array:
    """Sum over the degrees l of terms (l, n) and Legendre functions (m, l, q) and (m, l, j)."""
    return np.swapaxes(rays, 1, 2)[:, None] @ (terms.T[..., None] * nodes[:, None])


def _join(layers: Sequence[_Modes], mu: Array, weights: Array, light: _Light) -> Array:
    """Constants of falling and rising exponentials per layer, shape (layers, 2, m, n, N)."""
    modes, n, N = layers[0].rate.shape
    size = 2 * N * len(layers)
    system, right = np.zeros((modes, n, size, size)), np.zeros((modes, n, size))
    index = light.index
    R = np.zeros(N) if index is None else fresnel_reflectance(mu, 1.0 / index)
    beam = np.zeros(n)
    first, last = layers[0], layers[-1]
    # At the top: light down is the sky's and what the surface mirrors of the light up.
    system[..., :N, :N] = first.along - R[:, None] * first.against
    system[..., :N, N : 2 * N] = (first.against - R[:, None] * first.along) * first.across[
        ..., None, :
    ]
    right[..., :N] = light.sky.modes(mu, modes, index) - (first.sun_down - R * first.sun_up)
    row = N
    for place, (upper, lower) in enumerate(itertools.pairwise(layers)):
        beam = beam + upper.depth / light.mu_s
        at, here = 2 * N * place, np.exp(-beam)[:, None]
        for above, below, sun in (
            (
                (upper.along * upper.across[..., None, :], upper.against),
                (lower.along, lower.against * lower.across[..., None, :]),
                lower.sun_down - upper.sun_down,
            ),
            (
                (upper.against * upper.across[..., None, :], upper.along),
                (lower.against, lower.along * lower.across[..., None, :]),
                lower.sun_up - upper.sun_up,
            ),
        ):
            rows = slice(row, row + N)
            system[..., rows, at : at + N], system[..., rows, at + N : at + 2 * N] = above
            for step, block in enumerate(below):
                start = at + (2 + step) * N
                system[..., rows, start : start + N] = -block
            right[..., rows] = sun * here
            row += N
    # At the floor: light up is what it reflects; deep water has nothing that rises.
    rows, at = slice(row, row + N), size - 2 * N
    if math.isinf(last.bottom):
        system[..., rows, at + N :] = np.eye(N)
    else:
        reflect = np.zeros((modes, n, N, N))
        reflect[0] = 2.0 * light.floor_reflectance[:, None, None] * (weights * mu)
        across = last.across[..., None, :]
        system[..., rows, at : at + N] = (last.against - reflect @ last.along) * across
        system[..., rows, at + N :] = last.along - reflect @ last.against
        here = np.exp(-beam - last.depth / light.mu_s)
        lit = np.einsum("mnij,mnj->mni", reflect, last.sun_down) - last.sun_up
        right[..., rows] = lit * here[:, None]
        right[0, :, rows] += (light.floor_reflectance / math.pi * light.E * here)[:, None]
    # A rising exponential is counted from the bottom of its layer, so nothing overflows.
    constants = np.linalg.solve(system, right[..., None])[..., 0]
    return np.moveaxis(constants.reshape(modes, n, len(layers), 2, N), (2, 3), (0, 1))


def _path(near: Array, rate: Array, P: Array) -> Array:
    """Integral of e^{near - rate v} dv over the length P."""
    return attenuated_path(near, near - rate * P, rate * P, P)
