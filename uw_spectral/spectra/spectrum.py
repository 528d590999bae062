"""A spectrum on a wavelength grid, and the CSV tables that hold spectra."""

from __future__ import annotations

import csv
import difflib
import functools
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError, printable

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
_DECIMAL_COMMA = re.compile(r"^([-+]?\d*),(\d+(?:[eE][-+]?\d+)?)$")
DATA_DIRECTORY = Path(__file__).resolve().parents[2] / "data"


@dataclass(frozen=True, eq=False)
class Spectrum(ComparedByContent):
    """Values over wavelength, linearly interpolated, never extrapolated.

    Raises
    ------
    InputError
        If the grid is not increasing, or a number is not finite.
    """

    wavelengths: NDArray[np.float64]  #: Wavelengths in nm, strictly increasing, (n,).
    values: NDArray[np.float64]  #: The quantity at each wavelength, (n,) or (n, k).
    name: str  #: What it is, for messages (``"absorption of Jerlov IB"``).
    source: str = ""  #: Where the numbers come from.

    def __post_init__(self) -> None:
        wavelengths = constant(np.atleast_1d(self.wavelengths))
        values = constant(np.atleast_1d(self.values))
        if wavelengths.ndim != 1 or len(wavelengths) != len(values):
            raise InputError(
                f"{self.name}: {len(wavelengths)} wavelengths for {len(values)} values; "
                "give one value per wavelength"
            )
        if not np.all(np.isfinite(wavelengths)) or np.any(np.diff(wavelengths) <= 0):
            raise InputError(f"{self.name}: wavelengths must increase; sort the rows, no doubles")
        bad = ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        if bad.any():
            raise InputError(
                f"{self.name}: not a finite number at {wavelengths[bad][0]:g} nm; correct that row"
            )
        object.__setattr__(self, "wavelengths", wavelengths)
        object.__setattr__(self, "values", values)

    @property
    def range(self) -> tuple[float, float]:
        """First and last wavelength, nm."""
        return float(self.wavelengths[0]), float(self.wavelengths[-1])

    def at(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Interpolate linearly at wavelengths in nm, shape (m,), inside :attr:`range`.

        Raises
        ------
        InputError
            If a wavelength lies outside the table.
        """
        wanted = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        low, high = self.range
        outside = wanted[~((wanted >= low - 1e-9) & (wanted <= high + 1e-9))]
        if outside.size:
            raise InputError(
                f"{self.name} is known from {low:g} to {high:g} nm, but {outside[0]:g} nm was "
                "asked for; narrow --range or the wavelength list, or give a wider table"
            )
        if self.values.ndim == 1:
            return np.interp(wanted, self.wavelengths, self.values)
        columns = [np.interp(wanted, self.wavelengths, column) for column in self.values.T]
        return np.stack(columns, axis=-1)

    def at_or_zero(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Like :meth:`at`, but zero outside the table (for sensitivities that end there)."""
        wanted = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        low, high = self.range
        inside = (wanted >= low) & (wanted <= high)
        result = self.at(np.clip(wanted, low, high))
        return result * inside.reshape((-1,) + (1,) * (result.ndim - 1))


_NUMBERED = re.compile(r"^([A-Za-z][^:=\n]{1,29}?)\s*[:=]\s*[-+]?\.?\d", re.MULTILINE)
_ALIKE = 0.8
"""Of 1, how alike a word of a comment is to a key that is meant."""


@dataclass(frozen=True, eq=False)
class Table:
    """A CSV table: comment header, column names, numbers."""

    path: Path  #: For messages.
    header: str  #: Its comment lines (source, licence).
    columns: dict[str, NDArray[np.float64]]

    def spectrum(self, column: str, name: str) -> Spectrum:
        """Return one column over ``wavelength_nm``."""
        return Spectrum(self.columns["wavelength_nm"], self.columns[column], name, self.header)

    def stated(self, key: str) -> float | None:
        """Return the number of a comment line ``# key: number``, or with ``=``; None without one.

        What follows it, such as a unit, is not read.

        Raises
        ------
        InputError
            If it is not a number, there are two, or the key is misspelt.
        """
        found = re.findall(rf"^{re.escape(key)}\s*[:=](.*)$", self.header, re.MULTILINE)
        if not found:
            self._require_no_other(key)
            return None
        if len(found) > 1:
            raise InputError(f"{self.path}: the comment gives {key} twice; keep one")
        try:
            return float(found[0].partition("[")[0].split()[0])
        except (ValueError, IndexError) as error:
            raise InputError(
                f"{self.path}: the comment gives {key} as {found[0].strip()!r}; write "
                f"'# {key}: ' and a number, or leave it out"
            ) from error

    def _require_no_other(self, key: str) -> None:
        """Refuse the number of a key that looks like another, which nobody would read."""
        for other in _NUMBERED.findall(self.header):
            plain = other.strip().lower()
            if other != key and difflib.get_close_matches(plain, [key], cutoff=_ALIKE):
                raise InputError(
                    f"{self.path}: the comment gives {other.strip()!r}, which is not read; write "
                    f"'# {key}: ' if that is meant, or the number before the word"
                )


def is_file(path: str | Path) -> bool:
    """Whether a path names a file; not if it cannot be one, say by its length."""
    try:
        return Path(path).is_file()
    except OSError:
        return False


def split_location(location: str) -> tuple[Path, str]:
    """Return the file, and the name after ``#`` of what is meant in it, if there is one.

    Examples
    --------
    >>> split_location("cameras.txt#D90")[1]
    'D90'
    """
    if "#" in location and not is_file(location):
        base, _, name = location.rpartition("#")
        return Path(base), name
    return Path(location), ""


def read_text(path: str | Path, kind: str = "", advice: str = "save it as CSV (UTF-8)") -> str:
    """Read a text file.

    ``kind`` is what it should hold, for messages, as ``"sensor "``; ``advice`` what to do if it is
    no text.

    Raises
    ------
    InputError
        If the file cannot be read or is no text, in UTF-8 or Windows' code page of the West.
    """
    try:
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:  # a path with a null character is a ValueError
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot read {kind}{path}: {reason}; check the path") from error
    for encoding in ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        # What is lost in a crash is of nulls; DOS ends a text with its mark.
        if not _CONTROL.search(text := text.removesuffix("\x1a")):
            return text.replace("\r\n", "\n").replace("\r", "\n")
    raise InputError(f"{kind}{path} is not a text file; {advice}")


@dataclass(frozen=True)
class TableText:
    """Rows of a table as they are written: columns between commas, semicolons or tabs."""

    place: str  #: Where it is from, for messages.
    header: str  #: Its comment lines, which start with ``#``.
    names: tuple[str, ...]  #: Of the columns.
    #: Number of the line and cells, the names first; decimals have a point.
    rows: tuple[tuple[int, tuple[str, ...]], ...]


def table_text(text: str, place: str) -> TableText:
    r"""Split the text of a table into cells.

    What spreadsheets leave is passed over: empty rows, empty cells at the ends of rows, quotes
    about comments. Between semicolons, decimals may have a comma.

    Raises
    ------
    InputError
        If a line is none of a table.

    Examples
    --------
    >>> table_text("# of 2024;;\nwavelength_nm;a;\n400;0,1;\n;;\n", "").rows
    ((2, ('wavelength_nm', 'a')), (3, ('400', '0.1')))
    """
    comments, lines = [], []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip(' "').startswith("#"):
            comments.append(line.strip(' "\t,;').lstrip("# "))
        elif line.strip():
            lines.append((number, line))
    first = lines[0][1] if lines else ""
    delimiter = next((x for x in ",;\t" if x in first), ",")
    rows = []
    for number, line in lines:
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        except csv.Error as error:
            raise InputError(
                f"{place}, line {number} is none of a table of numbers: {error}; save it as CSV"
            ) from error
        if delimiter == ";" and rows:
            cells = [_DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
        width = len(rows[0][1]) if rows else 0
        while len(cells) > width and not cells[-1]:
            del cells[-1]
        if any(cells):
            rows.append((number, tuple(cells)))
    return TableText(place, "\n".join(comments), rows[0][1] if rows else (), tuple(rows))


def read_table(
    path: str | Path,
    required: tuple[str, ...] = ("wavelength_nm",),
    optional: tuple[str, ...] | None = None,
) -> Table:
    """Read a numeric table whose comment lines start with ``#``; see :func:`table_text`.

    Columns that are ``required`` must be there; without ``optional`` ones all others are read, but
    for those without any number.

    Raises
    ------
    InputError
        Missing file, missing or doubled column, or a cell that is not a finite number;
        the message names file, line and column.
    """
    path = Path(path)
    text = table_text(read_text(path), str(path))
    _check_names(text, required)
    names = text.names
    wanted = {*required, *(names if optional is None else optional)}
    for line, cells in text.rows[1:]:
        if len(cells) != len(names):
            raise InputError(
                f"{path}, line {line}: {len(cells)} cells where the header has {len(names)}; "
                "complete that row"
            )
    columns = {}
    for place, name in enumerate(names):
        cells = [(line, row[place]) for line, row in text.rows[1:]]
        has_number = name in required or any(number_of(cell) is not None for _, cell in cells)
        if name in wanted and has_number:
            columns[name] = constant([_finite(path, name, *cell) for cell in cells])
    return Table(path, text.header, columns)


def _check_names(text: TableText, required: tuple[str, ...]) -> None:
    names = text.names
    if not names:
        raise InputError(
            f"{text.place} holds no table; add a row of names"
            + (f", {', '.join(required)}, " if required else " ")
            + "and numbers below it"
        )
    place = f"{text.place}, line {text.rows[0][0]}"
    missing = [name for name in required if name not in names]
    if missing:
        advice = "add or rename it" if len(names) > 1 else "separate the columns by commas"
        raise InputError(
            f"{place}: column {', '.join(missing)} is missing; found "
            f"{printable(', '.join(names))}; {advice}"
        )
    unreadable = [name for name in names if not name.isprintable()]
    if unreadable:
        raise InputError(
            f"{place}: the column name {unreadable[0]!r} holds tabs or the like; separate the "
            "columns by commas"
        )
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        raise InputError(f"{place}: column {doubled[0]} is there twice; keep one of them")
    if len(text.rows) == 1:
        raise InputError(f"{text.place} has column names but no rows; add the numbers below them")


def number_of(text: str) -> float | None:
    """Return the number that a text is, None if it is none."""
    try:
        return float(text)
    except ValueError:
        return None


def _finite(path: Path, name: str, line: int, cell: str) -> float:
    value = number_of(cell)
    if value is None or not np.isfinite(value):
        raise InputError(
            f"{path}, line {line}, column {name}: {printable(cell)!r} is not a finite number; "
            "correct that cell"
        )
    return value


@functools.cache
def shipped_table(name: str) -> Table:
    """Return one of the project's own tables, by its file name; it is read once."""
    return read_table(DATA_DIRECTORY / name, required=())
