"""SeaBASS files: a public one, synthetic ones, damaged ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.water.measured import read_water
from underwater_spectral.uw_spectral.water.pure_water import (
    molecular_scattering,
    pure_water_absorption,
)
from underwater_spectral.uw_spectral.water.seabass import Kd_from_profile, read_seabass

# From nasa/HyperCP (MIT).
SAMPLE = Path(__file__).parent / "Water_Absorption.sb"
DEPTHS = np.arange(0.5, 10.1, 0.5)
TRUE_KD = {443.0: 0.10, 490.0: 0.08, 555.0: 0.12, 670.0: 0.60}


def _file(tmp_path, fields, rows, delimiter="comma", extra=""):
    path = tmp_path / "cast.sb"
    separator = {"comma": ",", "space": " ", "tab": "\t"}[delimiter]
    lines = [
        "/begin_header",
        "/investigators=A_Diver",
        "/missing=-999",
        f"/delimiter={delimiter}",
        "! synthetic",
        f"/fields={fields}",
        "/end_header",
    ]
    if extra:
        lines.insert(1, extra)
    lines += [separator.join(str(cell) for cell in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def _profile(tmp_path, noise=0.0):
    random = np.random.default_rng(7)
    fields = "station,depth," + ",".join(f"ed{nm:g}" for nm in TRUE_KD)
    rows = [
        ["A1", y, *(np.exp(-Kd * y + noise * random.standard_normal()) for Kd in TRUE_KD.values())]
        for y in DEPTHS
    ]
    return _file(tmp_path, fields, rows)


def test_public_sample():
    data = read_seabass(SAMPLE)
    assert data.header["experiment"] == "PureWater"
    assert data.units == ("nm", "1/m")
    nm = data.columns["wavelength"]
    inside = (nm >= 420) & (nm <= 700)
    np.testing.assert_allclose(
        data.columns["aw"][inside], pure_water_absorption(nm[inside]), rtol=1e-3
    )
    with pytest.raises(InputError, match="needed are a with b or c"):
        read_water(SAMPLE)


def test_kd_from_an_irradiance_profile(tmp_path):
    Kd = Kd_from_profile(read_seabass(_profile(tmp_path)))
    np.testing.assert_allclose(Kd.values, list(TRUE_KD.values()), rtol=1e-9)
    noisy = Kd_from_profile(read_seabass(_profile(tmp_path, 0.05)))
    np.testing.assert_allclose(noisy.values, list(TRUE_KD.values()), rtol=0.08)
    assert "standard error" in noisy.source
    water = read_water(tmp_path / "cast.sb")
    assert water.Kd([490])[0] == pytest.approx(0.08, rel=0.08)
    assert 0 < water.a([490])[0] < water.Kd([490])[0]


@pytest.mark.parametrize("delimiter", ["comma", "space", "tab"])
def test_a_and_b_by_row(tmp_path, delimiter):
    rows = [[440, 0.1, 0.5], [550, 0.08, 0.4], [650, -999, 0.3]]
    water = read_water(_file(tmp_path, "wavelength,a,b", rows, delimiter))
    assert water.a([440, 550]) == pytest.approx([0.1, 0.08])
    assert water.b([650])[0] == pytest.approx(0.3)
    with pytest.raises(InputError, match="440 to 550"):
        water.a([650])


def test_a_and_c_without_water_over_depths(tmp_path):
    rows = [[1, 0.10, 0.05, 0.60, 0.45], [2, 0.12, 0.07, 0.62, 0.47]]
    water = read_water(_file(tmp_path, "depth,agp440,agp555,cgp440,cgp555", rows))
    nm = np.array([440.0, 555.0])
    np.testing.assert_allclose(water.a(nm), np.add(pure_water_absorption(nm), [0.11, 0.06]))
    np.testing.assert_allclose(water.b(nm), np.add(molecular_scattering(nm), [0.50, 0.40]))


def test_kd_by_row(tmp_path):
    water = read_water(_file(tmp_path, "wavelength,kd", [[450, 0.05], [500, 0.06]]))
    assert water.Kd([500])[0] == pytest.approx(0.06)


@pytest.mark.parametrize(
    ("fields", "rows", "message"),
    [
        ("wavelength,a,b", [[440, 0.1, 0.2], [450, "x", 0.2]], r"line 9, column 2 \(a\): 'x'"),
        ("wavelength,a,b", [[440, 0.1, 0.2], [450, 0.1]], "line 9: 2 cells where /fields lists 3"),
        ("wavelength,a,b", [[440, 0.1, -0.2]], r"line 8, column 3 \(b\): -0.2 is negative"),
        ("wavelength,a,b", [[440, "nan", 0.2]], r"line 8, column 2 \(a\)"),
        ("wavelength,a,b", [[440, -999, 0.2]], "every value of a is missing"),
        ("wavelength,a,b", [], "no rows"),
        ("wavelength,a,a", [[440, 0.1, 0.2]], "listed twice"),
        ("ed490", [[1.0]], "no depth column"),
        ("depth,ed490", [[1, 0.9], [2, 0.8]], "2 usable depths"),
        ("depth,ed490", [[1, 0.9], [2, 0.0], [3, 0.7]], "line 9, column 2"),
        ("depth,ed490", [[1, 0.7], [2, 0.8], [3, 0.9]], "does not fall with depth"),
    ],
)
def test_damaged_files(tmp_path, fields, rows, message):
    with pytest.raises(InputError, match=message):
        read_water(_file(tmp_path, fields, rows))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wavelength,a\n", "line 1: a SeaBASS file starts with"),
        ("/begin_header\n/fields\n", "line 2, column 1: '/fields' has no '='"),
        ("/begin_header\n440 0.1\n", "line 2, column 1: '440 0.1' stands in the header"),
        ("/begin_header\n/fields=a\n", "/end_header is missing"),
        ("/begin_header\n/fields=a\n/end_header\n1\n", "no /delimiter"),
        ("/begin_header\n/fields=a\n/delimiter=pipe\n/end_header\n1\n", "delimiter 'pipe'"),
    ],
)
def test_damaged_headers(tmp_path, text, message):
    path = tmp_path / "bad.sb"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_seabass(path)
    with pytest.raises(InputError, match="cannot read"):
        read_seabass(tmp_path / "none.sb")
