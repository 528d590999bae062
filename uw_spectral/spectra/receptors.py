"""Sensors of any number of channels: eyes of animals, multispectral cameras."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent
from ..errors import InputError, unknown_name
from .bands import Bands
from .colour_rendering import warn_coverage
from .spectral_table import checked_spectral_table
from .spectrum import Spectrum, read_table

RECEPTORS_CONTENT = "a CSV table of wavelength_nm and one column per receptor"
"""What a file of receptors holds, in words."""

_MOST = 64
# What the channels of an EXR may be called; a point would begin a layer's.
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_ -]{0,30}")
_DISPLAYED = "RGB"


@dataclass(frozen=True, eq=False)
class Receptors(ComparedByContent):
    """Sensitivities of k channels, none of which is a colour by itself.

    Raises
    ------
    InputError
        If there are none or more than 64, a name is none that an EXR takes, or a channel is zero
        throughout.
    """

    name: str
    channels: tuple[str, ...]
    sensitivity: Spectrum  #: A column per channel.

    def __post_init__(self) -> None:
        if not 1 <= len(self.channels) <= _MOST:
            raise InputError(
                f"receptors {self.name}: {len(self.channels)} columns; give 1 to {_MOST}"
            )
        for channel, values in zip(self.channels, self.sensitivity.values.T, strict=True):
            if not _NAME.fullmatch(channel):
                raise InputError(
                    f"receptors {self.name}: column {channel!r}: name it with letters, digits, - "
                    "or _, at most 31"
                )
            if not values.any():
                raise InputError(
                    f"receptors {self.name}: {channel} is zero at every wavelength; correct it or "
                    "leave it out"
                )

    def response_in(self, bands: Bands) -> NDArray[np.float64]:
        """Sensitivity times band width, shape (k, n): responses per unit radiance of each band.

        Raises
        ------
        InputError
            If the bands hold nothing that a channel sees.
        """
        response = self.sensitivity.at_or_zero(bands.centres).T * bands.widths
        blind = ~response.any(axis=1)
        if blind.any():
            raise InputError(
                f"receptors {self.name}: {self.channels[int(np.argmax(blind))]} sees nothing of "
                f"the bands, {bands.centres[0]:g} to {bands.centres[-1]:g} nm; widen --range, or "
                "take more --bands"
            )
        return response

    def warn_doubts(self, bands: Bands) -> None:
        """Warn about sensitivity outside the bands and bands outside the sensitivity."""
        warn_coverage(self.name, self.sensitivity, bands)


def parse_receptors(text: str) -> Receptors:
    """Read receptors from ``"file:PATH"``, a CSV of ``wavelength_nm`` and a column for each.

    Raises
    ------
    InputError
        If the text names no file, or the file cannot be used; the message says where.
    """
    scheme, _, location = text.partition(":")
    if scheme != "file" or not location:
        raise InputError(f"receptors {text!r}: give file:PATH, {RECEPTORS_CONTENT}")
    path = Path(location)
    columns = dict(checked_spectral_table(read_table(path), str(path)).columns)
    wavelengths = columns.pop("wavelength_nm")
    if not columns:
        raise InputError(f"receptors {path} has no column beside wavelength_nm; add one for each")
    values = np.stack(list(columns.values()), axis=1)
    sensitivity = Spectrum(wavelengths, values, f"sensitivity of {path.stem}")
    return Receptors(path.stem, tuple(columns), sensitivity)


@dataclass(frozen=True)
class FalseColour:
    """Which receptors a picture shows as red, green and blue; several are averaged."""

    shown: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]

    @property
    def legend(self) -> dict[str, str]:
        """What each displayed colour stands for.

        Examples
        --------
        >>> FalseColour((("nir",), ("a", "b"), ("uv",))).legend
        {'R': 'nir', 'G': 'a+b', 'B': 'uv'}
        """
        return dict(zip(_DISPLAYED, map("+".join, self.shown), strict=True))

    def matrix(self, receptors: Receptors, white: ArrayLike) -> NDArray[np.float64]:
        """Matrix from responses to linear Rec.709 that shows a response ``white`` as white.

        Shapes (k,) to (3, k).
        """
        chosen = np.array([[name in names for name in receptors.channels] for names in self.shown])
        return chosen / chosen.sum(axis=1, keepdims=True) / np.asarray(white, np.float64)


def parse_false_colour(text: str, receptors: Receptors) -> FalseColour:
    """Read which receptors are shown as red, green and blue, as ``"nir,a+b,uv"``.

    An empty text shows the third of longest mean wavelength as red, the middle one as green.

    Raises
    ------
    InputError
        If there are not three, or a receptor is unknown.
    """
    if not text.strip():
        table = receptors.sensitivity
        mean = table.wavelengths @ table.values / table.values.sum(axis=0)
        order = [receptors.channels[i] for i in np.argsort(-mean, kind="stable")]
        thirds = [tuple(map(str, part)) for part in np.array_split(order, 3)]
        red, green, blue = (part or (order[-1],) for part in thirds)
        return FalseColour((red, green, blue))
    shown = [tuple(name.strip() for name in part.split("+")) for part in text.split(",")]
    if len(shown) != len(_DISPLAYED):
        raise InputError(
            f"false colour {text!r}: name what is shown as red, green and blue, as NIR,GREEN,UV; + "
            "averages several"
        )
    known = {name.lower(): name for name in receptors.channels}
    for name in (name for names in shown for name in names):
        if name.lower() not in known:
            raise unknown_name(f"receptor of {receptors.name}", name, receptors.channels)
    red, green, blue = (tuple(known[name.lower()] for name in names) for names in shown)
    return FalseColour((red, green, blue))
