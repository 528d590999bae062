"""Sunlight that has been scattered by small angles, many times over.

The closed form takes the forward peak χ2 of the phase function out of the
scattering and leaves it in the direct beam (delta scaling); the diffuse light
knows only the moments l = 0 and 1. Between those two lies the light that has
left the beam but is not yet diffuse: the aureole around the sun and the glow
at intermediate angles. It enters as the phase function p* that scatters the
scaled beam, at x = b y/μs scatterings along the slant path, by its Legendre
moments:

    l = 0, 1:  χₗ - f + (1 - e^{-fx})/x
    l ≥ 2:     (e^{(χₗ - f)x} - e^{-fx})/x

For l ≥ 2 this is the small-angle solution with all orders of scattering
(Goudsmit & Saunderson, Phys. Rev. 57, 24 (1940)), averaged over the path to
the surface; for l = 0, 1 it is single scattering, the diffuse field holds the
rest; a part that stays in the direction of the sun is left out. p* is p at
x = 0 and turns into the delta-Eddington phase function at x = ∞. It may be
slightly negative backwards, where the diffuse light outweighs it.

A pixel or a shader node needs few terms: e^{-fx} p, three moments that are
kept exactly, and a few Henyey-Greenstein lobes fitted to the rest.

Light solved in N streams knows the moments below N, and its forward peak is χN: the same
formulas, with N for 2, hold for it close to the sun.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..water.phase import BandPhase, henyey_greenstein
from .legendre import legendre_modes

_MOMENTS = 512
_BLUR = 4.0  # of the Legendre sum, e^{-4 (l/512)²}: 0.3°, about the radius of the sun
# 1 - asymmetry of the lobes, in units of 1 - χ1 and widening with x.
_WIDTHS = np.array([0.1, 0.3, 1.0, 2.0, 4.0])
_RIDGE = 1e-6
_WINDOW = 4.0  # of the Legendre sum close to the sun, e^{-4 (l/512)⁴}: flat where streams end
_FADES = math.radians(10.0), math.radians(15.0)
WIDEST = math.sin(_FADES[1] / 2) ** 2
"""Squared sine of half the angle to the sun from which on :func:`aureole_factor` is 1."""


@dataclass(frozen=True, eq=False)
class Aureole:
    """Coefficients of p* per band; make them with :func:`solve_aureole`.

    Attributes
    ----------
    single : array, shape (n,)
        Factor e^{-fx} of the phase function itself.
    smooth : tuple of three arrays, shape (n,)
        Coefficients of the Legendre polynomials 0, 1, 2 of the cosine.
    weights, asymmetries : tuple of arrays, shape (n,)
        Of the Henyey-Greenstein lobes.
    """

    single: Operand
    smooth: tuple[Operand, ...]
    weights: tuple[Operand, ...]
    asymmetries: tuple[Operand, ...]

    def astype(self, dtype: DTypeLike) -> Aureole:
        """Return the coefficients in another floating-point precision."""
        cast = np.dtype(dtype).type
        series = (self.smooth, self.weights, self.asymmetries)
        return Aureole(cast(self.single), *(tuple(map(cast, values)) for values in series))

    def spread(self, p: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return p*, given the phase function p at s2 = sin²(angle / 2)."""
        cosine = 1.0 - 2.0 * s2
        level, slope, bend = self.smooth
        total = self.single * p + level + cosine * slope
        total = total + bend * (1.5 * cosine * cosine - 0.5)
        for weight, asymmetry in zip(self.weights, self.asymmetries, strict=True):
            total = total + weight * henyey_greenstein(asymmetry, s2, m)
        return total


def solve_aureole(b: ArrayLike, phase: BandPhase, y_o: float, mu_s: float) -> Aureole:
    """Solve p* for a camera at depth y_o.

    Parameters
    ----------
    b : array_like, shape (n,)
        Scattering, 1/m.
    phase : BandPhase
        Phase function of the n bands.
    y_o : float
        Depth of the camera, m.
    mu_s : float
        Cosine of the in-water sun zenith angle.

    Returns
    -------
    Aureole
    """
    chi = np.vstack([np.ones(len(phase)), phase.moments(_MOMENTS)])
    x = np.broadcast_to(np.asarray(b, dtype=np.float64) * y_o / mu_s, len(phase))
    single = np.exp(-chi[2] * x)
    rest = moments_of_spread(chi, x) - single * chi
    blur = np.exp(-_BLUR * (np.arange(len(chi)) / _MOMENTS) ** 2)[:, None]

    asymmetries = np.maximum(1 - _WIDTHS[:, None] * ((1 - chi[1]) * (1 + x / 4)), 0)
    s2, legendre = _directions()
    p = phase.per_steradian(s2[:, None])
    target = legendre[:, 3:] @ (blur * rest)[3:]
    lobes = henyey_greenstein(asymmetries, s2[:, None, None])
    low = asymmetries ** np.arange(3)[:, None, None]
    lobes = lobes - np.einsum("dl,lkn->dkn", legendre[:, :3], low)
    # Errors count relative to the light in that direction.
    scale = 1 / (np.abs(single * p + legendre @ (blur * rest)) + 0.1 * p)
    weights = _least_squares(lobes * scale[:, None], target * scale)

    kept = rest[:3] - np.einsum("lkn,kn->ln", low, weights)
    smooth = kept * (np.array([1, 3, 5]) / (4 * np.pi))[:, None]
    return Aureole(single, tuple(smooth), tuple(weights), tuple(asymmetries))


