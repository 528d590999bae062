"""The ColorChecker in air: spectra, light, observer and Rec.709 against published colours."""

from __future__ import annotations

import warnings

import numpy as np
from underwater_spectral.uw_spectral.spectra._colour import colour_science
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import rec709_to_XYZ
from underwater_spectral.uw_spectral.spectra.reflectance import (
    colorchecker_patches,
    colorchecker_reflectance,
)
from underwater_spectral.validation import colorchecker as chart


def test_published_lab_values():
    """They are for D50; in D65 the error of the chromatic adaptation comes on top (0.58)."""
    in_d50 = chart.delta_e_to_published(chart.rendered_rgb("cie1931", chart.FINE, chart.d50()))
    assert in_d50.mean() <= 0.5
    assert in_d50.max() <= 0.5
    in_d65 = chart.delta_e_to_published(chart.rendered_rgb("cie1931", chart.FINE))
    assert in_d65.mean() <= 0.6


def test_tristimulus_values_in_d65():
    """The whole chain against colour-science's own integration, without any adaptation."""
    colour = colour_science()
    found = chart.rendered_rgb("cie1931", chart.FINE) @ rec709_to_XYZ().T
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    d65 = colour.SDS_ILLUMINANTS["D65"]
    expected = []
    for patch in colorchecker_patches():
        spectrum = colorchecker_reflectance(patch)
        values = dict(zip(spectrum.wavelengths, spectrum.values, strict=True))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it says that it aligns the grids
            XYZ = colour.sd_to_XYZ(colour.SpectralDistribution(values), cmfs, d65)
        expected.append(XYZ / 100)
    white = rec709_to_XYZ() @ np.ones(3)
    labs = [colour.XYZ_to_Lab(x, colour.XYZ_to_xy(white)) for x in (found, np.array(expected))]
    error = colour.delta_E(*labs, method="CIE 2000")
    assert error.max() <= 0.3


def test_error_falls_with_the_number_of_bands(record_property):
    truth = chart.rendered_rgb("cie1931", chart.FINE)
    errors = [
        float(
            chart.delta_e_CIE2000_images(
                chart.rendered_rgb("cie1931", Bands.uniform(count, *chart.RANGE)), truth
            ).mean()
        )
        for count in (3, 8, 32)
    ]
    record_property("ΔE2000 at 8 bands", errors[1])
    assert errors == sorted(errors, reverse=True)
    assert errors[1] < 0.5
    assert errors[2] < 0.1
