"""Spectral reflectance: of RGB colours by a linear uplift, and measured."""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import constant
from ..errors import InputError, unknown_name
from ._colour import colour_science
from .bands import Bands
from .illuminant import band_mean, parse_illuminant
from .spectral_table import read_spectral_table
from .spectrum import Spectrum

_COLORCHECKER = "BabelColor Average"


@functools.cache
def _uplift_functions() -> Spectrum:
    data = colour_science().recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019
    return Spectrum(
        data.wavelengths,
        data.values,
        "sRGB basis of Mallett & Yuksel 2019",
        "Mallett & Yuksel, Spectral Primary Decomposition, EGSR 2019, doi 10.2312/SR.20191216",
    )


@functools.lru_cache(maxsize=8)
def uplift_basis(bands: Bands) -> NDArray[np.float64]:
    """Reflectance of the three Rec.709 primaries in each band, shape (n, 3).

    The basis of Mallett & Yuksel 2019 at the band centres; beyond its 380 to 780 nm, where no
    sensor sees colour, the end value is held. Rows sum to 1, so white reflects 1 and every colour
    in [0, 1]³ stays in [0, 1].

    Sampled, not averaged over the band: for measured reflectances sampling is better from 6 bands
    on, but this steeper basis comes back better averaged (CIE 1931, D65, mean ΔE2000: 2.3 against
    3.4 at 6 bands, 1.1 against 1.2 at 8).
    """
    functions = _uplift_functions()
    values = functions.at(np.clip(bands.centres, *functions.range))
    # The published table sums to 1 within 1e-5 only.
    return constant(values / values.sum(axis=1, keepdims=True))


def uplift(rgb: ArrayLike, bands: Bands) -> NDArray[np.float64]:
    """Reflectance, (..., n), of scene-linear Rec.709 colours, (..., 3), in each band.

    Linear in rgb, so that it also works on textures inside a shader.
    """
    return np.asarray(rgb, dtype=np.float64) @ uplift_basis(bands).T


def projected(reflectance: ArrayLike, bands: Bands) -> NDArray[np.float64]:
    """Scene-linear Rec.709 colour whose :func:`uplift` comes closest to a reflectance, (n,).

    Examples
    --------
    >>> bands = Bands.at_wavelengths([450, 500, 550, 600])
    >>> projected(uplift([0.1, 0.4, 0.7], bands), bands).round(6).tolist()
    [0.1, 0.4, 0.7]
    """
    values = np.asarray(reflectance, dtype=np.float64)
    # Of few bands, the one closest to grey.
    grey = values.mean()
    colour = grey + np.linalg.lstsq(uplift_basis(bands), values - grey, rcond=None)[0]
    return np.clip(colour, 0.0, 1.0)


@functools.lru_cache(maxsize=8)
def emission_basis(bands: Bands) -> NDArray[np.float64]:
    """Radiance of the three Rec.709 primaries in each band, for emitters, shape (n, 3).

    The uplift times D65 over π: light (1, 1, 1) is as bright as a white
    diffuser in D65 of 1 at 560 nm, and the reduction of CIE 1931 balanced for
    that D65 returns the RGB, within the error of the bands.
    """
    d65 = band_mean(parse_illuminant("d65").direct, bands)
    return constant(uplift_basis(bands) * d65[:, None] / math.pi)


def reflectance_from_csv(path: str | Path) -> Spectrum:
    """Read a measured reflectance ``wavelength_nm,reflectance`` with values from 0 to 1.

    Raises
    ------
    InputError
        If the file cannot be used; values above 1 are refused.
    """
    table = read_spectral_table(path, ("reflectance",))
    values = table.columns["reflectance"]
    if values.max() > 1:
        row = int(np.argmax(values))
        raise InputError(
            f"{path}: reflectance {values[row]:g} at {table.columns['wavelength_nm'][row]:g} nm is "
            "above 1; divide by 100 if the table is in percent"
        )
    return table.spectrum("reflectance", f"reflectance of {Path(path).name}")


def parse_reflectance(text: str) -> Spectrum:
    """Return the reflectance that an option names: a number from 0 to 1, or a CSV file.

    Raises
    ------
    InputError
        If the number is out of range or the file cannot be used.

    Examples
    --------
    >>> parse_reflectance("0.2").at([400, 700])
    array([0.2, 0.2])
    """
    try:
        value = float(text)
    except ValueError:
        return reflectance_from_csv(text.removeprefix("file:"))
    if not 0 <= value <= 1:
        raise InputError(f"reflectance {text} is not between 0 and 1")
    return Spectrum(np.array([1.0, 1e6]), np.full(2, value), f"reflectance {value:g}")


def colorchecker_patches() -> tuple[str, ...]:
    """Names of the 24 ColorChecker patches, row by row."""
    return tuple(colour_science().SDS_COLOURCHECKERS[_COLORCHECKER])


def colorchecker_reflectance(patch: str) -> Spectrum:
    """Measured reflectance of a ColorChecker patch, 380 to 730 nm.

    The mean of 30 charts (BabelColor Average), from colour-science.

    Raises
    ------
    InputError
        If the patch is unknown.
    """
    names = {name.lower(): name for name in colorchecker_patches()}
    name = names.get(patch.strip().lower())
    if name is None:
        raise unknown_name("ColorChecker patch", patch, colorchecker_patches())
    data = colour_science().SDS_COLOURCHECKERS[_COLORCHECKER][name]
    return Spectrum(
        data.wavelengths, data.values, f"reflectance of ColorChecker {name}", _COLORCHECKER
    )
