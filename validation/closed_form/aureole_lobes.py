"""The aureole of `uw_spectral.transfer.aureole` for two streams, in terms a pixel can evaluate.

A pixel or a shader node needs few terms: e^{-fx} p, three moments that are
kept exactly, and a few Henyey-Greenstein lobes fitted to the rest.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.aureole import moments_of_spread
from ...uw_spectral.water.phase import BandPhase
from ...uw_spectral.water.phase_functions import henyey_greenstein

_MOMENTS = 512
_BLUR = 4.0  # of the Legendre sum, e^{-4 (l/512)²}: 0.3°, about the radius of the sun
# 1 - asymmetry of the lobes, in units of 1 - χ1 and widening with x.
_WIDTHS = np.array([0.1, 0.3, 1.0, 2.0, 4.0])
_RIDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Aureole:
    """Coefficients of p* per band; make them with :func:`solve_aureole`."""

    single: Operand  #: Factor e^{-fx} of the phase function itself, (n,).
    #: Coefficients of the Legendre polynomials 0, 1, 2 of the cosine, (n,).
    smooth: tuple[Operand, ...]
    #: Of the Henyey-Greenstein lobes, (n,).
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
    """Solve p* for a camera at depth y_o, m, and the in-water cosine mu_s of the sun."""
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
