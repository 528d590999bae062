"""CSV tables over wavelength, with the checks every optical quantity shares."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import InputError
from .spectrum import Table, read_table

# No table of this field is shorter than this, and none in µm reaches it.
SHORTEST_WAVELENGTH_NM = 10.0
LARGEST_NUMBER = 1e12
"""No quantity of this field is larger in any usual unit; what is, overflows sooner or later."""


def read_spectral_table(path: str | Path, columns: tuple[str, ...] = ()) -> Table:
    """Read a CSV file with ``wavelength_nm`` and non-negative columns.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : tuple of str
        Columns that must be there besides ``wavelength_nm``.

    Returns
    -------
    Table

    Raises
    ------
    InputError
        What :func:`read_table` refuses, a negative number, one above 1e12, or
        wavelengths that look like micrometres.
    """
    table = read_table(path, ("wavelength_nm", *columns))
    wavelengths = table.columns["wavelength_nm"]
    if wavelengths.max() < SHORTEST_WAVELENGTH_NM:
        raise InputError(
            f"{path}: wavelengths {wavelengths.min():g} to {wavelengths.max():g} look like "
            "micrometres; give nanometres (multiply by 1000)"
        )
    for name, values in table.columns.items():
        if np.any(values < 0):
            row = int(np.argmax(values < 0))
            raise InputError(
                f"{path}, row {wavelengths[row]:g} nm, column {name}: {values[row]:g} is negative; "
                "correct that row"
            )
        if np.any(values > LARGEST_NUMBER):
            row = int(np.argmax(values))
            raise InputError(
                f"{path}, row {wavelengths[row]:g} nm, column {name}: {values[row]:g} is too large "
                "to be true; correct that row"
            )
    return table
