"""What the papers say of their figures holds for our light; identities of the RGB methods."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from underwater_spectral.benchmarks import _paper_scenes as scenes
from underwater_spectral.benchmarks import _printed_water, paper_figures
from underwater_spectral.uw_spectral.errors import DataWarning
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.water.bio_optics import Constituents


@pytest.fixture(autouse=True)
def narrow_bands():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        yield


@pytest.mark.parametrize(
    ("place", "camera"), [(4, "Canon EOS 600D"), (5, "Canon Digital Rebel XTi")]
)
def test_eight_bands_are_closer_than_rgb(place, camera):
    """Monzon et al. 2024, §6.2 and Figure 13: IB by a Canon 600D, II by a 400D, both metrics."""
    sensor, scene = parse_sensor(camera), scenes.SCENES[place]
    for balanced in (False, True):
        found = paper_figures.figure14([sensor], [scene], balanced=balanced)
        (errors,) = found.values()
        spectral = errors[paper_figures.SPECTRAL]
        for name in (paper_figures.RGB_MEANS, paper_figures.RGB_WAVES):
            assert errors[name].rmse > spectral.rmse
            assert errors[name].delta_e > spectral.delta_e


def test_more_bands_than_eight_bring_ever_less():
    """Monzon et al. 2024, §4.3: eight are a trade-off, more have diminishing returns."""
    place = scenes.SCENES[4:5]
    sensor = parse_sensor("Canon EOS 600D")
    found = paper_figures.figure12([sensor], (3, 8, 32), place, scenes.FINE)
    for three, eight, many in zip(*found.values(), strict=True):
        assert three.delta_e - eight.delta_e > eight.delta_e - many.delta_e > 0


def test_rgb_is_exact_where_nothing_depends_on_wavelength():
    """Averages of constants are the constants, and a channel's light is its response."""
    grey = scenes.setting(scenes.SCENES[4], Bands.uniform(20))
    n = len(grey.column.bands)
    column = dataclasses.replace(
        grey.column, absorption=np.full(n, 0.05), scattering=np.full(n, 0.1)
    )
    patches = np.repeat(grey.patches[:, :1], n, axis=1)
    grey = scenes.Setting(column, np.full(n, 0.07), patches, grey.depth)
    response = parse_sensor("ARRI D21").response_in(column.bands)
    for method in (scenes.tables, scenes.closed_form, scenes.paper_printed, scenes.one_light):
        exact = method(grey) @ response.T
        for channels in (grey.mixed(response), grey.representative(response)):
            np.testing.assert_allclose(method(channels), exact, rtol=1e-6)


def test_the_printed_raman_coefficient_contradicts_its_paper():
    """Gutierrez et al. 2008 have less than 2 % of inelastic light; a_w as b_R gives far more."""
    shares = _printed_water.inelastic_shares(Constituents(0.1))
    assert shares["raman, printed"] > 10 * 0.02
    assert shares["raman, ours"] < 0.5 * shares["raman, printed"]
