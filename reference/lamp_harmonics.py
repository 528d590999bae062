"""Light of a lamp that water scatters twice and more, by spherical harmonics: a reference.

Round a lamp in endless water radiance depends on the distance r, on the angle θ from the lamp's
axis and on the direction ω. What is scattered once more is the source

    S(r, θ, ω) = b ∫ p(ω', ω) L(r, θ, ω') dω',

with L all light that was scattered already; the integral of S e^{-c t} along a ray is its radiance.
In Fourier space the equation of transfer couples harmonics of one order m' with their neighbours
only: (c - b χ_l) L_l + ik (α_l L_{l-1} + α_{l+1} L_{l+1}) = Q_l, α_l² = (l² - m'²)/(4 l² - 1).
Degrees beyond the highest are not scattered; they end the system exactly, by a continued fraction.
With the harmonics turned from the wave's frame into that of the radius, in which they keep their
order m, and plane waves in spherical Bessel functions j_λ, the source is

    S = Σ_m Σ_lj g^m_lj(r) Y_lm(ω) 4π φ_j Y_jm(θ),   φ_j the moments of the lamp's profile.

Nothing of it is fitted, and it has no photons' noise. Of the phase function and the profile it has
what is wider than some ten degrees; for what is narrower one bend stands, as of
:mod:`.multiple_scattering`: what that makes of the whole less what it makes of the wider part.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.content import ComparedByContent
from ..uw_spectral.lamps.angular_spread import WaterSpread, profile_moments
from ..uw_spectral.lamps.lamp import Lamp, RayPastLamp
from ..uw_spectral.lamps.multiple_scattering import BandLight, LampWater, scattered_more
from ..uw_spectral.lamps.profile import LampProfile
from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.water.phase import BandPhase

type Array = NDArray[np.float64]

DEGREES = 32
"""Highest degree of harmonics, of directions and of profiles."""

ROWS = 48
NEAREST, FARTHEST = 0.03, 20.0  # distances of the rows, in mean free paths
_SMOOTH, _SMOOTH_PROFILE = 0.5625, 0.4375  # of the highest degree, where moments are 1/e
_NODES = 96  # along a ray
_AROUND = 10  # orders m, from 0 on
_WAVES = 160  # wave numbers
_LONGEST_WAVE = 0.02  # wave number, in 1/c
_RESOLVED = 40.0  # waves along r, in rad, from which on they fade out
_LAST, _STEP = 150.0, 0.1  # of the integral over them
_CLOSED = 400  # degrees after which the continued fraction begins
_DIRECTIONS = 128  # of the quadrature over products of harmonics
_SMALLEST, _TINY = 1e-12, 1e-60


@dataclass(frozen=True, eq=False)
class SmoothPhase(BandPhase):
    """A phase function without what is narrower than some ten degrees."""

    degree: float = math.inf

    @classmethod
    def of(cls, phase: BandPhase, highest: int) -> SmoothPhase:
        """Return that which harmonics up to a degree resolve."""
        return cls(phase.components, phase.weights, _SMOOTH * highest)

    def moments(self, count: int) -> Array:
        """Legendre moments χ1 to χm per band, shape (m, n)."""
        degrees = np.arange(1.0, count + 1.0)[:, None]
        return super().moments(count) * np.exp(-((degrees / self.degree) ** 4))


@dataclass(frozen=True, eq=False)
class SmoothProfile(ComparedByContent, LampProfile):
    """A profile, blurred, which leaves it positive."""

    profile: LampProfile
    highest: int

    @property
    def moments(self) -> Array:
        """Mean over all directions of it times each Legendre polynomial."""
        degrees = np.arange(self.highest + 1.0)
        found = profile_moments(self.profile)[: self.highest + 1]
        return found * np.exp(-((degrees / (_SMOOTH_PROFILE * self.highest)) ** 2))

    @property
    def solid_angle(self) -> float:
        """Integral over the sphere, sr."""
        return 4.0 * math.pi * float(self.moments[0])

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Value at the cosine of the angle from the axis."""
        del m
        weighted = self.moments * (2.0 * np.arange(self.highest + 1.0) + 1.0)
        return np.polynomial.legendre.legval(np.asarray(cosine), weighted)


@dataclass(frozen=True, eq=False)
class LampField(ComparedByContent):
    """Harmonics of a water of n bands; equal ones are computed once.

    Parameters
    ----------
    a, b : array, shape (n,)
        Absorption and scattering, 1/m.
    phase : BandPhase
    degrees : int
        Highest one of harmonics.
    """

    a: Array
    b: Array
    phase: BandPhase
    degrees: int = DEGREES


