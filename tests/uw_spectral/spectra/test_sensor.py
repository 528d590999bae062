"""Sensors: catalogue, file formats, refusals."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import auto_exposure_stops, reduction
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.sensor import Sensor, list_sensors, parse_sensor
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.named import parse_water
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.uw_spectral.water.pure_water import molecular_scattering


def test_catalogue():
    names = list_sensors()
    assert len(names) == len(set(names)) == 91
    kinds = {kind: list_sensors(kind) for kind in ("observer", "camera", "film")}
    assert [len(group) for group in kinds.values()] == [4, 54, 33]
    assert names == [name for group in kinds.values() for name in group]
    for name in names:
        sensor = parse_sensor(name.upper())
        assert sensor.name == name
        assert sensor.licence
        assert name in kinds[sensor.kind]


def test_unknown_kind():
    with pytest.raises(InputError, match="unknown kind of sensor 'films'.*Near names: film"):
        list_sensors("films")


@pytest.mark.parametrize("name", list_sensors("film"))
def test_film_layers_record_red_green_and_blue(name):
    spectrum = parse_sensor(name).sensitivity
    peaks = spectrum.wavelengths[np.argmax(spectrum.values, axis=0)]
    for peak, (low, high) in zip(peaks, [(600, 665), (520, 570), (400, 480)], strict=True):
        assert low <= peak <= high
    assert spectrum.values.max() == 1
    assert spectrum.values[-1].max() < 0.02


def test_films_say_that_they_have_no_characteristic_curve():
    for kind in ("camera", "film", "observer"):
        for name in list_sensors(kind):
            said = "characteristic curve" in parse_sensor(name).note
            assert said == (kind == "film"), name


def test_film_is_the_published_curve():
    # Kodak 5219: points of its green-recording layer around 480, 550 and 590 nm.
    digitised = {
        479.9224: 1.5875, 484.8012: 1.8240, 547.4753: 2.7982,
        551.6036: 2.7876, 587.6318: 1.9775, 591.9477: 1.6016,
    }  # fmt: skip
    wavelengths = [480.0, 550.0, 590.0]
    published = 10 ** np.interp(wavelengths, list(digitised), list(digitised.values()))
    green = parse_sensor("Kodak Vision3 500T 5219").sensitivity.at(wavelengths)[:, 1]
    assert green / green[1] == pytest.approx(published / published[1], rel=1e-3)


@pytest.fixture(scope="module")
def jerlov_ib():
    bands = Bands.uniform(8)
    water = parse_water("jerlov:IB")
    daylight = parse_illuminant("d65")
    scattering = water.b(bands.centres)
    phase = parse_phase("mixture").for_bands(scattering, molecular_scattering(bands.centres))
    column = WaterColumn(
        bands, water.a(bands.centres), scattering, daylight.direct_in(bands), 0.93,
        np.array([0.37, 0.0, -0.93]), 0.0, math.inf, 0.0, "none", 1.34,
    )  # fmt: skip
    return bands, daylight, column.Ed(10.0, phase)


@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
@pytest.mark.parametrize("name", list_sensors())
def test_every_sensor_develops_jerlov_ib(name, jerlov_ib):
    bands, daylight, light = jerlov_ib
    sensor = parse_sensor(name)
    daylit, balanced = (
        reduction(sensor, bands, daylight, light, balance) for balance in ("daylight", "depth")
    )
    for develop, white in ((daylit, daylight.total_in(bands)), (balanced, light)):
        assert np.isfinite(develop.weights).all()
        assert develop.apply(white / math.pi) == pytest.approx(1.0, rel=1e-6)
        assert develop.delta_e < 8
    assert math.isfinite(auto_exposure_stops(daylit, light))
    # Daylight balanced, a white diffuser at 10 m is bluish.
    red, green, blue = daylit.apply(light / math.pi)
    assert red < green
    assert red < blue


def test_observer_is_the_standard_one():
    sensitivity = parse_sensor("cie1931").sensitivity
    assert sensitivity.at([555])[0, 1] == pytest.approx(1.0, abs=1e-4)


def test_near_names():
    with pytest.raises(InputError, match="unknown sensor 'Nikon D7001'.*Near names: Nikon D7"):
        parse_sensor("Nikon D7001")


def test_csv_file(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("wavelength_nm,R,G,B\n400,0,0.1,1\n700,1,0.2,0\n")
    sensor = parse_sensor(f"file:{path}")
    assert sensor.name == "mine"
    assert sensor.sensitivity.at([550])[0].tolist() == pytest.approx([0.5, 0.15, 0.5])


def _rawtoaces(main):
    return {
        "header": {"manufacturer": "Acme", "model": "One"},
        "spectral_data": {"index": {"main": ["R", "G", "B"]}, "data": {"main": main}},
    }


def test_rawtoaces_file(tmp_path):
    path = tmp_path / "acme.json"
    path.write_text(json.dumps(_rawtoaces({"700": [1, 0, 0], "400": [0, 0, 1], "550": [0, 1, 0]})))
    sensor = parse_sensor(f"file:{path}")
    assert sensor.name == "Acme One"
    assert sensor.sensitivity.at([550])[0].tolist() == [0, 1, 0]
    path.write_text(json.dumps({"spectral_data": {}}))
    with pytest.raises(InputError, match="is not a rawtoaces file"):
        parse_sensor(f"file:{path}")


def _jiang(name, scale):
    rows = [" ".join(str(scale * (k + 1) / 33) for k in range(33)) for _ in range(3)]
    return "\n".join([name, *rows])


def test_jiang2013_file(tmp_path):
    path = tmp_path / "camspec.txt"
    path.write_text(_jiang("Canon 1D", 1.0) + "\n" + _jiang("Nikon D3", 0.5) + "\n")
    assert parse_sensor(f"file:{path}#nikon d3").sensitivity.at([720])[0, 0] == pytest.approx(0.5)
    with pytest.raises(InputError, match="holds 2 cameras; choose one as .*Canon 1D, Nikon D3"):
        parse_sensor(f"file:{path}")
    with pytest.raises(InputError, match="unknown camera"):
        parse_sensor(f"file:{path}#Nikon D4")
    path.write_text("Canon 1D\n1 2 3\n1 2 3\n1 2 3\n")
    with pytest.raises(InputError, match="rows of 3, 3, 3 numbers; expected"):
        parse_sensor(f"file:{path}")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([[0, 1, 1], [-0.1, 1, 1]], "negative at 700 nm"),
        ([[0, 1, 1], [0, 1, 1]], "zero at every wavelength"),
        ([[1, 1], [1, 1]], "give three sensitivities"),
    ],
)
def test_bad_sensitivities(values, message):
    with pytest.raises(InputError, match=message):
        Sensor("test", Spectrum([400, 700], np.array(values, float), "test"), "camera", "", "")


def test_missing_and_binary_files(tmp_path):
    with pytest.raises(InputError, match="check the path"):
        parse_sensor(f"file:{tmp_path}/none.csv")
    path = tmp_path / "raw.bin"
    path.write_bytes(b"\xff\xfe\x81")
    with pytest.raises(InputError, match="not a text file"):
        parse_sensor(f"file:{path}")
