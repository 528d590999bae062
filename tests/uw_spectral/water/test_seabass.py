"""SeaBASS files: a public one, synthetic ones, damaged ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import Description, WaterDescription, resolve
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.water.measured import read_water
from underwater_spectral.uw_spectral.water.pure_water import (
    molecular_scattering,
    pure_water_absorption,
)
from underwater_spectral.uw_spectral.water.seabass import Kd_from_profile, read_seabass

# From nasa/HyperCP (MIT).
SAMPLE = Path(__file__).parent / "Water_Absorption.sb"
# A cast of an ac-9; its header says where it is from.
CAST = Path(__file__).parent / "arctic_ac9_20110411.sb"
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


def test_a_real_cast_to_the_end():
    """Absorption and attenuation under the ice, five depths: what the file holds comes out."""
    water = read_water(CAST)
    nm = np.array([412.0, 440.0, 488.0, 510.0, 532.0, 555.0, 650.0, 676.0, 715.0])
    agp = np.mean([0.114344, 0.098079, 0.081831, 0.081566, 0.084343])
    cgp = np.mean([0.178616, 0.155066, 0.137294, 0.123139, 0.124843])
    assert water.a([440.0])[0] == pytest.approx(agp + 0.00635)
    assert water.b([440.0])[0] == pytest.approx(cgp - agp + molecular_scattering([440.0])[0])
    assert np.all(water.a(nm) > pure_water_absorption(nm))
    assert np.all(water.b(nm) > molecular_scattering(nm))
    assert "start_date 20110411" in water.source
    assert water.caveats[0].startswith(
        "means over 5 depths, 1 to 3 m, between which they differ by"
    )
    drawn = resolve(Description(WaterDescription(water), bands=Bands.uniform(8, 420, 700)))
    assert drawn.column.absorption == pytest.approx(water.a(drawn.bands.centres))


def test_units_are_those_of_the_file(tmp_path):
    rows = [[440, 0.05, 0.40], [550, 0.01, 0.35]]
    fields = "wavelength,a,b"
    per_metre, per_centimetre, unsaid = (
        read_water(_file(tmp_path, fields, rows, extra=units))
        for units in ("/units=nm,1/m,m^-1", "/units=nm,1/cm,1/m", "")
    )
    assert per_metre.a([440.0, 550.0]).tolist() == unsaid.a([440.0, 550.0]).tolist() == [0.05, 0.01]
    assert per_centimetre.a([440.0, 550.0]) == pytest.approx([5.0, 1.0])
    assert per_centimetre.b([440.0, 550.0]) == pytest.approx([0.40, 0.35])
    kd = read_seabass(_file(tmp_path, "wavelength,kd", [[490, 0.001], [550, 0.002]],
                            extra="/units=nm,1/cm"))  # fmt: skip
    assert read_water(kd.path).Kd([490.0]) == pytest.approx([0.1])
    with pytest.raises(InputError, match=r"a is in '1/km', as /units says, which is none of 1/m"):
        read_water(_file(tmp_path, fields, rows, extra="/units=nm,1/km,1/m"))


def test_averages_say_how_far_the_depths_differ(tmp_path):
    rows = [[1, 0.10, 0.40], [5, 0.30, 0.40]]
    water = read_water(_file(tmp_path, "depth,a490,b490", rows))
    assert water.a([490])[0] == pytest.approx(0.2)
    assert "2 depths, 1 to 5 m, between which they differ by up to 100% of" in water.caveats[0]
    assert not read_water(_file(tmp_path, "depth,a490,b490", rows[:1])).caveats


def test_absorption_of_particles_and_of_dissolved_matter(tmp_path):
    """a = a_w + ap + ag; b = c - a, or bbp over bb/b and the water's own."""
    rows = [[440, 0.05, 0.03, 0.40], [550, 0.01, 0.006, 0.35], [700, -0.001, 0.0, 0.90]]
    water = read_water(_file(tmp_path, "wavelength,ap,ag,c", rows))
    nm = np.array([440.0, 550.0, 700.0])
    a = np.add(pure_water_absorption(nm), [0.08, 0.016, 0.0])
    np.testing.assert_allclose(water.a(nm[:2]), a[:2], rtol=1e-12)
    np.testing.assert_allclose(water.b(nm[:2]), [0.40, 0.35] - a[:2], rtol=1e-12)
    assert water.particle_backscatter is None