def scattered_more_by_harmonics(
    lamp: Lamp, ray: RayPastLamp, water: LampWater, degrees: int = DEGREES
) -> Array:
    """Radiance of a lamp's light that is scattered more than once along a ray.

    Parameters
    ----------
    lamp : Lamp
        Without shadows.
    ray : RayPastLamp
        A single one.
    water : LampWater
        Of n bands, made by :func:`.lamp_water`.
    degrees : int
        Highest one of harmonics: more of them resolve narrower angles.

    Returns
    -------
    array, shape (n,)
        In the unit of the intensity per m².

    Examples
    --------
    >>> from ..uw_spectral.lamps.lamp import ray_past_lamp
    >>> from ..uw_spectral.lamps.multiple_scattering import lamp_water
    >>> from ..uw_spectral.water.phase import parse_phase
    >>> water = lamp_water([0.1], [0.2], parse_phase("hg:0.9").for_bands([0.2]))
    >>> lamp = Lamp((0.5, 0.0, 4.0), (0.0, 0.0, -1.0), np.array([1.0]))
    >>> ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0)
    >>> scattered_more_by_harmonics(lamp, ray, water, 16).round(3)
    array([0.031])
    """
    assert isinstance(water.phase, BandPhase)
    phase, profile = water.phase, SmoothProfile(lamp.profile, degrees)
    field = LampField(water.a, water.b, phase, degrees)
    first, last = float(ray.near), min(float(ray.far), float(ray.near + water.reach))
    h = float(ray.h)
    ends = np.arcsinh(np.array([first, last]) / h)
    places, weights = np.polynomial.legendre.leggauss(_NODES)
    u = ends[0] + (ends[1] - ends[0]) * (places + 1.0) / 2.0
    s, r = h * np.sinh(u), h * np.cosh(u)
    t = np.maximum(float(ray.t0) + s, 0.0)
    turned = np.clip((float(ray.across) * h + float(ray.along) * s) / r, -1.0, 1.0)
    source = _source(field, profile, r, turned, -s / r, -float(ray.along))
    seen = source * np.exp(-water.c * t[:, None]) * (r * weights)[:, None]
    wide = lamp.intensity * seen.sum(axis=0) * (ends[1] - ends[0]) / 2.0
    smooth = SmoothPhase.of(phase, degrees)
    spread = WaterSpread(water.b, smooth)
    blurred = LampWater(water.a, water.b, water.c, smooth, spread, water.reach)
    as_bent = Lamp(lamp.position, lamp.axis, lamp.intensity, profile, lamp.radius)
    whole = scattered_more(lamp, ray, BandLight(lamp.intensity, water))
    part = scattered_more(as_bent, ray, BandLight(lamp.intensity, blurred))
    return np.asarray(wide + whole - part)


def _scale(field: LampField) -> float:
    """Extinction that rows are scaled with, 1/m."""
    return max(float(np.mean(field.a + field.b)), 1e-4)


def _source(
    field: LampField, profile: SmoothProfile, r: Array, turned: Array, bent: Array, off_axis: float
) -> Array:
    """S at places, shape (k, n), by distances and cosines, see the head of this module."""
    rows = np.geomspace(NEAREST, FARTHEST, ROWS) / _scale(field)
    kept = rows[:, None] * np.exp(field.a * rows[:, None])
    radial = _radial(field) * kept[:, None, None, None]
    place = np.interp(np.log(r), np.log(rows), np.arange(ROWS))
    low = np.clip(place.astype(int), 0, ROWS - 2)
    share = (place - low)[:, None, None, None, None]
    found = (1.0 - share) * radial[low] + share * radial[low + 1]
    sines = np.sqrt(np.maximum((1.0 - turned**2) * (1.0 - bent**2), _SMALLEST))
    azimuth = np.arccos(np.clip((off_axis - turned * bent) / sines, -1.0, 1.0))
    orders = np.arange(_AROUND)[:, None]
    around = np.where(orders > 0, 2.0, 1.0) * np.cos(orders * azimuth)
    on_axis = _harmonics(turned, field.degrees) * 4.0 * math.pi * profile.moments[:, None]
    of_bend = _harmonics(bent, field.degrees)
    S = np.einsum("kmljn,mjk,mlk,mk->kn", found, on_axis, of_bend, around, optimize=True)
    return np.asarray(S * np.exp(-field.a * r[:, None]) / r[:, None])


