"""Phase functions with a bounded forward peak, for renderers that follow paths at random.

Measured and modelled phase functions of sea particles rise without end towards the forward
direction. A path tracer meets that peak rarely and then finds it very bright. Light that turns
by less than a few degrees is as good as not scattered: it is left out of the scattering
coefficient, and two lobes that stay finite carry the rest.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from .phase import BandPhase, quadrature
from .phase_functions import EinsteinSmoluchowski, draine

NARROWEST_DEG = 3.0
"""Angle in degrees from which on the lobes follow the phase function."""
LARGEST_ASYMMETRY = 0.94
"""Of a lobe: it bounds the peak, and with it the noise."""

_MOLECULAR = EinsteinSmoluchowski().anisotropy
_ORDERS = 1, 2, 3, 5  # moments that are kept with the backscatter, far better than single angles
_HEAVY = 0.5  # weight of each of them, beside that of all the angles
# Asymmetries and weights of cos² of the narrow and of the wide lobe. Cycles, in single
# precision, loses light with weights of 1000; up to 5 it is exact.
_NARROW = tuple(itertools.product(np.linspace(0.86, LARGEST_ASYMMETRY, 9), (0, 0.25, 0.5, 1, 2, 5)))
_WIDE = tuple(
    itertools.product(
        (*np.arange(-0.1, 0.82, 0.025), 0.0), (0, 0.15, 0.3, 0.5, _MOLECULAR, 1.3, 2, 3.5, 5)
    )
)

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BoundedPhase(ComparedByContent):
    """Two Draine lobes for each of n bands, that stand for a phase function."""

    #: See :func:`.draine`, (2, n).
    asymmetries: Array
    alphas: Array
    #: Fraction of each lobe in the scattering coefficient, (2, n). What their sum lacks to 1 goes
    #: on as if it were not scattered.
    fractions: Array
    #: Relative error of the phase function that 95 % of the angles beyond :data:`NARROWEST_DEG`
    #: keep to, (n,).
    error: Array

    def per_steradian(self, s2: Array) -> Array:
        """Return what is scattered, relative to the whole coefficient, 1/sr, shape (..., n)."""
        lobes = draine(self.asymmetries, self.alphas, np.asarray(s2)[..., None, None])
        return (self.fractions * lobes).sum(axis=-2)


@functools.lru_cache(maxsize=32)
def bound_forward_peak(phase: BandPhase) -> BoundedPhase:
    """Fit two lobes to the phase function of each band, beyond its forward peak.

    They keep its backscatter and its first Legendre moments to about 1 %, light in the peak
    counting as not scattered (delta scaling), and follow its values from :data:`NARROWEST_DEG`
    on.

    As in W. J. Wiscombe, J. Atmos. Sci. 34, 1408 (1977), the peak counts as unscattered; here
    it is what the lobes do not carry. Lobes: B. T. Draine, Astrophys. J. 598, 1017 (2003).
    """
    s2 = _angles()
    kept = [1.0 - phase.moments(max(_ORDERS))[order - 1] for order in _ORDERS]
    values = phase.per_steradian(s2[:, None])
    wanted = np.concatenate([values, kept, [phase.backscatter_ratio]])
    narrow, wide = _lobes(_NARROW), _lobes(_WIDE)
    weights = np.full(len(wanted), _HEAVY)
    weights[: len(s2)] = 1.0 / math.sqrt(len(s2))
    # Errors are relative; bands with the same phase function share their fit.
    distinct, which = np.unique(wanted.T, axis=0, return_inverse=True)
    chosen = [_closest(narrow, wide, weights / w, weights) for w in distinct]
    i, j, fractions = (np.array([chosen[k][part] for k in which.ravel()]) for part in range(3))
    lobes = np.array(_NARROW)[i], np.array(_WIDE)[j]
    asymmetries, alphas = (np.stack([lobe[:, part] for lobe in lobes]) for part in range(2))
    found = BoundedPhase(asymmetries, alphas, fractions.T, np.zeros(len(phase)))
    error = np.quantile(np.abs(found.per_steradian(s2) / values - 1.0), 0.95, axis=0)
    return dataclasses.replace(found, error=error)


def _closest(narrow: Array, wide: Array, scale: Array, target: Array) -> tuple[int, int, Array]:
    """Return the two lobes that come closest to a target, and their fractions, 0 to 1."""
    one, other = narrow * scale, wide * scale
    a, b, cross = (one**2).sum(1)[:, None], (other**2).sum(1), one @ other.T
    u, v = (one @ target)[:, None], other @ target
    determinant = a * b - cross**2
    apart = determinant > 1e-6 * a * b  # else the lobes cannot be told apart
    safe = np.where(apart, determinant, 1.0)
    first, second = (b * u - cross * v) / safe, (a * v - cross * u) / safe
    possible = apart & (first >= 0) & (second >= 0) & (first + second <= 1 + 1e-9)
    # Also each wide lobe alone, as molecules are.
    alone = np.minimum(v / b, 1.0)
    single = int(np.argmin(alone * (alone * b - 2.0 * v)))
    gain = np.where(possible, first * u + second * v, -np.inf)
    i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    if gain[i, j] <= alone[single] * (2.0 * v[single] - alone[single] * b[single]):
        return 0, single, np.array([0.0, alone[single]])
    return int(i), int(j), np.array([first[i, j], second[i, j]])


def _angles() -> Array:
    """Squared sines of half the angles that are fitted."""
    angles = np.concatenate([np.geomspace(NARROWEST_DEG, 30, 40), np.arange(33, 181, 3)])
    return np.sin(np.radians(angles) / 2) ** 2


@functools.cache
def _lobes(shapes: tuple[tuple[float, float], ...]) -> Array:
    """Values, moments that are kept (1 - χ), and backscatter of lobes, one in each row."""
    g, alpha = (np.array(part)[:, None] for part in zip(*shapes, strict=True))
    theta, solid_angle = quadrature(())
    light = draine(g, alpha, np.sin(theta / 2) ** 2) * solid_angle
    legendre = np.polynomial.legendre.legvander(np.cos(theta), max(_ORDERS))[:, _ORDERS]
    back = light[:, theta > math.pi / 2].sum(axis=1, keepdims=True)
    return np.concatenate([draine(g, alpha, _angles()), light @ (1.0 - legendre), back], axis=1)
