"""Diffuse attenuation Kd: from the inherent optical properties, and from chlorophyll."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..spectra.spectrum import Spectrum, shipped_table
from .pure_water import molecular_scattering, pure_water_absorption

# A. Morel et al., Remote Sens. Environ. 111, 69 (2007): Kd(490) = Kw + χ C^e, of the measurements
# by the laboratory whose absorption and scattering the case 1 waters have. Their Eq. 8, with
# those of others, 0.0773 C^0.6715, is 2 to 6 % higher between 0.03 and 10 mg/m³.
_KW_490, _CHI_490, _E_490 = 0.0166, 0.07242, 0.68955


def Kd_Lee2013(
    a: ArrayLike, bb: ArrayLike, bb_molecular: ArrayLike, sun_zenith: float = 30.0
) -> NDArray[np.float64]:
    """Kd between the surface and the depth of 10 % light, from a, bb and the molecules' part.

    In clear water better than Lee et al. (2005), who take light scattered back by molecules for
    that of particles: up to 8 % too high there.

    The coefficients are absorption, backscattering, and the part of it by the water itself, all in
    1/m as Kd; the sun is in air, degrees, 0 to 90.

    Z.-P. Lee et al., J. Geophys. Res. Oceans 118, 4241 (2013).

    Raises
    ------
    InputError
        If a coefficient is negative or not finite, or the sun is below the horizon.
    """
    a, bb, molecular = checked_coefficients(
        sun_zenith, absorption=a, backscattering=bb, molecular=bb_molecular
    )
    strength = 4.259 * (1 - 0.52 * np.exp(-10.8 * a))
    return (1 + 0.005 * sun_zenith) * a + strength * (bb - 0.265 * molecular)


def checked_coefficients(sun_zenith: float, **coefficients: ArrayLike) -> list[NDArray[np.float64]]:
    """Return coefficients in 1/m as arrays, each finite and not negative.

    Raises
    ------
    InputError
        Names the one that is not, or a sun below the horizon.
    """
    if not 0 <= sun_zenith <= 90:
        raise InputError(f"Kd: the sun zenith must be 0 to 90 degrees, got {sun_zenith:g}")
    return [checked_coefficient(values, f"Kd: {name}") for name, values in coefficients.items()]


def checked_coefficient(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """Return values as an array; InputError if one is negative or not finite."""
    found = np.asarray(values, dtype=np.float64)
    if not np.all(np.isfinite(found) & (found >= 0)):
        raise InputError(f"{what} must be finite and not negative")
    return found


def Kd490_Morel2007(chlorophyll: ArrayLike) -> NDArray[np.float64]:
    """Kd at 490 nm, 1/m, of a case 1 water with this chlorophyll, mg/m³."""
    return _KW_490 + _CHI_490 * checked_coefficient(chlorophyll, "Kd(490): chlorophyll") ** _E_490


def Kd_Morel2001(chlorophyll: float) -> Spectrum:
    """Kd, 1/m, of a case 1 water with this chlorophyll, mg/m³, 350 to 700 nm.

    ``Kw + χ C^e`` with Kw = a + b/2 of pure water, where Kd comes nearer to a than it is.

    A. Morel & S. Maritorena, J. Geophys. Res. 106, 7163 (2001), Table 2.

    Raises
    ------
    InputError
        If the chlorophyll is negative or not finite.
    """
    if not (np.isfinite(chlorophyll) and chlorophyll >= 0):
        raise InputError(f"chlorophyll must be finite and not negative, got {chlorophyll:g} mg/m³")
    table = shipped_table("oceanic_diffuse_attenuation.csv").columns
    nm = table["wavelength_nm"]
    pure = pure_water_absorption(nm) + 0.5 * molecular_scattering(nm)
    name = f"Kd of case 1 water, {chlorophyll:g} mg/m³"
    return Spectrum(nm, pure + table["chi"] * chlorophyll ** table["e"], name)


def chlorophyll_Morel2007(Kd490: ArrayLike) -> NDArray[np.float64]:
    """Chlorophyll, mg/m³, of the case 1 water with this Kd at 490 nm, 1/m; 0 for pure water."""
    rest = np.maximum(checked_coefficient(Kd490, "Kd(490)") - _KW_490, 0.0)
    return (rest / _CHI_490) ** (1 / _E_490)
