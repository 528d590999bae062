"""Waters by the names that options and settings use."""

from __future__ import annotations

import functools

from ..errors import InputError
from .bio_optics import parse_constituents
from .kd_inversion import water_of_chlorophyll
from .measured import read_water
from .named_waters import named_water, named_waters
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

    Parameters
    ----------
    text : str
        ``"jerlov:IB"``; ``"bio:chl=1,cdom=0.1"``, constituents as
        :func:`.parse_constituents` reads them; ``"chl:3"``, mg/m³, see
        :func:`.water_of_chlorophyll`; ``"case:baltic"``, one of
        :func:`.named_waters`; or a file, as :func:`.read_water` reads it:
        ``"file:water.csv"``, ``"file:profile.csv"``, ``"file:station.sb"``.

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
        return named_water(rest)
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
