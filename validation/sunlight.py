"""Sun and clear sky above the water, and what of the sun a flat surface lets in."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.surface.refraction import REFRACTIVE_INDEX, fresnel_reflectance


def sky_fraction(zenith: float, bands: Bands) -> NDArray[np.float64]:
    """Fraction of the clear sky of SPECTRL2 in each band's irradiance, sun at a zenith in °."""
    light = parse_illuminant("clear-sky", zenith)
    direct, diffuse = light.direct_in(bands), light.diffuse_in(bands)
    return diffuse / (direct + diffuse)


def entering(zenith: float, index: float = REFRACTIVE_INDEX) -> float:
    """Fraction of the direct sun that enters the water."""
    return 1.0 - float(fresnel_reflectance(math.cos(math.radians(zenith)), index))