@functools.lru_cache(maxsize=8)
def _radial(field: LampField) -> Array:
    """g^m_lj at the distances, shape (ROWS, m, l, j, n)."""
    highest = field.degrees
    moments = SmoothPhase.of(field.phase, highest).moments(highest)
    scattering = field.b * np.concatenate([np.ones((1, len(field.b))), moments])
    turned, hankel = _turned(highest), _hankel(highest)
    waves = _waves() * _scale(field)
    found = []
    for c, b in zip(field.a + field.b, scattering.T, strict=True):
        solved = np.stack([_solved(order, float(c), b, waves) for order in range(highest + 1)])
        rows = []
        for degree, turn in enumerate(turned):
            # (j, m λ, m') by (j, m', k), then (j, m, λ k) by (λ k, r).
            by_wave = turn.astype(np.float64) @ np.moveaxis(solved[:, :, degree], 2, 0)
            by_wave = by_wave.reshape(highest + 1, _AROUND, -1)
            row = np.empty((highest + 1, _AROUND, ROWS))
            for parity in range(2):
                of_parity = slice((degree + parity) % 2, None, 2)
                row[of_parity] = by_wave[of_parity] @ hankel[parity]
            rows.append(row)
        found.append(np.einsum("ljmr->rmlj", np.stack(rows)))
    return np.stack(found, axis=-1) * _scale(field) ** 3


def _solved(order: int, c: float, scattering: Array, waves: Array) -> Array:
    """What is scattered after what was scattered, of waves along z, shape (k, l, j).

    Times i^(l - j) it is the amplitude of the degree l for a source of the degree j.
    """
    b, count = scattering[order:], len(scattering)
    beside = [math.sqrt(_coupled(degree, order)) for degree in range(order + 1, count)]
    ends = _closure(order, count, c, waves)
    once = b[:, None] * _inverse(np.full(len(b), c), beside, ends, waves, np.eye(len(b)))
    found = np.zeros((len(waves), count, count))
    found[:, order:, order:] = b[:, None] * _inverse(c - b, beside, ends, waves, once)
    return _without_tiny(found)


def _without_tiny(values: Array) -> Array:
    """Numbers so small that processors take many times as long for them are none."""
    return np.where(np.abs(values) < _TINY, 0.0, values)


def _inverse(
    kept: Array, beside: Sequence[float], ends: Array, waves: Array, sources: Array
) -> Array:
    """Solve for amplitudes (k, l, j) that are coupled with their neighbours only."""
    count = len(kept)
    whole = np.broadcast_to(sources, (len(waves), count, count)).copy()
    diagonal = np.tile(kept, (len(waves), 1))
    diagonal[:, -1] += ends
    for row in range(1, count):
        share = waves * beside[row - 1] / diagonal[:, row - 1]
        diagonal[:, row] += share * waves * beside[row - 1]
        whole[:, row] -= share[:, None] * whole[:, row - 1]
    whole[:, -1] /= diagonal[:, -1, None]
    for row in range(count - 2, -1, -1):
        above = (waves * beside[row])[:, None] * whole[:, row + 1]
        whole[:, row] = (whole[:, row] + above) / diagonal[:, row, None]
    return whole


def _closure(order: int, first: int, c: float, waves: Array) -> Array:
    """What all degrees from one on, which are not scattered, add to that below it."""
    squared = waves * waves
    rest = (c + np.sqrt(c * c + squared)) / 2.0
    for degree in range(first + _CLOSED, first, -1):
        rest = c + squared * _coupled(degree, order) / rest
    return np.asarray(squared * _coupled(first, order) / rest)


def _coupled(degree: int, order: int) -> float:
    return (degree * degree - order * order) / (4.0 * degree * degree - 1.0)


@functools.cache
def _waves() -> Array:
    """Wave numbers in which the solution is tabulated, over the extinction."""
    return np.concatenate([[0.0], np.geomspace(_LONGEST_WAVE, _LAST / NEAREST, _WAVES - 1)])


@functools.cache
def _hankel(highest: int) -> Array:
    """Integrals of k² j_λ(k r) over waves, for values between which it is linear.

    Of even λ and of odd ones, of shape (λ k, r).
    """
    waves, rows = _waves(), np.geomspace(NEAREST, FARTHEST, ROWS)
    x = np.arange(0.5, _LAST / _STEP) * _STEP
    u = x / _RESOLVED
    # Smooths in space by a kernel without moments of the second and fourth order.
    fading = np.exp(-u * u) * (1.0 + u * u + u**4 / 2.0)
    bessel = _bessel(2 * highest, x) * (x * x * fading * _STEP / (4.0 * math.pi**2))
    found = np.zeros((2 * highest + 1, ROWS, len(waves)))
    steps = np.log(np.maximum(waves, waves[1] / 10.0))
    for row, r in enumerate(rows):
        place = np.interp(np.log(np.maximum(x / r, waves[1] / 10.0)), steps, np.arange(_WAVES))
        low = np.clip(place.astype(int), 0, _WAVES - 2)
        for near, share in ((low, 1.0 - (place - low)), (low + 1, place - low)):
            hat = np.zeros((len(x), _WAVES))
            hat[np.arange(len(x)), near] = share
            found[:, row] += bessel @ hat / r**3
    found = np.moveaxis(found, 1, 2)
    even, odd = found[::2], np.zeros_like(found[::2])
    odd[:-1] = found[1::2]
    return _without_tiny(np.stack([part.reshape(-1, ROWS) for part in (even, odd)]))


