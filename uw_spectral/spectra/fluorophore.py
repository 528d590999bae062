"""Fluorophores of objects: proteins of corals, chlorophyll, dyes and markers.

A surface that absorbs the fraction α(λ') of the photons of light emits, matte,

    L(λ) = Φ η(λ)/λ · 1/π ∫ E(λ') α(λ') λ' dλ',

with the quantum yield Φ and the emission η in photons, ∫ η dλ = 1: the outer product of an
excitation and an emission, a reradiation matrix of rank one (Donaldson, Brit. J. Appl. Phys. 5,
210, 1954). Light of changed wavelength is added to what the surface reflects.
"""

from __future__ import annotations

import csv
import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..errors import InputError, unknown_name
from .bands import Bands
from .illuminant import band_mean
from .spectral_table import read_spectral_table
from .spectrum import DATA_DIRECTORY, Spectrum, read_text

Array = NDArray[np.float64]

FILE_CONTENT = "CSV wavelength_nm, excitation, emission, with '# quantum_yield: 0.5' above"
"""What a file of a fluorophore holds, in words."""
_FILE = "fluorophores.csv"
_YIELD = "quantum_yield"
_SOURCE = "published peaks and yields, idealised widths (data/fluorophores.csv)"
_GRID = np.arange(250.0, 1000.5, 1.0)  # nm, of the shipped ones


@dataclass(frozen=True, eq=False)
class Fluorophore(ComparedByContent):
    """What a fluorophore absorbs and emits.

    Raises
    ------
    InputError
        If the yield is not between 0 and 1, or a spectrum is zero throughout.
    """

    name: str
    excitation: Spectrum  #: Absorptance over its largest value; nothing beyond the table.
    emission: Spectrum  #: In photons per nm, of any scale; nothing beyond the table.
    quantum_yield: float  #: Photons emitted per photon absorbed.
    source: str

    def __post_init__(self) -> None:
        if not 0.0 < self.quantum_yield <= 1.0:
            raise InputError(
                f"fluorophore {self.name}: the quantum yield is {self.quantum_yield:g}; give "
                "photons emitted per photon absorbed, above 0 and at most 1"
            )
        for spectrum in (self.excitation, self.emission):
            if len(spectrum.wavelengths) < 2 or not np.any(spectrum.values > 0.0):
                raise InputError(
                    f"{spectrum.name} is zero at every wavelength; give one that is not"
                )

    @functools.cached_property
    def peak(self) -> float:
        """Wavelength of the strongest emission, nm."""
        return float(self.emission.wavelengths[np.argmax(self.emission.values)])

    def excitation_in(self, bands: Bands) -> Array:
        """Weights of the irradiance of bands, shape (n,), nm: α(λ') λ' dλ' over the peak's λ.

        Examples
        --------
        >>> dye = parse_fluorophore("fluorescein")
        >>> dye.excitation_in(Bands.uniform(3)).argmax()
        np.int64(0)
        """
        table = self.excitation
        absorbed = table.values / table.values.max() * table.wavelengths / self.peak
        return _mean(Spectrum(table.wavelengths, absorbed, table.name), bands) * bands.widths

    def emission_in(self, bands: Bands) -> Array:
        """Radiance times π of bands per unit of what excites, shape (n,), 1/nm."""
        table = self.emission
        photons = float(np.trapezoid(table.values, table.wavelengths))
        emitted = self.quantum_yield * table.values / photons * self.peak / table.wavelengths
        return _mean(Spectrum(table.wavelengths, emitted, table.name), bands)

    def reradiation(self, bands: Bands) -> Array:
        """Reradiation matrix of bands, shape (n, n): π L of a row per irradiance of a column.

        Of a surface that absorbs all light at the peak of the excitation.

        Examples
        --------
        No more photons come out than went in:

        >>> bands = Bands.uniform(60, 350.0, 800.0)
        >>> dye = parse_fluorophore("fluorescein")
        >>> into = np.zeros(60)
        >>> into[np.argmax(dye.excitation_in(bands))] = 1.0
        >>> out = dye.reradiation(bands) @ into
        >>> photons = (out * bands.centres).sum() / (into * bands.centres).sum()
        >>> round(float(photons), 2)
        0.92
        """
        return np.outer(self.emission_in(bands), self.excitation_in(bands))


def parse_fluorophore(text: str) -> Fluorophore:
    """Return the fluorophore of a name, in any case, or of ``"file:PATH"`` (:data:`FILE_CONTENT`).

    Raises
    ------
    InputError
        If the name is unknown (near names are suggested) or the file cannot be used.
    """
    scheme, _, rest = text.strip().partition(":")
    if scheme == "file" and rest:
        return _from_file(Path(rest))
    known = _shipped()
    name = text.strip().lower()
    if name not in known:
        raise unknown_name("fluorophore", text.strip(), [*known, "file:PATH"])
    return known[name][0]


def list_fluorophores() -> dict[str, str]:
    """Return the names of the fluorophores that need no file, and what each is."""
    return {name: text for name, (_, text) in _shipped().items()}


@functools.cache
def _shipped() -> dict[str, tuple[Fluorophore, str]]:
    lines = read_text(DATA_DIRECTORY / _FILE).splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {row["name"]: (_idealised(row), row["text"]) for row in rows}


def _idealised(row: dict[str, str]) -> Fluorophore:
    """Return bands of two halves of Gaussians, by their half widths at half maximum."""
    name = row["name"]

    def band(kind: str) -> Spectrum:
        peak, below, above = (float(row[f"{kind}{part}_nm"]) for part in ("", "_below", "_above"))
        away = _GRID - peak
        width = np.where(away < 0.0, below, above)
        return Spectrum(_GRID, 0.5 ** ((away / width) ** 2), f"{kind} of {name}", _SOURCE)

    return Fluorophore(name, band("excitation"), band("emission"), float(row[_YIELD]), _SOURCE)


def _from_file(path: Path) -> Fluorophore:
    table = read_spectral_table(path, ("excitation", "emission"))
    stated = table.stated(_YIELD)
    if stated is None:
        raise InputError(
            f"{path} does not say how much it emits; add a line '# {_YIELD}: ' and photons "
            "emitted per photon absorbed"
        )
    excitation, emission = (
        table.spectrum(kind, f"{kind} of {path.name}") for kind in ("excitation", "emission")
    )
    return Fluorophore(path.stem, excitation, emission, stated, f"file {path.name}")


def _mean(spectrum: Spectrum, bands: Bands) -> Array:
    """Mean over bands of what is nothing beyond its table."""
    low, high = bands.centres - bands.widths, bands.centres + bands.widths
    first, last = min(low.min(), spectrum.range[0] - 2.0), max(high.max(), spectrum.range[1] + 2.0)
    ends = [first, spectrum.range[0] - 1.0], [spectrum.range[1] + 1.0, last]
    grid = np.concatenate([ends[0], spectrum.wavelengths, ends[1]])
    values = np.concatenate([[0.0, 0.0], spectrum.values, [0.0, 0.0]])
    return band_mean(Spectrum(grid, values, spectrum.name), bands)
