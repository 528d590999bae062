"""What a diver or photographer reads off a water, with the error of colour that few bands make."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.colour_rendering import delta_e_CIE2000_images
from ..spectra.reflectance import colorchecker_reflectance
from ..spectra.spectrum import Spectrum
from .viewpoint import Viewpoint
from .visibility import euphotic_depth, horizontal_visibility, transmitted_light
from .water_colour import DominantColour, dominant_colour, water_swatch

PATCHES = ("white 9.5 (.05 D)", "dark skin", "foliage", "orange", "red", "yellow")
"""ColorChecker patches that the colour error looks at."""


@dataclass(frozen=True)
class ColourError:
    """ΔE2000 of few bands against many: each colour, by name, and their mean and maximum."""

    by_colour: dict[str, float]

    @property
    def mean(self) -> float:
        """Mean over the colours."""
        return float(np.mean(list(self.by_colour.values())))

    @property
    def maximum(self) -> float:
        """Largest of the colours."""
        return max(self.by_colour.values())


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


def colour_error(view: Viewpoint, reference: Viewpoint, distance: float = 2.0) -> ColourError:
    """Colour error of a choice of bands in this water, for this camera and depth.

    ΔE2000 of the open water, looking level, and of the ColorChecker :data:`PATCHES` at a distance
    before it, each developed as the renderer would, automatic exposure included. The reference is
    the same with many bands, :data:`.description.REFERENCE_BANDS` or so.

    Raises
    ------
    InputError
        If the depths differ, or a sensor sees no light at that depth.
    """
    if view.depth != reference.depth:
        raise InputError(
            f"colour error: the depths differ, {view.depth:g} and {reference.depth:g} m"
        )
    if not distance > 0:
        raise InputError(f"colour error: the distance must be positive, got {distance:g} m")
    errors = delta_e_CIE2000_images(
        _developed_colours(view, distance), _developed_colours(reference, distance)
    )
    return ColourError(dict(zip(("water", *PATCHES), errors.tolist(), strict=True)))


def _developed_colours(view: Viewpoint, distance: float) -> NDArray[np.float64]:
    """Scene-linear colours of the open water and of the patches before it."""
    patches = _patch_reflectances(view.column.bands) * view.light / math.pi
    seen = view.seen_level(patches, distance)
    return view.reduction.apply(np.vstack([view.background, seen]))


@functools.lru_cache(maxsize=8)
def _patch_reflectances(bands: Bands) -> NDArray[np.float64]:
    spectra = [colorchecker_reflectance(patch) for patch in PATCHES]
    return np.stack([s.at(np.clip(bands.centres, *s.range)) for s in spectra])
