"""Illuminants: scale, split into sun and sky, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import band_mean, parse_illuminant
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum

BANDS = Bands.uniform(8)


@pytest.mark.parametrize("name", ["d65", "equal-energy"])
def test_relative_illuminants_are_one_at_560_and_have_no_sky(name):
    light = parse_illuminant(name, 30)
    assert light.unit == "relative"
    assert light.direct.at([560])[0] == pytest.approx(1.0)
    assert np.all(light.diffuse_in(BANDS) == 0)


def test_d65_is_bluish():
    blue, red = parse_illuminant("d65").direct.at([460, 660])
    assert blue == pytest.approx(1.178, abs=0.001)
    assert red == pytest.approx(0.802, abs=0.001)


def test_direct_sun_falls_with_the_cosine():
    high, low = (parse_illuminant("astm-g173", z).direct_in(BANDS) for z in (0, 60))
    assert np.allclose(low / high, 0.5)


def test_clear_sky_at_the_tabulated_angles_and_between():
    previous = parse_illuminant("clear-sky", 0).direct_in(BANDS)
    for zenith in (10, 30, 45, 60, 75):
        light = parse_illuminant("clear-sky", zenith)
        direct = light.direct_in(BANDS)
        assert np.all(direct < previous)
        assert np.all(light.diffuse_in(BANDS) > 0)
        previous = direct
    # PAR of a clear noon: 400 to 550 W/m2.
    total = parse_illuminant("clear-sky", 0).total_in(BANDS) @ BANDS.widths
    assert 400 < total < 550


def test_file(tmp_path):
    path = tmp_path / "lamp.csv"
    path.write_text("wavelength_nm,irradiance,diffuse\n400,1,0.5\n700,2,0.5\n")
    light = parse_illuminant(f"file:{path}")
    assert light.total.at([550]).tolist() == [2.0]
    path.write_text("wavelength_nm,irradiance\n400,0\n700,0\n")
    with pytest.raises(InputError, match="zero at every wavelength"):
        parse_illuminant(f"file:{path}")


@pytest.mark.parametrize(
    ("name", "zenith", "message"),
    [
        ("d56", 30, "unknown illuminant 'd56'.*Near names: d65"),
        ("d65", 90, "not above the horizon"),
        ("d65", math.nan, "not above the horizon"),
        ("clear-sky", 80, "tabulated for a sun zenith of 0 to 75"),
    ],
)
def test_refusals(name, zenith, message):
    with pytest.raises(InputError, match=message):
        parse_illuminant(name, zenith)


def test_band_mean_is_exact_for_a_line():
    line = Spectrum([400, 549, 550, 551, 700], [0, 0, 1, 0, 0], "line")
    assert band_mean(line, Bands.uniform(3))[1] == pytest.approx(1.0 / 100)
    with pytest.raises(InputError, match="is known from"):
        band_mean(line, Bands.uniform(3, 300, 900))