@pytest.mark.parametrize(("header", "ratio"), [("", 0.0183), ("/bb/b=0.01", 0.01)])
def test_scattering_from_backscattering(tmp_path, header, ratio):
    rows = [[440, 0.05, -0.001, 0.004], [550, 0.01, 0.006, 0.003]]
    water = read_water(_file(tmp_path, "wavelength,ap,ag,bbp", rows, extra=header))
    nm = np.array([440.0, 550.0])
    a = np.add(pure_water_absorption(nm), [0.05, 0.016])
    np.testing.assert_allclose(water.a(nm), a, rtol=1e-12)
    expected = np.array([0.004, 0.003]) / ratio + molecular_scattering(nm)
    np.testing.assert_allclose(water.b(nm), expected, rtol=1e-12)
    assert water.particle_backscatter == ratio
    assert any(f"bbp with bb/b {ratio:g}" in text for text in water.caveats)
    assert any("ag: values down to -0.005 1/m are noise" in text for text in water.caveats)
    bb = water.phase_model.for_bands(water.b(nm), molecular_scattering(nm)).backscatter_ratio
    np.testing.assert_allclose(
        bb * water.b(nm), [0.004, 0.003] + molecular_scattering(nm) / 2, rtol=5e-3
    )


def test_noise_of_scattering_where_there_is_little(tmp_path):
    rows = [[440, 0.1, 0.4], [715, 1.003, 1.0]]
    assert read_water(_file(tmp_path, "wavelength,a,c", rows)).b([715.0])[0] == 0
    rows[1][1] = 1.1
    with pytest.raises(InputError, match="c - a of cast.sb: -0.1 1/m at 715 nm is negative"):
        read_water(_file(tmp_path, "wavelength,a,c", rows))


def test_an_impossible_backscatter_is_refused(tmp_path):
    rows = [[440, 0.1, 0.004]]
    with pytest.raises(InputError, match="/bb/b=0, but bb/b of particles is 0.0001 to 0.2"):
        read_water(_file(tmp_path, "wavelength,a,bbp", rows, extra="/bb/b=0"))


def test_backscatter_ratio_is_measured_where_b_is_too(tmp_path):
    nm = np.array([440.0, 550.0])
    b = 0.3 + molecular_scattering(nm)
    rows = [[wave, 0.1, value, 0.0036] for wave, value in zip(nm, b, strict=True)]
    water = read_water(_file(tmp_path, "wavelength,a,b,bbp", rows))
    assert water.particle_backscatter == pytest.approx(0.012)
    assert any("measured: 0.012" in text for text in water.caveats)
    np.testing.assert_allclose(water.b(nm), b)
    rows = [[*row[:3], 0.3] for row in rows]
    odd = read_water(_file(tmp_path, "wavelength,a,b,bbp", rows))
    assert odd.particle_backscatter is None
    assert any("which no particles have" in text for text in odd.caveats)


def test_the_sun_of_a_measurement(tmp_path):
    """From a field, a header line of ours, or date, time and place; else it is said."""
    rows = [[450, 0.05, 40.0], [500, 0.06, 44.0]]
    water = read_water(_file(tmp_path, "wavelength,kd,sza", rows))
    assert "sun at 42°" in water.caveats[0]
    rows = [row[:2] for row in rows]
    water = read_water(_file(tmp_path, "wavelength,kd", rows, extra="/sun_zenith=65"))
    assert "sun at 65°" in water.caveats[0]
    # Overhead at noon in June on the tropic of Cancer, and half past ten 22.5 degrees from it.
    when = "/start_date=20200621\n/start_time=10:31:00[GMT]\n/north_latitude=23.44[DEG]"
    place = f"{when}\n/east_longitude=0.0[DEG]"
    water = read_water(_file(tmp_path, "wavelength,kd", rows, extra=place))
    assert "sun at 20.7" in water.caveats[0]
    for extra in ("", when, place.replace("10:31", "23:31"), place.replace("10:31", "late")):
        water = read_water(_file(tmp_path, "wavelength,kd", rows, extra=extra))
        assert any("sun of the Kd measurement is not known" in text for text in water.caveats)
    with pytest.raises(InputError, match="/sun_zenith=noon is not a number"):
        read_water(_file(tmp_path, "wavelength,kd", rows, extra="/sun_zenith=noon"))


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
    ("fields", "rows", "words"),
    [
        ("station,wavelength,kd", [["A1", 490, 0.05], ["B2", 490, 0.5]], r"2 stations \(A1, B2\)"),
        ("station,depth,ed490", [[n, y, 0.9**y] for n in (1, 2) for y in (1, 2, 3)], "2 stations"),
        ("lat,lon,kd490", [[10, 20, 0.05], [10.5, 20, 0.5]], r"places by lat \(10, 10.5\)"),
        ("lon,kd490", [[179, 0.05], [-179, 0.5]], "places by lon"),
        ("date,kd490", [[20200621, 0.05], [20200801, 0.5]], r"2 days \(20200621, 20200801\)"),
    ],
)
def test_stations_are_not_averaged(tmp_path, fields, rows, words):
    with pytest.raises(InputError, match=f"cast.sb holds .*{words}.*keep the rows of one"):
        read_water(_file(tmp_path, fields, rows))