def _bessel(highest: int, x: Array) -> Array:
    """Spherical Bessel functions j_0 to j_λ, shape (λ + 1, k), by falling degrees."""
    begin = highest + 60 + int(x.max())
    found = np.zeros((highest + 1, len(x)))
    above, here = np.zeros(len(x)), np.full(len(x), 1e-100)
    total = np.zeros(len(x))
    for degree in range(begin, -1, -1):
        if degree <= highest:
            found[degree] = here
        total += (2 * degree + 1) * here * here
        above, here = here, (2 * degree + 1) / x * here - above
        large = np.abs(here) > 1e100
        for values in (above, here):
            values[large] *= 1e-100
        found[:, large] *= 1e-100
        total[large] *= 1e-200
    # Σ (2λ + 1) j_λ² = 1, and j_0 = sin x / x has the sign.
    found /= np.sqrt(total)
    return found * np.where(found[0] * np.sin(x) < 0.0, -1.0, 1.0)


@functools.cache
def _turned(highest: int) -> NDArray[np.float32]:
    """Harmonics in the frame of the radius for those in that of a wave, (l, j, m λ, m').

    Waves of the orders m' and -m' cancel unless l + j + λ is even: of λ those are kept.
    """
    mu, weight = np.polynomial.legendre.leggauss(_DIRECTIONS)
    rotated, count = _rotated(mu, highest), highest + 1
    degree = np.arange(2 * highest + 1)
    plane = np.polynomial.legendre.legvander(mu, 2 * highest)  # (k, λ)
    plane = plane * (2.0 * degree + 1.0) * weight[:, None]
    found = np.zeros((count, count, _AROUND, count, count), np.float32)
    of, by = np.divmod(np.arange(count * count), count)
    for parity in range(2):
        pairs = (of + by) % 2 == parity
        l, j, along = of[pairs], by[pairs], degree[parity::2]  # noqa: E741
        # i^(l - j + λ) is real.
        sign = 1.0 - ((l[:, None] - j[:, None] + along) % 4)
        for m, wave in np.ndindex(_AROUND, count):
            d = rotated[m, wave]
            share = (d[l] * d[j]) @ plane[:, along] * (sign * (2.0 if wave else 1.0))
            found[l, j, m, : len(along), wave] = share
    return found.reshape(count, count, -1, count)


def _rotated(mu: Array, highest: int) -> Array:
    """Wigner's d^l_mm'(μ), (m, m', l, k), by the eigenvectors of rotations."""
    found = np.zeros((_AROUND, highest + 1, highest + 1, len(mu)))
    for degree in range(highest + 1):
        m = np.arange(-degree, degree)
        raised = np.diag(np.sqrt(degree * (degree + 1.0) - m * (m + 1.0)), -1)
        turns, vectors = np.linalg.eigh((raised - raised.T) / 2j)
        phases = np.exp(-1j * np.arccos(mu)[:, None] * turns)
        ahead = vectors[degree:]
        d = np.einsum("an,kn,bn->abk", ahead[:_AROUND], phases, ahead.conj(), optimize=True).real
        found[: len(d), : degree + 1, degree] = d
    return found


def _harmonics(mu: Array, highest: int) -> Array:
    """Normalised harmonics of an azimuth of 0 at cosines, shape (m, l, k)."""
    sine = np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
    found = np.zeros((_AROUND, highest + 1, len(mu)))
    first = np.full(len(mu), math.sqrt(0.25 / math.pi))
    for m in range(_AROUND):
        if m:
            first = -first * sine * math.sqrt(1.0 + 0.5 / m)
        found[m, m] = first
        found[m, m + 1] = mu * math.sqrt(2.0 * m + 3.0) * first
        for degree in range(m + 2, highest + 1):
            below = math.sqrt(_coupled(degree - 1, m)) * found[m, degree - 2]
            found[m, degree] = (mu * found[m, degree - 1] - below) / math.sqrt(_coupled(degree, m))
    return found
