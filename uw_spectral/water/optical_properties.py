"""Absorption and scattering of a body of water: Jerlov types, files, uniform water."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent
from ..errors import DataWarning, InputError, unknown_name
from ..spectra.spectral_table import read_spectral_table
from ..spectra.spectrum import Spectrum, Table, shipped_table
from .phase import BACKSCATTER_RANGE, FournierForand, SeawaterMixture
from .pure_water import PURE_WATER_TABLE, molecular_scattering, pure_water_absorption

JERLOV_TYPES = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")
JERLOV_SOURCES = ("solonenko2015", "williamson2022")
DEFAULT_SOURCE = "solonenko2015"
BACKSCATTER = "bb/b"
"""Key in the comment of a table, as ``# bb/b: 0.01``."""

# Rows of Solonenko & Mobley 2015, Table 7, that repeat another block.
_REPAIRED_TYPES = ("3C", "5C")

# What a publication's caveats name: its types, and columns that no water has.
_ANY_TYPE = re.compile(r"\b(?:I{1,3}|I[AB]|[1-9]C)\b")
_NOT_TAKEN = re.compile(r"\bKd0\b|^KdH\b")

_PURE = np.arange(300.0, 801.0, 5.0)  # nm, where pure water is known
_SOUND = ("ok", "interpolated")
_STATUS_TEXTS = {
    "suspect": "does not agree with the scattering model of the same paper",
    "reconstructed": "was recomputed from the paper's Eq. 8, its table being misprinted there",
    "model_extrapolation": "is modelled, not measured (measured from 412 to 715 nm)",
    "repaired": "was filled in, the table being misprinted there (data/SOURCES.md)",
}


@dataclass(frozen=True)
class Doubt:
    """A caveat that concerns part of a table.

    ``text`` names quantity and wavelengths; an interpolated value rests on
    the doubtful rows if its wavelength lies strictly between ``above`` and
    ``below`` (nm).
    """

    text: str
    above: float
    below: float

    def concerns(self, wavelengths: ArrayLike) -> bool:
        """Return whether a value at any of these wavelengths rests on doubtful rows."""
        wanted = np.asarray(wavelengths, dtype=np.float64)
        return bool(np.any((wanted > self.above) & (wanted < self.below)))