@pytest.mark.parametrize(
    ("fields", "rows"),
    [
        ("station,kd490", [["A1", 0.05], ["A1", 0.06], ["-999", 0.07]]),
        ("lat,lon,kd490", [[10, 179.995, 0.05], [10.01, -179.995, 0.06], [-999, -999, 0.07]]),
        ("date,kd490", [[20191231, 0.05], [20200101, 0.07]]),
    ],
)
def test_repeats_at_one_station_are_averaged_and_said(tmp_path, fields, rows):
    water = read_water(_file(tmp_path, fields, rows))
    assert water.Kd([490])[0] == pytest.approx(0.06)
    assert water.caveats[0] == f"means over {len(rows)} measurements that differ by up to 33% of " \
        "the mean"  # fmt: skip


def test_marks_of_older_files_and_what_editors_leave(tmp_path):
    rows = [[440, 0.05, 0.40], [550, 0.01, 0.35]]
    path = _file(tmp_path, "wavelength,a,b", rows)
    wanted = read_water(path).a([440.0, 500.0]).tolist()
    text = path.read_text()
    for changed in (
        text.replace("_header", "_header@"),
        "\n" + text.upper(),
        text.replace("0.4\n", "0.4,,\n").replace("A_Diver", "Jérôme"),
        text.replace("/delimiter=comma", "/delimiter=semicolon").replace("0,0", "0;0")
        .replace("05,0", "05;0").replace("01,0", "01;0"),
    ):  # fmt: skip
        path.write_bytes(changed.encode("cp1252"))
        assert read_water(path).a([440.0, 500.0]).tolist() == wanted


def test_measured_light_is_an_illuminant(tmp_path):
    """Es in the archive's unit, µW cm⁻² nm⁻¹, is a hundredth of W m⁻² nm⁻¹."""
    rows = [[1, 90.0, 120.0, 0.9], [2, 110.0, 140.0, 0.8]]
    for unit, factor in (("", 0.01), ("uW/cm^2/nm", 0.01), ("W/m^2/nm", 1.0), ("mW/m^2/nm", 1e-3)):
        units = f"/units=m,{unit},{unit},"
        path = _file(tmp_path, "depth,es443,es560,ed443", rows, extra=units)
        light = parse_illuminant(f"file:{path}")
        assert light.total.at([443, 560]) == pytest.approx([100 * factor, 130 * factor])
        assert light.above_surface
        assert light.unit == "W m-2 nm-1"
    by_row = _file(tmp_path, "wavelength,es", [[443, 100], [560, 130]])
    assert parse_illuminant(f"file:{by_row}").total.at([443]) == pytest.approx([1.0])
    stations = _file(tmp_path, "station,wavelength,es", [["A", 443, 1], ["B", 560, 1]])
    with pytest.raises(InputError, match="2 stations"):
        parse_illuminant(f"file:{stations}")
    with pytest.raises(InputError, match="needed is es"):
        parse_illuminant(f"file:{SAMPLE}")


@pytest.mark.parametrize(
    ("fields", "rows", "message"),
    [
        ("wavelength,ap,c", [[440, 0.1, 0.2]], "needed are a with b or c .* ap and ag for a"),
        ("wavelength,ap,ag,c", [[440, 0.1, -0.1, 0.2]], r"line 8, column 3 \(ag\): -0.1 is neg"),
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
