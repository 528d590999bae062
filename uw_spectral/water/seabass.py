"""SeaBASS files (``.sb``), the format of NASA's archive of ocean measurements."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, printable
from ..spectra.spectral_table import LARGEST_NUMBER, SHORTEST_WAVELENGTH_NM
from ..spectra.spectrum import Spectrum, read_text
from .kd_inversion import check_pure_water_range, invert_Kd
from .optical_properties import Water
from .pure_water import molecular_scattering, pure_water_absorption

_DELIMITERS = {"comma": ",", "tab": "\t", "space": None}
_FLAGS = ("missing", "above_detection_limit", "below_detection_limit")
_SPECTRAL_FIELD = re.compile(r"(kd|agp|cgp|ed|a|b|c)_?(\d{3}(?:\.\d+)?)(nm)?")
_FEWEST_DEPTHS = 3
_SMALLEST_TRANSMISSION = 0.01  # of the light at the shallowest depth: noise lies below


@dataclass(frozen=True, eq=False)
class SeaBASS:
    """Contents of a SeaBASS file.

    Parameters
    ----------
    path : Path
    header : dict
        ``/key=value`` lines, keys in lower case.
    fields, units : tuple of str
        Column names and units in lower case.
    columns : dict
        Numbers by column; missing ones are NaN, columns of text are left out.
    lines : array
        Line number of each row.
    """

    path: Path
    header: dict[str, str]
    fields: tuple[str, ...]
    units: tuple[str, ...]
    columns: dict[str, NDArray[np.float64]]
    lines: NDArray[np.int_]


def read_seabass(path: str | Path) -> SeaBASS:
    """Read a SeaBASS file.

    Parameters
    ----------
    path : str or Path

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
            raise InputError(f"{path}: the header has no /{key}; add it before /end_header")
    if header["delimiter"].lower() not in _DELIMITERS:
        raise InputError(
            f"{path}: delimiter {header['delimiter']!r} is not one of {', '.join(_DELIMITERS)}; "
            "correct it"
        )
    delimiter = _DELIMITERS[header["delimiter"].lower()]
    fields = tuple(cell.strip().lower() for cell in header["fields"].split(","))
    units = tuple(cell.strip().lower() for cell in header.get("units", "").split(","))
    doubled = [field for field in fields if fields.count(field) > 1]
    if doubled:
        raise InputError(f"{path}: the field {doubled[0]} is listed twice in /fields; keep one")
    flags = [_number(header[key].split("[")[0]) for key in _FLAGS if key in header]

    rows: list[list[str]] = []
    numbers: list[int] = []
    for number, line in enumerate(lines[first:], start=first + 1):
        if not line.strip() or line.startswith("!"):
            continue
        cells = [cell.strip() for cell in line.split(delimiter)]
        if len(cells) != len(fields):
            raise InputError(
                f"{path}, line {number}: {len(cells)} cells where /fields lists {len(fields)}; "
                "complete that row"
            )
        rows.append(cells)
        numbers.append(number)
    if not rows:
        raise InputError(f"{path} has a header but no rows below /end_header; add them")
    columns = {}
    for index, field in enumerate(fields):
        values = [_number(row[index]) for row in rows]
        if all(value is None for value in values) and not _is_ours(field):
            continue
        for value, number, row in zip(values, numbers, rows, strict=True):
            if value is None or not (value in flags or abs(value) <= LARGEST_NUMBER):
                if not _is_ours(field):
                    break
                raise InputError(
                    f"{path}, line {number}, column {index + 1} ({field}): {row[index]!r} is not "
                    f"a finite number up to {LARGEST_NUMBER:g}; correct it or mark it as /missing"
                )
        else:
            columns[field] = np.array([np.nan if value in flags else value for value in values])
    return SeaBASS(path, header, fields, units, columns, np.array(numbers))


