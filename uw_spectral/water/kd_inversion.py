"""Absorption and scattering of a water of which only Kd was measured.

One number per wavelength cannot give two, so a bio-optical closure supplies
the scattering: the case 1 water with the same Kd(490). The absorption then
follows by solving Lee et al. (2005) for it. How far that is from the truth was
measured on the Jerlov types; the bounds come from the natural spread of
particle scattering.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataWarning, InputError
from ..spectra.spectral_table import read_spectral_table
from ..spectra.spectrum import Spectrum
from .bio_optics import particle_scattering
from .diffuse_attenuation import Kd_Lee2005, chlorophyll_Morel2007
from .optical_properties import Water
from .phase import FournierForand
from .pure_water import molecular_scattering

REFERENCE_WAVELENGTH = 490.0
# Particle scattering over its mean law: 0.12 and 0.45 over 0.30 (Gordon & Morel 1983).
_SCATTERING_SPREAD = (0.4, 1.5)
_LARGEST_CHLOROPHYLL = 100.0
_PURE_WATER = (300.0, 800.0)  # nm
_STEPS = 60


@dataclass(frozen=True, eq=False)
class KdInversion:
    """What Kd says about a water.

    Parameters
    ----------
    water : Water
        Best estimate, with the measured Kd.
    a_range, b_range : array, shape (2, n)
        Bounds at the wavelengths of Kd, 1/m, for particle scattering from 0.4
        to 1.5 times its mean law.
    chlorophyll : float
        Of the case 1 water with the same Kd(490), mg/m³.
    """

    water: Water
    a_range: NDArray[np.float64]
    b_range: NDArray[np.float64]
    chlorophyll: float


def invert_Kd(Kd: Spectrum, sun_zenith: float = 30.0) -> KdInversion:
    """Estimate a and b from Kd.

    Parameters
    ----------
    Kd : Spectrum
        1/m, in 300 to 800 nm and known at 490 nm.
    sun_zenith : float
        Of the measurement, in air, degrees.

    Returns
    -------
    KdInversion

    Raises
    ------
    InputError
        If Kd is not positive, does not cover 490 nm, or goes beyond 300 to 800 nm.

    Warns
    -----
    DataWarning
        If Kd is so low that backscattering alone exceeds it; a is 0 there.

    References
    ----------
    Z.-P. Lee, K.-P. Du & R. Arnone, J. Geophys. Res. 110, C02016 (2005), solved for a;
    A. Morel et al., Remote Sens. Environ. 111, 69 (2007), for the chlorophyll; H. R. Gordon &
    A. Morel (1983) for b; bb/b as in the default phase function.

    Examples
    --------
    >>> Kd = Spectrum([450, 490, 600], [0.032, 0.034, 0.248], "Kd")
    >>> invert_Kd(Kd).water.a([450]).round(3)
    array([0.02])
    """
    nm, values = Kd.wavelengths, Kd.values
    if values.ndim != 1 or np.any(values <= 0):
        row = int(np.argmax(values <= 0)) if values.ndim == 1 else 0
        raise InputError(f"{Kd.name}: Kd must be positive, at {nm[row]:g} nm it is not; correct it")
    check_pure_water_range(Kd)
    if not nm[0] <= REFERENCE_WAVELENGTH <= nm[-1]:
        raise InputError(
            f"{Kd.name} reaches from {nm[0]:g} to {nm[-1]:g} nm; the inversion needs it at 490 nm, "
            "where it stands for the chlorophyll. Add rows, or give a and b"
        )
    chlorophyll = min(
        float(chlorophyll_Morel2007(Kd.at([REFERENCE_WAVELENGTH]))[0]), _LARGEST_CHLOROPHYLL
    )
    # That of the default phase function, with which this water will be drawn.
    ratio = FournierForand().backscatter
    molecular, particles = molecular_scattering(nm), particle_scattering(chlorophyll, nm)

    def solve(spread: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        bb = 0.5 * molecular + spread * ratio * particles
        return _absorption(values, bb, sun_zenith), molecular + spread * particles

    a, b = solve(1.0)
    if np.any(a == 0):
        warnings.warn(
            f"{Kd.name}: Kd is so low at {nm[a == 0][0]:g} nm that backscattering alone exceeds "
            "it; the absorption is taken as 0 there. Check the units (1/m)",
            DataWarning,
            stacklevel=2,
        )
    bounds = [solve(spread) for spread in _SCATTERING_SPREAD]
    caveat = (
        "a and b are inverted from Kd (Lee et al. 2005, scattering of a case 1 water with "
        f"chlorophyll {chlorophyll:.2g} mg/m³). Against the published a and b of the ten Jerlov "
        "types, 400 to 700 nm: a is off by 9 % in the median, 29 % at the 90th percentile and 92 % "
        "at worst; b by a factor of 1.5 in the median, but of 10 to 60 in I and IA"
    )
    water = Water(
        Spectrum(nm, a, f"a from {Kd.name}"),
        Spectrum(nm, b, f"b from {Kd.name}"),
        Kd,
        f"{Kd.name}, inverted",
        Kd.source,
        (caveat,),
    )
    return KdInversion(
        water,
        np.sort(np.stack([pair[0] for pair in bounds]), axis=0),
        np.stack([pair[1] for pair in bounds]),
        chlorophyll,
    )


def check_pure_water_range(spectrum: Spectrum) -> None:
    """Refuse a spectrum that reaches where pure water is not known, 300 to 800 nm."""
    low, high = _PURE_WATER
    outside = [nm for nm in spectrum.range if not low <= nm <= high]
    if outside:
        raise InputError(
            f"{spectrum.name}: {outside[0]:g} nm lies outside {low:g} to {high:g} nm, where pure "
            "water is known; leave such rows out"
        )


def water_from_Kd_csv(path: str | Path, sun_zenith: float = 30.0) -> Water:
    """Water from a table ``wavelength_nm,Kd`` in nm and 1/m, by :func:`invert_Kd`.

    Raises
    ------
    InputError
        If the file cannot be used; the message names file and row.
    """
    table = read_spectral_table(path, ("Kd",))
    return invert_Kd(table.spectrum("Kd", f"Kd of {Path(path).name}"), sun_zenith).water


def _absorption(Kd: ArrayLike, bb: ArrayLike, sun_zenith: float) -> NDArray[np.float64]:
    """Solve Kd_Lee2005(a, bb) = Kd by bisection; 0 where there is no solution."""
    Kd, bb = np.asarray(Kd), np.asarray(bb)
    low, high = np.zeros_like(Kd), Kd.copy()
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        above = Kd_Lee2005(middle, bb, sun_zenith) > Kd
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(Kd_Lee2005(0.0, bb, sun_zenith) >= Kd, 0.0, 0.5 * (low + high))
