"""How much of the light in a water column carries the pattern of the waves, per band.

Small-angle scattering is a transfer function of the pattern's wave number κ,

    M(κ) = exp(b ∫₀^ℓ χ(q s) ds),      ℓ = y/μs,

(W. H. Wells, J. Opt. Soc. Am. 59, 686 (1969)), with χ(l + 1/2) the Legendre
moments χₗ of the phase function and q the wave number across the ray. The
unscattered light e^{-cℓ} carries the pattern times M, M = 1 for fine detail and
e^{bℓ} for coarse; the remaining light is not modulated. So the pattern is sharp
and strong in bands where little is scattered and the sky is dark: in the red.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..surface.caustics import disc_transfer, pattern_power
from ..surface.wave_components import wave_numbers
from ..water.phase import BandPhase
from .solved_field import SolvedField

_MOMENTS = 512


def scattering_transfer(
    b: ArrayLike, phase: BandPhase, mu_s: float, depth: float, q: ArrayLike
) -> NDArray[np.float64]:
    """Exponent b ∫ χ(q s) ds of the transfer function by small-angle scattering, shape (..., n).

    It is the logarithm of the modulated light relative to the unscattered light: b ℓ at q = 0, 0
    for fine detail. ``q`` is the wave number across the ray, rad/m.
    """
    path = depth / mu_s
    q = np.asarray(q, dtype=np.float64)
    x = np.log1p(np.maximum(q * path, 0.0))
    knots, mean = _mean_moment(phase)
    log_knots = np.log1p(knots)
    b = np.broadcast_to(np.asarray(b, dtype=np.float64), len(phase))
    bands = [np.interp(x, log_knots, mean[:, band]) for band in range(len(phase))]
    return np.stack(bands, axis=-1) * (b * path)


def _mean_moment(phase: BandPhase) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean of χ from 0 to x, at knots x: shapes (k,) and (k, n)."""
    order = np.arange(1, _MOMENTS + 1)
    chi = np.maximum(phase.moments(_MOMENTS), 0.0)
    # Beyond the computed moments the forward peak goes on as a power law.
    half = _MOMENTS // 2
    floor = np.finfo(np.float64).tiny
    power = np.log((chi[-1] + floor) / (chi[half - 1] + floor)) / math.log(2)
    power = np.minimum(power, 0.0)
    beyond = np.geomspace(_MOMENTS + 1, 1e6, 200)
    tail = chi[-1] * (beyond[:, None] / _MOMENTS) ** power
    x = np.concatenate([[0.0, 0.5], order + 0.5, beyond + 0.5])
    values = np.concatenate([np.ones((2, len(phase))), chi, tail])
    steps = np.diff(x)[:, None] * (values[1:] + values[:-1]) / 2
    integral = np.concatenate([np.zeros((1, len(phase))), np.cumsum(steps, axis=0)])
    mean = integral / np.maximum(x, 1e-300)[:, None]
    mean[0] = 1.0
    return x, mean


@dataclass(frozen=True, eq=False)
class SunlitWater:
    """How much of the light in a water column carries the pattern, per band.

    Below the floor, where the patterns of coarse images may lie, it is as at the floor.
    """

    #: Of the n bands, in water of one layer; its streams decide what :meth:`sun_fraction` counts as
    #: sun, so take those that are drawn.
    field: SolvedField

    def modulated(self, depth: float, q: ArrayLike) -> NDArray[np.float64]:
        """Modulated irradiance at wave number q, over the whole of it, shape (..., n)."""
        field, sun = self.field, self.field.light
        depth = min(depth, field.floor_depth)
        c = field.extinction_between(0.0, depth, scaled=False)
        exponent = scattering_transfer(field.scattering, field.phase_at(0.0), sun.mu_s, depth, q)
        light = sun.E * np.exp(exponent - c * depth / sun.mu_s)
        total = field.Ed(depth)
        return np.divide(light, total, out=np.zeros_like(light), where=total > 0)

    def sun_fraction(self, depth: float) -> NDArray[np.float64]:
        """Fraction of the direct and forward-scattered sun in the irradiance, shape (n,).

        The two of :meth:`.SolvedPatchLight.surface_irradiance`, which a renderer multiplies
        by the pattern.
        """
        field = self.field
        depth = min(depth, field.floor_depth)
        light, total = field.light.E * field.beam([depth])[:, 0], field.Ed(depth)
        return np.divide(light, total, out=np.zeros_like(light), where=total > 0)

    def variation(
        self, pattern: NDArray, tile: float, depth: float, collector: float = 0.0
    ) -> NDArray[np.float64]:
        """Coefficient of variation of Ed per band, shape (n,).

        ``pattern`` (N, N) is that of the unscattered sunlight, from :func:`caustic_pattern`, and
        ``tile`` its side, m; a level ``collector`` averages it over its diameter, m.
        """
        power = pattern_power(pattern)[..., None]
        transfer = self._transfer(pattern, tile, depth, collector)
        return np.sqrt(np.sum(power * transfer**2, axis=(0, 1)))

    def _transfer(
        self, pattern: NDArray, tile: float, depth: float, collector: float
    ) -> NDArray[np.float64]:
        kx, ky = wave_numbers(tile, len(pattern))
        sx, sy, sz = (float(value) for value in self.field.sun)
        across = np.sqrt(kx**2 + ky**2 + (kx * sx + ky * sy) ** 2 / sz**2)
        knots = np.linspace(0.0, math.sqrt(across.max()), 600) ** 2
        table = self.modulated(depth, knots)
        bands = [np.interp(across, knots, table[:, band]) for band in range(table.shape[1])]
        return np.stack(bands, -1) * disc_transfer(np.hypot(kx, ky) * (collector / 2))[..., None]
