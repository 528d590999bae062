"""Phase functions: where scattered light goes.

Every phase function is per steradian and integrates to 1 over the sphere. The
formulas take ``s2``, the squared sine of half the scattering angle: unlike the
cosine it still resolves the forward peak, also in single precision.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand

PER_SPHERE = 1.0 / (4.0 * math.pi)
_SMALLEST_S2 = 1e-16  # 2e-8 rad; the Fournier-Forand and Petzold functions have no value at 0


class PhaseFunction:
    """A phase function that does not depend on wavelength.

    A subclass gives :meth:`per_steradian`; everything else follows by
    quadrature.
    """

    @property
    def kinks(self) -> tuple[float, ...]:
        """Scattering angles in rad where the function is not smooth."""
        return ()

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the phase function at ``s2 = sin²(angle / 2) > 0``, in 1/sr.

        ``m`` holds the elementary functions: numpy's, or a node tree's.
        """
        raise NotImplementedError

    def __call__(self, cosine: ArrayLike) -> NDArray[np.floating]:
        """Evaluate at the cosine of the scattering angle, in 1/sr."""
        s2 = 0.5 * (1 - np.asarray(cosine))
        return self.per_steradian(np.maximum(s2, _SMALLEST_S2))

    def normalisation(self) -> float:
        """Return the integral over the sphere by quadrature; 1 for a proper function."""
        return float(_integral_over_sphere(self, np.ones_like))

    @property
    def g(self) -> float:
        """Mean cosine of the scattering angle."""
        return float(self.moments(1)[0])

    @property
    def backscatter_ratio(self) -> float:
        """Fraction of the light that is scattered backwards, bb/b."""
        return float(
            _integral_over_sphere(self, lambda angle: np.where(angle > math.pi / 2, 1.0, 0.0))
        )

    def moments(self, count: int) -> NDArray[np.float64]:
        """Legendre moments χ1 to χn, χl = ∫ p(Θ) P_l(cos Θ) dΩ, accurate up to a few hundred."""
        return _moments(self, count)

    def for_bands(self, b: ArrayLike, b_molecular: ArrayLike | None = None) -> BandPhase:
        """Resolve for bands: the same function in each (``b_molecular`` is not needed)."""
        del b_molecular
        return BandPhase((self,), np.ones((1, np.atleast_1d(b).shape[0])))


class PhaseModel(Protocol):
    """What the user chooses: it becomes a :class:`BandPhase` once the water is known."""

    def for_bands(self, b: ArrayLike, b_molecular: ArrayLike | None = None) -> BandPhase:
        """Resolve for bands of scattering b, of which b_molecular by the water itself."""
        ...


@dataclass(frozen=True, eq=False)
class Mixture:
    """Phase functions added up; the weights may be values of shader nodes."""

    components: tuple[PhaseFunction, ...]  #: The k parts.
    weights: Operand  #: Their shares.

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the value in 1/sr; arrays ``s2`` need a last axis of 1 for the bands."""
        return sum(
            weight * component.per_steradian(s2, m)
            for weight, component in zip(self.weights, self.components, strict=True)
        )


@dataclass(frozen=True, eq=False)
class BandPhase(ComparedByContent, Mixture):
    """Mixture of phase functions whose weights may differ by band."""

    #: Fraction of each of the k parts in each band, (k, n); each column adds up to 1.
    weights: NDArray[np.float64]

    def __post_init__(self) -> None:
        weights = np.asarray(self.weights)
        if weights.ndim != 2 or len(weights) != len(self.components):
            raise InputError("phase mixture: give one row of weights per component")
        if not (np.all(weights >= 0) and np.allclose(weights.sum(axis=0), 1, atol=1e-6)):
            raise InputError("phase mixture: weights must not be negative and add up to 1 per band")
        object.__setattr__(self, "weights", constant(weights, weights.dtype))

    def __len__(self) -> int:
        return self.weights.shape[1]

    def __call__(self, cosine: ArrayLike) -> NDArray[np.float64]:
        """Evaluate at cosines of shape (...), in 1/sr; shape (..., n)."""
        values = np.stack([component(cosine) for component in self.components], axis=-1)
        return values @ self.weights

    def normalisation(self) -> NDArray[np.float64]:
        """Return the integral over the sphere per band, shape (n,)."""
        return self._mean([component.normalisation() for component in self.components])

    def moments(self, count: int) -> NDArray[np.float64]:
        """Legendre moments χ1 to χm per band, shape (m, n)."""
        each = np.stack([component.moments(count) for component in self.components], axis=-1)
        return each @ self.weights

    @property
    def chi1(self) -> NDArray[np.float64]:
        """First Legendre moment (mean cosine) per band, shape (n,)."""
        return self.moments(1)[0]

    @property
    def chi2(self) -> NDArray[np.float64]:
        """Second Legendre moment per band, shape (n,)."""
        return self.moments(2)[1]

    @property
    def backscatter_ratio(self) -> NDArray[np.float64]:
        """Share bb/b per band, shape (n,)."""
        return self._mean([component.backscatter_ratio for component in self.components])

    def _mean(self, values: list[float]) -> NDArray[np.float64]:
        return np.asarray(values) @ self.weights


@functools.cache
def quadrature(kinks: tuple[float, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Scattering angles and solid angles that resolve any forward or backward peak.

    Gauss-Legendre in the logarithm of the angle up to 0.02 rad, in the angle
    beyond; the last 0.02 rad before π by the logarithm of the distance to it.
    """
    nodes, weights = np.polynomial.legendre.leggauss(16)

    def panels(edges: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
        return (middle[:, None] + half[:, None] * nodes).ravel(), np.outer(half, weights).ravel()

    peak, inner = 0.02, np.asarray(sorted(kinks))
    log_edges = np.union1d(np.linspace(-60, math.log(peak), 120), np.log(inner[inner < peak]))
    logs, log_weights = panels(log_edges)
    near, near_weights = np.exp(logs), np.exp(logs) * log_weights
    edges = np.concatenate(
        [
            np.geomspace(peak, 0.2, 20),
            np.linspace(0.2, math.pi - 0.2, 40),
            math.pi - np.geomspace(peak, 0.2, 20),
            [math.pi / 2],
            inner[(inner > peak) & (inner < math.pi - peak)],
        ]
    )
    angles, angle_weights = panels(np.unique(edges))
    theta = np.concatenate([near, angles, math.pi - near])
    widths = np.concatenate([near_weights, angle_weights, near_weights])
    return theta, 2 * math.pi * np.sin(theta) * widths


def _integral_over_sphere(
    phase: PhaseFunction, of: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> NDArray[np.float64]:
    theta, solid_angle = quadrature(phase.kinks)
    s2 = np.sin(theta / 2) ** 2
    return (phase.per_steradian(s2) * of(theta) * solid_angle).sum()


@functools.lru_cache(maxsize=64)
def _moments(phase: PhaseFunction, count: int) -> NDArray[np.float64]:
    theta, solid_angle = quadrature(phase.kinks)
    density = phase.per_steradian(np.sin(theta / 2) ** 2) * solid_angle
    cosine = np.cos(theta)
    before, legendre = np.ones_like(cosine), cosine
    # 1 - ∫p(1 - P_l): the part of an infinite forward peak that no node sees counts as forward.
    moments = np.empty(count)
    for order in range(1, count + 1):
        moments[order - 1] = 1 - np.sum(density * (1 - legendre))
        following = ((2 * order + 1) * cosine * legendre - order * before) / (order + 1)
        before, legendre = legendre, following
    return constant(moments)
