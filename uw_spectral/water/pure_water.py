"""Absorption and scattering of water itself, without anything in it."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import unknown_name
from ..spectra.spectrum import Spectrum, shipped_table

PURE_WATER_TABLE = "pure_water_absorption.csv"
_SCATTERING_TABLE = "molecular_scattering.csv"


def pure_water_absorption(
    wavelengths: ArrayLike, source: str = "pope_fry_1997"
) -> NDArray[np.float64]:
    """Absorption of pure water, 1/m, from 300 to 800 nm.

    Sources are ``pope_fry_1997`` (IOCCG 2018 outside 420 to 727.5 nm) and ``smith_baker_1981``.

    Raises
    ------
    InputError
        Wavelength outside the table, or unknown source.
    """
    name = f"absorption of pure water ({source})"
    return _tabulated(PURE_WATER_TABLE, source, "absorption of pure water", name).at(wavelengths)


def molecular_scattering(
    wavelengths: ArrayLike, model: str = "zhang2009_S35_T22"
) -> NDArray[np.float64]:
    """Scattering of the water molecules and salt ions, b_w in 1/m, from 300 to 800 nm.

    Its backscattering is b_w / 2. Models are ``zhang2009_S35_T22`` (sea water, 22 °C),
    ``zhang2009_S0_T20`` (fresh water), ``morel1974_sea``, ``smith_baker_1981_sea`` and
    ``haltrin1999``.

    Raises
    ------
    InputError
        If a wavelength lies outside the table, or the model is unknown.
    """
    name = f"molecular scattering {model}"
    return _tabulated(_SCATTERING_TABLE, model, "molecular scattering", name).at(wavelengths)


@functools.cache
def _tabulated(file: str, column: str, kind: str, name: str) -> Spectrum:
    table = shipped_table(file)
    known = [column for column in table.columns if column != "wavelength_nm"]
    if column not in known:
        raise unknown_name(kind, column, known)
    return table.spectrum(column, name)
