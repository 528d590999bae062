"""How much of uniform light from below the water surface mirrors back down."""

from __future__ import annotations

import functools

import numpy as np

from ...uw_spectral.surface.refraction import fresnel_reflectance
from ...uw_spectral.transfer.rough_surface import WaterSurface


@functools.lru_cache(maxsize=64)
def internal_reflectance(surface: WaterSurface) -> float:
    """Fraction of uniform upward radiance in the water that the surface reflects back down.

    What leaves is, by reciprocity, what a uniform sky brings, over n².
    """
    if not surface.slope_variance:
        return diffuse_internal_reflectance(surface.refractive_index)
    return 1.0 - surface.sky_transmittance / surface.refractive_index**2


@functools.lru_cache(maxsize=64)
def diffuse_internal_reflectance(refractive_index: float) -> float:
    """Fraction R of uniform upward radiance that a flat surface reflects back down.

    ``R = 2 ∫ R_F(μ) μ dμ`` from water into air; 0 for an index-matched surface.
    """
    critical = np.sqrt(max(1 - refractive_index**-2, 0.0))
    nodes, weights = np.polynomial.legendre.leggauss(64)
    # μ = critical + (1 - critical) t² softens the square-root rise at the critical angle.
    t = (nodes + 1) / 2
    cosine = critical + (1 - critical) * t**2
    step = (1 - critical) * t * weights
    cone = np.sum(2 * cosine * fresnel_reflectance(cosine, 1 / refractive_index) * step)
    return float(critical**2 + cone)
