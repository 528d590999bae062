"""Words that settings know, where any may be written: for suggestions, with what each means."""

from __future__ import annotations

import functools
from collections.abc import Callable

JERLOV_TEXTS = {
    "I": "Clearest ocean",
    "IA": "Very clear ocean",
    "IB": "Clear ocean, tropical reefs",
    "II": "Ocean off the coasts, upwelling",
    "III": "Productive ocean",
    "1C": "Clearest coast",
    "3C": "Coast, as the North Sea",
    "5C": "Turbid coast",
    "7C": "Estuary, harbour",
    "9C": "Most turbid coast",
}
_ILLUMINANTS = {
    "d65": "Average daylight, all of it from the sun",
    "clear-sky": "Sun and blue sky, by the height of the sun",
    "astm-g173": "Standard solar spectrum",
    "equal-energy": "The same at every wavelength",
}
_SKY_PICTURES = {"world": "The scene's own world: its picture, sky texture or colours"}
_EMISSIONS = {
    "led": "Cold white LED",
    "led-warm": "Warm white LED",
    "led:450,20": "LED of one colour by its peak and width in nm; blue ones make corals glow",
    "halogen": "Halogen lamp",
    "hid": "Metal halide lamp",
    "blackbody:5600": "Black body of a temperature in K",
}
LAMP_SPECTRA = {
    "LED-B1": "LED, phosphor, 2731 K",
    "LED-B2": "LED, phosphor, 3003 K",
    "LED-B3": "LED, phosphor, 4112 K",
    "LED-B4": "LED, phosphor, 5111 K",
    "LED-B5": "LED, phosphor, 6597 K",
    "LED-BH1": "LED, phosphor and red, 2853 K",
    "LED-RGB1": "LED, red, green and blue, 2842 K",
    "LED-V1": "LED, violet, 2721 K",
    "LED-V2": "LED, violet, 4077 K",
    "A": "Halogen, 2856 K",
    "ISO 7589 Studio Tungsten": "Studio tungsten",
    "ISO 7589 Photoflood": "Photoflood",
    "MHC100/U/MP/3K": "Metal halide, 3000 K",
    "MHC100/U/MP/4K": "Metal halide, 4000 K",
    "HP1": "Sodium, high pressure",
    "HP4": "Metal halide, high pressure",
    "Kinoton 75P": "Xenon, of a cinema projector",
    "Mercury": "Mercury",
    "FL2": "Fluorescent, cool white",
    "FL11": "Fluorescent, narrow bands",
}
"""Measured spectra of lamps by the names that :func:`.parse_emission` takes, and what they are."""
_HOUSINGS = {
    "none": "No port: what the lens sees in water is what it sees in air",
    "flat": "A plane window: magnifies by 1.34, with colour fringes at the edges",
    "dome": "A spherical shell: keeps the field of view",
}
_FILTERS = {
    "none": "Nothing before the camera",
    "long-pass:480,15": "Pale yellow: with royal blue lamps, for cyan to red",
    "long-pass:500,15": "Yellow: with blue lamps, for green to red",
    "long-pass:520,15": "Deep yellow",
    "long-pass:600,15": "Red: for chlorophyll",
}
_PHASES = {
    "mixture": "Molecules and sea particles by their fraction in each band",
    "petzold": "Measured average particles, the same in all bands",
    "fournier-forand:1.10,0.0183": "Particles by refractive index and backscattered fraction",
    "hg:0.924": "Henyey-Greenstein",
    "tthg:0.95,-0.3,0.95": "Two-term Henyey-Greenstein",
    "rayleigh": "Molecules of a gas",
    "einstein-smoluchowski": "Molecules of sea water",
    "isotropic": "To all sides alike",
}


@functools.cache
def known_words(kind: str) -> tuple[tuple[str, str], ...]:
    """Return words and what they mean.

    ``kind`` is ``waters``, ``sensors``, ``filters``, ``illuminants``, ``phases``, ``housings``,
    ``sky_pictures``, ``emissions`` (of lamps) or ``fluorophores`` (of materials).

    Examples
    --------
    >>> dict(known_words("waters"))["jerlov:7C"]
    'Estuary, harbour'
    """
    if kind == "waters":
        return _waters()
    if kind == "emissions":
        return _emissions()
    if kind == "fluorophores":
        from ..uw_spectral.spectra.fluorophore import list_fluorophores

        return tuple(list_fluorophores().items())
    if kind == "sensors":
        from ..uw_spectral.spectra.sensor import FILM_NOTE, list_sensors

        found = [(name, "Eye") for name in list_sensors("observer")]
        found += [(name, "Camera") for name in list_sensors("camera")]
        return (*found, *((name, f"Film: {FILM_NOTE}") for name in list_sensors("film")))
    words = {
        "illuminants": _ILLUMINANTS, "phases": _PHASES, "housings": _HOUSINGS, "filters": _FILTERS,
        "sky_pictures": _SKY_PICTURES,
    }  # fmt: skip
    return tuple(words[kind].items())


def suggestions(kind: str) -> Callable[..., list[tuple[str, str]]]:
    """Return what suggests words of a kind (:func:`.known_words`) while a text is written.

    Those that hold what is written; all of them, where it is one of them.
    """

    # Blender takes nothing but a function.
    def search(_: object, __: object, written: str) -> list[tuple[str, str]]:
        words = known_words(kind)
        text = "" if any(word == written for word, _ in words) else written.lower()
        return [pair for pair in words if text in pair[0].lower()]

    return search


def _emissions() -> tuple[tuple[str, str], ...]:
    from ..uw_spectral.lamps.emission import list_emissions

    known = LAMP_SPECTRA | _EMISSIONS
    others = [(name, "Light source") for name in list_emissions() if name not in known]
    return (*_EMISSIONS.items(), *LAMP_SPECTRA.items(), *others)


def _waters() -> tuple[tuple[str, str], ...]:
    from ..uw_spectral.water.named import list_waters

    found = {f"jerlov:{name}": text for name, text in JERLOV_TEXTS.items()}
    found["constituents"] = "By chlorophyll, CDOM, minerals and detritus"
    for source, names in list_waters().items():
        found |= {name: source for name in names if name not in found}
    return tuple(found.items())
