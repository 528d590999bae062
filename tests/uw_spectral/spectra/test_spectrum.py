"""Spectra, tables and bands: values, refusals, messages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from underwater_spectral.uw_spectral.errors import InputError, unknown_name
from underwater_spectral.uw_spectral.spectra.bands import Bands
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
        ("wavelength_nm,a\n400,x\n", "line 2, column a: 'x' is not a finite number"),
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


def test_byte_order_mark_and_comments(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("\ufeff# source: me\nwavelength_nm,a\n400,1\n", encoding="utf-8")
    table = read_table(path)
    assert table.header == "source: me"
    assert table.columns["a"].tolist() == [1.0]


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