def aureole_factor(
    water: Sequence[tuple[BandPhase, NDArray[np.float64]]], streams: int, s2: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return p*/p where the light is solved in streams, at angles close to the sun.

    Parameters
    ----------
    water : sequence of (BandPhase, array of shape (d, n))
        Phase function of each layer, and scatterings along the slant paths in it.
    streams : int
        N, even.
    s2 : array, shape (t,)
        Squared sines of half the scattering angle.

    Returns
    -------
    array, shape (t, d, n)
        1 from 15° on; from 10° on it fades.
    """
    count = max(_MOMENTS, 2 * streams)
    x = [scatterings for _, scatterings in water]
    x[0] = np.maximum(x[0], 1e-9)
    total = np.sum(x, axis=0)
    p, chi = np.zeros(()), np.zeros(())
    for (phase, _), share in zip(water, np.array(x) / total, strict=True):
        p = p + share * phase.per_steradian(s2[:, None, None])
        moments = np.vstack([np.ones(len(phase)), phase.moments(count)])
        chi = chi + share * moments[:, None]
    single = np.exp(-chi[streams] * total)
    rest = moments_of_spread(chi, total, streams) - single * chi
    spread = np.tensordot(_legendre_terms(count, s2.tobytes()), rest, axes=(0, 0))
    low, high = _FADES
    close = np.clip((high - 2.0 * np.arcsin(np.sqrt(s2))) / (high - low), 0.0, 1.0)
    # What the streams leave out of a backward peak has no place here.
    close = close[:, None, None] * (chi[streams - 1] > 0)
    return 1.0 + close * (single - 1.0 + spread / np.maximum(p, 1e-30))


@functools.lru_cache(maxsize=4)
def _legendre_terms(count: int, s2: bytes) -> NDArray[np.float64]:
    """Terms (2l + 1)/(4π) P_l, fading out, shape (l, t), at the bytes of s2."""
    degree = np.arange(count + 1)
    terms = (2 * degree + 1) / (4 * np.pi) * np.exp(-_WINDOW * (degree / count) ** 4)
    return terms[:, None] * legendre_modes(count, 1, 1.0 - 2.0 * np.frombuffer(s2))[0]


def moments_of_spread(
    chi: NDArray[np.float64], x: NDArray[np.float64], known: int = 2
) -> NDArray[np.float64]:
    """Legendre moments of p*.

    Parameters
    ----------
    chi : array, shape (l, n)
        Moments of the phase function from l = 0 to ``known`` at least.
    x : array, shape (n,)
        Scatterings along the slant path.
    known : int
        How many moments the diffuse light knows.

    Returns
    -------
    array, shape (l, n)
    """
    f = chi[known]
    x = np.maximum(x, 1e-9)
    lost = -np.expm1(-f * x)
    moments = (np.expm1(np.minimum(chi - f, 0) * x) + lost) / x
    moments[:known] = chi[:known] - f + lost / x
    return moments


def _least_squares(lobes: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights (k, n) of lobes (directions, k, n) for a target (directions, n)."""
    gram = np.einsum("dkn,djn->nkj", lobes, lobes)
    wanted = np.einsum("dkn,dn->nk", lobes, target)
    ridge = _RIDGE * np.trace(gram, axis1=1, axis2=2) + np.finfo(np.float64).tiny
    gram = gram + ridge[:, None, None] * np.eye(len(gram[0]))
    return np.linalg.solve(gram, wanted[..., None])[..., 0].T


@functools.cache
def _directions() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions of the fit as s2, and the Legendre terms (2l+1)/(4π) P_l there."""
    angle = np.radians(np.concatenate([np.geomspace(0.3, 30, 32), np.linspace(34, 180, 24)]))
    degree = np.arange(_MOMENTS + 1, dtype=np.float64)
    terms = np.polynomial.legendre.legvander(np.cos(angle), _MOMENTS)
    return np.sin(angle / 2) ** 2, terms * (2 * degree + 1) / (4 * np.pi)
