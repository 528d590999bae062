"""Light of a lamp that water scatters twice and more, as a source along rays, by harmonics.

Round a lamp in endless water radiance depends on the distance r, on the angle θ from the lamp's axis
and on the direction ω. What is scattered once more is the source

    S(r, θ, ω) = b ∫ p(ω', ω) L(r, θ, ω') dω',

with L all light that was scattered already. In Fourier space the equation of transfer
couples harmonics of one order m' with their neighbours only: (c - b χ_l) L_l + ik (α_l L_{l-1} +
α_{l+1} L_{l+1}) = Q_l, α_l² = (l² - m'²)/(4 l² - 1). Orders beyond :data:`ORDERS` are not scattered;
they end the system exactly, by a continued fraction. With the harmonics turned from the wave's
frame into that of the radius, in which they keep their order m, and plane waves in
spherical Bessel functions j_λ, the source is

    S = Σ_m Σ_lj g^m_lj(r) Y_lm(ω) 4π φ_j Y_jm(θ),   φ_j the moments of the lamp's profile.

Nothing of it is fitted, and it has no photons' noise. Of the phase function it has what is wider
than some ten degrees, :func:`smooth_moments`; what is narrower goes nearly straight on, and one bend
stands for it: :mod:`.multiple_scattering`.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..mathematics import NUMPY, Mathematics, Operand
from ..water.phase import BandPhase
from .angular_spread import profile_moments
from .profile import LampProfile

type Array = NDArray[np.float64]

ORDERS = 24
"""Highest order of harmonics, of directions and of profiles."""
AROUND = 3
"""Orders m of the azimuth about the radius, from 0 on."""
ROWS, TURNS, BENDS = 24, 24, 32
"""Of the table: distances, angles from the axis, deflections from the radius."""
NEAREST, FARTHEST = 0.06, 16.0
"""Distances of the rows, in mean free paths."""
_TURN_POWER, _BEND_POWER = 1.5, 2.0
"""Angles are the finer the smaller."""

_SMOOTH = 13.0  # order at which moments have fallen to 1/e
_FADE = 20.0  # of profiles
_WAVES = 120  # wave numbers
_LONGEST_WAVE = 0.02  # wave number, in 1/c
_RESOLVED = 40.0  # waves along r, in rad, from which on they fade out
_LAST, _STEP = 150.0, 0.1  # of the integral over them
_CLOSED = 400  # orders after which the continued fraction begins
_DIRECTIONS = 128  # of the quadrature over products of harmonics
_SMALLEST = 1e-12


def smooth_moments(chi: Array) -> Array:
    """Moments of the phase function without what is narrower than some ten degrees.

    Parameters
    ----------
    chi : array, shape (l, ...)
        Moments from 0 on.
    """
    orders = np.arange(len(chi)).reshape(-1, *[1] * (chi.ndim - 1))
    return np.asarray(chi * np.exp(-((orders / _SMOOTH) ** 4)))


def row_place(distance: Operand, c: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of a distance in m among the rows, even in its logarithm.

    Examples
    --------
    >>> round(float(row_place(16.0, 1.0)), 9), float(row_place(0.001, 1.0))
    (23.0, 0.0)
    """
    scale = (ROWS - 1.0) / math.log(FARTHEST / NEAREST)
    held = m.clamp(distance * c, NEAREST, FARTHEST)
    return (m.log(held) - math.log(NEAREST)) * scale


