"""Absorption and scattering of a body of water: Jerlov types, files, uniform water."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent
from ..errors import DataWarning, InputError, unknown_name
from ..spectra.spectral_table import read_spectral_table
from ..spectra.spectrum import Spectrum, Table, shipped_table
from .jerlov_tables import (
    REPAIRED_TYPES,
    Doubt,
    below_water,
    between_rows_as_water,
    caveats_of,
    implausible,
    mixture,
    published_columns,
)
from .phase_functions import BACKSCATTER_RANGE, FournierForand, SeawaterMixture
from .pure_water import molecular_scattering, pure_water_absorption

JERLOV_TYPES = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")
JERLOV_SOURCES = ("solonenko2015", "williamson2022")
DEFAULT_SOURCE = "solonenko2015"
BACKSCATTER = "bb/b"
"""Key in the comment of a table, as ``# bb/b: 0.01``."""
_PURE = np.arange(300.0, 801.0, 5.0)  # nm, where pure water is known


@dataclass(frozen=True, eq=False)
class Water(ComparedByContent):
    """Inherent optical properties of a homogeneous body of water.

    Raises
    ------
    InputError
        If a coefficient is negative or not finite (the message names the row), or bb/b is not
        one of sea particles.
    """

    #: a and b in 1/m.
    absorption: Spectrum
    scattering: Spectrum
    #: Kd in 1/m where the source has one; only comparisons and plots use it.
    diffuse_attenuation: Spectrum | None
    #: What it is and where the numbers come from.
    name: str
    source: str
    caveats: tuple[str, ...] = ()  #: What a user of the data should know, at all wavelengths.
    doubts: tuple[Doubt, ...] = ()  #: What they should know at some wavelengths.
    #: bb/b of the particles, where the source says something of it; it chooses the default phase
    #: function. None stands for the average of Petzold's, 0.0183.
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
        """Water with the same absorption and scattering, 1/m, at every wavelength."""
        everywhere = np.array([1.0, 1e6])
        absorption = Spectrum(everywhere, np.full(2, a), f"absorption of {name}")
        scattering = Spectrum(everywhere, np.full(2, b), f"scattering of {name}")
        return cls(absorption, scattering, None, name, "given by the user")

    @classmethod
    def jerlov(cls, water_type: str, source: str = DEFAULT_SOURCE) -> Water:
        """One of the ten Jerlov types, from the ``jerlov`` package.

        Solonenko & Mobley, Appl. Opt. 54, 5392 (2015); Williamson & Hollins,
        Appl. Opt. 61, 9951 (2022).

        Types are :data:`JERLOV_TYPES`, in any case. The source ``"solonenko2015"`` is inverted from
        Kd, 300-700 nm, all types, with HydroLight's Kd; misprinted rows of 3C and 5C are repaired
        from ``data/``. ``"williamson2022"`` is measured, 300-800 nm, IB to 5C, no Kd.

        Raises
        ------
        InputError
            If the type or the source is unknown, or the source has no such type.

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
        columns = published_columns(canonical, source)
        if source == "solonenko2015" and canonical in REPAIRED_TYPES:
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
        spectra["a"] = between_rows_as_water(spectra["a"])
        return cls(
            spectra["a"],
            spectra["b"],
            spectra.get("Kd"),
            f"{name} ({source})",
            f"{published.citation}; doi {published.doi}; PyPI jerlov {jerlov.__version__}",
            (*caveats_of(canonical, published.caveats), *below_water(columns["a"], name)),
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
        doubts = implausible(table.columns["wavelength_nm"], table.columns, name)
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
        """Mix with a fraction of another water, by volume.

        Coefficients mix linearly, as absorbing and scattering matter does; Kd, which does not, is
        dropped.

        Raises
        ------
        InputError
            If the fraction is outside 0 to 1, or the tables do not overlap.
        """
        if not 0.0 <= fraction <= 1.0:
            raise InputError(f"the fraction of {other.name} is {fraction:g}; give 0 to 1")
        if fraction == 0.0:
            return self
        if fraction == 1.0:
            return other
        name = f"{self.name} with {fraction:.4g} of {other.name}"
        return Water(
            mixture(self.absorption, other.absorption, fraction, f"absorption of {name}"),
            mixture(self.scattering, other.scattering, fraction, f"scattering of {name}"),
            None,
            name,
            f"{self.source} | {other.source}",
            tuple(dict.fromkeys((*self.caveats, *other.caveats))),
            (*self.doubts, *other.doubts),
            self._mixed_backscatter(other, fraction),
        )

    def concentrated(self, factor: float) -> Water:
        """Multiply what is in the water beside the water itself by a factor; 0 is pure water.

        a_w + f (a - a_w), and b likewise, with a_w and b_w of pure sea water; where a table lies
        below these, it stays. Kd, which does not scale so, is dropped.

        Raises
        ------
        InputError
            If it is negative or not finite.
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
        """Multiply the coefficients by factors, 0 or more.

        Raises
        ------
        InputError
            If a factor is negative or not finite.
        """
        for what, factor in (("absorption", absorption), ("scattering", scattering)):
            if not (factor >= 0 and np.isfinite(factor)):
                raise InputError(f"the factor on {what} is {factor:g}; give 0 or more")
        if absorption == scattering == 1.0:
            return self
        return replace(
            self,
            absorption=replace(self.absorption, values=self.absorption.values * absorption),
            scattering=replace(self.scattering, values=self.scattering.values * scattering),
            diffuse_attenuation=None,
            name=f"{self.name}, absorption × {absorption:.4g}, scattering × {scattering:.4g}",
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
