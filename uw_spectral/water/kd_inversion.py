"""Absorption and scattering of a water of which only Kd was measured.

One number per wavelength cannot give two, so a bio-optical closure supplies
the scattering and its bb/b: the case 1 water with the same Kd(490). The
absorption then follows by solving Lee et al. (2013) for it, with the sun of the
measurement. How far that is from the truth was measured on light fields solved
for known waters, and on the Jerlov types; the bounds come from the natural
spread of particle scattering.
"""

from __future__ import annotations

import dataclasses
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataWarning, InputError
from ..spectra.spectral_table import read_spectral_table
from ..spectra.spectrum import Spectrum
from .bio_optics import particle_backscatter_Morel2001, particle_scattering_Loisel1998
from .diffuse_attenuation import Kd_Lee2013, Kd_Morel2001, chlorophyll_Morel2007
from .optical_properties import BACKSCATTER, Water
from .phase_functions import BACKSCATTER_RANGE
from .pure_water import molecular_scattering, pure_water_absorption

REFERENCE_WAVELENGTH = 490.0
TYPICAL_SUN_ZENITH = 30.0
"""Sun zenith in degrees of a measurement that does not say its own."""

SUN_ZENITH = "sun_zenith"
"""Key in the comment of a table of Kd, as ``# sun_zenith: 45``."""

# Particle scattering over its mean law: 0.12 and 0.45 over 0.30 (Gordon & Morel 1983).
_SCATTERING_SPREAD = (0.4, 1.5)
_LARGEST_CHLOROPHYLL = 100.0
_PURE_WATER = (300.0, 800.0)  # nm
_MEASURED_CHLOROPHYLL = (0.01, 30.0)  # mg/m³
_STEPS = 60
_ACCURACY = (
    "From light solved for case 1 waters of 0.03 to 10 mg/m³, sun at 0 to 70°, a comes back within "
    "3 % in the median and 16 % at worst. Of water with more in it than phytoplankton Kd does not "
    "tell: against the published a and b of the ten Jerlov types, a is off by 14 % in the median "
    "and 124 % at worst, b by a factor of 1.9 in the median, of 10 to 60 in I and IA"
)


@dataclass(frozen=True, eq=False)
class KdInversion:
    """What Kd says about a water."""

    water: Water  #: Best estimate, with the measured Kd.
    #: Bounds at the wavelengths of Kd, 1/m, for particle scattering from 0.4 to 1.5 times its mean
    #: law, (2, n).
    a_range: NDArray[np.float64]
    b_range: NDArray[np.float64]
    chlorophyll: float  #: Of the case 1 water with the same Kd(490), mg/m³.
    backscatter: float  #: bb/b of the particles.


