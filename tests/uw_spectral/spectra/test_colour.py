"""Development and uplift: white, exposure, round trips, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import DataWarning, InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import (
    auto_exposure_stops,
    delta_e_CIE2000_images,
    luminance,
    reduction,
    srgb_encode,
)
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.reflectance import (
    colorchecker_patches,
    colorchecker_reflectance,
    emission_basis,
    parse_reflectance,
    uplift,
    uplift_basis,
)
from underwater_spectral.uw_spectral.spectra.sensor import list_sensors, parse_sensor
from underwater_spectral.validation.colour_errors import round_trip_error, srgb_rmse

BANDS = Bands.uniform(35, 380.0, 730.0)
FINE = Bands.uniform(200, 380.0, 780.0)
D65 = parse_illuminant("d65")
CAMERAS = ["cie1931", "ARRI D21", "Nikon D7000", "Sigma SDMerill (NPL)"]
AT_DEPTH = D65.total_in(BANDS) * np.exp(-((BANDS.centres - 470) ** 2) / 2 / 40**2)


@pytest.fixture(autouse=True)
def _quiet():
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        yield


@pytest.mark.parametrize("sensor", CAMERAS)
@pytest.mark.parametrize("stops", [-2.0, 0.0, 1.5])
def test_white_is_white(sensor, stops):
    camera = parse_sensor(sensor)
    for balance, light in (("daylight", D65.total_in(BANDS)), ("depth", AT_DEPTH)):
        develop = reduction(camera, BANDS, D65, AT_DEPTH, balance, stops)
        assert develop.apply(light / math.pi) == pytest.approx(2.0**stops, rel=1e-6)


@pytest.mark.parametrize("sensor", CAMERAS)
def test_without_balance_luminance_is_kept(sensor):
    develop = reduction(parse_sensor(sensor), BANDS, D65, AT_DEPTH, "none")
    assert luminance(develop.apply(D65.total_in(BANDS) / math.pi)) == pytest.approx(1.0, abs=0.02)


def test_every_sensor_develops_daylight_within_a_few_delta_e():
    worst = {}
    for name in list_sensors():
        worst[name] = reduction(parse_sensor(name), Bands.uniform(16), D65).delta_e
    assert max(worst.values()) < 6.0, worst
    assert np.median(list(worst.values())) < 2.0


@pytest.mark.parametrize("count", [1, 2, 3, 9])
@pytest.mark.parametrize("balance", ["daylight", "depth", "none"])
def test_responses_are_the_sensors_through_however_few_bands(count, balance):
    """The matrix of this camera has no inverse in one band or two."""
    camera, bands = parse_sensor("Canon EOS 5D Mark IV"), Bands.uniform(count)
    depth = np.linspace(0.2, 1.0, count)
    develop = reduction(camera, bands, D65, depth, balance, 1.5)
    assert np.array_equal(develop.response, camera.response_in(bands))
    assert develop.matrix @ develop.response == pytest.approx(develop.weights, rel=1e-9)
    if balance != "none":
        white = depth if balance == "depth" else D65.total_in(bands)
        assert develop.apply(white / math.pi) == pytest.approx(2.0**1.5, rel=1e-9)


def test_automatic_exposure():
    develop = reduction(parse_sensor("cie1931"), BANDS, D65, AT_DEPTH)
    stops = auto_exposure_stops(develop, AT_DEPTH)
    again = reduction(parse_sensor("cie1931"), BANDS, D65, AT_DEPTH, "daylight", stops)
    assert luminance(again.apply(AT_DEPTH / math.pi)) == pytest.approx(0.9)
    with pytest.raises(InputError, match="no light at that depth"):
        auto_exposure_stops(develop, 0 * AT_DEPTH)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"white_balance": "tungsten"}, "unknown white balance"),
        ({"white_balance": "depth", "depth_white": None}, "needs the light at depth"),
        ({"white_balance": "depth", "depth_white": [1.0]}, "has shape"),
        ({"exposure_stops": math.nan}, "finite number of stops"),
    ],
)
def test_bad_development(arguments, message):
    with pytest.raises(InputError, match=message):
        reduction(parse_sensor("cie1931"), BANDS, D65, **({"depth_white": AT_DEPTH} | arguments))


def test_bands_that_miss_the_sensor():
    with pytest.warns(DataWarning, match="the bands cover"):
        reduction(parse_sensor("cie1931"), Bands.uniform(8, 450, 650), D65)
    with pytest.raises(InputError, match="sees no light"):
        reduction(parse_sensor("cie1931"), BANDS, D65, 0 * AT_DEPTH, "depth")


def test_uplift_is_physical_and_linear():
    basis = uplift_basis(BANDS)
    assert np.all(basis >= 0)
    assert basis.sum(axis=1) == pytest.approx(1.0)
    colours = np.random.default_rng(1).random((50, 3))
    reflectance = uplift(colours, BANDS)
    assert np.all((reflectance >= 0) & (reflectance <= 1))
    assert uplift(2 * colours, BANDS) == pytest.approx(2 * reflectance)


def test_uplift_round_trip():
    exact = round_trip_error(FINE, D65, reduction(parse_sensor("cie1931"), FINE, D65))
    assert exact.mean < 0.1
    coarse = Bands.uniform(8)
    eight = round_trip_error(coarse, D65, reduction(parse_sensor("cie1931"), coarse, D65))
    assert exact.mean < eight.mean < 1.5


def test_emission_comes_back_as_its_colour():
    develop = reduction(parse_sensor("cie1931"), FINE, D65)
    colours = np.array([[1.0, 1, 1], [1, 0.2, 0.1], [0, 0.5, 1]])
    assert develop.apply(colours @ emission_basis(FINE).T) == pytest.approx(colours, abs=5e-3)


def test_reflectances():
    assert len(colorchecker_patches()) == 24
    assert 0.8 < colorchecker_reflectance("White 9.5 (.05 D)").at([550])[0] < 1.0
    with pytest.raises(InputError, match="unknown ColorChecker patch"):
        colorchecker_reflectance("mauve")
    with pytest.raises(InputError, match="is not between 0 and 1"):
        parse_reflectance("-0.1")


def test_reflectance_files(tmp_path):
    path = tmp_path / "sand.csv"
    path.write_text("wavelength_nm,reflectance\n400,0.2\n700,0.4\n")
    assert parse_reflectance(f"file:{path}").at([550]).tolist() == pytest.approx([0.3])
    path.write_text("wavelength_nm,reflectance\n400,20\n700,40\n")
    with pytest.raises(InputError, match="divide by 100 if the table is in percent"):
        parse_reflectance(f"file:{path}")


def test_differences():
    black, white = np.zeros((1, 1, 3)), np.ones((1, 1, 3))
    assert srgb_rmse(black, white) == pytest.approx(1.0)
    assert delta_e_CIE2000_images(black, white)[0, 0] == pytest.approx(100.0, abs=0.1)
    assert srgb_encode([0.5]) == pytest.approx(0.7353569)
    assert srgb_encode([-1.0, 2.0]) == pytest.approx([0.0, 1.0])
