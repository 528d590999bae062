"""Where light of a lamp that was scattered already is scattered once more: a table to look up.

The source S of :mod:`.lamp_harmonics`, over the distance from the lamp, the angle from its axis and
the direction towards the camera. The logarithm is tabulated, without what absorption takes
up to there, times r.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..table import Axis, Lookup, Scale, Table, angular
from .lamp_harmonics import AROUND, Harmonics, lamp_distances, on_sphere
from .profile import LampProfile

Array = NDArray[np.float64]

AZIMUTHS, TURNS, BENDS = 8, 32, 48
"""Of the table: azimuths about the radius between the lamp's axis and the way of the light, angles
of the radius from the axis, and of that way from the radius."""
_DARKEST = 1e-9
BEYOND_ROWS = 5.0
"""Times the last row, up to which the table goes on as it ends."""
_NONE = 1e-30
_SMALLEST = 1e-12


AZIMUTH, TURNED, BENT = (
    Scale(count, 1.0, -1.0, angular(power))
    for count, power in ((AZIMUTHS, 1.5), (TURNS, 1.5), (BENDS, 2.5))
)
"""Where their cosines lie, which are the finer the smaller the angles."""


def source_axes(scale: Operand) -> tuple[Axis, ...]:
    """Return the axes of the table, as of :func:`.lamp_distances`."""
    angles = AZIMUTH.axis("azimuth"), TURNED.axis("turned"), BENT.axis("bent")
    return lamp_distances(scale, BEYOND_ROWS).axis("distance"), *angles


def source_seen(
    source: Lookup,
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
    return m.exp(source.at(distance=r, azimuth=azimuth, turned=turned, bent=bent))


@functools.lru_cache(maxsize=16)
def source_table(solved: Harmonics, profile: LampProfile) -> Table:
    """Tabulate the source of a lamp of an intensity of 1."""
    by_turn = solved.around(profile, TURNED.values()) * solved.scattering
    found = in_directions(by_turn)
    r = solved.distances[:, None, None, None, None]
    return tabulated(found * r * np.exp(solved.a * r), solved.scale)


def in_directions(by_turn: Array) -> Array:
    """Values by azimuth, turn and bend, shape (ROWS, AZIMUTHS, TURNS, BENDS, n).

    Of coefficients as of :func:`.round_axis`, of the turns of the table.
    """
    of_bend = on_sphere(np.cos(BENT.values()), by_turn.shape[3] - 1)
    orders = np.arange(AROUND)[:, None]
    around = np.where(orders > 0, 2.0, 1.0) * np.cos(orders * AZIMUTH.values())
    by_bend = np.einsum("rtmln,mlk->mrtkn", by_turn, of_bend, optimize=True)
    return np.einsum("mrtkn,mz->rztkn", by_bend, around, optimize=True)


def tabulated(found: Array, scale: float) -> Table:
    """Tabulate the logarithm of such values."""
    least = _DARKEST * found.max(axis=(1, 2, 3), keepdims=True)
    values = np.log(np.maximum(found, np.maximum(least, _NONE)))
    # It goes on beyond the last row as it ends, where noise may rise.
    values[-1] = np.minimum(values[-1], values[-2])
    return Table(values, source_axes(scale))
