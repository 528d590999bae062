"""Sunlight that has been scattered by small angles, many times over.

Light that is solved in N streams knows the moments of the phase function below N, and takes its
forward peak χN out of the scattering. Between those two lies the light that has left the beam
but is not yet diffuse: the aureole around the sun. It enters as the phase function p* that
scatters the scaled beam, at x = b y/μs scatterings along the slant path, by its Legendre moments,
f = χN:

    l < N:  χₗ - f + (1 - e^{-fx})/x
    l ≥ N:  (e^{(χₗ - f)x} - e^{-fx})/x

For l ≥ N this is the small-angle solution with all orders of scattering
(Goudsmit & Saunderson, Phys. Rev. 57, 24 (1940)), averaged over the path to
the surface; below it is single scattering, the diffuse field holds the
rest; a part that stays in the direction of the sun is left out. p* is p at
x = 0 and turns into the scaled phase function at x = ∞. It may be
slightly negative backwards, where the diffuse light outweighs it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..water.phase import BandPhase
from .legendre import legendre_modes

_MOMENTS = 512
_WINDOW = 4.0  # of the Legendre sum close to the sun, e^{-4 (l/512)⁴}: flat where streams end
_FADES = math.radians(10.0), math.radians(15.0)
WIDEST = math.sin(_FADES[1] / 2) ** 2
"""Squared sine of half the angle to the sun from which on :meth:`SpreadSun.factor` is 1."""


@dataclass(frozen=True, eq=False)
class SpreadSun:
    """The sun's beam at some depths, spread by small angles; make it with :func:`spread_sun`."""

    #: Phase function of each layer, and its fraction in the scatterings on the way, (d, n)).
    parts: Sequence[tuple[BandPhase, NDArray[np.float64]]]
    #: Fraction that was scattered by the peak alone or not at all, (d, n).
    single: NDArray[np.float64]
    rest: NDArray[np.float64]  #: Moments of the light that was scattered more, (l, d, n).
    #: Whether the peak is one: what streams leave out of a backward peak has no place here, (d, n).
    counts: NDArray[np.bool_]

    def factor(self, s2: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return p*/p at angles close to the sun, s2 (t,), shape (t, d, n).

        1 from 15° on; from 10° on it fades.
        """
        p = sum(fraction * phase.per_steradian(s2[:, None, None]) for phase, fraction in self.parts)
        terms = _legendre_terms(len(self.rest) - 1, s2.tobytes())
        spread = np.tensordot(terms, self.rest, axes=(0, 0))
        low, high = _FADES
        close = np.clip((high - 2.0 * np.arcsin(np.sqrt(s2))) / (high - low), 0.0, 1.0)
        close = close[:, None, None] * self.counts
        return 1.0 + close * (self.single - 1.0 + spread / np.maximum(p, 1e-30))


def spread_sun(water: Sequence[tuple[BandPhase, NDArray[np.float64]]], streams: int) -> SpreadSun:
    """Return the sun where its light is solved in streams.

    ``water`` is the phase function of each layer, and the scatterings along the slant paths in it,
    (d, n).
    """
    count = max(_MOMENTS, 2 * streams)
    x = [scatterings for _, scatterings in water]
    x[0] = np.maximum(x[0], 1e-9)
    total = np.sum(x, axis=0)
    parts = [(phase, each / total) for (phase, _), each in zip(water, x, strict=True)]
    chi = np.zeros(())
    for phase, fraction in parts:
        moments = np.vstack([np.ones(len(phase)), phase.moments(count)])
        chi = chi + fraction * moments[:, None]
    single = np.exp(-chi[streams] * total)
    rest = moments_of_spread(chi, total, streams) - single * chi
    return SpreadSun(parts, single, rest, chi[streams - 1] > 0)


@functools.lru_cache(maxsize=4)
def _legendre_terms(count: int, s2: bytes) -> NDArray[np.float64]:
    """Terms (2l + 1)/(4π) P_l, fading out, shape (l, t), at the bytes of s2."""
    degree = np.arange(count + 1)
    terms = (2 * degree + 1) / (4 * np.pi) * np.exp(-_WINDOW * (degree / count) ** 4)
    return terms[:, None] * legendre_modes(count, 1, 1.0 - 2.0 * np.frombuffer(s2))[0]


def moments_of_spread(
    chi: NDArray[np.float64], x: NDArray[np.float64], known: int = 2
) -> NDArray[np.float64]:
    """Legendre moments of p*, shape (l, n).

    ``chi`` (l, n) are those of the phase function from l = 0 to ``known`` at least, ``x`` (n,) the
    scatterings along the slant path.
    """
    f = chi[known]
    x = np.maximum(x, 1e-9)
    lost = -np.expm1(-f * x)
    moments = (np.expm1(np.minimum(chi - f, 0) * x) + lost) / x
    moments[:known] = chi[:known] - f + lost / x
    return moments
