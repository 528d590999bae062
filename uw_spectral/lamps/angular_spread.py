"""How scattering spreads the light of a lamp over angles, after any number of scatterings.

Of light that has gone a length l, n scatterings with the probability of Poisson of b l, the
Legendre moments of its total deflection are e^{-b l (1 - χl)} (Goudsmit & Saunderson, Phys. Rev.
57, 24, 1940). One place stands for all scatterings of a path there: exact for one, and right in
the number of paths of two of which one is small. So :mod:`.multiple_scattering` has what goes
nearly straight on.

What harmonics follow (:mod:`.delta_scaled_phase`) is not in the tables, but in the last two of
those of patches. A scattering by ψ at the fraction σ of the way from the place that is lit back to
the lamp turns what is seen there by (1 - σ) ψ, and the direction in which the light had left the
lamp by σ ψ. A function of those directions so loses its Legendre moments as e^{-b r X(l)},
X(l) = ∫ (1 - χ(l σ)) dσ (Wells, J. Opt. Soc. Am. 59, 686, 1969): the radiance round a lamp, and the
profile of a lamp. None of this is fitted.

All of it depends on the length, over which it is tabulated for a water.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..table import LOGARITHMIC, Axis, Lookup, Scale, Table, discrete_axis, root
from ..water.phase import BandPhase
from .delta_scaled_phase import BEYOND, RESOLVED, moments_beyond, wide_moments
from .profile import LampProfile, sample_place

Array = NDArray[np.float64]

LENGTHS, ANGLES = 64, 64
"""Rows and columns of the table of deflections."""
ABOUT, OF_SURFACES, ANGLE2 = 0, 1, 2
"""Of the table of patches: the light from about the lamp, that of objects, and the mean square of
the angle between the former and the lamp, rad²."""
PROFILE_LENGTHS, PROFILE_ANGLES = 32, 64
ABOUT_LAMP = math.radians(30.0)
"""Within this of the lamp, scattered light has the lamp's shadows."""
OBJECT = math.radians(10.0)
"""Within this of its middle, what is around an object that is seen shines as the object does."""

_MOMENTS = 400  # of phase functions
_OF_PROFILE = 80
_PLACES = 400  # of the quadratures of profiles and patches
_SMALLEST = 1e-30
_SMALL = 1e-2


def path_lengths(count: int) -> Scale:
    """Return so many lengths of paths, m; shorter and longer ones are held."""
    return Scale(count, 1e-3, 1e3, LOGARITHMIC)


_LENGTHS, _PROFILE_LENGTHS = path_lengths(LENGTHS), path_lengths(PROFILE_LENGTHS)
_HALVES = Scale(ANGLES, 0.0, math.pi / 2, root(3.0))
NARROW_SCALES = _LENGTHS, _HALVES
NARROW = _LENGTHS.axis("length"), _HALVES.axis("half")
"""Axes of the table of deflections, of which it has the half, rad."""
ON_PATCHES = _LENGTHS.axis("length"), discrete_axis("quantity", 3)
_COSINES = Axis("cosine", PROFILE_ANGLES, lambda x, m: sample_place(x, PROFILE_ANGLES, m))
PROFILE = _PROFILE_LENGTHS.axis("length"), _COSINES
"""Axes of the profile of a lamp, by the cosine from its axis."""


class Spread(Protocol):
    """The tables of a water, of arrays or in a node tree."""

    @property
    def narrow(self) -> Lookup:
        """Logarithm of the fraction of light, 1/(sr m): see :class:`WaterSpread`."""
        ...

    @property
    def on_patches(self) -> Lookup:
        """Scattered irradiance over that without water."""
        ...

    def profile(self, profile: LampProfile) -> Lookup:
        """Profile of a lamp as light that was scattered has it."""
        ...


@dataclass(frozen=True, eq=False)
class WaterSpread(ComparedByContent):
    """The tables of a water of n bands, kept for equal ones."""

    b: Array  #: Scattering, 1/m, (n,).
    phase: BandPhase

    @property
    def narrow(self) -> Table:
        """Logarithm of the fraction of light per angle and length, but for absorption.

        Of light that was scattered at least twice on a length l, over l, by the whole deflection,
        less the same of :func:`.wide_moments`.
        """
        return _narrow(self)

    @property
    def on_patches(self) -> Table:
        """Scattered irradiance of an isotropic lamp over that without water, but for absorption.

        :data:`ABOUT` is the light from about the lamp, on a patch that faces it, but for what
        harmonics follow (:mod:`.scattered_irradiance`); :data:`OF_SURFACES` the fraction of an
        object's light that is scattered and seen in its place; :data:`ANGLE2` the mean square angle
        of all light from about the lamp from it.
        """
        return _on_patches(self)

    def profile(self, profile: LampProfile) -> Table:
        """Profile of a lamp as light has it that goes nearly straight on for a length."""
        return _profile(self, profile)

    @functools.cached_property
    def chi(self) -> Array:
        """Moments of the phase function from 0 on, shape (m + 1, n)."""
        return np.concatenate([np.ones((1, len(self.b))), self.phase.moments(_MOMENTS)])

    @functools.cached_property
    def onward(self) -> Array:
        """Moments of what harmonics do not follow for patches, likewise."""
        return self.chi - moments_beyond(self.phase, _MOMENTS, BEYOND)

    def scattered(self, lengths: Array, moments: Array, highest: int) -> Array:
        """Moments of light that is scattered at least once on lengths, shape (lengths, l, n).

        ``moments`` are those of the scattering, that of degree 0 its fraction.
        """
        bl = lengths[:, None, None] * self.b
        blurs = _blurs(moments)[: highest + 1]
        return -np.exp(-bl * blurs) * np.expm1(bl * (blurs - moments[0]))


