"""Light of foam on the surface: a matte layer, seen from the air and from the water.

Sun and sky light it from above. It throws its reflectance back to all sides, and what fresh foam
does not throw back it lets through to all sides; that it absorbs in the red what it reflects
less there is left out of what comes through.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..surface.whitecaps import FRESH_REFLECTANCE, foam_reflectance
from .above_water import light_in_air
from .water_column import WaterColumn


@dataclass(frozen=True, eq=False)
class FoamLight:
    """Radiance of fresh foam; arrays of shape (n,)."""

    sun: NDArray[np.float64]  #: Seen from the air, by the sun straight onto it.
    sky: NDArray[np.float64]  #: Seen from the air, by the sky.
    below: NDArray[np.float64]  #: Just below it, by both.


@dataclass(frozen=True)
class FoamAhead:
    """Foam on the surface where a ray from below meets it."""

    fraction: Operand  #: Of the surface.
    radiance: Operand  #: Channels: just below fresh foam.


def foam_light(column: WaterColumn) -> FoamLight:
    """Return the light of fresh foam on the water of a column.

    Examples
    --------
    >>> from ..spectra.bands import Bands
    >>> column = WaterColumn(Bands.uniform(1), 0.05, 0.1, 0.9788, 1.0, (0, 0, -1), 0.1,
    ...                      math.inf, 0.0, "flat", 1.34)
    >>> light = foam_light(column)
    >>> light.sun.round(3), light.sky.round(3), light.below.round(3)
    (array([0.175]), array([0.055]), array([0.188]))
    """
    light, high = light_in_air(column), max(-float(column.skylight.sun[2]), 0.0)
    matte = foam_reflectance(column.bands.centres) / math.pi
    through = (1.0 - FRESH_REFLECTANCE) / math.pi
    return FoamLight(matte * light.sun, matte * light.sky, through * (high * light.sun + light.sky))


def foam_from_above(
    sun: Operand,
    sky: Operand,
    normal: Sequence[Operand],
    sunlight: Sequence[Operand],
    m: Mathematics = NUMPY,
) -> Operand:
    """Radiance of fresh foam seen from the air, from those of :class:`FoamLight`.

    ``normal`` is the surface's, upwards; ``sunlight`` the unit direction of sunlight in air.
    """
    return sun * m.maximum(-dot(normal, sunlight), 0.0) + sky
