"""What porous objects reflect once water fills their pores.

Grains scatter light more forward in water than in air, so that it goes deeper, and more of it is
absorbed: S. A. Twomey, C. F. Bohren & J. L. Mergenthaler, Appl. Opt. 25, 431 (1986).
"""

from __future__ import annotations

import functools

import numpy as np

from ..mathematics import NUMPY, Mathematics, Operand
from .refraction import fresnel_reflectance

GRAIN_INDEX = 1.54
"""Of quartz against air; cellulose and clays are close to it, carbonates higher."""
_ANGLES = 20_000


@functools.cache
def mean_cosine_of_grains(n: float) -> float:
    """Mean cosine of light after a clear sphere, large against wavelengths, of an index n ≥ 1.

    Geometric optics without diffraction, which closely packed grains have none of: the momentum
    that a ray leaves in a sphere (A. Ashkin, Biophys. J. 61, 569 (1992), eq. 1) is 1 less the
    mean cosine of all rays that it becomes.
    """
    # Even steps of the area of the sphere's disc.
    sine = np.sqrt((np.arange(_ANGLES) + 0.5) / _ANGLES)
    i, r = np.arcsin(sine), np.arcsin(sine / n)
    R = fresnel_reflectance(np.cos(i), n)
    turned = (np.cos(2 * i - 2 * r) + R * np.cos(2 * i)) / (1 + R**2 + 2 * R * np.cos(2 * r))
    return float(np.mean((1 - R) ** 2 * turned - R * np.cos(2 * i)))


def wet_reflectance_TwomeyEtAl1986(
    R: Operand, g_wet: Operand, z: Operand, m: Mathematics = NUMPY
) -> Operand:
    """Reflectance of a porous object where it lies, from that which it has dry.

    ``R`` is that of the dry object, thick and matte; ``g_wet`` the mean cosine of its grains in
    water, :func:`mean_cosine_of_grains`; ``z`` the height above the water surface, m.

    A thick layer of two streams reflects (1 - s)/(1 + s), s² = (1 - w0)/(1 - w0 g); water leaves
    the single-scattering albedo w0 of the grains as it is.
    """
    g = mean_cosine_of_grains(GRAIN_INDEX)
    root = (1.0 - R) / (1.0 + R)
    s2 = root * root
    absorbed = s2 * (1.0 - g) / (1.0 - g * s2)
    s = m.sqrt(absorbed / ((1.0 - g_wet) + g_wet * absorbed))
    return m.select(m.less(z, 0.0), (1.0 - s) / (1.0 + s), R)