def turn_place(cosine: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of the cosine of the angle from the axis.

    Examples
    --------
    >>> float(turn_place(1.0)), round(float(turn_place(-1.0)), 9)
    (0.0, 23.0)
    """
    return _place(cosine, TURNS, 1.0 / _TURN_POWER, m)


def bend_place(cosine: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of the cosine of the deflection from the radius; see :func:`turn_place`."""
    return _place(cosine, BENDS, 1.0 / _BEND_POWER, m)


def _place(cosine: Operand, count: int, power: float, m: Mathematics) -> Operand:
    angle = m.arccos(m.clamp(cosine, -1.0, 1.0))
    return m.power(angle / math.pi, power) * (count - 1.0)


def _angles(count: int, power: float) -> Array:
    return np.asarray(math.pi * np.linspace(0.0, 1.0, count) ** power)


@dataclass(frozen=True, eq=False)
class ScatteredField(ComparedByContent):
    """The field of a lamp in a water of n bands; equal ones are computed once.

    Parameters
    ----------
    a, b : array, shape (n,)
        Absorption and scattering, 1/m.
    phase : BandPhase
    """

    a: Array
    b: Array
    phase: BandPhase

    @property
    def scale(self) -> float:
        """Extinction that rows are scaled with, 1/m."""
        return max(float(np.mean(self.a + self.b)), 1e-4)

    @property
    def distances(self) -> Array:
        """Of the rows, m."""
        return np.geomspace(NEAREST, FARTHEST, ROWS) / self.scale

    def source(self, profile: LampProfile) -> Array:
        """Return S without what absorption takes up to there, times r, of an intensity of 1.

        Parameters
        ----------
        profile : LampProfile

        Returns
        -------
        array, shape (AROUND, ROWS, TURNS, BENDS, n)
            Terms of the cosines of 0, 1, 2 ... times the azimuth between the lamp's axis and the
            direction of the light, about the radius; 1/(m² sr).
        """
        return _source(self, profile)


@functools.lru_cache(maxsize=32)
def _source(field: ScatteredField, profile: LampProfile) -> Array:
    moments = profile_moments(profile)[: ORDERS + 1]
    orders = np.arange(ORDERS + 1.0)
    moments = 4.0 * math.pi * moments * np.exp(-((orders / _FADE) ** 8))
    on_axis = _harmonics(_angles(TURNS, _TURN_POWER))
    of_bend = _harmonics(_angles(BENDS, _BEND_POWER))
    twice = np.where(np.arange(AROUND) > 0, 2.0, 1.0)
    r = field.distances[:, None]
    arrived = r * np.exp(field.a * r)
    by_turn = np.einsum("rmljn,j,mjt->mrtln", _radial(field), moments, on_axis, optimize=True)
    found = np.einsum("mrtln,mlk,m->mrtkn", by_turn, of_bend, twice, optimize=True)
    return np.asarray(found * arrived[None, :, None, None])


@functools.lru_cache(maxsize=8)
def _radial(field: ScatteredField) -> Array:
    """g^m_lj at the distances, shape (ROWS, AROUND, l, j, n)."""
    chi = np.concatenate([np.ones((1, len(field.b))), field.phase.moments(ORDERS)])
    scattering = field.b * smooth_moments(chi)
    turned, hankel = _turned(), _hankel()
    waves = _waves() * field.scale
    found = []
    for c, b in zip(field.a + field.b, scattering.T, strict=True):
        solved = np.stack([_solved(order, float(c), b, waves) for order in range(ORDERS + 1)])
        # (l, j, m λ, m') by (l, j, m', k)
        by_wave = turned @ np.moveaxis(solved, (0, 1, 2, 3), (2, 3, 0, 1))
        shape = (ORDERS + 1, ORDERS + 1, AROUND, -1, _WAVES)
        found.append(np.einsum("ljmak,ark->rmlj", by_wave.reshape(shape), hankel, optimize=True))
    return np.stack(found, axis=-1) * field.scale**3


def _solved(order: int, c: float, scattering: Array, waves: Array) -> Array:
    """What is scattered after what was scattered, of waves along z, shape (k, l, j).

    Times i^(l - j) it is the amplitude of the harmonic l for a source in the harmonic j.
    """
    l = np.arange(order + 1, ORDERS + 1)  # noqa: E741
    beside = np.sqrt((l * l - order * order) / (4.0 * l * l - 1.0))
    b = scattering[order:]
    straight = waves[:, None, None] * (np.diag(beside, -1) - np.diag(beside, 1))
    straight = straight + c * np.eye(len(b))
    straight[:, -1, -1] += _closure(order, c, waves)
    once = b[:, None] * np.linalg.inv(straight)
    more = np.linalg.solve(straight - np.diag(b), once)
    found = np.zeros((len(waves), ORDERS + 1, ORDERS + 1))
    found[:, order:, order:] = b[:, None] * more
    return found


def _closure(order: int, c: float, waves: Array) -> Array:
    """What all higher orders, which are not scattered, add to the last one."""
    squared = waves * waves
    tail = (c + np.sqrt(c * c + squared)) / 2.0
    for l in range(ORDERS + _CLOSED, ORDERS, -1):  # noqa: E741
        tail = squared * _coupled(l, order) / tail + (c if l > ORDERS + 1 else 0.0)
    return np.asarray(tail)


def _coupled(l: int, order: int) -> float:  # noqa: E741
    return (l * l - order * order) / (4.0 * l * l - 1.0)


@functools.cache
def _waves() -> Array:
    """Wave numbers in which the solution is tabulated, over the extinction."""
    return np.concatenate([[0.0], np.geomspace(_LONGEST_WAVE, _LAST / NEAREST, _WAVES - 1)])


@functools.cache
def _hankel() -> Array:
    """Integrals of k² j_λ(k r) over waves, for values between which it is linear, (λ, r, k)."""
    waves, rows = _waves(), np.geomspace(NEAREST, FARTHEST, ROWS)
    x = np.arange(0.5, _LAST / _STEP) * _STEP
    u = x / _RESOLVED
    # Smooths in space by a kernel without moments of the second and fourth order.
    fading = np.exp(-u * u) * (1.0 + u * u + u**4 / 2.0)
    bessel = _bessel(2 * ORDERS, x) * (x * x * fading * _STEP / (4.0 * math.pi**2))
    found = np.zeros((2 * ORDERS + 1, ROWS, len(waves)))
    steps = np.log(np.maximum(waves, waves[1] / 10.0))
    for row, r in enumerate(rows):
        place = np.interp(np.log(np.maximum(x / r, waves[1] / 10.0)), steps, np.arange(_WAVES))
        low = np.clip(place.astype(int), 0, _WAVES - 2)
        for near, share in ((low, 1.0 - (place - low)), (low + 1, place - low)):
            hat = np.zeros((len(x), _WAVES))
            hat[np.arange(len(x)), near] = share
            found[:, row] += bessel @ hat / r**3
    return found


def _bessel(highest: int, x: Array) -> Array:
    """Spherical Bessel functions j_0 to j_λ, shape (λ + 1, k), by falling orders."""
    begin = highest + 60 + int(x.max())
    found = np.zeros((highest + 1, len(x)))
    above, here = np.zeros(len(x)), np.full(len(x), 1e-100)
    total = np.zeros(len(x))
    for order in range(begin, -1, -1):
        if order <= highest:
            found[order] = here
        total += (2 * order + 1) * here * here
        above, here = here, (2 * order + 1) / x * here - above
        large = np.abs(here) > 1e100
        for values in (above, here):
            values[large] *= 1e-100
        found[:, large] *= 1e-100
        total[large] *= 1e-200
    # Σ (2λ + 1) j_λ² = 1, and j_0 = sin x / x has the sign.
    found /= np.sqrt(total)
    return found * np.where(found[0] * np.sin(x) < 0.0, -1.0, 1.0)


@functools.cache
def _turned() -> Array:
    """Harmonics in the frame of the radius for those in that of a wave, (l, j, m λ, m')."""
    mu, weight = np.polynomial.legendre.leggauss(_DIRECTIONS)
    rotated = _rotated(mu)
    plane = np.polynomial.legendre.legvander(mu, 2 * ORDERS).T  # (λ, k)
    order = np.arange(2 * ORDERS + 1)
    plane = plane * ((2.0 * order + 1.0)[:, None] * weight)
    shape = (ORDERS + 1, ORDERS + 1, AROUND, 2 * ORDERS + 1, ORDERS + 1)
    found = np.zeros(shape)
    for m in range(AROUND):
        for wave in range(ORDERS + 1):
            for side in {wave, -wave}:
                d = rotated[m, ORDERS + side]
                found[:, :, m, :, wave] += np.einsum("lk,jk,ak->lja", d, d, plane, optimize=True)
    l, j, a = np.ix_(order[: ORDERS + 1], order[: ORDERS + 1], order)
    # i^(l - j + λ) is real where it does not vanish.
    turns = (l - j + a) % 4
    sign = np.where(turns == 0, 1.0, np.where(turns == 2, -1.0, 0.0))
    found *= sign[:, :, None, :, None]
    return found.reshape(ORDERS + 1, ORDERS + 1, -1, ORDERS + 1)


def _rotated(mu: Array) -> Array:
    """Wigner's d^l_mm'(μ), (AROUND, 2 ORDERS + 1, l, k), by the eigenvectors of rotations."""
    found = np.zeros((AROUND, 2 * ORDERS + 1, ORDERS + 1, len(mu)))
    for l in range(ORDERS + 1):  # noqa: E741
        m = np.arange(-l, l)
        raised = np.diag(np.sqrt(l * (l + 1.0) - m * (m + 1.0)), -1)
        turns, vectors = np.linalg.eigh((raised - raised.T) / 2j)
        phases = np.exp(-1j * np.arccos(mu)[:, None] * turns)
        rows = vectors[l : l + AROUND]
        d = np.einsum("an,kn,bn->abk", rows, phases, vectors.conj(), optimize=True).real
        found[: len(rows), ORDERS - l : ORDERS + l + 1, l] = d
    return found


def _harmonics(angles: Array) -> Array:
    """Normalised harmonics of an azimuth of 0, shape (AROUND, l, k)."""
    mu, sine = np.cos(angles), np.sin(angles)
    found = np.zeros((AROUND, ORDERS + 1, len(mu)))
    first = np.full(len(mu), math.sqrt(0.25 / math.pi))
    for m in range(AROUND):
        if m:
            first = -first * sine * math.sqrt(1.0 + 0.5 / m)
        found[m, m] = first
        found[m, m + 1] = mu * math.sqrt(2.0 * m + 3.0) * first
        for l in range(m + 2, ORDERS + 1):  # noqa: E741
            below = math.sqrt(_coupled(l - 1, m))
            scale = 1.0 / math.sqrt(_coupled(l, m))
            found[m, l] = scale * (mu * found[m, l - 1] - below * found[m, l - 2])
    return found
