"""SeaBASS files (``.sb``), the format of NASA's archive of ocean measurements."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, printable
from .spectral_table import LARGEST_NUMBER, SHORTEST_WAVELENGTH_NM
from .spectrum import Spectrum, number_of, read_text

_DELIMITERS = {"comma": ",", "tab": "\t", "semicolon": ";", "space": None}
_FLAGS = ("missing", "above_detection_limit", "below_detection_limit")
_QUANTITIES = "kd|agp|cgp|bbp|ed|es|ap|ag|a|b|c"
_SPECTRAL_FIELD = re.compile(rf"({_QUANTITIES})_?(\d{{3}}(?:\.\d+)?)(nm)?")
_BEGIN, _END = "/begin_header", "/end_header"
_PER_METRE = {"": 1.0, "1/m": 1.0, "m^-1": 1.0, "1/cm": 100.0, "cm^-1": 100.0}
_IRRADIANCE = {
    "": 0.01, "uw/cm^2/nm": 0.01, "mw/cm^2/um": 0.01, "mw/m^2/nm": 0.001, "w/m^2/um": 0.001,
    "w/m^2/nm": 1.0,
}  # fmt: skip
_UNITS: dict[str, dict[str, float]] = {"ed": _IRRADIANCE, "es": _IRRADIANCE}
_NEAR = 0.02  # degrees that a ship drifts during a station: 2 km
_DATES = ("%Y%m%d", "%Y-%m-%d")


@dataclass(frozen=True, eq=False)
class SeaBASS:
    """Contents of a SeaBASS file."""

    path: Path
    header: dict[str, str]  #: ``/key=value`` lines, keys in lower case.
    #: Column names and units in lower case.
    fields: tuple[str, ...]
    units: tuple[str, ...]
    #: Numbers by column; missing ones are NaN, columns of text are left out.
    columns: dict[str, NDArray[np.float64]]
    lines: NDArray[np.int_]  #: Line number of each row.
    cells: dict[str, tuple[str, ...]]  #: All columns as they are written, without what is missing.

    def place(self, field: str, row: int) -> str:
        """Return where a value stands, for messages."""
        column = self.fields.index(field) + 1
        return f"{self.path}, line {self.lines[row]}, column {column} ({field})"

    def by_wavelength(self, quantity: str) -> list[tuple[str, float]]:
        """Return columns like ``kd490`` of a quantity, with their wavelengths in nm."""
        matches = [(field, _SPECTRAL_FIELD.fullmatch(field)) for field in self.columns]
        return [(field, float(m[2])) for field, m in matches if m and m[1] == quantity]

    def columns_of(self, quantity: str) -> list[tuple[str, float | None]]:
        """Return columns of a quantity with their wavelengths; None where the rows have them."""
        if quantity in self.columns and "wavelength" in self.columns:
            return [(quantity, None)]
        return [*self.by_wavelength(quantity)]

    def samples(self, quantity: str, lowest: float = 0.0) -> dict[float, list[float]]:
        """Return what was measured of a quantity at each wavelength, in 1/m or W m⁻² nm⁻¹.

        What is not below ``lowest`` and negative is noise, and counts as 0.

        Raises
        ------
        InputError
            If a value is below that, none is there, or the unit is not known.
        """
        samples: dict[float, list[float]] = {}
        for field, nm in self.columns_of(quantity):
            values = self.columns[field] * self._factor(field, quantity)
            if np.any(values < lowest):
                row = int(np.argmax(values < lowest))
                raise InputError(
                    f"{self.place(field, row)}: {values[row]:g} is negative; correct it or mark it "
                    "as /missing"
                )
            wavelengths = self.columns["wavelength"] if nm is None else np.full(len(values), nm)
            for wavelength, value in zip(wavelengths, values, strict=True):
                if np.isfinite(value) and np.isfinite(wavelength):
                    samples.setdefault(float(wavelength), []).append(max(float(value), 0.0))
        if not samples:
            raise InputError(f"{self.path}: every value of {quantity} is missing; give some")
        return samples

    def spectrum(self, quantity: str, source: str, lowest: float = 0.0) -> Spectrum:
        """Return the means of :meth:`samples`.

        Raises
        ------
        InputError
            As that, or if wavelengths are not those of light.
        """
        samples = self.samples(quantity, lowest)
        nm_sorted = sorted(samples)
        if nm_sorted[0] < SHORTEST_WAVELENGTH_NM:
            raise InputError(
                f"{self.path}: a wavelength of {nm_sorted[0]:g} nm is none of light; give "
                "nanometres"
            )
        means = np.array([np.mean(samples[value]) for value in nm_sorted])
        return Spectrum(np.array(nm_sorted), means, f"{quantity} of {self.path.name}", source)

    def require_one_station(self) -> None:
        """Raise InputError if rows are of several stations, whose mean is no water and no light."""
        for what, found in self._apart():
            listed = ", ".join(found[:4]) + (", …" if len(found) > 4 else "")
            raise InputError(
                f"{self.path} holds {len(found)} {what} ({printable(listed)}), and their mean is "
                "none of them; keep the rows of one"
            )

    def _apart(self) -> Iterator[tuple[str, list[str]]]:
        stations = list(dict.fromkeys(self.cells.get("station", ())))
        if len(stations) > 1:
            yield "stations", stations
        for field in ("lat", "lon"):
            degrees = self.columns.get(field, np.array([]))
            degrees = np.unwrap(degrees[np.isfinite(degrees)], period=360.0)
            if len(degrees) and np.ptp(degrees) > _NEAR:
                yield f"places by {field}", [f"{x:g}" for x in np.unique(degrees)]
        dates = sorted(set(self.cells.get("date", ())))
        if len(dates) > 1 and not _next_day(dates):
            yield "days", dates

    def _factor(self, field: str, quantity: str) -> float:
        """Return what brings a column to 1/m or W m⁻² nm⁻¹."""
        place = self.fields.index(field)
        unit = self.units[place] if place < len(self.units) else ""
        known = _UNITS.get(quantity, _PER_METRE)
        if unit not in known:
            raise InputError(
                f"{self.path}: {field} is in {unit!r}, as /units says, which is none of "
                f"{', '.join(filter(None, known))}; convert it"
            )
        return known[unit]


def is_seabass(text: str) -> bool:
    """Whether a text begins as a SeaBASS file does.

    Examples
    --------
    >>> is_seabass("/begin_header"), is_seabass("wavelength_nm,a,b")
    (True, False)
    """
    return _is_mark(text.lstrip().partition("\n")[0], _BEGIN)


def read_seabass(path: str | Path) -> SeaBASS:
    """Read a SeaBASS file.

    Raises
    ------
    InputError
        What is wrong, with line and column.
    """
    path = Path(path)
    lines = read_text(path, advice="SeaBASS files are plain text").splitlines()
    header, first = _header(path, lines)
    for key in ("fields", "delimiter"):
        if key not in header:
            raise InputError(f"{path}: the header has no /{key}; add it before {_END}")
    fields = tuple(cell.strip().lower() for cell in header["fields"].split(","))
    units = tuple(cell.strip().lower() for cell in header.get("units", "").split(","))
    doubled = [field for field in fields if fields.count(field) > 1]
    if doubled:
        raise InputError(f"{path}: the field {doubled[0]} is listed twice in /fields; keep one")
    rows, numbers = _rows(path, lines, first, header["delimiter"], len(fields))
    flags = [number_of(header[key].split("[")[0]) for key in _FLAGS if key in header]
    columns, cells = {}, {}
    for index, field in enumerate(fields):
        texts = tuple(row[index] for row in rows)
        values = [number_of(text) for text in texts]
        kept = zip(texts, values, strict=True)
        cells[field] = tuple(text for text, value in kept if text and value not in flags)
        bad = [value not in flags and not _is_sound(value) for value in values]
        if any(bad) and _is_ours(field):
            row = bad.index(True)
            raise InputError(
                f"{path}, line {numbers[row]}, column {index + 1} ({field}): {texts[row]!r} is not "
                f"a finite number up to {LARGEST_NUMBER:g}; correct it or mark it as /missing"
            )
        if not any(bad):
            columns[field] = np.array([np.nan if value in flags else value for value in values])
    return SeaBASS(path, header, fields, units, columns, np.array(numbers), cells)


def _rows(
    path: Path, lines: Sequence[str], first: int, delimiter: str, count: int
) -> tuple[list[list[str]], list[int]]:
    """Return the cells of each row, and the numbers of their lines."""
    if delimiter.lower() not in _DELIMITERS:
        raise InputError(
            f"{path}: delimiter {delimiter!r} is not one of {', '.join(_DELIMITERS)}; correct it"
        )
    rows, numbers = [], []
    for number, line in enumerate(lines[first:], start=first + 1):
        if not line.strip() or line.startswith("!"):
            continue
        cells = [cell.strip() for cell in line.split(_DELIMITERS[delimiter.lower()])]
        while len(cells) > count and not cells[-1]:
            del cells[-1]
        if len(cells) != count:
            raise InputError(
                f"{path}, line {number}: {len(cells)} cells where /fields lists {count}; complete "
                "that row"
            )
        rows.append(cells)
        numbers.append(number)
    if not rows:
        raise InputError(f"{path} has a header but no rows below {_END}; add them")
    return rows, numbers


def _header(path: Path, lines: Sequence[str]) -> tuple[dict[str, str], int]:
    """Return the keys of the header, and the number of its last line."""
    begin = next((number for number, line in enumerate(lines) if line.strip()), 0)
    if not lines or not _is_mark(lines[begin], _BEGIN):
        raise InputError(f"{path}, line 1: a SeaBASS file starts with {_BEGIN}; add it")
    header: dict[str, str] = {}
    for number, line in enumerate(lines[begin + 1 :], start=begin + 2):
        text = line.strip()
        if _is_mark(text, _END):
            return header, number
        if text.startswith("/"):
            key, equals, value = text[1:].partition("=")
            if not equals:
                raise InputError(
                    f"{path}, line {number}, column {line.index('/') + 1}: {text[:30]!r} has no "
                    "'='; write /key=value"
                )
            header[key.strip().lower()] = value.strip()
        elif text and not text.startswith("!"):
            raise InputError(
                f"{path}, line {number}, column 1: {text[:30]!r} stands in the header; header "
                f"lines start with / or !. Is {_END} missing?"
            )
    raise InputError(f"{path}: {_END} is missing; add it below the header")


def _is_mark(line: str, mark: str) -> bool:
    """Whether a line begins or ends the header; older files have an @ there."""
    return line.strip().lower().removesuffix("@") == mark


def _is_sound(value: float | None) -> bool:
    return value is not None and abs(value) <= LARGEST_NUMBER


def _is_ours(field: str) -> bool:
    """Whether the field is read, so that text in it is an error."""
    bare = field in ("wavelength", "depth", *_QUANTITIES.split("|"))
    return bare or _SPECTRAL_FIELD.fullmatch(field) is not None


def _next_day(dates: Sequence[str]) -> bool:
    """Whether sorted dates are of one night."""
    for form in _DATES:
        try:
            first, last = (datetime.strptime(x, form) for x in (dates[0], dates[-1]))
        except ValueError:
            continue
        return (last - first).days <= 1
    return False
