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


def read_spectral_table(
    path: str | Path, columns: tuple[str, ...], optional: tuple[str, ...] = ()
) -> Table:
    """Read ``wavelength_nm`` and non-negative columns of a CSV file; others may hold anything.

    Raises
    ------
    InputError
        What :func:`read_table` refuses, a negative number, one above 1e12, or
        wavelengths that look like micrometres.
    """
    return checked_spectral_table(
        read_table(path, ("wavelength_nm", *columns), optional), str(path)
    )


def checked_spectral_table(table: Table, place: str) -> Table:
    """Return a table over wavelength if its numbers can be true.

    Raises
    ------
    InputError
        A negative number, one above 1e12, or wavelengths that look like micrometres.
    """
    wavelengths = table.columns["wavelength_nm"]
    if wavelengths.max() < SHORTEST_WAVELENGTH_NM:
        raise InputError(
            f"{place}: wavelengths {wavelengths.min():g} to {wavelengths.max():g} look like "
            "micrometres; give nanometres (multiply by 1000)"
        )
    for name, values in table.columns.items():
        for bad, what in (
            (values < 0, "negative"),
            (values > LARGEST_NUMBER, "too large to be true"),
        ):
            if bad.any():
                row = int(np.argmax(bad))
                raise InputError(
                    f"{place}, row {wavelengths[row]:g} nm, column {name}: {values[row]:g} is "
                    f"{what}; correct that row"
                )
    return table
