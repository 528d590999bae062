"""What a diver or photographer reads off a water, all of it together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..spectra.spectrum import Spectrum
from .band_error import ColourError, colour_error
from .viewpoint import Viewpoint
from .visibility import euphotic_depth, horizontal_visibility, transmitted_light
from .water_colour import DominantColour, dominant_colour, water_swatch


@dataclass(frozen=True, eq=False)
class Readouts:
    """Everything a panel shows about one water."""

    visibility: float  #: Level sighting range of a black target at 2 % contrast, m.
    euphotic_depth: float  #: Depth of 1 % of PAR, m.
    colour: DominantColour  #: Of the open water.
    swatch: NDArray[np.float64]  #: sRGB of the open water through the camera, (3,).
    #: Fraction of the light that reaches the camera's depth, per reference band.
    transmitted_light: Spectrum
    colour_error: ColourError  #: Of the chosen bands.


def readouts(view: Viewpoint, reference: Viewpoint) -> Readouts:
    """All read-outs of a water.

    The reference has :data:`.description.REFERENCE_BANDS`; all but the colour error is read from
    it.

    Raises
    ------
    InputError
        If no light is left at the camera's depth.
    """
    return Readouts(
        horizontal_visibility(reference),
        euphotic_depth(reference.column, reference.phase),
        dominant_colour(reference),
        water_swatch(reference),
        Spectrum(
            reference.column.bands.centres, transmitted_light(reference), "light left at depth"
        ),
        colour_error(view, reference),
    )
