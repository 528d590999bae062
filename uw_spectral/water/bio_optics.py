"""Absorption, scattering and phase function of a water from what is in it.

a = Σ a_i and b = Σ b_i over pure water, phytoplankton, CDOM, detritus and
minerals; the phase function is their b-weighted mixture.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..spectra.spectrum import Spectrum, shipped_table
from .diffuse_attenuation import Kd_Lee2013
from .optical_properties import Water
from .phase import BandPhase, PhaseFunction
from .phase_functions import BACKSCATTER_RANGE, EinsteinSmoluchowski, FournierForand
from .pure_water import molecular_scattering, pure_water_absorption

SEA_SALINITY = 35.0
"""Salinity of the sea in g/kg, for which the molecular scattering is tabulated."""

# H. Loisel & A. Morel, Limnol. Oceanogr. 43, 847 (1998), at 550 nm, 1/m; their 0.347 at 660 nm.
_PARTICLE_SCATTERING, _PARTICLE_EXPONENT = 0.416, 0.766
# A. Morel & S. Maritorena, J. Geophys. Res. 106, 7163 (2001): mg/m³ between which the spectral
# exponent of the scattering changes.
_EXPONENT_CHANGES = (0.02, 2.0)
# A. Morel & B. Gentili, Remote Sens. Environ. 113, 998 (2009): dissolved and detrital matter, 1/m
# at 400 nm, and the exponent of the chlorophyll; 1/nm.
_COLOURED_MATTER, _COLOURED_MATTER_EXPONENT, _CASE1_CDOM_SLOPE = 0.065, 0.63, 0.018
# V. I. Haltrin, Appl. Opt. 38, 6826 (1999): small (terrigenic) particles, m²/g at 400 nm.
_MINERAL_SCATTERING = 1.151302
# M. Babin et al., J. Geophys. Res. 108 (C7), 3211 (2003): m²/g at 443 nm; public codes take
# 0.031 to 0.041.
_MINERAL_ABSORPTION = 0.031
_MINERAL_INDEX = 1.15
_SMALLEST_BACKSCATTER = 0.002
# bb/b of the two functions between which that of organic particles is interpolated.
_FIXED_BACKSCATTER = (0.003, 0.0112)
_TRACE = 1e-9  # scattering in 1/m of particles that do no harm
_WAVELENGTHS = np.arange(300.0, 800.1, 2.5)
# Ranges of what is not bounded by 0 alone; bb/b is bounded by the line of sea particles.
_RANGES = {
    "chlorophyll": (0.0, 100.0),
    "salinity": (0.0, 40.0),
    "cdom_slope": (0.0, 0.1),
    "detritus_slope": (0.0, 0.1),
    "backscatter": BACKSCATTER_RANGE,
    "mineral_slope": (0.0, 0.1),
    "mineral_exponent": (0.0, 4.0),
    "mineral_backscatter": (0.001, 0.2),
    "scattering_power": (0.0, 2.0),
    "scattering_exponent": (-1.0, 4.0),
    "chlorophyll_yield": (0.0, 1.0),
    "cdom_yield": (0.0, 1.0),
}


@dataclass(frozen=True)
class Constituents:
    """What a water holds besides the water itself.

    Raises
    ------
    InputError
        If a quantity is negative, not finite or out of its range.

    Examples
    --------
    >>> Constituents(chlorophyll=1.0, cdom=0.05).absorption([440, 550, 675]).round(3)
    array([0.094, 0.074, 0.468])
    """

    #: mg/m³, 0 to 100. Absorbs as phytoplankton; scatters as all the particles that go with it.
    chlorophyll: float = 0.0
    cdom: float = 0.0  #: Absorption a_y(440) of coloured dissolved organic matter, 1/m.
    minerals: float = 0.0  #: Suspended minerals, g/m³; they absorb and scatter.
    #: Absorption a_d(400) of dead organic particles, 1/m. Their scattering is part of that of the
    #: phytoplankton.
    detritus: float = 0.0
    #: Decay of the two absorptions with wavelength, 1/nm.
    cdom_slope: float = 0.014
    detritus_slope: float = 0.011
    #: bb/b of the organic particles; None takes it from the chlorophyll (Morel & Maritorena 2001).
    backscatter: float | None = None
    #: g/kg, 0 to 40; it changes the molecular scattering only. The temperature has no place here:
    #: no table of its effect on absorption has a licence that lets it ship.
    salinity: float = SEA_SALINITY
    #: Decay of the absorption of minerals with wavelength, 1/nm: the mean of Babin et al. (2003),
    #: 0.0123 ± 0.0013.
    mineral_slope: float = 0.0123
    #: Of the wavelength in their scattering, λ^-1.7: small terrigenic particles (Haltrin 1999);
    #: large ones have 0.3.
    mineral_exponent: float = 1.7
    #: bb/b of the minerals, 0.001 to 0.2: 0.039 for small ones (Haltrin 1999).
    mineral_backscatter: float = 0.039
    #: b(550) of all that goes with 1 mg/m³ of chlorophyll, 1/m, and the power of the chlorophyll:
    #: Loisel & Morel (1998). Gordon & Morel (1983) have 0.30 (0.12 to 0.45) and 0.62.
    scattering_at_one: float = _PARTICLE_SCATTERING
    scattering_power: float = _PARTICLE_EXPONENT
    #: ν of (550/λ)^ν in it; None takes it from the chlorophyll (Morel & Maritorena 2001).
    scattering_exponent: float | None = None
    #: Photons that chlorophyll emits per photon absorbed from 370 to 690 nm: 0.01 to 0.1 in nature.
    chlorophyll_yield: float = 0.02
    #: The same of CDOM, where light excites it best; None as sample FA7 of Hawes (1992), 0.02.
    #: 0.005 to 0.025 in much of it.
    cdom_yield: float | None = None

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            low, high = _RANGES.get(field.name, (0.0, math.inf))
            if value is not None and not (math.isfinite(value) and low <= value <= high):
                limit = "not negative" if high == math.inf else f"{low:g} to {high:g}"
                raise InputError(
                    f"constituents: {field.name} must be a finite number, {limit}, got {value:g}"
                )

    @classmethod
    def case1(cls, chlorophyll: float) -> Constituents:
        """Open ocean, where everything goes with the chlorophyll.

        One set of laws of one laboratory: absorption of the particles by Bricaud et
        al. (1998), detritus being what they find besides phytoplankton; dissolved and
        detrital absorption together ``0.065 C^0.63`` at 400 nm with the slope 0.018
        (Morel & Gentili 2009), so that CDOM is this, at 440 nm, less the detritus;
        scattering by Loisel & Morel (1998), its spectral exponent and bb/b by Morel
        & Maritorena (2001).

        Examples
        --------
        >>> sea = Constituents.case1(1.0)
        >>> round(sea.cdom, 4), round(float(sea.scatterings([550.0])["phytoplankton"][0]), 3)
        (0.0174, 0.416)
        """
        own = cls(chlorophyll, cdom_slope=_CASE1_CDOM_SLOPE)
        particles = _power_law("p", chlorophyll, np.array([440.0]))[0]
        phytoplankton = _power_law("phi", chlorophyll, np.array([440.0]))[0]
        detritus = max(float(particles - phytoplankton), 0.0)
        at_400 = _COLOURED_MATTER * chlorophyll**_COLOURED_MATTER_EXPONENT
        return dataclasses.replace(
            own,
            cdom=max(at_400 * math.exp(-own.cdom_slope * 40.0) - detritus, 0.0),
            detritus=detritus * math.exp(own.detritus_slope * 40.0),
        )

    def absorptions(self, wavelengths: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Absorption by constituent, 1/m, each of shape (n,)."""
        nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        return {
            "water": pure_water_absorption(nm),
            "phytoplankton": phytoplankton_absorption(self.chlorophyll, nm),
            "cdom": self.cdom * np.exp(-self.cdom_slope * (nm - 440.0)),
            "detritus": self.detritus * np.exp(-self.detritus_slope * (nm - 400.0)),
            "minerals": self.minerals
            * _MINERAL_ABSORPTION
            * np.exp(-self.mineral_slope * (nm - 443.0)),
        }

    def scatterings(self, wavelengths: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Scattering by constituent, 1/m, each of shape (n,)."""
        nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        fresh, sea = (
            molecular_scattering(nm, model) for model in ("zhang2009_S0_T20", "zhang2009_S35_T22")
        )
        return {
            "water": fresh + (sea - fresh) * self.salinity / SEA_SALINITY,
            "phytoplankton": particle_scattering_Loisel1998(
                self.chlorophyll,
                nm,
                self.scattering_at_one,
                self.scattering_power,
                self.scattering_exponent,
            ),
            "minerals": self.minerals * _MINERAL_SCATTERING * (400.0 / nm) ** self.mineral_exponent,
        }

    def absorption(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Total absorption a, 1/m, shape (n,)."""
        return np.sum(list(self.absorptions(wavelengths).values()), axis=0)

    def scattering(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Total scattering b, 1/m, shape (n,)."""
        return np.sum(list(self.scatterings(wavelengths).values()), axis=0)

    def backscattering(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Total backscattering bb, 1/m, shape (n,)."""
        parts = self.scatterings(wavelengths)
        return (
            0.5 * parts["water"]
            + self.organic_backscatter * parts["phytoplankton"]
            + self.mineral_backscatter * parts["minerals"]
        )

    @property
    def organic_backscatter(self) -> float:
        """bb/b of the particles that go with the chlorophyll."""
        return self.backscatter or particle_backscatter_Morel2001(self.chlorophyll)

    def phase(self, wavelengths: ArrayLike) -> BandPhase:
        """Phase function per band: molecules, organic particles and minerals, weighted by b."""
        parts = {name: b for name, b in self.scatterings(wavelengths).items() if b.any()}
        phases = self.phases
        weights = np.stack(list(parts.values()))
        return BandPhase(tuple(phases[name] for name in parts), weights / weights.sum(axis=0))

    def phase_of_fixed_parts(self, wavelengths: ArrayLike) -> BandPhase:
        """Phase function per band in the same four parts whatever the amounts, for animation.

        :meth:`phase` has a part that changes with the chlorophyll. Here it is
        mixed of two, so that a change of the amounts changes weights only. The
        backscattering is the same for bb/b of 0.003 to 0.0112 (chlorophyll of 0.02
        to 40 mg/m³, and held there beyond); organic particles scatter up to 8 %
        less at 1 to 20°, within 1.3 % backwards.
        """
        parts = self.scatterings(wavelengths)
        low, high = _FIXED_BACKSCATTER
        fraction = float(np.clip((self.organic_backscatter - low) / (high - low), 0.0, 1.0))
        # In water without particles the bands would have the same weights, in its neighbour not.
        organic = np.maximum(parts["phytoplankton"], _TRACE)
        weights = np.stack(
            [parts["water"], (1 - fraction) * organic, fraction * organic, parts["minerals"]]
        )
        components = (
            EinsteinSmoluchowski(),
            *_fixed_organic(),
            FournierForand(_MINERAL_INDEX, self.mineral_backscatter),
        )
        return BandPhase(components, weights / weights.sum(axis=0))

    @property
    def phases(self) -> dict[str, PhaseFunction]:
        """Phase function by constituent."""
        return {
            "water": EinsteinSmoluchowski(),
            "phytoplankton": FournierForand.of_backscatter_Mobley2002(self.organic_backscatter),
            "minerals": FournierForand(_MINERAL_INDEX, self.mineral_backscatter),
        }

    @property
    def particle_backscatter(self) -> float | None:
        """bb/b at 550 nm of all particles together; None without any.

        With it one particle function serves all bands, where b and the molecular part alone
        are known. :meth:`phase` is exact; with as much minerals as organic particles bb/b
        differs from it by 17 % at 400 nm.
        """
        parts = self.scatterings([550.0])
        organic, mineral = float(parts["phytoplankton"][0]), float(parts["minerals"][0])
        if not organic + mineral:
            return None
        back = self.organic_backscatter * organic + self.mineral_backscatter * mineral
        return back / (organic + mineral)

    def water(self, name: str = "", source: str = "") -> Water:
        """Return the :class:`.Water`, 300 to 800 nm, with Kd of Lee et al. (2013).

        Examples
        --------
        >>> Constituents.case1(0.1).water().a([450, 650]).round(3)
        array([0.024, 0.342])
        """
        name = name or f"water with {self.described()}"
        a, b = self.absorption(_WAVELENGTHS), self.scattering(_WAVELENGTHS)
        bb, molecular = self.backscattering(_WAVELENGTHS), self.scatterings(_WAVELENGTHS)["water"]
        caveats = [
            "absorption of phytoplankton below 400 and above 700 nm is extrapolated",
            "Kd is computed (Lee et al. 2013, sun at 30°)",
        ]
        if self.chlorophyll > 30:
            caveats.append("chlorophyll above 30 mg/m³ lies beyond the measurements of the model")
        return Water(
            Spectrum(_WAVELENGTHS, a, f"a of {name}"),
            Spectrum(_WAVELENGTHS, b, f"b of {name}"),
            Spectrum(_WAVELENGTHS, Kd_Lee2013(a, bb, 0.5 * molecular), f"Kd of {name}"),
            name,
            source
            or "Pope & Fry 1997, Bricaud et al. 1998, Loisel & Morel 1998, Morel & Maritorena "
            "2001, Haltrin 1999, Babin et al. 2003, Zhang et al. 2009",
            tuple(caveats),
            particle_backscatter=self.particle_backscatter,
        )

    def described(self) -> str:
        """Return what differs from pure sea water, as an option spells it.

        Examples
        --------
        >>> Constituents(chlorophyll=1.0, cdom=0.05).described()
        'chl=1,cdom=0.05'
        """
        changed = [
            f"{key}={getattr(self, name):g}"
            for key, name in _KEYS.items()
            if getattr(self, name) != getattr(_PURE, name)
        ]
        return ",".join(changed) or "nothing in it"


AMOUNTS = ("chlorophyll", "cdom", "minerals", "detritus")
"""Amounts of :class:`Constituents`, as columns of a profile and settings call them."""
PROPERTIES = {
    "cdom-slope": "cdom_slope",
    "detritus-slope": "detritus_slope",
    "bb/b": "backscatter",
    "salinity": "salinity",
    "mineral-slope": "mineral_slope",
    "mineral-exponent": "mineral_exponent",
    "mineral-bb/b": "mineral_backscatter",
    "organic-b": "scattering_at_one",
    "organic-power": "scattering_power",
    "organic-exponent": "scattering_exponent",
    "chl-yield": "chlorophyll_yield",
    "cdom-yield": "cdom_yield",
}
"""What of :class:`Constituents` is no amount, by the keys of options and of tables' comments."""

_KEYS = dict(zip(("chl", *AMOUNTS[1:]), AMOUNTS, strict=True)) | PROPERTIES
_PURE = Constituents()


@functools.cache
def _fixed_organic() -> tuple[FournierForand, ...]:
    """The two that :meth:`Constituents.phase_of_fixed_parts` mixes."""
    return tuple(map(FournierForand.of_backscatter_Mobley2002, _FIXED_BACKSCATTER))


def parse_constituents(text: str) -> Constituents:
    """Read constituents as an option spells them, ``"chl=1,cdom=0.05,minerals=0.1"``.

    Keys are chl, cdom, minerals, detritus, and those of :data:`PROPERTIES`; ``"case1=0.5"`` stands
    for :meth:`Constituents.case1`, which the other keys then change; empty is pure sea water.

    Raises
    ------
    InputError
        Unknown or repeated key, no number, or a number out of range.
    """
    values: dict[str, float] = {}
    for cell in (part for part in text.split(",") if part.strip()):
        key, _, number = (part.strip() for part in cell.partition("="))
        key = key.lower()
        if key not in (*_KEYS, "case1"):
            raise unknown_name("constituent", key, (*_KEYS, "case1"))
        if key in values:
            raise InputError(f"constituents {text!r}: {key} is given twice")
        try:
            values[key] = float(number)
        except ValueError as error:
            raise InputError(
                f"constituents {text!r}: {cell.strip()!r} is not key=number; write chl=1,cdom=0.05"
            ) from error
    chlorophyll = values.pop("case1", None)
    if chlorophyll is not None:
        Constituents(chlorophyll)
    base = _PURE if chlorophyll is None else Constituents.case1(chlorophyll)
    return dataclasses.replace(base, **{_KEYS[key]: value for key, value in values.items()})


def phytoplankton_absorption(chlorophyll: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Absorption of phytoplankton, A C^E, 1/m (Bricaud et al. 1998); 300 to 800 nm.

    Examples
    --------
    >>> phytoplankton_absorption(1.0, [440, 550]).round(4)
    array([0.0378, 0.007 ])
    """
    return _power_law("phi", chlorophyll, np.atleast_1d(wavelengths))


def particle_scattering_Loisel1998(
    chlorophyll: float,
    wavelengths: ArrayLike,
    at_one: float = _PARTICLE_SCATTERING,
    power: float = _PARTICLE_EXPONENT,
    exponent: float | None = None,
) -> NDArray[np.float64]:
    """Scattering of the particles of a case 1 water, 0.416 C^0.766 (λ/550)^v, 1/m.

    Loisel & Morel (1998), as Morel & Maritorena (2001) use it: v = (log10 C - 0.3)/2, held
    beyond 0.02 and 2 mg/m³, where it is -1 and 0. Others have another b(550) ``at_one`` mg/m³,
    another power, or another exponent -v.

    Examples
    --------
    >>> particle_scattering_Loisel1998(10.0, [440, 550]).round(2)
    array([2.43, 2.43])
    """
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    low, high = _EXPONENT_CHANGES
    if exponent is None:
        exponent = 0.0 if chlorophyll > high else 0.5 * (0.3 - math.log10(max(chlorophyll, low)))
    return at_one * chlorophyll**power * (550.0 / nm) ** exponent


def particle_backscatter_Morel2001(chlorophyll: float) -> float:
    """bb/b at 550 nm of the particles of a case 1 water (Morel & Maritorena 2001).

    Held between 0.2 % and its value at 0.02 mg/m³, the range of the data.

    Examples
    --------
    >>> round(particle_backscatter_Morel2001(1.0), 4)
    0.007
    """
    logarithm = math.log10(max(chlorophyll, 0.02))
    return max(0.002 + 0.01 * (0.5 - 0.25 * logarithm), _SMALLEST_BACKSCATTER)


def _power_law(part: str, chlorophyll: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    if not (math.isfinite(chlorophyll) and chlorophyll >= 0):
        raise InputError(
            f"chlorophyll must be a finite number, not negative, got {chlorophyll:g} mg/m³"
        )
    table = shipped_table("phytoplankton_absorption.csv")
    factor, exponent = (
        table.spectrum(f"{letter}_{part}", "absorption of phytoplankton").at(wavelengths)
        for letter in "AE"
    )
    return factor * chlorophyll**exponent
