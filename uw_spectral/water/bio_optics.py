"""Absorption, scattering and phase function of a water from what is in it.

a = Σ a_i and b = Σ b_i over pure water, phytoplankton, CDOM, detritus and
minerals; the phase function is their b-weighted mixture. Functions named
``..._Gutierrez2008`` are the forms printed in D. Gutierrez, F. J. Serón,
A. Muñoz & O. Anson, Comput. Graph. Forum 27, 547 (2008), for comparison only.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..mathematics import NUMPY, Mathematics, Operand
from ..spectra.spectrum import Spectrum, shipped_table
from .diffuse_attenuation import Kd490_Morel2007, Kd_Lee2005, chlorophyll_Morel2007
from .optical_properties import Water
from .phase import (
    BandPhase,
    EinsteinSmoluchowski,
    FournierForand,
    PhaseFunction,
    SeawaterMixture,
    henyey_greenstein,
)
from .pure_water import molecular_scattering, pure_water_absorption

SEA_SALINITY = 35.0
"""Salinity of the sea in g/kg, for which the molecular scattering is tabulated."""

# H. R. Gordon & A. Morel, Lecture Notes 4, Springer (1983).
_PARTICLE_SCATTERING, _PARTICLE_EXPONENT = 0.30, 0.62
# V. I. Haltrin, Appl. Opt. 38, 6826 (1999): small (terrigenic) particles, m²/g at 400 nm.
_MINERAL_SCATTERING, _MINERAL_SCATTERING_EXPONENT, _MINERAL_BACKSCATTER = 1.151302, 1.7, 0.039
# M. Babin et al., J. Geophys. Res. 108 (C7), 3211 (2003): m²/g at 443 nm, 1/nm. Public codes
# take 0.031 to 0.041 m²/g; the slope is the mean of the survey, 0.0123 ± 0.0013.
_MINERAL_ABSORPTION, _MINERAL_SLOPE = 0.031, 0.0123
_MINERAL_INDEX = 1.15
_ORGANIC_BACKSCATTER = (1e-4, 0.2)  # range of the line of sea particles
_SMALLEST_BACKSCATTER = 0.002
# bb/b of the two functions between which that of organic particles is interpolated.
_FIXED_BACKSCATTER = (0.003, 0.0112)
_TRACE = 1e-9  # scattering in 1/m of particles that do no harm
_WAVELENGTHS = np.arange(300.0, 800.1, 2.5)


@dataclass(frozen=True)
class Constituents:
    """What a water holds besides the water itself.

    Parameters
    ----------
    chlorophyll : float
        mg/m³, 0 to 100. Absorbs as phytoplankton; scatters as all the
        particles that go with it.
    cdom : float
        Absorption a_y(440) of coloured dissolved organic matter, 1/m.
    minerals : float
        Suspended minerals, g/m³; they absorb and scatter.
    detritus : float
        Absorption a_d(400) of dead organic particles, 1/m. Their scattering
        is part of that of the phytoplankton.
    cdom_slope, detritus_slope : float
        Decay of the two absorptions with wavelength, 1/nm.
    backscatter : float or None
        bb/b of the organic particles; None takes it from the chlorophyll
        (Morel & Maritorena 2001).
    salinity : float
        g/kg, 0 to 40; it changes the molecular scattering only. The
        temperature has no place here: no table of its effect on absorption
        has a licence that lets it ship.

    Raises
    ------
    InputError
        If a quantity is negative, not finite or out of its range.

    Examples
    --------
    >>> Constituents(chlorophyll=1.0, cdom=0.05).absorption([440, 550, 675]).round(3)
    array([0.094, 0.074, 0.468])
    """

    chlorophyll: float = 0.0
    cdom: float = 0.0
    minerals: float = 0.0
    detritus: float = 0.0
    cdom_slope: float = 0.014
    detritus_slope: float = 0.011
    backscatter: float | None = None
    salinity: float = SEA_SALINITY

    def __post_init__(self) -> None:
        bounds = {"chlorophyll": 100.0, "salinity": 40.0, "cdom_slope": 0.1, "detritus_slope": 0.1}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            bound = bounds.get(field.name, math.inf)
            if field.name == "backscatter":
                low, high = _ORGANIC_BACKSCATTER
                if value is not None and not low <= value <= high:
                    raise InputError(
                        f"constituents: backscatter must be {low:g} to {high:g}, got {value:g}"
                    )
            elif not (math.isfinite(value) and 0 <= value <= bound):
                limit = "not negative" if bound == math.inf else f"0 to {bound:g}"
                raise InputError(
                    f"constituents: {field.name} must be a finite number, {limit}, got {value:g}"
                )

    @classmethod
    def case1(cls, chlorophyll: float) -> Constituents:
        """Open ocean, where everything goes with the chlorophyll.

        CDOM is 20 % of the absorption at 440 nm by water and particles,
        ``0.2 (a_w + 0.06 C^0.65)`` (Morel & Maritorena 2001); detritus is what
        Bricaud et al. (1998) find in the particles besides phytoplankton.

        Examples
        --------
        >>> round(Constituents.case1(1.0).cdom, 4)
        0.0133
        """
        own = cls(chlorophyll)
        particles = _power_law("p", chlorophyll, np.array([440.0]))[0]
        phytoplankton = _power_law("phi", chlorophyll, np.array([440.0]))[0]
        pure = pure_water_absorption([440.0])[0]
        return dataclasses.replace(
            own,
            cdom=float(0.2 * (pure + 0.06 * chlorophyll**0.65)),
            detritus=float(
                max(particles - phytoplankton, 0.0) * math.exp(own.detritus_slope * 40.0)
            ),
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
            * np.exp(-_MINERAL_SLOPE * (nm - 443.0)),
        }

    def scatterings(self, wavelengths: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Scattering by constituent, 1/m, each of shape (n,)."""
        nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        fresh, sea = (
            molecular_scattering(nm, model) for model in ("zhang2009_S0_T20", "zhang2009_S35_T22")
        )
        return {
            "water": fresh + (sea - fresh) * self.salinity / SEA_SALINITY,
            "phytoplankton": particle_scattering(self.chlorophyll, nm),
            "minerals": self.minerals
            * _MINERAL_SCATTERING
            * (400.0 / nm) ** _MINERAL_SCATTERING_EXPONENT,
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
            + _MINERAL_BACKSCATTER * parts["minerals"]
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
        share = float(np.clip((self.organic_backscatter - low) / (high - low), 0.0, 1.0))
        # In water without particles the bands would have the same weights, in its neighbour not.
        organic = np.maximum(parts["phytoplankton"], _TRACE)
        weights = np.stack(
            [parts["water"], (1 - share) * organic, share * organic, parts["minerals"]]
        )
        components = (
            EinsteinSmoluchowski(),
            *map(FournierForand.of_backscatter_Mobley2002, _FIXED_BACKSCATTER),
            FournierForand(_MINERAL_INDEX, _MINERAL_BACKSCATTER),
        )
        return BandPhase(components, weights / weights.sum(axis=0))

    @property
    def phases(self) -> dict[str, PhaseFunction]:
        """Phase function by constituent."""
        return {
            "water": EinsteinSmoluchowski(),
            "phytoplankton": FournierForand.of_backscatter_Mobley2002(self.organic_backscatter),
            "minerals": FournierForand(_MINERAL_INDEX, _MINERAL_BACKSCATTER),
        }

    def phase_model(self) -> SeawaterMixture:
        """Return the mixture with one particle function for all bands, of their bb/b at 550 nm.

        For places that know b and the molecular part only. :meth:`phase` is exact; with as
        much minerals as organic particles bb/b differs from it by up to 7 % at 400 and 700 nm.
        """
        parts = self.scatterings([550.0])
        organic, mineral = float(parts["phytoplankton"][0]), float(parts["minerals"][0])
        total = organic + mineral
        if not total:
            return SeawaterMixture()
        back = self.organic_backscatter * organic + _MINERAL_BACKSCATTER * mineral
        return SeawaterMixture(FournierForand.of_backscatter_Mobley2002(back / total))

    def water(self, name: str = "", source: str = "") -> Water:
        """Return the :class:`.Water`, 300 to 800 nm, with Kd of Lee et al. (2005).

        Examples
        --------
        >>> Constituents.case1(0.1).water().a([450, 650]).round(3)
        array([0.024, 0.342])
        """
        name = name or f"water with {self.described()}"
        a, b = self.absorption(_WAVELENGTHS), self.scattering(_WAVELENGTHS)
        caveats = [
            "absorption of phytoplankton below 400 and above 700 nm is extrapolated",
            "Kd is computed (Lee et al. 2005, sun at 30°)",
        ]
        if self.chlorophyll > 30:
            caveats.append("chlorophyll above 30 mg/m³ lies beyond the measurements of the model")
        return Water(
            Spectrum(_WAVELENGTHS, a, f"a of {name}"),
            Spectrum(_WAVELENGTHS, b, f"b of {name}"),
            Spectrum(
                _WAVELENGTHS, Kd_Lee2005(a, self.backscattering(_WAVELENGTHS)), f"Kd of {name}"
            ),
            name,
            source
            or "Pope & Fry 1997, Bricaud et al. 1998, Gordon & Morel 1983, Haltrin 1999, "
            "Babin et al. 2003, Zhang et al. 2009",
            tuple(caveats),
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


_KEYS = {
    "chl": "chlorophyll",
    "cdom": "cdom",
    "minerals": "minerals",
    "detritus": "detritus",
    "cdom-slope": "cdom_slope",
    "detritus-slope": "detritus_slope",
    "bb/b": "backscatter",
    "salinity": "salinity",
}
_PURE = Constituents()


def parse_constituents(text: str) -> Constituents:
    """Read constituents as an option spells them.

    Parameters
    ----------
    text : str
        ``"chl=1,cdom=0.05,minerals=0.1"``; keys chl, cdom, minerals, detritus,
        cdom-slope, detritus-slope, bb/b, salinity; ``"case1=0.5"`` stands for
        :meth:`Constituents.case1`, which the other keys then change; empty is
        pure sea water.

    Raises
    ------
    InputError
        Unknown or repeated key, no number, or a number out of range.

    Examples
    --------
    >>> parse_constituents("chl=1, cdom=0.05").cdom
    0.05
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


def constituents_of(water: str) -> Constituents | None:
    """Return the constituents of a water as :mod:`.water_names` spells it, if it has any.

    Raises
    ------
    InputError
        If a constituent or a named water is unknown.

    Examples
    --------
    >>> constituents_of("bio:chl=1").chlorophyll
    1.0
    >>> constituents_of("jerlov:IB") is None
    True
    """
    scheme, _, rest = water.partition(":")
    if scheme == "bio":
        return parse_constituents(rest)
    if scheme == "case":
        return _named(rest)[1].constituents
    return None


@dataclass(frozen=True)
class NamedWater:
    """A typical water of a sea, and where its numbers come from."""

    constituents: Constituents
    source: str


def named_waters() -> dict[str, NamedWater]:
    """Return the five seas of Gutierrez et al. 2008, Figure 3, as typical constituents.

    The concentrations of the figure are not published with it in a form that
    could be used here; the sources of ours are stated one by one.

    Examples
    --------
    >>> list(named_waters())
    ['atlantic', 'mediterranean', 'baltic', 'north-sea', 'cdom-coast']
    """
    coastlooc = "Massicotte et al., Earth Syst. Sci. Data 15, 3529 (2023), COASTLOOC"
    open_med = Constituents.case1(0.1)
    return {
        "atlantic": NamedWater(
            Constituents.case1(0.15), f"median chlorophyll of the NE Atlantic, {coastlooc}; case 1"
        ),
        "mediterranean": NamedWater(
            dataclasses.replace(open_med, cdom=2 * open_med.cdom),
            "chlorophyll at the limit of oligotrophic water, 0.1 mg/m³; twice the CDOM of a case 1 "
            "water (Morel & Gentili, Biogeosciences 6, 2625 (2009))",
        ),
        "baltic": NamedWater(
            Constituents(5.9, cdom=0.4, minerals=0.5, detritus=0.08, cdom_slope=0.018, salinity=7),
            f"median chlorophyll of the Baltic, {coastlooc}; slope of CDOM: Kratzer & Moore, "
            "Remote Sens. 10, 418 (2018); a_y, minerals, detritus and salinity: chosen, typical",
        ),
        "north-sea": NamedWater(
            Constituents(2.0, cdom=0.15, minerals=0.65, detritus=0.05, cdom_slope=0.0176),
            f"minerals from the median b_p(440) = 1.21 1/m of the North Sea, {coastlooc}; slope of "
            "CDOM: Babin et al. (2003); chlorophyll, a_y and detritus: chosen, typical",
        ),
        "cdom-coast": NamedWater(
            Constituents(5.0, cdom=0.75, minerals=0.5, detritus=0.1, cdom_slope=0.0176),
            f"CDOM: the largest a(350) = 3.66 1/m, off the Oder, {coastlooc}, taken to 440 nm with "
            "the slope of Babin et al. (2003); the rest: chosen, typical",
        ),
    }


def named_water(name: str) -> Water:
    """Return a typical water of a sea; see :func:`named_waters`.

    Raises
    ------
    InputError
        If the name is unknown.
    """
    key, sea = _named(name)
    return sea.constituents.water(key, sea.source)


def _named(name: str) -> tuple[str, NamedWater]:
    known = named_waters()
    key = name.strip().lower().replace(" ", "-").replace("_", "-")
    if key not in known:
        raise unknown_name("sea", name, known)
    return key, known[key]


def phytoplankton_absorption(chlorophyll: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Absorption of phytoplankton, A C^E, 1/m (Bricaud et al. 1998); 300 to 800 nm.

    Examples
    --------
    >>> phytoplankton_absorption(1.0, [440, 550]).round(4)
    array([0.0378, 0.007 ])
    """
    return _power_law("phi", chlorophyll, np.atleast_1d(wavelengths))


def particle_scattering(chlorophyll: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Scattering of the particles of a case 1 water, 0.30 C^0.62 (550/λ), 1/m.

    Gordon & Morel (1983); the factor ranges from 0.12 to 0.45 in nature.
    """
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    return _PARTICLE_SCATTERING * chlorophyll**_PARTICLE_EXPONENT * 550.0 / nm


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


def jerlov_chlorophyll(water_type: str) -> float:
    """Chlorophyll, mg/m³, of the case 1 water with the Kd(490) of a Jerlov type.

    For the oceanic types I to III. In coastal types other matter adds to
    Kd: there it is an upper bound.

    Examples
    --------
    >>> round(jerlov_chlorophyll("II"), 2)
    0.29
    """
    return float(chlorophyll_Morel2007(Water.jerlov(water_type).Kd([490.0]))[0])


def chlorophyll_jerlov(chlorophyll: float) -> str:
    """Oceanic Jerlov type whose Kd(490) is closest to a case 1 water's (ratio-wise).

    Examples
    --------
    >>> chlorophyll_jerlov(0.3)
    'II'
    """
    Kd = float(Kd490_Morel2007(chlorophyll))
    oceanic = ("I", "IA", "IB", "II", "III")
    return min(oceanic, key=lambda t: abs(math.log(Water.jerlov(t).Kd([490.0])[0] / Kd)))


def water_Gutierrez2008(constituents: Constituents) -> Water:
    """Return the water as the paper's equations print it, errors included.

    Smith & Baker's a_w for its Table 1; b_w taken for β_w(90°), thus 16.06
    times too high. The printed a*(λ) of one phytoplankton species is
    replaced by Bricaud et al. (1998), its detritus scattering left out.
    """
    nm = _WAVELENGTHS
    parts = constituents.absorptions(nm)
    parts["water"] = pure_water_absorption(nm, "smith_baker_1981")
    b = 16.06 * molecular_scattering(nm, "smith_baker_1981_sea") + particle_scattering(
        constituents.chlorophyll, nm
    )
    name = f"{constituents.described()} as printed in Gutierrez et al. 2008"
    return Water(
        Spectrum(nm, np.sum(list(parts.values()), axis=0), f"a of {name}"),
        Spectrum(nm, b, f"b of {name}"),
        None,
        name,
        "Gutierrez et al., Comput. Graph. Forum 27, 547 (2008)",
        ("printed form, for comparison only: scattering of water is 16 times too high",),
    )


def isotropic_Gutierrez2008(s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Isotropic phase function as printed, 1/π; it integrates to 4."""
    del m
    return 0.0 * s2 + 1.0 / math.pi


def henyey_greenstein_Gutierrez2008(g: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Henyey-Greenstein as printed, without 1/(4π); it integrates to 4π."""
    return 4.0 * math.pi * henyey_greenstein(g, s2, m)


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
