"""What light passes on its way into a housing: sea water under pressure, and the glass of ports."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..surface.refraction import refractive_index_QuanFry1995

Array = NDArray[np.float64]

_DEEPEST = 11000.0  # dbar: as far as Millard & Seaver go


@dataclass(frozen=True)
class SeaWater:
    """Water before the port.

    Index at the surface: :func:`.refractive_index_QuanFry1995`. What pressure adds: R. C. Millard &
    G. Seaver, Deep-Sea Res. 37, 1909 (1990), the terms with pressure; from 500 to 700 nm.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> SeaWater().refractive_index([400, 550, 700]).round(4)
    array([1.3499, 1.3408, 1.3365])
    >>> SeaWater(pressure=4000.0, temperature=2.0).refractive_index(550).round(4).item()
    1.3482
    """

    salinity: float = 35.0  #: g/kg, 0 to 40.
    temperature: float = 20.0  #: °C, 0 to 30.
    #: Above that of the atmosphere, dbar (nearly the depth in m), 0 to 11 000.
    pressure: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.pressure <= _DEEPEST:
            raise InputError(
                f"sea water: the pressure must be 0 to {_DEEPEST:g} dbar, got {self.pressure:g}"
            )
        refractive_index_QuanFry1995(550.0, self.salinity, self.temperature)

    def refractive_index(self, wavelength: ArrayLike) -> Array:
        """Refractive index against air at wavelengths in nm."""
        surface = refractive_index_QuanFry1995(wavelength, self.salinity, self.temperature)
        S, T, p = self.salinity, self.temperature, self.pressure
        microns = np.asarray(wavelength, dtype=np.float64) / 1000.0
        pure = 1.5868383e-6 + 1.0712063e-8 / microns**2 - 9.4834486e-9 * T + 1.0100326e-10 * T**2
        salt = S * (-1.1177517e-9 + 5.7311268e-11 * T - 1.5460458e-12 * T**2)
        curved = -1.574074e-11 + 5.8085198e-15 * T**2
        return surface + p * (pure + salt) + p**2 * curved


@dataclass(frozen=True)
class Glass:
    """Material of a port.

    Raises
    ------
    InputError
        If a term is not finite, or light of the visible range is absorbed.

    Examples
    --------
    >>> GLASSES["BK7"].refractive_index(587.5618).round(5).item()
    1.5168
    >>> Glass.of_index(1.49).refractive_index([400.0, 700.0]).round(6).tolist()
    [1.49, 1.49]
    """

    name: str
    #: B and C, µm², of Sellmeier's equation n² = 1 + Σ B λ² / (λ² − C).
    terms: tuple[tuple[float, float], ...]
    source: str

    def __post_init__(self) -> None:
        if not all(math.isfinite(x) for term in self.terms for x in term):
            raise InputError(f"glass {self.name}: the coefficients must be finite")
        index = self.refractive_index([380.0, 550.0, 780.0])
        if not (np.isfinite(index) & (index >= 1.0)).all():
            raise InputError(
                f"glass {self.name}: the index must be at least 1 from 380 to 780 nm, got "
                f"{index.tolist()}"
            )

    @classmethod
    def of_index(cls, index: float) -> Glass:
        """Return a glass of one index for all wavelengths."""
        return cls(f"n = {index:g}", ((index * index - 1.0, 0.0),), "given")

    def refractive_index(self, wavelength: ArrayLike) -> Array:
        """Refractive index against air at wavelengths in nm."""
        square = (np.asarray(wavelength, dtype=np.float64) / 1000.0) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.sqrt(1.0 + sum(B * square / (square - C) for B, C in self.terms))


GLASSES = {
    glass.name: glass
    for glass in (
        Glass(
            "BK7",
            (
                (1.03961212, 0.00600069867),
                (0.231792344, 0.0200179144),
                (1.01046945, 103.560653),
            ),
            "Schott, optical glass data sheets, N-BK7; 310 to 2500 nm",
        ),
        Glass(
            "fused silica",
            (
                (0.6961663, 0.0684043**2),
                (0.4079426, 0.1162414**2),
                (0.8974794, 9.896161**2),
            ),
            "I. H. Malitson, J. Opt. Soc. Am. 55, 1205 (1965); 210 to 3710 nm",
        ),
        Glass(
            "acrylic",
            ((1.1819, 0.011313),),
            "N. Sultanova et al., Acta Phys. Pol. A 116, 585 (2009), PMMA; 437 to 1052 nm, "
            "below extrapolated",
        ),
    )
}
"""Materials that ports are made of, by name."""


def find_glass(name: str) -> Glass:
    """Return a material by its name.

    Raises
    ------
    InputError
        If it is unknown.
    """
    if name not in GLASSES:
        raise unknown_name("glass", name, GLASSES)
    return GLASSES[name]
