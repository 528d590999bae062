"""Light of a lamp that water scatters twice and more, by spherical harmonics.

Round a lamp in endless water radiance depends on the distance r, on the angle θ from the lamp's
axis and on the direction ω. L is that of all light that was scattered. What of it is scattered once
more is the source

    S(r, θ, ω) = b ∫ p(ω', ω) L(r, θ, ω') dω',

the integral of S e^{-c t} along a ray its radiance, and the integral of L over directions, each by
its cosine, the irradiance of a patch. In Fourier space the equation of transfer couples harmonics
of one order m' with their neighbours only:
(c - b χ_l) L_l + ik (α_l L_{l-1} + α_{l+1} L_{l+1}) = Q_l, α_l² = (l² - m'²)/(4 l² - 1).
Degrees beyond the highest are not scattered; they end the system exactly, by a continued fraction.
With the harmonics turned from the wave's frame into that of the radius, in which they keep their
order m, and plane waves in spherical Bessel functions j_λ, it is

    L = Σ_m Σ_lj g^m_lj(r) Y_lm(ω) 4π φ_j Y_jm(θ),   φ_j the moments of the lamp's profile.

Nothing of it is fitted, and it has no photons' noise. Scattering is that of
:mod:`.delta_scaled_phase`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent
from ..mathematics import Operand
from ..table import LOGARITHMIC, Scale
from ..water.phase import BandPhase
from .angular_spread import profile_moments
from .delta_scaled_phase import BEYOND, DEGREES, RESOLVED, moments_beyond, wide_moments
from .profile import LampProfile

Array = NDArray[np.float64]

ROWS = 24
NEAREST, FARTHEST = 0.06, 10.0
"""Distances of the rows, in mean free paths."""
_ROW = (FARTHEST / NEAREST) ** (1.0 / (ROWS - 1.0))
_FEW_DEGREES = 16
AROUND = 10
"""Orders m, from 0 on."""
_WAVES = 160  # wave numbers
_LONGEST_WAVE = 0.02  # wave number, in 1/c
_RESOLVED = 40.0  # waves along r, in rad, from which on they fade out
_LAST, _STEP = 150.0, 0.1  # of the integral over them
_CLOSED = 400  # degrees after which the continued fraction begins
_DIRECTIONS = 128  # of the quadrature over products of harmonics
_TINY = 1e-60
_CLEAREST = 1e-4  # 1/m
_LEAST_ABSORPTION = 1e-4  # of the extinction: without any, light would fill all water
_ABSORBED = 8.0  # absorption times distance, from which on what is left is less than the errors


def lamp_distances(scale: Operand, beyond: float = 1.0) -> Scale:
    """Return the distances of the rows, m, of an extinction that scales them, 1/m."""
    return Scale(ROWS, NEAREST, FARTHEST, LOGARITHMIC, beyond, scale)


@dataclass(frozen=True, eq=False)
class Harmonics(ComparedByContent):
    """The light of lamps in a water of n bands; equal ones are computed once."""

    a: Array
    b: Array
    phase: BandPhase
    degrees: int = DEGREES
    beyond: float = 0.0

    @property
    def scale(self) -> float:
        """Extinction that rows are scaled with, 1/m: in their steps, so that waters share them."""
        c = max(float(np.mean(self.a + self.b)), _CLEAREST)
        return _ROW ** round(math.log(c) / math.log(_ROW))

    def for_patches(self) -> Harmonics:
        """Return what is enough for the irradiance of patches, whose cosine is smooth."""
        return replace(self, degrees=min(self.degrees, _FEW_DEGREES), beyond=BEYOND)

    def of_bands(self, indices: ArrayLike) -> Harmonics:
        """Return it in some of the bands."""
        chosen = np.asarray(indices, dtype=int)
        phase = BandPhase(self.phase.components, np.asarray(self.phase.weights)[:, chosen])
        return replace(self, a=self.a[chosen], b=self.b[chosen], phase=phase)

    @property
    def moments(self) -> Array:
        """Of what is scattered, shape (l, n)."""
        if self.beyond:
            return moments_beyond(self.phase, self.degrees, self.beyond)
        return wide_moments(self.phase, self.degrees, RESOLVED * DEGREES / self.degrees)

    @property
    def distances(self) -> Array:
        """Of the rows, m."""
        return lamp_distances(self.scale).values()

    @property
    def radial(self) -> Array:
        """Coefficients g at the distances, shape (ROWS, m, l, j, n), 1/m²."""
        return _radial(self)

    @property
    def scattering(self) -> Array:
        """Coefficients b χ_l of each degree, shape (l, n), 1/m."""
        return np.minimum(self.b * self.moments, (1.0 - _LEAST_ABSORPTION) * self.extinction)

    def around(
        self, profile: LampProfile, turns: Array, degrees: int | None = None, blur: float = 1.0
    ) -> Array:
        """Coefficients of L round a lamp of an intensity of 1, shape (ROWS, turns, m, l, n), 1/m².

        ``turns`` are angles θ, rad; ``degrees`` the highest order m. The profile is blurred: the
        higher, the less of it rings on the lamp's dark side.
        """
        orders = AROUND if degrees is None else degrees + 1
        return round_axis(self.radial[:, :orders], profile, turns, blur)

    @property
    def extinction(self) -> Array:
        """Extinction of each band without what is taken for straight on, 1/m."""
        return np.maximum(self.a + self.b * self.moments[0], _CLEAREST)


def round_axis(radial: Array, profile: LampProfile, turns: Array, blur: float = 1.0) -> Array:
    """Coefficients round a lamp, (ROWS, turns, m, l, n), of those (ROWS, m, l, j, n) at distances.

    See :meth:`Harmonics.around`.
    """
    orders, highest = radial.shape[1], radial.shape[3] - 1
    # Blurred as far as the harmonics go, or what is beyond them would ring.
    fading = np.exp(-blur * (np.arange(highest + 1.0) / highest) ** 2)
    moments = 4.0 * math.pi * profile_moments(profile)[: highest + 1] * fading
    on_axis = on_sphere(np.cos(turns), highest)[:orders]
    return np.einsum("rmljn,j,mjt->rtmln", radial, moments, on_axis, optimize=True)


@functools.lru_cache(maxsize=8)
def _radial(field: Harmonics) -> Array:
    waves, found = wave_numbers(field.scale), []
    for a, c, b in zip(field.a, field.extinction, field.scattering.T, strict=True):
        orders = range(field.degrees + 1)
        solved = np.stack([scattered_waves(m, float(c), b, waves) for m in orders])
        by_row = at_distances(solved, field.scale)
        found.append(_continued(by_row, float(a) * field.distances))
    return np.stack(found, axis=-1)


def at_distances(waves: Array, scale: float) -> Array:
    """Coefficients at the distances of a scale, shape (ROWS, m, l, j).

    Of amplitudes of waves of :func:`wave_numbers`, shape (m', k, l, j); orders that are not given
    are none, and degrees l after the last that is given are left out.
    """
    orders, count, degrees = len(waves), waves.shape[-1], waves.shape[-2]
    hankel, rows = _hankel(count - 1), []
    for degree, turn in enumerate(_turned(count - 1)[:degrees]):
        # (j, m λ, m') by (j, m', k), then (j, m, λ k) by (λ k, r).
        by_wave = turn[..., :orders].astype(np.float64) @ np.moveaxis(waves[:, :, degree], 2, 0)
        by_wave = by_wave.reshape(count, AROUND, -1)
        row = np.empty((count, AROUND, ROWS))
        for parity in range(2):
            of_parity = slice((degree + parity) % 2, None, 2)
            row[of_parity] = by_wave[of_parity] @ hankel[parity]
        rows.append(row)
    return np.einsum("ljmr->rmlj", np.stack(rows)) * scale**3


def wave_numbers(scale: float) -> Array:
    """Return the wave numbers in which solutions are tabulated, 1/m, for an extinction, 1/m."""
    return _waves() * scale


def _continued(rows: Array, absorbed: Array) -> Array:
    """Go on from where absorption hides the light as it falls off besides: by absorption, and 1/r.

    Both are tabulated apart from it (:mod:`.scattered_source`), and its errors would grow there.
    """
    last = max(int(np.searchsorted(absorbed, _ABSORBED)) - 1, 0)
    beyond = np.maximum(absorbed, absorbed[last])
    left = np.exp(absorbed[last] - beyond) * absorbed[last] / beyond if absorbed[last] else 1.0
    rows = rows[np.minimum(np.arange(ROWS), last)]
    return rows * np.broadcast_to(left, ROWS)[:, None, None, None]


def scattered_waves(m: int, c: float, scattering: Array, waves: Array) -> Array:
    """Radiance of what was scattered, of waves along z of the order m, shape (k, l, j).

    Times i^(l - j) it is the amplitude of the degree l for a source of the degree j.
    """
    unscattered = radiance_of(m, c, 0.0 * scattering, waves, np.eye(len(scattering)))
    return radiance_of(m, c, scattering, waves, scattering[:, None] * unscattered)


def radiance_of(m: int, c: float, scattering: Array, waves: Array, sources: Array) -> Array:
    """Radiance of waves along z that come from sources, both of the shape (k, l, j)."""
    b, count = scattering[m:], len(scattering)
    beside = [math.sqrt(_coupled(degree, m)) for degree in range(m + 1, count)]
    ends = _closure(m, count, c, waves)
    found = np.zeros((len(waves), count, count))
    given = sources[..., m:, m:]
    found[:, m:, m:] = _inverse(c - b, beside, ends, waves, given)
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
        fraction = waves * beside[row - 1] / diagonal[:, row - 1]
        diagonal[:, row] += fraction * waves * beside[row - 1]
        whole[:, row] -= fraction[:, None] * whole[:, row - 1]
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
        for near, fraction in ((low, 1.0 - (place - low)), (low + 1, place - low)):
            hat = np.zeros((len(x), _WAVES))
            hat[np.arange(len(x)), near] = fraction
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
    found = np.zeros((count, count, AROUND, count, count), np.float32)
    of, by = np.divmod(np.arange(count * count), count)
    for parity in range(2):
        pairs = (of + by) % 2 == parity
        l, j, along = of[pairs], by[pairs], degree[parity::2]  # noqa: E741
        # i^(l - j + λ) is real.
        sign = 1.0 - ((l[:, None] - j[:, None] + along) % 4)
        for m, wave in np.ndindex(AROUND, count):
            d = rotated[m, wave]
            fraction = (d[l] * d[j]) @ plane[:, along] * (sign * (2.0 if wave else 1.0))
            found[l, j, m, : len(along), wave] = fraction
    return found.reshape(count, count, -1, count)


def _rotated(mu: Array, highest: int) -> Array:
    """Wigner's d^l_mm'(μ), (m, m', l, k), by the eigenvectors of rotations."""
    found = np.zeros((AROUND, highest + 1, highest + 1, len(mu)))
    for degree in range(highest + 1):
        m = np.arange(-degree, degree)
        raised = np.diag(np.sqrt(degree * (degree + 1.0) - m * (m + 1.0)), -1)
        turns, vectors = np.linalg.eigh((raised - raised.T) / 2j)
        phases = np.exp(-1j * np.arccos(mu)[:, None] * turns)
        ahead = vectors[degree:]
        d = np.einsum("an,kn,bn->abk", ahead[:AROUND], phases, ahead.conj(), optimize=True).real
        found[: len(d), : degree + 1, degree] = d
    return found


def on_sphere(mu: Array, highest: int) -> Array:
    """Normalised harmonics of an azimuth of 0 at cosines, shape (m, l, k)."""
    sine = np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
    found = np.zeros((AROUND, highest + 1, len(mu)))
    first = np.full(len(mu), math.sqrt(0.25 / math.pi))
    for m in range(AROUND):
        if m:
            first = -first * sine * math.sqrt(1.0 + 0.5 / m)
        found[m, m] = first
        found[m, m + 1] = mu * math.sqrt(2.0 * m + 3.0) * first
        for degree in range(m + 2, highest + 1):
            below = math.sqrt(_coupled(degree - 1, m)) * found[m, degree - 2]
            found[m, degree] = (mu * found[m, degree - 1] - below) / math.sqrt(_coupled(degree, m))
    return found
