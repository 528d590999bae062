"""The colour of the open water: to the eye in words, and through the camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..spectra.colour_rendering import srgb_encode
from ..spectra.sensor import standard_observer
from ..transfer.discrete_ordinates import Emission
from ..transfer.water_column import FEW_STREAMS
from .viewpoint import Viewpoint

# Hues of the spectrum by the wavelength in nm where they end, as usually quoted from Bruno &
# Svoronos, CRC Handbook of Fundamental Spectroscopic Correlation Charts (2005); other accounts of
# it have no cyan and differ by up to 10 nm elsewhere. Names only: no number depends on them.
_HUES = {
    450.0: "violet",
    485.0: "blue",
    500.0: "cyan",
    565.0: "green",
    590.0: "yellow",
    625.0: "orange",
    math.inf: "red",
}
_SMALLEST_PURITY = 0.02


@dataclass(frozen=True)
class DominantColour:
    """Colour of a light against a white."""

    #: Dominant wavelength in nm; of the complementary colour, and negative, for purples; NaN for a
    #: light without colour.
    wavelength: float
    purity: float  #: Excitation purity, 0 (white) to 1 (spectral).
    name: str  #: Hue in words, ``"grey"`` without colour.


def dominant_colour(view: Viewpoint) -> DominantColour:
    """Colour of the open water to an eye adapted to the light above it (CIE 15, CIE 1931).

    Raises
    ------
    InputError
        If no light is left at that depth.
    """
    bands = view.column.bands
    observer, white = standard_observer().response_in(bands), view.illuminant.total_in(bands)
    return dominant_colour_of(observer @ view.background, observer @ white)


def dominant_colour_of(XYZ: ArrayLike, white: ArrayLike) -> DominantColour:
    """Dominant wavelength, excitation purity and hue of CIE 1931 tristimulus values.

    Raises
    ------
    InputError
        If the colour is black.
    """
    XYZ, white = np.asarray(XYZ, dtype=np.float64), np.asarray(white, dtype=np.float64)
    if not XYZ.sum() > 0:
        raise InputError("dominant colour: there is no light to see; move the camera up")
    xy, xy_white = XYZ[:2] / XYZ.sum(), white[:2] / white.sum()
    if np.hypot(*(xy - xy_white)) < 1e-4:
        return DominantColour(math.nan, 0.0, "grey")
    wavelength, boundary = _dominant_wavelength(xy, xy_white)
    purity = float(np.hypot(*(xy - xy_white)) / np.hypot(*(boundary - xy_white)))
    if purity < _SMALLEST_PURITY:
        return DominantColour(math.nan, purity, "grey")
    name = next(hue for end, hue in _HUES.items() if wavelength < end)
    return DominantColour(wavelength, purity, "purple" if wavelength < 0 else name)


def _dominant_wavelength(
    xy: NDArray[np.float64], white: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Where the line from a white through a colour leaves the CIE 1931 locus: nm and xy.

    The wavelength of a purple is its complementary one, negative. Like
    ``colour.dominant_wavelength``, which needs scipy; Blender has none.
    """
    observer = standard_observer().sensitivity
    nm = np.arange(380.0, 701.0)
    XYZ = observer.at(nm)
    locus = XYZ[:, :2] / XYZ.sum(axis=1, keepdims=True)

    def crossing(
        direction: NDArray[np.float64], first: NDArray[np.float64], step: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions along a ray from the white and along segments where they meet."""
        away = first - white
        det = direction[0] * step[:, 1] - direction[1] * step[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (away[:, 0] * step[:, 1] - away[:, 1] * step[:, 0]) / det
            fraction = (away[:, 0] * direction[1] - away[:, 1] * direction[0]) / det
        return np.where((along > 0) & (fraction >= 0) & (fraction <= 1), along, np.inf), fraction

    direction = xy - white
    for sign in (1.0, -1.0):
        along, fraction = crossing(sign * direction, locus[:-1], np.diff(locus, axis=0))
        nearest = int(np.argmin(along))
        if np.isfinite(along[nearest]):
            break
    wavelength = sign * float(nm[nearest] + fraction[nearest])
    if sign < 0:
        along, _ = crossing(direction, locus[:1], locus[-1:] - locus[:1])
        return wavelength, white + along[0] * direction
    return wavelength, white + along[nearest] * direction


def water_swatch(view: Viewpoint) -> NDArray[np.float64]:
    """Display colour (sRGB) of the open water through the camera, looking level, shape (3,).

    Encoded values from 0 to 1. Black where no light at all is left.

    Raises
    ------
    InputError
        If a white object at that depth has no positive luminance to expose for.
    """
    if not np.any(view.light > 0):
        return np.zeros(3)
    return srgb_encode(view.reduction.apply(view.background))


def inelastic_fraction(view: Viewpoint, emission: Emission) -> float:
    """Fraction of light of changed wavelength in the luminance of the open water, looking level."""
    field = view.column.solved_field(view.phase, FEW_STREAMS, emission)
    total = field.radiance(view.depth, view.level)
    luminance = standard_observer().response_in(view.column.bands)[1]
    return float(luminance @ (total - view.background) / (luminance @ total))
