"""Where light of a lamp that was scattered already is scattered once more: a table to look up.

The source S of :mod:`.lamp_harmonics`, over the distance from the lamp, the angle from its axis and
the direction towards the camera. The logarithm is tabulated, without what absorption takes
up to there, times r.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..look_up import multilinear_of_columns
from ..mathematics import NUMPY, Mathematics, Operand
from .lamp_harmonics import (
    AROUND,
    FARTHEST,
    NEAREST,
    ROWS,
    Harmonics,
    on_sphere,
)
from .profile import LampProfile

Array = NDArray[np.float64]

AZIMUTHS, TURNS, BENDS = 8, 32, 48
"""Of the table: azimuths about the radius between the lamp's axis and the way of the light, angles
of the radius from the axis, and of that way from the radius."""
_TURN_POWER, _BEND_POWER, _AZIMUTH_POWER = 1.5, 2.5, 1.5
"""Angles are the finer the smaller."""
_DARKEST = 1e-9
_BEYOND = 5.0  # times the last row, up to which the table goes on as it ends
_NONE = 1e-30
_SMALLEST = 1e-12


def row_place(distance: Operand, scale: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of a distance in m among the rows, even in its logarithm; beyond the last one too.

    Examples
    --------
    >>> round(float(row_place(10.0, 1.0)), 9), float(row_place(0.001, 1.0))
    (23.0, 0.0)
    """
    held = m.clamp(distance * scale, NEAREST, _BEYOND * FARTHEST)
    steps = (ROWS - 1.0) / math.log(FARTHEST / NEAREST)
    return (m.log(held) - math.log(NEAREST)) * steps


def turn_place(cosine: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of the cosine of the angle from the axis.

    Examples
    --------
    >>> float(turn_place(1.0)), round(float(turn_place(-1.0)), 9)
    (0.0, 31.0)
    """
    return _place(cosine, TURNS, 1.0 / _TURN_POWER, m)


def turn_angles() -> Array:
    """Angles from the axis of the columns, rad."""
    return _angles(TURNS, _TURN_POWER)


def bend_place(cosine: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of the cosine of the deflection from the radius; see :func:`turn_place`."""
    return _place(cosine, BENDS, 1.0 / _BEND_POWER, m)


def azimuth_place(cosine: Operand, m: Mathematics = NUMPY) -> Operand:
    """Place of the cosine of the azimuth; see :func:`turn_place`."""
    return _place(cosine, AZIMUTHS, 1.0 / _AZIMUTH_POWER, m)


def _place(cosine: Operand, count: int, power: float, m: Mathematics) -> Operand:
    angle = m.arccos(m.clamp(cosine, -1.0, 1.0))
    return m.power(angle / math.pi, power) * (count - 1.0)


def _angles(count: int, power: float) -> Array:
    return np.asarray(math.pi * np.linspace(0.0, 1.0, count) ** power)


class Source(Protocol):
    """The source of light that was scattered already, round a lamp of an intensity of 1."""

    @property
    def scale(self) -> Operand:
        """Extinction that distances are scaled with, 1/m."""
        ...

    def at(self, row: Operand, azimuth: Operand, turn: Operand, bend: Operand) -> Operand:
        """Interpolate the table at places, linearly."""
        ...


def source_seen(
    source: Source,
    r: Operand,
    turned: Operand,
    bent: Operand,
    off_axis: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Radiance per metre that water adds towards a camera, absorption up to there apart, times r.

    Of the cosines ``turned`` is between the lamp's axis and the radius, ``bent`` between the radius
    and the light's way to the camera, ``off_axis`` between the axis and that way.
    """
    sines = (1.0 - turned * turned) * (1.0 - bent * bent)
    azimuth = (off_axis - turned * bent) / m.sqrt(m.maximum(sines, _SMALLEST))
    places = azimuth_place(azimuth, m), turn_place(turned, m), bend_place(bent, m)
    return m.exp(source.at(row_place(r, source.scale, m), *places))


@dataclass(frozen=True, eq=False)
class SourceTable:
    """A table of n bands, shape (ROWS, AZIMUTHS, TURNS, BENDS, n)."""

    values: Array
    scale: float

    def at(self, row: Operand, azimuth: Operand, turn: Operand, bend: Operand) -> Array:
        """Interpolate at places of shape (..., 1), or of no shape; shape (..., n)."""
        return multilinear_of_columns(self.values, (row, azimuth, turn, bend))


def source_table(solved: Harmonics, profile: LampProfile) -> SourceTable:
    """Tabulate the source of a lamp of an intensity of 1."""
    return _source(solved, profile)


@functools.lru_cache(maxsize=16)
def _source(solved: Harmonics, profile: LampProfile) -> SourceTable:
    of_bend = on_sphere(np.cos(_angles(BENDS, _BEND_POWER)), solved.degrees)
    orders = np.arange(AROUND)[:, None]
    around = np.where(orders > 0, 2.0, 1.0) * np.cos(orders * _angles(AZIMUTHS, _AZIMUTH_POWER))
    by_turn = solved.around(profile, turn_angles()) * solved.scattering
    by_bend = np.einsum("rtmln,mlk->mrtkn", by_turn, of_bend, optimize=True)
    found = np.einsum("mrtkn,mz->rztkn", by_bend, around, optimize=True)
    r = solved.distances[:, None, None, None, None]
    found *= r * np.exp(solved.a * r)
    least = _DARKEST * found.max(axis=(1, 2, 3), keepdims=True)
    values = np.log(np.maximum(found, np.maximum(least, _NONE)))
    # It goes on beyond the last row as it ends, where noise may rise.
    values[-1] = np.minimum(values[-1], values[-2])
    return SourceTable(values, solved.scale)
