"""Waters from SeaBASS files (``.sb``)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

import numpy as np

from ..errors import InputError, printable
from ..spectra.seabass import SeaBASS, read_seabass
from ..spectra.spectrum import Spectrum, number_of
from ..surface.sun_position import sun_zenith_Spencer1971
from .kd_inversion import SUN_ZENITH, check_pure_water_range, invert_Kd
from .optical_properties import BACKSCATTER, Water
from .phase_functions import BACKSCATTER_RANGE, FournierForand
from .pure_water import molecular_scattering, pure_water_absorption

_INHERENT = ("a", "b", "c", "agp", "cgp", "ap", "ag", "bbp")
# Of these pure water is subtracted; where little is left, noise makes it negative.
_WITHOUT_WATER = ("agp", "cgp", "ap", "ag", "bbp")
_NOISE = 0.005  # 1/m
_FEWEST_DEPTHS = 3
_SMALLEST = 1e-9  # 1/m
_HORIZON = 90.0
_SMALLEST_TRANSMISSION = 0.01  # of the light at the shallowest depth: noise lies below


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

    Raises
    ------
    InputError
        If the file is damaged, is of several stations, has none of these, or a value is negative
        (line and column are named).
    """
    data = read_seabass(path)
    data.require_one_station()
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
    return number_of((text or "").split("[")[0])


def _time(header: Mapping[str, str], which: str) -> datetime | None:
    """Start or end of the measurement; None where the header does not say it."""
    clock = header.get(f"{which}_time", "").split("[")[0]
    try:
        text = f"{header.get(f'{which}_date', '')} {clock} +0000"
        return datetime.strptime(text, "%Y%m%d %H:%M:%S %z")
    except ValueError:
        return None


def _averaged(data: SeaBASS, quantities: tuple[str, ...]) -> tuple[str, ...]:
    """Say over which depths or repeats there are means, and how far these go apart."""
    depth = data.columns.get("depth", np.array([]))
    depth = np.unique(depth[np.isfinite(depth)])
    apart, most = 0.0, 1
    for quantity in quantities:
        for values in data.samples(quantity, _lowest(quantity)).values():
            apart = max(apart, np.ptp(values) / max(np.mean(values), _SMALLEST))
            most = max(most, len(values))
    if not apart:
        return ()
    if len(depth) < 2:
        return (f"means over {most} measurements that differ by up to {apart:.0%} of the mean",)
    return (
        f"means over {len(depth)} depths, {depth[0]:g} to {depth[-1]:g} m, between which they "
        f"differ by up to {apart:.0%} of the mean; for water that differs with depth make a table "
        "with depth_m",
    )


def _noisy(data: SeaBASS, quantities: tuple[str, ...]) -> tuple[str, ...]:
    negative = [
        quantity
        for quantity in quantities
        if any(np.any(data.columns[field] < 0) for field, _ in data.columns_of(quantity))
    ]
    if not negative:
        return ()
    return (
        f"{', '.join(negative)}: values down to -{_NOISE:g} 1/m are noise about nothing, and count "
        "as 0",
    )


def Kd_from_profile(data: SeaBASS) -> Spectrum:
    """Kd, 1/m, by regression of ln Ed on depth, per wavelength.

    Depths with less than 1 % of the light of the shallowest one are left out.

    Its source states the largest relative standard error.

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
    for field, nm in data.by_wavelength("ed"):
        Ed = data.columns[field]
        given = np.isfinite(Ed) & np.isfinite(depth)
        if np.any(given & (Ed <= 0)):
            row = int(np.argmax(given & (Ed <= 0)))
            raise InputError(
                f"{data.place(field, row)}: Ed must be positive, got {Ed[row]:g}; mark dark "
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


def _has(data: SeaBASS, quantity: str) -> bool:
    if quantity == "ed":
        return bool(data.by_wavelength(quantity))
    return bool(data.columns_of(quantity))


def _lowest(quantity: str) -> float:
    return -_NOISE if quantity in _WITHOUT_WATER else 0.0


def _spectrum(data: SeaBASS, quantity: str, source: str) -> Spectrum:
    return data.spectrum(quantity, source, _lowest(quantity))


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