def water_from_seabass(path: str | Path) -> Water:
    """Water from a SeaBASS file.

    In this order: ``a`` with ``b`` or ``c`` (or ``agp``, ``cgp``, which lack
    the water itself: it is added); ``kd``; ``ed`` over ``depth``, from which
    Kd follows by regression (:func:`Kd_from_profile`). Either one row per
    wavelength with a ``wavelength`` column, or columns like ``kd490``; over
    several depths these are averaged. A Kd is inverted to a and b
    (:func:`.invert_Kd`). Wavelengths at which nothing was measured are left
    out.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Water

    Raises
    ------
    InputError
        If the file is damaged, has none of these, or a value is negative
        (line and column are named).
    """
    data = read_seabass(path)
    name = data.path.name
    source = "; ".join(
        f"{key} {data.header[key]}"
        for key in ("investigators", "experiment", "cruise", "start_date")
        if key in data.header
    )
    spectra = {
        quantity: _spectrum(data, quantity, source)
        for quantity in ("a", "b", "c", "agp", "cgp", "kd")
        if _has(data, quantity)
    }
    total = {q: s for q, s in spectra.items() if q in ("a", "b", "c")}
    for quantity in ("agp", "cgp"):
        if quantity in spectra and quantity[0] not in total:
            total[quantity[0]] = _with_water(spectra[quantity], quantity)
    if "a" in total and ("b" in total or "c" in total):
        a = total["a"]
        b = total.get("b") or _difference(total["c"], a)
        return Water(a, b, spectra.get("kd"), name, source)
    if "kd" in spectra:
        return invert_Kd(spectra["kd"]).water
    if _has(data, "ed"):
        return invert_Kd(Kd_from_profile(data)).water
    raise InputError(
        f"{data.path}: found {printable(', '.join(data.fields))}; needed are a with b or c, or kd, "
        "or ed with depth, by a wavelength column or in columns like kd490"
    )


def Kd_from_profile(data: SeaBASS) -> Spectrum:
    """Kd by regression of ln Ed on depth, per wavelength.

    Depths with less than 1 % of the light of the shallowest one are left out.

    Parameters
    ----------
    data : SeaBASS
        With ``depth`` and columns like ``ed490``.

    Returns
    -------
    Spectrum
        Kd in 1/m; its source states the largest relative standard error.

    Raises
    ------
    InputError
        No depth, fewer than three depths, light that does not fall, or a
        value that is not positive.
    """
    if "depth" not in data.columns:
        raise InputError(f"{data.path}: Ed is there, but no depth column to fit it over; add it")
    depth = data.columns["depth"]
    found: dict[float, tuple[float, float]] = {}
    for field, nm in _fields(data, "ed"):
        Ed = data.columns[field]
        given = np.isfinite(Ed) & np.isfinite(depth)
        if np.any(given & (Ed <= 0)):
            row = int(np.argmax(given & (Ed <= 0)))
            raise InputError(
                f"{_place(data, field, row)}: Ed must be positive, got {Ed[row]:g}; mark dark "
                "values as missing"
            )
        if not given.any():
            continue
        top = Ed[given][np.argmin(depth[given])]
        used = given & (Ed >= _SMALLEST_TRANSMISSION * top)
        y, light = depth[used], np.log(Ed[used])
        if len(np.unique(y)) < _FEWEST_DEPTHS:
            raise InputError(
                f"{data.path}, column {field}: {len(np.unique(y))} usable depths; a slope needs "
                f"{_FEWEST_DEPTHS}"
            )
        spread = np.sum((y - y.mean()) ** 2)
        slope = float(np.sum((y - y.mean()) * light) / spread)
        residual = light - light.mean() - slope * (y - y.mean())
        if slope >= 0:
            raise InputError(
                f"{data.path}, column {field}: Ed does not fall with depth; is depth positive down?"
            )
        found[nm] = (-slope, float(np.sqrt(np.sum(residual**2) / (len(y) - 2) / spread)))
    if not found:
        raise InputError(f"{data.path}: every Ed is missing; give some")
    nm = np.array(sorted(found))
    Kd, error = np.array([found[value] for value in nm]).T
    return Spectrum(
        nm,
        Kd,
        f"Kd of {data.path.name}",
        f"regression of ln Ed on depth, standard error up to {np.max(error / Kd):.1%}",
    )