@functools.lru_cache(maxsize=16)
def _narrow(spread: WaterSpread) -> Table:
    lengths, half = _LENGTHS.values(), _HALVES.values()

    def twice(chi: Array) -> Array:
        """Moments after two scatterings and more."""
        x, bl = (lengths[:, None, None] * (spread.b * part)[None] for part in (chi, chi[:1]))
        few = np.exp(-bl) * x * x * (0.5 + x / 6.0)
        return np.where(np.abs(x) < _SMALL, few, np.exp(x - bl) - np.exp(-bl) * (1.0 + x))

    wide = wide_moments(spread.phase, _MOMENTS, RESOLVED)
    found = _summed(twice(spread.chi) - twice(wide), np.cos(2.0 * half), _MOMENTS)
    per_metre = found / (4.0 * math.pi * lengths[:, None, None])
    return Table(np.log(np.maximum(per_metre, _SMALLEST)), NARROW)


@functools.lru_cache(maxsize=16)
def _on_patches(spread: WaterSpread) -> Table:
    lengths = _LENGTHS.values()
    fractions = spread.scattered(lengths, spread.chi, _MOMENTS)
    # Unless it is turned more.
    left = np.exp(-lengths[:, None, None] * (spread.b * (1.0 - spread.onward[0])))
    onward = left * spread.scattered(lengths, spread.onward, _MOMENTS)
    about = _received(onward, math.cos(ABOUT_LAMP), 1)
    seen = _received(fractions, math.cos(OBJECT), 0)
    whole, nearer = (_received(fractions, math.cos(ABOUT_LAMP), power) for power in (1, 2))
    nearer = np.divide(nearer, whole, out=np.ones_like(whole), where=whole > _SMALLEST)
    angle2 = 2.0 * (1.0 - nearer)
    values = np.concatenate([about, seen, angle2], axis=1)
    return Table(np.maximum(values, 0.0), ON_PATCHES)


@functools.lru_cache(maxsize=16)
def _profile(spread: WaterSpread, profile: LampProfile) -> Table:
    lengths = _PROFILE_LENGTHS.values()
    onward = spread.scattered(lengths, spread.onward, _OF_PROFILE)
    sent = onward[:, :1]
    fractions = np.divide(onward, sent, out=np.ones_like(onward), where=sent > _SMALLEST)
    fractions = fractions * profile_moments(profile)[:, None]
    sine = np.linspace(0.0, 1.0, PROFILE_ANGLES)
    values = _summed(fractions, 1.0 - 2.0 * sine * sine, _OF_PROFILE)
    return Table(np.maximum(values, 0.0), PROFILE)


def _summed(moments: Array, cosines: Array, highest: int) -> Array:
    """Sum of (2 l + 1) times moments, (rows, l, n), and Legendre polynomials: (rows, k, n).

    The highest moments are faded out, without which the sum would ring.
    """
    orders = np.arange(highest + 1.0)
    fading = np.exp(-((2.0 * orders / highest) ** 4))
    weighted = np.moveaxis(moments * (fading * (2.0 * orders + 1.0))[:, None], 1, -1)
    return np.moveaxis(weighted @ _legendre(highest, tuple(cosines)), 1, -1)


@functools.lru_cache(maxsize=16)
def _legendre(highest: int, cosines: tuple[float, ...]) -> Array:
    """Legendre polynomials from 0 on, shape (l + 1, k), not to be written."""
    mu = np.array(cosines)
    found = np.empty((highest + 1, len(mu)))
    found[0], found[1] = 1.0, mu
    for order in range(1, highest):
        following = (2 * order + 1) * mu * found[order] - order * found[order - 1]
        found[order + 1] = following / (order + 1)
    found.flags.writeable = False
    return found


def _blurs(moments: Array) -> Array:
    """Return X, the mean over σ from 0 to 1 of χ0 - χ at the order scaled by σ, shape (k, n).

    An order l counts as √(l (l + 1)), as whose square χ0 - χ begins.
    """
    y = np.sqrt(np.arange(_MOMENTS + 1.0) * (np.arange(_MOMENTS + 1.0) + 1.0))
    lost = moments[0] - moments
    steps = np.diff(y)[:, None] * (lost[1:] + lost[:-1]) / 2.0
    steps[0] = lost[1] * y[1] / 3.0
    whole = np.concatenate([np.zeros((1, moments.shape[1])), np.cumsum(steps, axis=0)])
    return whole / np.maximum(y, 1.0)[:, None]


def _received(fractions: Array, lowest: float, power: int) -> Array:
    """Light from around an axis by a power of the cosine from it."""
    window = _window(lowest, power)[:, None]
    return _summed(fractions * window, np.ones(1), _MOMENTS) / (4.0 * math.pi)


@functools.cache
def _window(lowest: float, power: int) -> Array:
    """Integrals of μ to a power times P_l(μ) over the directions above a cosine, sr."""
    places, weights = np.polynomial.legendre.leggauss(_PLACES)
    mu = lowest + (1.0 - lowest) * (places + 1.0) / 2.0
    return _legendre(_MOMENTS, tuple(mu)) @ (math.pi * (1.0 - lowest) * weights * mu**power)


@functools.lru_cache(maxsize=64)
def profile_moments(profile: LampProfile) -> Array:
    """Mean over all directions of a profile times each Legendre polynomial, shape (m,)."""
    places, weights = np.polynomial.legendre.leggauss(_PLACES)
    # All of the places within the edge: a narrow beam would fall between them.
    half = 1.0 if profile.edge is None else (1.0 - profile.edge) / 2.0
    cosines = 1.0 - half * (1.0 - places)
    values = half * weights * np.asarray(profile.value(cosines))
    return _legendre(_OF_PROFILE, tuple(cosines)) @ values / 2.0
