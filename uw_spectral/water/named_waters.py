"""Waters with names: measured constituents of seas and lakes."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from ..errors import unknown_name
from .bio_optics import Constituents, parse_constituents
from .optical_properties import Water


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
            Constituents(2.0, cdom=0.15, minerals=0.51, detritus=0.05, cdom_slope=0.0176),
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
