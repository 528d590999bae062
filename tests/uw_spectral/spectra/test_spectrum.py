"""Spectra, tables and bands: values, refusals, messages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from underwater_spectral.uw_spectral.errors import InputError, unknown_name
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.spectral_table import read_spectral_table
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum, read_table


def test_interpolates_and_never_extrapolates():
    spectrum = Spectrum([400, 500, 700], [1.0, 3.0, 3.0], "absorption of test")
    assert spectrum.at([400, 450, 600]).tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match="absorption of test is known from 400 to 700 nm, but 399"):
        spectrum.at([399])
    with pytest.raises(InputError, match="but nan nm"):
        spectrum.at([np.nan])
    assert spectrum.at_or_zero([300, 450]).tolist() == [0.0, 2.0]


@pytest.mark.parametrize(
    ("wavelengths", "values", "message"),
    [
        ([400, 400], [1, 2], "wavelengths must increase"),
        ([500, 400], [1, 2], "wavelengths must increase"),
        ([400, 500], [1, np.nan], "not a finite number at 500 nm"),
        ([400, 500], [1], "one value per wavelength"),
    ],
)
def test_bad_spectra(wavelengths, values, message):
    with pytest.raises(InputError, match=message):
        Spectrum(wavelengths, values, "test")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no table"),
        ("# only a comment\n", "holds no table"),
        ("wavelength_nm,a\n", "column names but no rows"),
        ("lambda,a\n400,1\n", "line 1: column wavelength_nm is missing; found lambda, a"),
        ("# c\nwavelength_nm,a\n400,1\n500\n", "line 4: 1 cells where the header has 2"),
        ("wavelength_nm,a\n400,x\n500,1\n", "line 2, column a: 'x' is not a finite number"),
        ("wavelength_nm,a\n400,inf\n", "line 2, column a: 'inf'"),
    ],
)
def test_bad_tables_name_line_and_column(tmp_path, text, message):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_table(path)


def test_table_errors_of_the_file_itself(tmp_path):
    with pytest.raises(InputError, match="check the path"):
        read_table(tmp_path / "none.csv")
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="not a text file"):
        read_table(binary)


PLAIN = b"# source: me\nwavelength_nm,a,b\n400,0.1,2\n500,0.25,3e-1\n"


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + PLAIN,
        PLAIN.replace(b"\n", b"\r\n") + b"\x1a",
        PLAIN.replace(b"\n", b"\r"),
        PLAIN.replace(b",", b";"),
        PLAIN.replace(b",", b";").replace(b".", b","),
        PLAIN.replace(b",", b"\t"),
        PLAIN.replace(b"\n", b",,\n") + b",,,,\n \n,,,,\n",
        PLAIN.replace(b"# source: me", b'"# source: me",,'),
        PLAIN.replace(b"400", b"  # a later comment\n\n 400 "),
        b'"wavelength_nm","a","b"\n"400","0.1","2"\n"500","0.25","3e-1"\n',
        b"wavelength_nm,a,note,b,empty\n400,0.1,at the pier,2,\n500,0.25,\xb0 \xb5,3e-1,\n",
    ],
)
def test_tables_of_spreadsheets_say_what_the_plain_one_says(content, tmp_path):
    path = tmp_path / "table.csv"
    path.write_bytes(content)
    table = read_table(path, ("wavelength_nm", "a"))
    assert {name: values.tolist() for name, values in table.columns.items()} == {
        "wavelength_nm": [400, 500], "a": [0.1, 0.25], "b": [2, 0.3],
    }  # fmt: skip
    if b"source" in content:
        assert table.header.startswith("source: me")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wavelength_nm,a\n400,0,1\n", "line 2: 3 cells where the header has 2"),
        ('wavelength_nm,a\n400,"0,1"\n', "column a: '0,1' is not a finite number"),
        ("wavelength_nm\ta\n400\t0,1\n", "column a: '0,1' is not a finite number"),
        ("wavelength_nm;a\n400;1.234,5\n", "column a: '1.234,5' is not a finite number"),
        ("wavelength_nm;a\n400;0,1\n500;\n", "line 3, column a: '' is not a finite number"),
        ("wavelength_nm,a (1/cm)\n400,0.1\n", r"column a is missing; found .*a \(1/cm\)"),
        ("wavelength_nm a\n400 0.1\n", "separate the columns by commas"),
    ],
)
def test_what_may_mean_two_things_is_refused(text, words, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_table(path, ("wavelength_nm", "a"))


def test_only_the_columns_of_a_quantity_must_be_sound(tmp_path):
    path = tmp_path / "water.csv"
    path.write_text("wavelength_nm,station,temperature,a,b\n400,1,-1.2,1,2\n500,B2,nan,1,2\n")
    table = read_spectral_table(path, ("a", "b"), ("Kd",))
    assert set(table.columns) == {"wavelength_nm", "a", "b"}
    path.write_text("wavelength_nm,a,b,Kd\n400,1,2,n/a\n")
    with pytest.raises(InputError, match="column Kd"):
        read_spectral_table(path, ("a", "b", "Kd"))


@given(st.integers(1, 512), st.floats(300, 500), st.floats(501, 830))
def test_uniform_bands_tile_the_range(count, start, end):
    bands = Bands.uniform(count, start, end)
    assert len(bands) == count
    assert np.isclose(bands.widths.sum(), end - start)
    edges = bands.centres - bands.widths / 2
    assert np.allclose(edges, start + (end - start) * np.arange(count) / count)


@given(st.integers(1, 40), st.sampled_from([1, 3]))
def test_passes_carry_every_band_once(count, per_pass):
    passes = Bands.uniform(count).packed(per_pass)
    assert [i for indices in passes for i in indices] == list(range(count))
    assert all(1 <= len(indices) <= per_pass for indices in passes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Bands.uniform(0), "must be 1 to 512, got 0"),
        (lambda: Bands.uniform(3, 700, 400), "700 to 400 nm is empty"),
        (lambda: Bands.uniform(3, np.nan, 400), "empty or not positive"),
        (lambda: Bands.at_wavelengths([500, 400]), "must be positive and increase"),
        (lambda: Bands.at_wavelengths([]), "at least one band"),
        (lambda: Bands([400.0], [0.0]), "widths must be positive"),
    ],
)
def test_bad_bands(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_unknown_names_suggest():
    message = str(unknown_name("sensor", "arri", ["ARRI D21", "Nikon D200"]))
    assert message == "unknown sensor 'arri'. Near names: ARRI D21. Known: ARRI D21, Nikon D200"