def _header(path: Path, lines: list[str]) -> tuple[dict[str, str], int]:
    if not lines or lines[0].strip().lower() != "/begin_header":
        raise InputError(f"{path}, line 1: a SeaBASS file starts with /begin_header; add it")
    header: dict[str, str] = {}
    for number, line in enumerate(lines[1:], start=2):
        text = line.strip()
        if text.lower() == "/end_header":
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
                "lines start with / or !. Is /end_header missing?"
            )
    raise InputError(f"{path}: /end_header is missing; add it below the header")


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _is_ours(field: str) -> bool:
    """Whether the field is read for a water, so that text in it is an error."""
    bare = field in ("wavelength", "depth", "kd", "agp", "cgp", "ed", "a", "b", "c")
    return bare or _SPECTRAL_FIELD.fullmatch(field) is not None


def _place(data: SeaBASS, field: str, row: int) -> str:
    return f"{data.path}, line {data.lines[row]}, column {data.fields.index(field) + 1} ({field})"


def _fields(data: SeaBASS, quantity: str) -> list[tuple[str, float]]:
    """Columns like ``kd490`` of a quantity, with their wavelengths."""
    matches = [(field, _SPECTRAL_FIELD.fullmatch(field)) for field in data.columns]
    return [(field, float(m[2])) for field, m in matches if m and m[1] == quantity]


def _has(data: SeaBASS, quantity: str) -> bool:
    by_row = quantity in data.columns and "wavelength" in data.columns and quantity != "ed"
    return by_row or bool(_fields(data, quantity))


def _spectrum(data: SeaBASS, quantity: str, source: str) -> Spectrum:
    columns = (
        [(quantity, None)]
        if quantity in data.columns and "wavelength" in data.columns
        else _fields(data, quantity)
    )
    samples: dict[float, list[float]] = {}
    for field, nm in columns:
        values = data.columns[field]
        if np.any(values < 0):
            row = int(np.argmax(values < 0))
            raise InputError(
                f"{_place(data, field, row)}: {values[row]:g} is negative; correct it or mark it "
                "as /missing"
            )
        wavelengths = data.columns["wavelength"] if nm is None else np.full(len(values), nm)
        for wavelength, value in zip(wavelengths, values, strict=True):
            if np.isfinite(value) and np.isfinite(wavelength):
                samples.setdefault(float(wavelength), []).append(float(value))
    if not samples:
        raise InputError(f"{data.path}: every value of {quantity} is missing; give some")
    nm_sorted = sorted(samples)
    if nm_sorted[0] < SHORTEST_WAVELENGTH_NM:
        raise InputError(
            f"{data.path}: a wavelength of {nm_sorted[0]:g} nm is none of light; give nanometres"
        )
    return Spectrum(
        np.array(nm_sorted),
        np.array([np.mean(samples[value]) for value in nm_sorted]),
        f"{quantity} of {data.path.name}",
        source,
    )


def _with_water(spectrum: Spectrum, quantity: str) -> Spectrum:
    """Add pure water to agp, and its scattering too to cgp."""
    check_pure_water_range(spectrum)
    values = spectrum.values + pure_water_absorption(spectrum.wavelengths)
    if quantity == "cgp":
        values = values + molecular_scattering(spectrum.wavelengths)
    return Spectrum(
        spectrum.wavelengths, values, f"{spectrum.name} with pure water", spectrum.source
    )


def _difference(c: Spectrum, a: Spectrum) -> Spectrum:
    """Scattering c - a on the wavelengths of c that a covers."""
    low, high = a.range
    inside = (c.wavelengths >= low) & (c.wavelengths <= high)
    if not inside.any():
        raise InputError(f"{c.name} and {a.name} share no wavelengths; give both at the same ones")
    nm = c.wavelengths[inside]
    return Spectrum(nm, c.values[inside] - a.at(nm), c.name.replace("c of", "c - a of"), c.source)
