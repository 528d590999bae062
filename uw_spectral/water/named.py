"""Waters by the names that options and settings use, those of seas and lakes among them."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

from ..errors import InputError, unknown_name
from .bio_optics import Constituents, parse_constituents
from .kd_inversion import water_of_chlorophyll
from .measured import read_water
from .optical_properties import DEFAULT_SOURCE, JERLOV_SOURCES, Water
from .profile import DepthProfile, WaterProfile


def list_waters() -> dict[str, tuple[str, ...]]:
    """Return the waters that :func:`parse_water` knows, by source."""
    import jerlov

    published = {
        source: tuple(f"jerlov:{name}" for name in jerlov.get_source(source).water_types)
        for source in JERLOV_SOURCES
    }
    return {**published, "constituents": tuple(f"case:{name}" for name in named_waters())}


def parse_water(text: str, source: str = DEFAULT_SOURCE) -> Water | WaterProfile:
    """Return the water that an option names, in layers if a file gives it over depth.

    As ``"jerlov:IB"``; ``"bio:chl=1,cdom=0.1"``, constituents as :func:`.parse_constituents` reads
    them; ``"chl:3"``, mg/m³, see :func:`.water_of_chlorophyll`; ``"case:baltic"``, one of
    :func:`named_waters`; or a file, as :func:`.read_water` reads it: ``"file:water.csv"``,
    ``"file:profile.csv"``, ``"file:station.sb"``.

    Raises
    ------
    InputError
        If the text has another form, or its water cannot be had.
    """
    scheme, _, rest = text.partition(":")
    if scheme == "jerlov" and rest:
        return _jerlov(rest, source)
    if scheme == "bio":
        return parse_constituents(rest).water()
    if scheme == "chl":
        return water_of_chlorophyll(_amount(text, rest))
    if scheme == "case" and rest:
        name, sea = _named(rest)
        return sea.constituents.water(name, sea.source)
    if scheme == "file" and rest:
        return read_water(rest)
    raise InputError(
        f"water {text!r} is not understood; write jerlov:IB, bio:chl=1,cdom=0.1, chl:3, "
        "case:baltic or file:water.csv"
    )


def parse_uniform_water(text: str, source: str = DEFAULT_SOURCE) -> Water:
    """Return the water that an option names, which must be the same at every depth.

    Raises
    ------
    InputError
        Also if it is a profile.
    """
    water = parse_water(text, source)
    if isinstance(water, DepthProfile):
        raise InputError(f"water {text!r} differs with depth; give one that does not here")
    return water


def _amount(text: str, number: str) -> float:
    try:
        return float(number)
    except ValueError:
        raise InputError(
            f"water {text!r} is not understood; write the chlorophyll in mg/m³, as chl:3"
        ) from None


@functools.lru_cache(maxsize=32)
def _jerlov(water_type: str, source: str) -> Water:
    return Water.jerlov(water_type, source)


def constituents_of(water: str) -> Constituents | None:
    """Return the constituents of a water as :func:`parse_water` spells it, if it has any.

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


def _named(name: str) -> tuple[str, NamedWater]:
    known = named_waters()
    key = name.strip().lower().replace(" ", "-").replace("_", "-")
    if key not in known:
        raise unknown_name("sea", name, known)
    return key, known[key]
