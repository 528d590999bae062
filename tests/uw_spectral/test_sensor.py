"""Sensors: catalogue, file formats, refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.sensor import Sensor, list_sensors, parse_sensor
from underwater_spectral.uw_spectral.spectrum import Spectrum


def test_catalogue():
    names = list_sensors()
    assert len(names) == len(set(names)) == 56
    for name in names:
        sensor = parse_sensor(name.upper())
        assert sensor.name == name
        assert sensor.licence
        assert sensor.kind == ("observer" if name.startswith("cie") else "camera")


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