@dataclass(frozen=True, eq=False)
class Water(ComparedByContent):
    """Inherent optical properties of a homogeneous body of water.

    Parameters
    ----------
    absorption, scattering : Spectrum
        a and b in 1/m.
    diffuse_attenuation : Spectrum or None
        Kd in 1/m where the source has one; only comparisons and plots use it.
    name, source : str
        What it is and where the numbers come from.
    caveats : tuple of str
        What a user of the data should know, at all wavelengths.
    doubts : tuple of Doubt
        What they should know at some wavelengths.
    particle_backscatter : float or None
        bb/b of the particles, where the source says something of it; it chooses the default
        phase function. None stands for the average of Petzold's, 0.0183.

    Raises
    ------
    InputError
        If a coefficient is negative or not finite (the message names the row), or bb/b is not
        one of sea particles.
    """

    absorption: Spectrum
    scattering: Spectrum
    diffuse_attenuation: Spectrum | None
    name: str
    source: str
    caveats: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    particle_backscatter: float | None = None

    def __post_init__(self) -> None:
        low, high = BACKSCATTER_RANGE
        ratio = self.particle_backscatter
        if ratio is not None and not low <= ratio <= high:
            raise InputError(
                f"{self.name}: bb/b of the particles must be {low:g} to {high:g}, got {ratio:g}"
            )
        for spectrum in (self.absorption, self.scattering, self.diffuse_attenuation):
            if spectrum is not None and np.any(spectrum.values < 0):
                row = int(np.argmax(spectrum.values < 0))
                raise InputError(
                    f"{spectrum.name}: {spectrum.values[row]:g} 1/m at "
                    f"{spectrum.wavelengths[row]:g} nm is negative; coefficients are 0 or more"
                )

    @classmethod
    def uniform(cls, a: float, b: float, name: str = "uniform water") -> Water:
        """Water with the same coefficients at every wavelength.

        Parameters
        ----------
        a, b : float
            Absorption and scattering in 1/m.

        Examples
        --------
        >>> Water.uniform(0.05, 0.1).c([400, 700]).round(3)
        array([0.15, 0.15])
        """
        everywhere = np.array([1.0, 1e6])
        absorption = Spectrum(everywhere, np.full(2, a), f"absorption of {name}")
        scattering = Spectrum(everywhere, np.full(2, b), f"scattering of {name}")
        return cls(absorption, scattering, None, name, "given by the user")

    @classmethod
    def jerlov(cls, water_type: str, source: str = DEFAULT_SOURCE) -> Water:
        """One of the ten Jerlov types, from the ``jerlov`` package.

        Parameters
        ----------
        water_type : str
            I, IA, IB, II, III, 1C, 3C, 5C, 7C or 9C, in any case.
        source : str
            ``"solonenko2015"``: inverted from Kd, 300-700 nm, all types, with
            HydroLight's Kd; misprinted rows of 3C and 5C are repaired from
            ``data/``. ``"williamson2022"``: measured, 300-800 nm, IB to 5C,
            no Kd.

        Raises
        ------
        InputError
            If the type or the source is unknown, or the source has no such type.

        References
        ----------
        Solonenko & Mobley, Appl. Opt. 54, 5392 (2015); Williamson & Hollins,
        Appl. Opt. 61, 9951 (2022).

        Examples
        --------
        >>> Water.jerlov("ib").a([450, 550])
        array([0.0235, 0.0623])
        """
        import jerlov

        canonical = {name.lower(): name for name in JERLOV_TYPES}.get(water_type.strip().lower())
        if canonical is None:
            raise unknown_name("Jerlov type", water_type, JERLOV_TYPES)
        if source not in JERLOV_SOURCES:
            raise unknown_name("source of Jerlov types", source, JERLOV_SOURCES)
        published = jerlov.get_source(source)
        if canonical not in published.water_types:
            raise InputError(
                f"{source} has no Jerlov {canonical} (too few measurements); it has "
                f"{', '.join(published.water_types)}. Use --water-source solonenko2015"
            )
        name = f"Jerlov {canonical}"
        columns = _published_columns(canonical, source)
        if source == "solonenko2015" and canonical in _REPAIRED_TYPES:
            table = shipped_table(f"solonenko2015_repaired_{canonical}.csv").columns
            for quantity in ("a", "Kd"):
                columns[quantity] = columns[quantity].repaired(
                    table["wavelength_nm"], table[quantity]
                )
        spectra = {
            quantity: Spectrum(
                column.wavelengths, column.values, f"{quantity} of {name}", published.citation
            )
            for quantity, column in columns.items()
        }
        spectra["a"] = _between_rows_as_water(spectra["a"])
        return cls(
            spectra["a"],
            spectra["b"],
            spectra.get("Kd"),
            f"{name} ({source})",
            f"{published.citation}; doi {published.doi}; PyPI jerlov {jerlov.__version__}",
            (*_caveats_of(canonical, published.caveats), *_below_water(columns["a"], name)),
            tuple(
                doubt
                for quantity, column in columns.items()
                for doubt in column.doubts(f"{quantity} of {name}")
            ),
        )

    @classmethod
    def from_csv(cls, path: str | Path) -> Water:
        """Water from a table ``wavelength_nm,a,b[,Kd]`` in nm and 1/m.

        A comment line ``# bb/b: 0.01`` gives that of the particles.

        Warns (:class:`DataWarning`) about absorption far below that of pure
        water, which means other units or missing water, and about Kd below a.

        Raises
        ------
        InputError
            If the file cannot be used; the message names file and row.
        """
        return cls.from_table(read_spectral_table(path, ("a", "b"), ("Kd",)), Path(path).name)

    @classmethod
    def from_table(cls, table: Table, name: str) -> Water:
        """Water from a table with the columns of :meth:`from_csv`; warns as that does."""
        doubts = _implausible(table.columns["wavelength_nm"], table.columns, name)
        for doubt in doubts:
            warnings.warn(doubt, DataWarning, stacklevel=2)
        spectra = {
            quantity: table.spectrum(quantity, f"{quantity} of {name}")
            for quantity in ("a", "b", "Kd")
            if quantity in table.columns
        }
        source = table.header or f"file {name}"
        return cls(
            spectra["a"],
            spectra["b"],
            spectra.get("Kd"),
            name,
            source,
            doubts,
            particle_backscatter=table.stated(BACKSCATTER),
        )

    def mixed(self, other: Water, fraction: float) -> Water:
        """Mix with another water, by volume.

        Parameters
        ----------
        other : Water
            The water that is mixed in.
        fraction : float
            Its share, 0 to 1. Coefficients mix linearly, as absorbing and
            scattering matter does; Kd, which does not, is dropped.

        Raises
        ------
        InputError
            If the fraction is outside 0 to 1, or the tables do not overlap.

        Examples
        --------
        >>> Water.uniform(0.1, 0.2).mixed(Water.uniform(0.3, 0.2), 0.25).a(500).round(3).item()
        0.15
        """
        if not 0.0 <= fraction <= 1.0:
            raise InputError(f"the fraction of {other.name} is {fraction:g}; give 0 to 1")
        if fraction == 0.0:
            return self
        if fraction == 1.0:
            return other
        name = f"{self.name} with {fraction:.4g} of {other.name}"
        return Water(
            _mixture(self.absorption, other.absorption, fraction, f"absorption of {name}"),
            _mixture(self.scattering, other.scattering, fraction, f"scattering of {name}"),
            None,
            name,
            f"{self.source} | {other.source}",
            tuple(dict.fromkeys((*self.caveats, *other.caveats))),
            (*self.doubts, *other.doubts),
            self._mixed_backscatter(other, fraction),
        )

    def concentrated(self, factor: float) -> Water:
        """Multiply what is in the water beside the water itself.

        a_w + f (a - a_w), and b likewise, with a_w and b_w of pure sea water; where a table lies
        below these, it stays. Kd, which does not scale so, is dropped.

        Parameters
        ----------
        factor : float
            0 (pure water) or more.

        Raises
        ------
        InputError
            If it is negative or not finite.

        Examples
        --------
        >>> Water.jerlov("II").concentrated(0.0).a(440).round(5).item()
        0.00635
        """
        if not (factor >= 0 and np.isfinite(factor)):
            raise InputError(f"the concentration is {factor:g}; give 0 or more")
        if factor == 1.0:
            return self
        parts = {}
        for name, pure in (
            ("absorption", pure_water_absorption), ("scattering", molecular_scattering)
        ):  # fmt: skip
            spectrum: Spectrum = getattr(self, name)
            known = spectrum.wavelengths
            # Where it is known, as finely as pure water is.
            grid = np.union1d(known, _PURE[(known[0] < _PURE) & (known[-1] > _PURE)])
            values = spectrum.at(grid)
            inside = np.maximum(values - pure(np.clip(grid, _PURE[0], _PURE[-1])), 0.0)
            parts[name] = replace(
                spectrum, wavelengths=grid, values=values + (factor - 1.0) * inside
            )
        name = f"{self.name}, concentration × {factor:.4g}"
        return replace(self, **parts, diffuse_attenuation=None, name=name)

    def scaled(self, absorption: float, scattering: float) -> Water:
        """Multiply the coefficients.

        Parameters
        ----------
        absorption, scattering : float
            Factors on a and on b, 0 or more.

        Raises
        ------
        InputError
            If a factor is negative or not finite.

        Examples
        --------
        >>> Water.uniform(0.1, 0.2).scaled(2.0, 0.5).c(500).round(3).item()
        0.3
        """
        for what, factor in (("absorption", absorption), ("scattering", scattering)):
            if not (factor >= 0 and np.isfinite(factor)):
                raise InputError(f"the factor on {what} is {factor:g}; give 0 or more")
        if absorption == scattering == 1.0:
            return self
        scaled = (
            replace(spectrum, values=spectrum.values * factor)
            for spectrum, factor in ((self.absorption, absorption), (self.scattering, scattering))
        )
        name = f"{self.name}, absorption × {absorption:.4g}, scattering × {scattering:.4g}"
        return replace(
            self,
            **dict(zip(("absorption", "scattering"), scaled, strict=True)),
            diffuse_attenuation=None,
            name=name,
        )

    @property
    def phase_model(self) -> SeawaterMixture:
        """Molecules and sea particles with the bb/b of this water."""
        if self.particle_backscatter is None:
            return SeawaterMixture()
        return SeawaterMixture(FournierForand.of_backscatter_Mobley2002(self.particle_backscatter))

    def _mixed_backscatter(self, other: Water, fraction: float) -> float | None:
        """bb/b of particles, a fraction of them another water's, weighted by their scattering."""
        if self.particle_backscatter == other.particle_backscatter:
            return self.particle_backscatter
        weights = np.array([(1.0 - fraction), fraction])
        weights *= [water.scattering.values.mean() for water in (self, other)]
        ratios = [
            FournierForand().backscatter if ratio is None else ratio
            for ratio in (self.particle_backscatter, other.particle_backscatter)
        ]
        return float(weights @ ratios / weights.sum()) if weights.any() else None

    def a(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Absorption in 1/m; refuses wavelengths outside the table."""
        return self.absorption.at(wavelengths)

    def b(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Scattering in 1/m; refuses wavelengths outside the table."""
        return self.scattering.at(wavelengths)

    def c(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Extinction ``a + b`` in 1/m."""
        return self.a(wavelengths) + self.b(wavelengths)

    def Kd(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Diffuse attenuation in 1/m.

        Raises
        ------
        InputError
            If the source of this water has no Kd.
        """
        if self.diffuse_attenuation is None:
            raise InputError(f"{self.name} has no Kd; add a column Kd, or use solonenko2015")
        return self.diffuse_attenuation.at(wavelengths)

    def caveats_at(self, wavelengths: ArrayLike) -> tuple[str, ...]:
        """All caveats that hold when this water is used at these wavelengths."""
        return (*self.caveats, *(d.text for d in self.doubts if d.concerns(wavelengths)))

    def warn_doubts(self, wavelengths: ArrayLike) -> None:
        """Emit a :class:`DataWarning` for each doubt that concerns these wavelengths.

        Reading a, b or c is silent; whoever starts a computation for a user
        calls this once.
        """
        for doubt in self.doubts:
            if doubt.concerns(wavelengths):
                warnings.warn(doubt.text, DataWarning, stacklevel=2)


def _caveats_of(water_type: str, caveats: Iterable[str]) -> tuple[str, ...]:
    """Return the caveats of a publication that concern a type and what is taken of it."""
    found = ((text, set(_ANY_TYPE.findall(text))) for text in caveats)
    return tuple(
        text
        for text, types in found
        if (not types or water_type in types) and not _NOT_TAKEN.search(text)
    )


def _between_rows_as_water(a: Spectrum) -> Spectrum:
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


def _below_water(a: _Column, name: str) -> tuple[str, ...]:
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


def _mixture(one: Spectrum, other: Spectrum, fraction: float, name: str) -> Spectrum:
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
        found, last = [], len(self.statuses) - 1
        starts = [
            row
            for row, status in enumerate(self.statuses)
            if status and (row == 0 or self.statuses[row - 1] != status)
        ]
        for first in starts:
            status = self.statuses[first]
            end = first
            while end < last and self.statuses[end + 1] == status:
                end += 1
            meaning = _STATUS_TEXTS.get(status, f"has the status {status!r}")
            rows = f"{self.wavelengths[first]:g} to {self.wavelengths[end]:g} nm"
            above = self.wavelengths[first - 1] if first else -np.inf
            below = self.wavelengths[end + 1] if end < last else np.inf
            found.append(Doubt(f"{name}, {rows}: {meaning}", float(above), float(below)))
        return found


def _published_columns(water_type: str, source: str) -> dict[str, _Column]:
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


def _implausible(
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
