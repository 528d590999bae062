"""Published tables of Jerlov's water types: which columns are sound, and what is repaired."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from importlib import resources

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..spectra.spectrum import Spectrum, shipped_table
from .pure_water import PURE_WATER_TABLE, pure_water_absorption

# Rows of Solonenko & Mobley 2015, Table 7, that repeat another block.
REPAIRED_TYPES = ("3C", "5C")
# What a publication's caveats name: its types, and columns that no water has.
_ANY_TYPE = re.compile(r"\b(?:I{1,3}|I[AB]|[1-9]C)\b")
_NOT_TAKEN = re.compile(r"\bKd0\b|^KdH\b")
_SOUND = ("ok", "interpolated")
_STATUS_TEXTS = {
    "suspect": "does not agree with the scattering model of the same paper",
    "reconstructed": "was recomputed from the paper's Eq. 8, its table being misprinted there",
    "model_extrapolation": "is modelled, not measured (measured from 412 to 715 nm)",
    "repaired": "was filled in, the table being misprinted there (data/SOURCES.md)",
}


@dataclass(frozen=True)
class Doubt:
    """A caveat that concerns part of a table."""

    text: str  #: Names quantity and wavelengths.
    #: Interpolated values strictly between these, nm, rest on the doubtful rows.
    above: float
    below: float

    def concerns(self, wavelengths: ArrayLike) -> bool:
        """Return whether a value at any of these wavelengths rests on doubtful rows."""
        wanted = np.asarray(wavelengths, dtype=np.float64)
        return bool(np.any((wanted > self.above) & (wanted < self.below)))


def caveats_of(water_type: str, caveats: Iterable[str]) -> tuple[str, ...]:
    """Return the caveats of a publication that concern a type and what is taken of it."""
    found = ((text, set(_ANY_TYPE.findall(text))) for text in caveats)
    return tuple(
        text
        for text, types in found
        if (not types or water_type in types) and not _NOT_TAKEN.search(text)
    )


def between_rows_as_water(a: Spectrum) -> Spectrum:
    """Return an absorption with rows between: what is not water, linear, plus water.

    Absorption of water itself has steps that a straight line over 25 nm misses by up to a
    fifth, between 575 and 600 nm most.
    """
    pure = shipped_table(PURE_WATER_TABLE).columns["wavelength_nm"]
    inside = pure[(pure > a.wavelengths[0]) & (pure < a.wavelengths[-1])]
    wavelengths = np.union1d(a.wavelengths, inside)
    rest = replace(a, values=a.values - pure_water_absorption(a.wavelengths))
    values = rest.at(wavelengths) + pure_water_absorption(wavelengths)
    return replace(a, wavelengths=wavelengths, values=np.maximum(values, 0.0))


def below_water(a: _Column, name: str) -> tuple[str, ...]:
    """Say where an absorption lies below that of pure water."""
    with np.errstate(divide="ignore"):
        lack = 1.0 - a.values / pure_water_absorption(a.wavelengths)
    # Ultraviolet is left out: there tables of pure water differ by more than a factor of two.
    rows = (lack > 0.01) & (a.wavelengths >= 400)
    if not rows.any():
        return ()
    where = a.wavelengths[rows]
    return (
        f"absorption of {name} at {where[0]:g} to {where[-1]:g} nm lies up to "
        f"{100 * lack[rows].max():.0f} % below that of pure water (Pope & Fry 1997); kept as "
        "published",
    )


def mixture(one: Spectrum, other: Spectrum, fraction: float, name: str) -> Spectrum:
    """Return spectra of two neighbours by the fraction of the other one."""
    wavelengths = np.union1d(one.wavelengths, other.wavelengths)
    low = max(one.wavelengths[0], other.wavelengths[0])
    high = min(one.wavelengths[-1], other.wavelengths[-1])
    common = wavelengths[(wavelengths >= low) & (wavelengths <= high)]
    if common.size == 0:
        raise InputError(f"{one.name} and {other.name} have no wavelength in common")
    return Spectrum(common, (1 - fraction) * one.at(common) + fraction * other.at(common), name)


@dataclass(frozen=True, eq=False)
class _Column:
    """One quantity of a Jerlov type, with the status of each row; empty where it is sound."""

    wavelengths: NDArray[np.float64]
    values: NDArray[np.float64]
    statuses: tuple[str, ...]

    def repaired(self, wavelengths: NDArray[np.float64], values: NDArray[np.float64]) -> _Column:
        """Return the column with other values in the rows at these wavelengths."""
        new = dict(zip(wavelengths.tolist(), values.tolist(), strict=True))
        rows = zip(self.wavelengths.tolist(), self.values.tolist(), self.statuses, strict=True)
        found = [
            (new[nm], "repaired") if nm in new else (value, status) for nm, value, status in rows
        ]
        return replace(
            self,
            values=np.array([value for value, _ in found]),
            statuses=tuple(status for _, status in found),
        )

    def doubts(self, name: str) -> list[Doubt]:
        """Return one doubt per run of neighbouring rows of the same status."""
        found, nm = [], [-np.inf, *self.wavelengths.tolist(), np.inf]
        rows = enumerate(self.statuses, start=1)
        for status, run in itertools.groupby(rows, key=lambda row: row[1]):
            places = [place for place, _ in run]
            if status:
                first, last = places[0], places[-1]
                meaning = _STATUS_TEXTS.get(status, f"has the status {status!r}")
                text = f"{name}, {nm[first]:g} to {nm[last]:g} nm: {meaning}"
                found.append(Doubt(text, nm[first - 1], nm[last + 1]))
        return found


def published_columns(water_type: str, source: str) -> dict[str, _Column]:
    """Return what the ``jerlov`` package tabulates for a type: a, b and, if it is there, Kd."""
    with (resources.files("jerlov.data") / f"{source}_iop.csv").open(encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if row["water_type"] == water_type]
    columns = {}
    for quantity, tabulated in (("a", "a"), ("b", "b"), ("Kd", "KdH")):
        found = sorted(
            (
                float(row["wavelength_nm"]),
                float(row["value_per_m"] or "nan"),
                "" if row["status"] in _SOUND else row["status"],
            )
            for row in rows
            if row["quantity"] == tabulated
        )
        if found:
            wavelengths, values, statuses = zip(*found, strict=True)
            columns[quantity] = _Column(np.array(wavelengths), np.array(values), statuses)
    return columns


def implausible(
    wavelengths: NDArray[np.float64], columns: dict[str, NDArray[np.float64]], name: str
) -> tuple[str, ...]:
    """Return what no body of water can be, in words."""
    import jerlov

    found = []
    # Above 600 nm water itself dominates, and its tables agree within a few percent.
    red = (wavelengths >= 600) & (wavelengths <= 700)
    if red.any():
        pure = np.asarray(jerlov.pure_water_absorption(wavelengths[red]))
        ratio = columns["a"][red] / pure
        if ratio.min() < 0.5:
            row = int(np.argmin(ratio))
            found.append(
                f"{name}: a = {columns['a'][red][row]:g} at {wavelengths[red][row]:g} nm, where "
                f"pure water has {pure[row]:.3g} 1/m; multiply by 100 if the table is in 1/cm, add "
                "pure water if it was left out"
            )
    if "Kd" in columns and np.any(columns["Kd"] < columns["a"]):
        row = int(np.argmax(columns["Kd"] < columns["a"]))
        found.append(
            f"{name}: Kd is below a at {wavelengths[row]:g} nm, so they do not describe one water; "
            "take both from one source"
        )
    return tuple(found)
