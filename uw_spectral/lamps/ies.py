"""Photometric files of lamps: IES LM-63."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError, printable
from ..spectra.spectrum import read_text
from .profile import TableProfile

_C, _B, _A = 1, 2, 3  # photometric types
_TILT = re.compile(r"\s*TILT\s*=", re.IGNORECASE)
_HEADER = (
    "number of lamps", "lumens per lamp", "candela multiplier", "number of vertical angles",
    "number of horizontal angles", "photometric type", "unit", "width", "length", "height",
    "ballast factor", "ballast-lamp photometric factor", "input watts",
)  # fmt: skip
_MOST_ANGLES = 3600
_TURNS = ((0.0, 90.0), (0.0, 180.0), (90.0, 270.0), (0.0, 360.0))
"""First and last horizontal angle of type C: a quadrant, either half, and no symmetry."""
_SIDE = 90.0  # degrees, where types A and B end at most
_GAP = 1.5  # of a step, that planes without the last, 360°, may be apart across it
_FINEST, _AZIMUTHS = 0.25, 72  # degrees and number, of A and B as type C
_DARK = 0.01  # degrees, within which a lamp that shines back alone begins
_GENERATION = re.compile(
    r"LM-63-(20)?19\b"
)  # edition in which "file generation type" took the factor's place
_GENERATIONS = (1.0, 1.2)  # of the file generation type


@dataclass(frozen=True, eq=False)
class Photometry(ComparedByContent):
    """Luminous intensity of a lamp by direction; nadir, 0°, is its axis."""

    name: str
    vertical: NDArray[np.float64]  #: Angle from the axis, degrees, 0 to at most 180, (v,).
    #: Azimuth about it, degrees; the range tells the symmetry, (h,).
    horizontal: NDArray[np.float64]
    candela: NDArray[np.float64]  #: cd, with multiplier and ballast factors, (h, v).

    @property
    def mean_candela(self) -> NDArray[np.float64]:
        """Mean over the azimuth, cd, shape (v,)."""
        if len(self.horizontal) == 1:
            return self.candela[0]
        turn = self.horizontal[-1] - self.horizontal[0]
        return np.trapezoid(self.candela, self.horizontal, axis=0) / turn

    def profile(self, points: int | None = None) -> TableProfile:
        """Profile of the mean over the azimuth, at most so many points; 1 at its highest."""
        return TableProfile.of_angles(self.vertical, self.mean_candela, points, self.name)

    @property
    def lumens(self) -> float:
        """Luminous flux of the whole lamp, lm, by its candela."""
        return float(self.mean_candela.max()) * self.profile().solid_angle

    @property
    def asymmetry(self) -> float:
        """Largest deviation from the mean over the azimuth, over the highest mean."""
        mean = self.mean_candela
        return float(np.abs(self.candela - mean).max() / mean.max())


def read_ies(path: str | Path) -> Photometry:
    """Read an IES LM-63 file (1986 to 2019), as the lamp shines when it is not tilted.

    Raises
    ------
    InputError
        If the file cannot be read, ends early or late, holds what is not a number, or its angles
        and candela cannot be true.
    """
    return parse_ies(read_text(path, "photometric file ", "save it as text"), str(path))


@functools.lru_cache(maxsize=32)
def parse_ies(text: str, place: str = "photometric file") -> Photometry:
    """Read the text of an IES LM-63 file.

    Types A and B, about a vertical and a horizontal pole, are turned into C about the beam (0, 0).
    """
    lines = text.splitlines()
    at = next((i for i, line in enumerate(lines) if _TILT.match(line)), None)
    if at is None:
        raise InputError(f"{place} has no line TILT=; it is no IES LM-63 file; export it as one")
    numbers = _Numbers(place, lines[at + 1 :], at + 2)
    # Tilt, here or in a file, is output against the lamp's position: the candela are for none.
    if lines[at].partition("=")[2].strip().upper() == "INCLUDE":
        numbers.take(1, "orientation of the tilt")
        name = "number of tilt angles"
        count = _as_count(numbers.take(1, name)[0], name, place)
        numbers.take(2 * count, "tilt factors")
    head: dict[str, float] = dict(zip(_HEADER, numbers.take(len(_HEADER), "header"), strict=True))
    kind = head["photometric type"]
    if kind not in (_C, _B, _A):
        raise InputError(
            f"{place}: the photometric type is {kind:g}; it is 1 (C), 2 (B) or 3 (A); correct it"
        )
    counts = []
    for name in ("number of vertical angles", "number of horizontal angles"):
        counts.append(_as_count(head[name], name, place))
    vertical = numbers.take(counts[0], "vertical angles")
    horizontal = numbers.take(counts[1], "horizontal angles")
    candela = numbers.take(counts[0] * counts[1], "candela").reshape(counts[1], counts[0])
    numbers.end()
    candela = candela * _factor(head, lines[0], place)
    if candela.min() < 0 or not candela.max() > 0:
        raise InputError(
            f"{place}: candela, by their multiplier and ballast factors, must not be negative, nor "
            "all zero; correct them"
        )
    for name, angles in (("vertical", vertical), ("horizontal", horizontal)):
        if np.any(np.diff(angles) <= 0):
            raise InputError(f"{place}: the {name} angles do not increase; sort them")
    about_nadir = _of_type_c if kind == _C else functools.partial(_about_beam, kind == _B)
    return Photometry(place, *map(constant, about_nadir(vertical, horizontal, candela, place)))


def _factor(head: Mapping[str, float], first_line: str, place: str) -> float:
    """What the candela of a file are multiplied by."""
    factor = head["candela multiplier"] * head["ballast factor"]
    of_lamp = head["ballast-lamp photometric factor"]
    if not _GENERATION.search(first_line):
        return factor * of_lamp
    least, most = _GENERATIONS
    if not least <= of_lamp < most:
        raise InputError(
            f"{place}: the file generation type of LM-63-2019 is {of_lamp:g}; it is {least:g} to "
            f"{most:g}: give it, or name the edition whose ballast-lamp factor this is"
        )
    return factor


class _Numbers:
    """The numbers of a file in order, each with the line it stands in."""

    def __init__(self, place: str, lines: list[str], first: int) -> None:
        self._place = place
        self._cells = [
            (number, cell)
            for number, line in enumerate(lines, start=first)
            for cell in line.replace(",", " ").split()
        ]

    def take(self, count: int, what: str) -> NDArray[np.float64]:
        """Return the next ones."""
        cells, self._cells = self._cells[:count], self._cells[count:]
        if len(cells) < count:
            raise InputError(
                f"{self._place} ends after {len(cells)} of {count} numbers of its {what}; "
                "the file is cut short; get it again"
            )
        values = np.empty(count)
        for index, (line, cell) in enumerate(cells):
            try:
                values[index] = float(cell)
            except ValueError:
                values[index] = math.nan
            if not math.isfinite(values[index]):
                raise InputError(
                    f"{self._place}, line {line}: {printable(cell, 40)!r} of its {what} is not a "
                    "finite number; correct it"
                )
        return values

    def end(self) -> None:
        """Refuse numbers that no count of the header stands for."""
        line, cell = self._cells[0] if self._cells else (0, "")
        if re.fullmatch(r"[-+.\d]+(e[-+]?\d+)?", cell, re.IGNORECASE):
            raise InputError(
                f"{self._place}, line {line}: {printable(cell, 40)!r} follows the last candela; "
                "correct the numbers of angles; decimals have a point"
            )


def _as_count(value: float, what: str, place: str) -> int:
    if value != int(value) or not 1 <= value <= _MOST_ANGLES:
        raise InputError(
            f"{place}: the {what} must be 1 to {_MOST_ANGLES}, got {value:g}; correct the header"
        )
    return int(value)


def _of_type_c(
    vertical: NDArray, horizontal: NDArray, candela: NDArray, place: str
) -> tuple[NDArray, NDArray, NDArray]:
    """Check the planes of type C, and fill up what they leave out."""
    if vertical[0] == _TURNS[0][1]:
        # All light goes back: none before it.
        vertical = np.concatenate([[0.0, vertical[0] - _DARK], vertical])
        candela = np.pad(candela, ((0, 0), (2, 0)))
    if vertical[0] != 0 or vertical[-1] > _TURNS[1][1]:
        raise InputError(
            f"{place}: vertical angles from {vertical[0]:g} to {vertical[-1]:g}°; type C has 0 to "
            "90 or 180, or 90 to 180; correct them"
        )
    if len(horizontal) == 1:
        return vertical, horizontal, candela
    ends = horizontal[0], horizontal[-1]
    around = _TURNS[-1][1]
    if ends[0] == 0 and 0 < around - ends[1] <= _GAP * np.diff(horizontal).max():
        horizontal, candela = np.append(horizontal, around), np.vstack([candela, candela[:1]])
    elif not any(np.allclose(ends, turn) for turn in _TURNS):
        raise InputError(
            f"{place}: horizontal angles from {ends[0]:g} to {ends[1]:g}°; type C has 0 alone, 0 "
            "to 90, 180 or 360, or 90 to 270; correct them"
        )
    return vertical, horizontal, candela


def _about_beam(
    level: bool, vertical: NDArray, horizontal: NDArray, candela: NDArray, place: str
) -> tuple[NDArray, NDArray, NDArray]:
    """Turn type B, whose pole is level, or A, whose pole is upright, into C about the beam.

    IES LM-75, *Goniophotometer types and photometric coordinates*.
    """
    for name, angles in (("vertical", vertical), ("horizontal", horizontal)):
        first, last = angles[0], angles[-1]
        if len(angles) < 2 or first not in (0.0, -last) or not 0 < last <= _SIDE:
            raise InputError(
                f"{place}: {name} angles from {first:g} to {last:g}°; types A and B have -90 to "
                "90, or 0 to 90; correct them"
            )
    step = max(min(np.diff(vertical).min(), np.diff(horizontal).min()), _FINEST)
    theta = np.linspace(0.0, _SIDE, math.ceil(_SIDE / step) + 1)
    azimuth = np.linspace(*_TURNS[-1], _AZIMUTHS + 1)
    sine, turn = np.sin(np.radians(theta)), np.radians(azimuth)[:, None]
    across, up = sine * np.cos(turn), sine * np.sin(turn)
    ahead = np.broadcast_to(np.cos(np.radians(theta)), up.shape)
    along, over = (across, up) if level else (up, across)
    by_pole = np.degrees(np.arcsin(np.clip(along, -1.0, 1.0)))
    about_pole = np.degrees(np.arctan2(over, ahead))
    h, v = (by_pole, about_pole) if level else (about_pole, by_pole)
    return theta, azimuth, _looked_up(candela, (horizontal, h), (vertical, v))


def _looked_up(
    values: NDArray, one: tuple[NDArray, NDArray], other: tuple[NDArray, NDArray]
) -> NDArray:
    """Interpolate linearly in both angles; mirrored where these begin at 0, and 0 outside."""
    (i, x, inside), (j, y, within) = _cell(*one), _cell(*other)
    low, high = ((1 - y) * values[k, j] + y * values[k, j + 1] for k in (i, i + 1))
    return ((1 - x) * low + x * high) * (inside & within)


def _cell(known: NDArray, wanted: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Return number of the step, fraction of it, and whether the angle is among the known ones."""
    at = np.abs(wanted) if known[0] == 0 else wanted
    place = np.interp(at, known, np.arange(len(known)))
    step = np.minimum(place.astype(int), len(known) - 2)
    return step, place - step, (at >= known[0] - _DARK) & (at <= known[-1] + _DARK)
