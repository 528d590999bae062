"""Colour error of few bands: the ColorChecker in air, by sensor and number of bands."""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra._colour import colour_science
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, rec709_to_XYZ, reduction
from ..uw_spectral.spectra.illuminant import Illuminant, parse_illuminant
from ..uw_spectral.spectra.reflectance import colorchecker_patches, colorchecker_reflectance
from ..uw_spectral.spectra.sensor import parse_sensor
from ..uw_spectral.spectra.spectrum import Spectrum
from .colour_errors import round_trip_error

SENSORS = ("cie1931", "ARRI D21", "Nikon D7000", "Canon EOS 5D Mark II")


COUNTS = (3, 4, 6, 8, 12, 16, 32)


RANGE = (400.0, 700.0)


# The spectra end at 730 nm, where the observer sees a millionth.
FINE = Bands.uniform(350, 380.0, 730.0)


def d50() -> Illuminant:
    """CIE D50, the light that the published values are for."""
    colour = colour_science()
    data = colour.SDS_ILLUMINANTS["D50"]
    values = data.values / data[560]
    return Illuminant(
        "D50",
        Spectrum(data.wavelengths, values, "D50"),
        Spectrum(data.wavelengths, 0.0 * values, "D50 sky"),
        "relative",
        "CIE 15",
    )


def rendered_rgb(sensor: str, bands: Bands, light: Illuminant | None = None) -> NDArray[np.float64]:
    """Scene-linear Rec.709 of the 24 patches in a light (D65), shape (24, 3)."""
    light = light or parse_illuminant("d65")
    reflectances = np.stack(
        [colorchecker_reflectance(patch).at(bands.centres) for patch in colorchecker_patches()]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)  # bands short of the sensor's ends
        develop = reduction(parse_sensor(sensor), bands, light)
    return develop.apply(reflectances * light.total_in(bands) / math.pi)


def published_lab() -> NDArray[np.float64]:
    """Lab values (D50) published with the reflectances, shape (24, 3)."""
    colour = colour_science()
    chart = colour.CCS_COLOURCHECKERS["BabelColor Average"]
    xyY = np.array([chart.data[patch] for patch in colorchecker_patches()])
    return np.asarray(colour.XYZ_to_Lab(colour.xyY_to_XYZ(xyY), chart.illuminant))


def lab_under_chart_white(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lab of scene-linear Rec.709, adapted by Bradford to the white of the published values."""
    colour = colour_science()
    chart = colour.CCS_COLOURCHECKERS["BabelColor Average"]
    XYZ = rgb @ rec709_to_XYZ().T
    adapted = colour.chromatic_adaptation(
        XYZ,
        rec709_to_XYZ() @ np.ones(3),
        colour.xy_to_XYZ(chart.illuminant),
        method="Von Kries",
        transform="Bradford",
    )
    return np.asarray(colour.XYZ_to_Lab(adapted, chart.illuminant))


def delta_e_to_published(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """ΔE2000 of the 24 patches against the published values."""
    return np.asarray(
        colour_science().delta_E(lab_under_chart_white(rgb), published_lab(), method="CIE 2000")
    )


def table() -> dict[tuple[str, int], tuple[float, float, float]]:
    """ΔE2000 by sensor and number of bands: mean, worst, and mean of the uplift's round trip.

    The truth is CIE 1931 on a fine grid; a camera's own colour error is part of its figure.
    """
    truth = rendered_rgb("cie1931", FINE)
    d65 = parse_illuminant("d65")
    rows = {}
    for sensor in SENSORS:
        for count in COUNTS:
            bands = Bands.uniform(count, *RANGE)
            error = delta_e_CIE2000_images(rendered_rgb(sensor, bands), truth)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DataWarning)
                trip = round_trip_error(bands, d65, reduction(parse_sensor(sensor), bands, d65))
            rows[sensor, count] = (float(error.mean()), float(error.max()), trip.mean)
    return rows
