"""Photometric files of lamps: IES LM-63, type C."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError, printable
from ..spectra.spectrum import read_text
from .profile import TableProfile

_TYPE_C = 1
_HEADER = (
    "number of lamps", "lumens per lamp", "candela multiplier", "number of vertical angles",
    "number of horizontal angles", "photometric type", "unit", "width", "length", "height",
    "ballast factor", "future use", "input watts",
)  # fmt: skip
_MOST_ANGLES = 3600
_TURNS = (0.0, 90.0, 180.0, 360.0)
"""Last horizontal angle: one plane for all, quadrant, half and no symmetry."""


@dataclass(frozen=True, eq=False)
class Photometry(ComparedByContent):
    """Luminous intensity of a lamp by direction; nadir, 0°, is its axis.

    Parameters
    ----------
    name : str
    vertical : array, shape (v,)
        Angle from the axis, degrees, 0 to at most 180.
    horizontal : array, shape (h,)
        Azimuth about it, degrees, from 0; the last tells the symmetry.
    candela : array, shape (h, v)
        cd, with multiplier and ballast factor.
    """

    name: str
    vertical: NDArray[np.float64]
    horizontal: NDArray[np.float64]
    candela: NDArray[np.float64]

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
    """Read an IES LM-63 file (1986 to 2019) of photometric type C, without tilt.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        If the file cannot be read, ends early, holds what is not a number, is of type A or
        B, is tilted by a file, or its angles and candela cannot be true.
    """
    return parse_ies(read_text(path, "photometric file ", "save it as text"), str(path))


@functools.lru_cache(maxsize=32)
def parse_ies(text: str, place: str = "photometric file") -> Photometry:
    """Read the text of an IES LM-63 file.

    Examples
    --------
    >>> lamp = parse_ies('''IESNA:LM-63-2002
    ... TILT=NONE
    ... 1 -1 1 3 1 1 2 0 0 0
    ... 1 1 50
    ... 0 45 90
    ... 0
    ... 100 50 0''')
    >>> round(lamp.lumens)
    249
    """
    lines = text.splitlines()
    at = next((i for i, line in enumerate(lines) if line.strip().upper().startswith("TILT")), None)
    if at is None:
        raise InputError(f"{place} has no line TILT=; it is no IES LM-63 file; export it as one")
    tilt = lines[at].partition("=")[2].strip()
    if tilt.upper() not in ("NONE", "INCLUDE"):
        raise InputError(
            f"{place}, line {at + 1}: TILT={printable(tilt)} names another file, which is not "
            "read; write TILT=NONE"
        )
    numbers = _Numbers(place, lines[at + 1 :], at + 2)
    if tilt.upper() == "INCLUDE":
        # Output against the lamp's position: the file's candela are for none.
        numbers.take(1, "orientation of the tilt")
        count = numbers.count("number of tilt angles")
        numbers.take(2 * count, "tilt factors")
    head = dict(zip(_HEADER, numbers.take(len(_HEADER), "header"), strict=True))
    kind = head["photometric type"]
    if kind != _TYPE_C:
        raise InputError(
            f"{place}: the photometry is of type {({2: 'B', 3: 'A'}).get(int(kind), f'{kind:g}')}; "
            "only type C (1) is read; convert the file"
        )
    counts = []
    for name in ("number of vertical angles", "number of horizontal angles"):
        counts.append(_as_count(head[name], name, place))
    vertical = numbers.take(counts[0], "vertical angles")
    horizontal = numbers.take(counts[1], "horizontal angles")
    factor = head["candela multiplier"] * head["ballast factor"]
    candela = numbers.take(counts[0] * counts[1], "candela").reshape(counts[1], counts[0]) * factor
    _check(vertical, horizontal, candela, place)
    return Photometry(place, constant(vertical), constant(horizontal), constant(candela))


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

    def count(self, what: str) -> int:
        """Return the next one as a count."""
        return _as_count(self.take(1, what)[0], what, self._place)


def _as_count(value: float, what: str, place: str) -> int:
    if value != int(value) or not 1 <= value <= _MOST_ANGLES:
        raise InputError(
            f"{place}: the {what} must be 1 to {_MOST_ANGLES}, got {value:g}; correct the header"
        )
    return int(value)


def _check(vertical: NDArray, horizontal: NDArray, candela: NDArray, place: str) -> None:
    if vertical[0] != 0:
        raise InputError(
            f"{place}: vertical angles from {vertical[0]:g}°: a lamp is read that shines along "
            "0°; turn it round in its own program"
        )
    for name, angles in (("vertical", vertical), ("horizontal", horizontal)):
        if np.any(np.diff(angles) <= 0):
            raise InputError(f"{place}: the {name} angles do not increase; sort them")
    if horizontal[0] != 0 or not np.any(np.isclose(horizontal[-1], _TURNS)):
        raise InputError(
            f"{place}: horizontal angles from {horizontal[0]:g} to {horizontal[-1]:g}°; type C "
            "has 0, or 0 to 90, 180 or 360"
        )
    if candela.min() < 0 or not candela.max() > 0:
        raise InputError(f"{place}: candela must not be negative, nor all zero; correct them")
