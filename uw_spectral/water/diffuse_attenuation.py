"""Diffuse attenuation Kd: from the inherent optical properties, and from chlorophyll."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

# A. Morel et al., Remote Sens. Environ. 111, 69 (2007): Kd(490) = Kw + χ C^e.
_KW_490, _CHI_490, _E_490 = 0.0166, 0.07242, 0.68955


def Kd_Lee2005(a: ArrayLike, bb: ArrayLike, sun_zenith: float = 30.0) -> NDArray[np.float64]:
    """Kd between the surface and the depth of 10 % light, from a and bb.

    Parameters
    ----------
    a, bb : array_like
        Absorption and backscattering (molecules and particles), 1/m.
    sun_zenith : float
        In air, degrees, 0 to 90.

    Returns
    -------
    array
        Kd in 1/m.

    Raises
    ------
    InputError
        If a coefficient is negative or not finite, or the sun is below the horizon.

    References
    ----------
    Z.-P. Lee, K.-P. Du & R. Arnone, J. Geophys. Res. 110, C02016 (2005).

    Examples
    --------
    >>> Kd_Lee2005([0.05], [0.003]).round(4)
    array([0.0662])
    """
    a, bb = np.asarray(a, dtype=np.float64), np.asarray(bb, dtype=np.float64)
    for name, values in (("absorption", a), ("backscattering", bb)):
        if not np.all(np.isfinite(values) & (values >= 0)):
            raise InputError(f"Kd: {name} must be finite and not negative")
    if not 0 <= sun_zenith <= 90:
        raise InputError(f"Kd: the sun zenith must be 0 to 90 degrees, got {sun_zenith:g}")
    return (1 + 0.005 * sun_zenith) * a + 4.18 * (1 - 0.52 * np.exp(-10.8 * a)) * bb


def Kd490_Morel2007(chlorophyll: ArrayLike) -> NDArray[np.float64]:
    """Kd at 490 nm, 1/m, of a case 1 water with this chlorophyll, mg/m³.

    Examples
    --------
    >>> round(float(Kd490_Morel2007(1.0)), 3)
    0.089
    """
    chlorophyll = np.asarray(chlorophyll, dtype=np.float64)
    if not np.all(np.isfinite(chlorophyll) & (chlorophyll >= 0)):
        raise InputError("Kd(490): chlorophyll must be finite and not negative")
    return _KW_490 + _CHI_490 * chlorophyll**_E_490


def chlorophyll_Morel2007(Kd490: ArrayLike) -> NDArray[np.float64]:
    """Chlorophyll, mg/m³, of the case 1 water with this Kd at 490 nm, 1/m; 0 for pure water.

    Examples
    --------
    >>> float(chlorophyll_Morel2007(Kd490_Morel2007(0.3)).round(6))
    0.3
    """
    Kd490 = np.asarray(Kd490, dtype=np.float64)
    if not np.all(np.isfinite(Kd490) & (Kd490 >= 0)):
        raise InputError("Kd(490) must be finite and not negative")
    return (np.maximum(Kd490 - _KW_490, 0.0) / _CHI_490) ** (1 / _E_490)
