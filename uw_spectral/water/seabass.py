"""SeaBASS files (``.sb``), the format of NASA's archive of ocean measurements."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, printable
from ..spectra.spectral_table import LARGEST_NUMBER, SHORTEST_WAVELENGTH_NM
from ..spectra.spectrum import Spectrum, read_text
from ..surface.sun_position import sun_zenith_Spencer1971
from .kd_inversion import SUN_ZENITH, check_pure_water_range, invert_Kd
from .optical_properties import BACKSCATTER, Water
from .phase import BACKSCATTER_RANGE, FournierForand
from .pure_water import molecular_scattering, pure_water_absorption

_DELIMITERS = {"comma": ",", "tab": "\t", "space": None}
_PER_METRE = {"": 1.0, "1/m": 1.0, "m^-1": 1.0, "1/cm": 100.0, "cm^-1": 100.0}
_FLAGS = ("missing", "above_detection_limit", "below_detection_limit")
_SPECTRAL_FIELD = re.compile(r"(kd|agp|cgp|bbp|ed|ap|ag|a|b|c)_?(\d{3}(?:\.\d+)?)(nm)?")
_INHERENT = ("a", "b", "c", "agp", "cgp", "ap", "ag", "bbp")
_BEGIN = "/begin_header"
# Of these pure water is subtracted; where little is left, noise makes it negative.
_WITHOUT_WATER = ("agp", "cgp", "ap", "ag", "bbp")
_NOISE = 0.005  # 1/m
_FEWEST_DEPTHS = 3
_SMALLEST = 1e-9  # 1/m
_HORIZON = 90.0
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


def is_seabass(text: str) -> bool:
    """Whether a text begins as a SeaBASS file does.

    Examples
    --------
    >>> is_seabass("/begin_header"), is_seabass("wavelength_nm,a,b")
    (True, False)
    """
    return text.partition("\n")[0].strip().lower() == _BEGIN


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

    In this order:

    - absorption ``a``, ``agp`` or ``ap`` with ``ag``, and scattering ``b``, or ``c`` or ``cgp``
      less the absorption, or ``bbp`` over bb/b. Pure water is added to what lacks it (agp, ap,
      ag, cgp, bbp).
    - ``kd``.
    - ``ed`` over ``depth``, from which Kd follows by regression (:func:`Kd_from_profile`).

    Either one row per wavelength with a ``wavelength`` column, or columns like ``kd490``; over
    several depths these are averaged, and a caveat says over which and how far they differ.
    Wavelengths at which nothing was measured are left out.

    bb/b of the particles is that of ``bbp`` and b where both are there, else what a header line
    ``/bb/b=0.01`` states, else that of the default phase function. A Kd is inverted to a and b
    (:func:`.invert_Kd`), for the sun of the field ``sza``, of a header line ``/sun_zenith=45``, or
    of date, time and place.

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
    source = "; ".join(
        f"{key} {data.header[key]}"
        for key in ("investigators", "experiment", "cruise", "start_date")
        if key in data.header
    )
    found = {
        quantity: _spectrum(data, quantity, source)
        for quantity in _INHERENT
        if _has(data, quantity)
    }
    a = _absorption(found)
    scattering = None if a is None else _scattering(data, found, a)
    if a is not None and scattering is not None:
        b, ratio, caveats = scattering
        return Water(
            a,
            b,
            _spectrum(data, "kd", source) if _has(data, "kd") else None,
            data.path.name,
            source,
            (*_averaged(data, tuple(found)), *_noisy(data, tuple(found)), *caveats),
            particle_backscatter=ratio,
        )
    if _has(data, "kd"):
        water, averaged = _inverted(data, _spectrum(data, "kd", source)), _averaged(data, ("kd",))
        return dataclasses.replace(water, caveats=(*averaged, *water.caveats))
    if _has(data, "ed"):
        return _inverted(data, Kd_from_profile(data))
    raise InputError(
        f"{data.path}: found {printable(', '.join(data.fields))}; needed are a with b or c (or agp "
        "with cgp, or ap and ag for a, or bbp for b), or kd, or ed with depth, by a wavelength "
        "column or in columns like kd490"
    )


def _absorption(found: Mapping[str, Spectrum]) -> Spectrum | None:
    """Total absorption, with pure water."""
    if "a" in found:
        return found["a"]
    if "agp" in found:
        return _with_water(found["agp"], "agp")
    if "ap" in found and "ag" in found:
        return _with_water(_combined(found["ap"], found["ag"], 1.0, "ap + ag of"), "agp")
    return None


def _scattering(
    data: SeaBASS, found: Mapping[str, Spectrum], a: Spectrum
) -> tuple[Spectrum, float | None, list[str]] | None:
    """Total scattering, bb/b of the particles, and what is to be said of both."""
    stated = _stated(data, BACKSCATTER)
    low, high = BACKSCATTER_RANGE
    if stated is not None and not low <= stated <= high:
        raise InputError(
            f"{data.path}: /{BACKSCATTER}={stated:g}, but bb/b of particles is {low:g} to "
            f"{high:g}; correct it or leave it out"
        )
    bbp, b = found.get("bbp"), found.get("b")
    if b is None and ("c" in found or "cgp" in found):
        c = found["c"] if "c" in found else _with_water(found["cgp"], "cgp")
        b = _combined(c, a, -1.0, "c - a of")
        noise = (b.values < 0) & (b.values >= -_NOISE)
        b = dataclasses.replace(b, values=np.where(noise, 0.0, b.values))
    if b is None:
        if bbp is None:
            return None
        ratio = FournierForand().backscatter if stated is None else stated
        check_pure_water_range(bbp)
        values = bbp.values / ratio + molecular_scattering(bbp.wavelengths)
        b = Spectrum(bbp.wavelengths, values, f"b of {data.path.name}", bbp.source)
        whose = "as the header has it" if stated is not None else "that of the default phase"
        return b, ratio, [f"b is computed from bbp with bb/b {ratio:.3g}, {whose}"]
    if bbp is None:
        return b, stated, []
    check_pure_water_range(b)
    particles = dataclasses.replace(b, values=b.values - molecular_scattering(b.wavelengths))
    shared = (bbp.wavelengths >= b.range[0]) & (bbp.wavelengths <= b.range[1])
    nm = bbp.wavelengths[shared]
    measured = bbp.at(nm) / np.maximum(particles.at(nm), _SMALLEST) if len(nm) else np.array([])
    ratio = float(np.median(measured)) if len(nm) else None
    if ratio is not None and low <= ratio <= high:
        return b, ratio, [f"bb/b of the particles is measured: {ratio:.3g}"]
    told = "share no wavelengths" if ratio is None else f"give {ratio:.3g}, which no particles have"
    return b, stated, [f"bb/b of the particles is not known: bbp and b {told}"]


def _inverted(data: SeaBASS, Kd: Spectrum) -> Water:
    return invert_Kd(Kd, _sun_zenith(data), _stated(data, BACKSCATTER)).water


def _sun_zenith(data: SeaBASS) -> float | None:
    """Sun zenith in degrees that the file says or that follows from its time and place."""
    if "sza" in data.columns and np.isfinite(data.columns["sza"]).any():
        return float(np.nanmean(data.columns["sza"]))
    stated = _stated(data, SUN_ZENITH)
    if stated is not None:
        return stated
    north = _degrees(data.header.get("north_latitude"))
    east = _degrees(data.header.get("east_longitude"))
    begin, end = (_time(data.header, which) for which in ("start", "end"))
    if north is None or east is None or begin is None:
        return None
    middle = begin if end is None else begin + (end - begin) / 2
    zenith = sun_zenith_Spencer1971(middle, north, east)
    return zenith if zenith < _HORIZON else None


def _stated(data: SeaBASS, key: str) -> float | None:
    """Number of a header line that is ours, if it is there."""
    if key not in data.header:
        return None
    value = _degrees(data.header[key])
    if value is None:
        raise InputError(
            f"{data.path}: /{key}={data.header[key]} is not a number; correct it or leave it out"
        )
    return value


def _degrees(text: str | None) -> float | None:
    """Return the number before a unit in brackets."""
    return _number((text or "").split("[")[0])


def _time(header: Mapping[str, str], which: str) -> datetime | None:
    """Start or end of the measurement; None where the header does not say it."""
    clock = header.get(f"{which}_time", "").split("[")[0]
    try:
        text = f"{header.get(f'{which}_date', '')} {clock} +0000"
        return datetime.strptime(text, "%Y%m%d %H:%M:%S %z")
    except ValueError:
        return None


def _averaged(data: SeaBASS, quantities: tuple[str, ...]) -> tuple[str, ...]:
    """Say over which depths there are means, and how far these go apart."""
    depth = data.columns.get("depth", np.array([]))
    depth = np.unique(depth[np.isfinite(depth)])
    apart = 0.0
    for quantity in quantities:
        for values in _samples(data, quantity).values():
            apart = max(apart, np.ptp(values) / max(np.mean(values), _SMALLEST))
    if len(depth) < 2 or not apart:
        return ()
    return (
        f"means over {len(depth)} depths, {depth[0]:g} to {depth[-1]:g} m, between which they "
        f"differ by up to {apart:.0%} of the mean; for water that differs with depth make a table "
        "with depth_m",
    )


def _noisy(data: SeaBASS, quantities: tuple[str, ...]) -> tuple[str, ...]:
    negative = [
        quantity
        for quantity in quantities
        if any(np.any(data.columns[field] < 0) for field, _ in _columns(data, quantity))
    ]
    if not negative:
        return ()
    return (
        f"{', '.join(negative)}: values down to -{_NOISE:g} 1/m are noise about nothing, and count "
        "as 0",
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
    if not lines or lines[0].strip().lower() != _BEGIN:
        raise InputError(f"{path}, line 1: a SeaBASS file starts with {_BEGIN}; add it")
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
    bare = field in ("wavelength", "depth", "kd", "ed", *_INHERENT)
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


def _columns(data: SeaBASS, quantity: str) -> list[tuple[str, float | None]]:
    """Columns of a quantity with their wavelengths; None where the rows have them."""
    if quantity in data.columns and "wavelength" in data.columns:
        return [(quantity, None)]
    return [(field, nm) for field, nm in _fields(data, quantity)]


def _per_metre(data: SeaBASS, field: str) -> float:
    """Return the factor that makes the values of a column 1/m."""
    place = data.fields.index(field)
    unit = data.units[place] if place < len(data.units) else ""
    if unit not in _PER_METRE:
        raise InputError(
            f"{data.path}: {field} is in {unit!r}, as /units says, which is none of "
            f"{', '.join(filter(None, _PER_METRE))}; convert it"
        )
    return _PER_METRE[unit]


def _samples(data: SeaBASS, quantity: str) -> dict[float, list[float]]:
    """Values of a quantity by wavelength, one for each depth at which it was measured."""
    samples: dict[float, list[float]] = {}
    lowest = -_NOISE if quantity in _WITHOUT_WATER else 0.0
    for field, nm in _columns(data, quantity):
        values = data.columns[field] * _per_metre(data, field)
        if np.any(values < lowest):
            row = int(np.argmax(values < lowest))
            raise InputError(
                f"{_place(data, field, row)}: {values[row]:g} is negative; correct it or mark it "
                "as /missing"
            )
        wavelengths = data.columns["wavelength"] if nm is None else np.full(len(values), nm)
        for wavelength, value in zip(wavelengths, values, strict=True):
            if np.isfinite(value) and np.isfinite(wavelength):
                samples.setdefault(float(wavelength), []).append(max(float(value), 0.0))
    if not samples:
        raise InputError(f"{data.path}: every value of {quantity} is missing; give some")
    return samples


def _spectrum(data: SeaBASS, quantity: str, source: str) -> Spectrum:
    samples = _samples(data, quantity)
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


def _combined(one: Spectrum, other: Spectrum, factor: float, title: str) -> Spectrum:
    """One spectrum plus ``factor`` times another, on the wavelengths that both cover."""
    low, high = other.range
    inside = (one.wavelengths >= low) & (one.wavelengths <= high)
    if not inside.any():
        raise InputError(
            f"{one.name} and {other.name} share no wavelengths; give both at the same ones"
        )
    nm = one.wavelengths[inside]
    name = f"{title} {one.name.partition(' of ')[2]}"
    return Spectrum(nm, one.values[inside] + factor * other.at(nm), name, one.source)