def invert_Kd(
    Kd: Spectrum, sun_zenith: float | None = None, backscatter: float | None = None
) -> KdInversion:
    """Estimate a and b from Kd.

    Z.-P. Lee et al., J. Geophys. Res. Oceans 118, 4241 (2013), solved for a;
    A. Morel et al., Remote Sens. Environ. 111, 69 (2007), for the chlorophyll; H. Loisel &
    A. Morel (1998) for b; A. Morel & S. Maritorena (2001) for bb/b.

    Kd is in 1/m, within 300 to 800 nm and known at 490 nm. The sun of the measurement is in air, 0
    to 90 degrees; :data:`TYPICAL_SUN_ZENITH`, with a caveat, if it is not known. ``backscatter`` is
    bb/b of the particles, with which the water is drawn; that of the case 1 water (Morel &
    Maritorena 2001) if it is not known.

    Raises
    ------
    InputError
        If Kd is not positive, does not cover 490 nm, or goes beyond 300 to 800 nm; if the sun
        is not above the horizon, or bb/b not one of sea particles.

    Warns
    -----
    DataWarning
        If Kd is so low that backscattering alone exceeds it; a is 0 there.
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
    zenith = TYPICAL_SUN_ZENITH if sun_zenith is None else sun_zenith
    if not 0 <= zenith < 90:
        raise InputError(
            f"{Kd.name}: the sun zenith of the measurement must be 0 to 90 degrees (90 is the "
            f"horizon), got {zenith:g}"
        )
    low, high = BACKSCATTER_RANGE
    if backscatter is not None and not low <= backscatter <= high:
        raise InputError(
            f"{Kd.name}: bb/b of the particles must be {low:g} to {high:g}, got {backscatter:g}"
        )
    chlorophyll = min(
        float(chlorophyll_Morel2007(Kd.at([REFERENCE_WAVELENGTH]))[0]), _LARGEST_CHLOROPHYLL
    )
    ratio = particle_backscatter_Morel2001(chlorophyll) if backscatter is None else backscatter
    molecular = molecular_scattering(nm)
    particles = particle_scattering_Loisel1998(chlorophyll, nm)

    def solve(spread: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        back = (0.5 * molecular + spread * ratio * particles, 0.5 * molecular, zenith)
        return _absorption(values, *back), molecular + spread * particles

    a, b = solve(1.0)
    if np.any(a == 0):
        warnings.warn(
            f"{Kd.name}: Kd is so low at {nm[a == 0][0]:g} nm that backscattering alone exceeds "
            "it; the absorption is taken as 0 there. Check the units (1/m)",
            DataWarning,
            stacklevel=2,
        )
    bounds = [solve(spread) for spread in _SCATTERING_SPREAD]
    caveats = [
        "a and b are inverted from Kd (Lee et al. 2013, scattering of a case 1 water with "
        f"chlorophyll {chlorophyll:.2g} mg/m³, bb/b {ratio:.3g}, sun at {zenith:.3g}°). {_ACCURACY}"
    ]
    if sun_zenith is None:
        caveats.append(
            f"the sun of the Kd measurement is not known and taken at {zenith:g}° from the zenith; "
            "if it was at 60°, a is an eighth too high. A table of Kd can say "
            f"'# {SUN_ZENITH}: 60'"
        )
    water = Water(
        Spectrum(nm, a, f"a from {Kd.name}"),
        Spectrum(nm, b, f"b from {Kd.name}"),
        Kd,
        f"{Kd.name}, inverted",
        Kd.source,
        tuple(caveats),
        particle_backscatter=ratio,
    )
    return KdInversion(
        water,
        np.sort(np.stack([pair[0] for pair in bounds]), axis=0),
        np.stack([pair[1] for pair in bounds]),
        chlorophyll,
        ratio,
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


def water_from_Kd_csv(path: str | Path) -> Water:
    """Water from a table ``wavelength_nm,Kd`` in nm and 1/m, by :func:`invert_Kd`.

    Its comment may say ``# sun_zenith: 45``, the sun of the measurement in degrees from the
    zenith, and ``# bb/b: 0.01`` of the particles.

    Raises
    ------
    InputError
        If the file cannot be used; the message names file and row.
    """
    table = read_spectral_table(path, ("Kd",))
    Kd = table.spectrum("Kd", f"Kd of {Path(path).name}")
    return invert_Kd(Kd, table.stated(SUN_ZENITH), table.stated(BACKSCATTER)).water


def water_of_chlorophyll(chlorophyll: float) -> Water:
    """Case 1 water, 0.01 to 30 mg/m³, with Kd as measured: Morel & Maritorena (2001), inverted.

    For a sun at 30°. Its constituents are not told apart. Above 560 nm their Kd is close to a of
    pure water, less than Kd of any water: nowhere is a taken to be below that of pure water.

    Raises
    ------
    InputError
        If the chlorophyll is outside that.
    """
    low, high = _MEASURED_CHLOROPHYLL
    if not low <= chlorophyll <= high:
        raise InputError(
            f"chlorophyll must be {low:g} to {high:g} mg/m³, where Kd was measured, got "
            f"{chlorophyll:g}"
        )
    Kd = Kd_Morel2001(chlorophyll)
    found = invert_Kd(Kd, TYPICAL_SUN_ZENITH).water
    nm = found.absorption.wavelengths
    a = np.maximum(found.absorption.values, pure_water_absorption(nm))
    return dataclasses.replace(
        found,
        absorption=Spectrum(nm, a, f"a from {Kd.name}"),
        diffuse_attenuation=None,
        name=f"case 1 water, chlorophyll {chlorophyll:g} mg/m³",
        source="Kd of Morel & Maritorena (2001)",
    )


def _absorption(
    Kd: ArrayLike, bb: ArrayLike, bb_molecular: ArrayLike, sun_zenith: float
) -> NDArray[np.float64]:
    """Solve Kd_Lee2013(a, …) = Kd by bisection; 0 where there is no solution."""
    Kd = np.asarray(Kd)
    back = bb, bb_molecular, sun_zenith
    low, high = np.zeros_like(Kd), Kd.copy()
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        above = Kd_Lee2013(middle, *back) > Kd
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(Kd_Lee2013(0.0, *back) >= Kd, 0.0, 0.5 * (low + high))
