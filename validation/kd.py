"""Diffuse attenuation and chlorophyll by other published ways than the water's own."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.water.diffuse_attenuation import (
    Kd490_Morel2007,
    checked_coefficients,
    chlorophyll_Morel2007,
)
from ..uw_spectral.water.optical_properties import Water


def Kd_Lee2005(a: ArrayLike, bb: ArrayLike, sun_zenith: float = 30.0) -> NDArray[np.float64]:
    """Kd between the surface and the depth of 10 % light, 1/m, from a and bb, both in 1/m.

    bb is of molecules and particles; the sun is in air, degrees, 0 to 90. Z.-P. Lee, K.-P. Du & R.
    Arnone, J. Geophys. Res. 110, C02016 (2005).

    Examples
    --------
    >>> Kd_Lee2005([0.05], [0.003]).round(4)
    array([0.0662])
    """
    a, bb = checked_coefficients(sun_zenith, absorption=a, backscattering=bb)
    return (1 + 0.005 * sun_zenith) * a + 4.18 * (1 - 0.52 * np.exp(-10.8 * a)) * bb


def jerlov_chlorophyll(water_type: str) -> float:
    """Chlorophyll, mg/m³, of the case 1 water with the Kd(490) of a Jerlov type.

    For the oceanic types I to III. In coastal types other matter adds to
    Kd: there it is an upper bound.
    """
    return float(chlorophyll_Morel2007(Water.jerlov(water_type).Kd([490.0]))[0])


def chlorophyll_jerlov(chlorophyll: float) -> str:
    """Oceanic Jerlov type whose Kd(490) is closest to a case 1 water's (ratio-wise)."""
    Kd = float(Kd490_Morel2007(chlorophyll))
    oceanic = ("I", "IA", "IB", "II", "III")
    return min(oceanic, key=lambda t: abs(math.log(Water.jerlov(t).Kd([490.0])[0] / Kd)))
