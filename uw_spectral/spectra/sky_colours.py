"""Spectra of light from the sky, of its colours in a picture."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._colour import colour_science
from .bands import Bands
from .colour_rendering import rec709_to_XYZ
from .illuminant import band_mean, parse_illuminant
from .reflectance import emission_basis
from .sensor import standard_observer
from .spectrum import Spectrum

SKY_SOURCE = "CIE 15:2004, components S0, S1 and S2 of daylight"
_FINE = Bands.uniform(42, 360.0, 780.0)


@functools.cache
def _daylight_primaries() -> Spectrum:
    """Spectra of a red, a green and a blue of Rec.709, of the components S0, S1, S2 of daylight."""
    found = colour_science().colorimetry.SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES.values()
    wavelengths = np.asarray(next(iter(found)).wavelengths, np.float64)
    components = np.stack([one.values for one in found], axis=1)
    d65, eye = parse_illuminant("d65").direct, standard_observer().sensitivity
    seen = (wavelengths >= eye.range[0]) & (wavelengths <= d65.range[1])
    observer = eye.at(wavelengths[seen])
    XYZ = observer.T @ components[seen] / (observer[:, 1] @ d65.at(wavelengths[seen]))
    primaries = components @ np.linalg.inv(np.linalg.solve(rec709_to_XYZ(), XYZ)) / math.pi
    return Spectrum(wavelengths, primaries, "components of daylight", SKY_SOURCE)


@functools.lru_cache(maxsize=16)
def sky_basis(bands: Bands, saturation: float = 0.0) -> NDArray[np.float64]:
    """Radiance of the Rec.709 primaries of a picture of the sky in each band, shape (n, 3).

    Colours are sums of the three components of daylight (CIE 15), so every daylight has its own
    spectrum; light (1, 1, 1) is as bright as a white diffuser in D65 of 1 at 560 nm. Of colours
    that no daylight has a ``saturation`` > 0 takes a part from :func:`.emission_basis`; both have
    the colours that they stand for.
    """
    of_daylight = band_mean(_daylight_primaries(), bands)
    return of_daylight + saturation * (emission_basis(bands) - of_daylight)


def least_saturation(rgb: ArrayLike) -> float:
    """Return the ``saturation`` of :func:`sky_basis` from which no spectrum of (k, 3) is negative.

    Examples
    --------
    >>> least_saturation([[1.0, 1.0, 1.0], [0.3, 0.5, 1.0]])
    0.0
    >>> 0.0 < least_saturation([[0.3, 1.0, 0.3]]) <= 1.0
    True
    """
    colours = np.asarray(rgb, np.float64)
    daylight, other = (colours @ sky_basis(_FINE, part).T for part in (0.0, 1.0))
    short = daylight < 0
    return float(np.max(daylight[short] / (daylight[short] - other[short]), initial=0.0))
