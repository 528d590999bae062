"""Sensors of any number of channels, and the colours that stand for them."""

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import DataWarning, InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.receptors import (
    FalseColour,
    parse_false_colour,
    parse_receptors,
)
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor

NAMES = tuple(f"N{peak}" for peak in range(420, 700, 30))
WAVELENGTHS = np.arange(380, 741, 5)
TABLE = np.exp(-(((WAVELENGTHS[:, None] - np.arange(420, 700, 30)) / 20.0) ** 2) / 2)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "eye.csv"
    rows = np.column_stack([WAVELENGTHS, TABLE])
    np.savetxt(path, rows, "%.9g", ",", header=",".join(("wavelength_nm", *NAMES)), comments="")
    return path


def test_each_column_is_a_channel(file):
    receptors = parse_receptors(f"file:{file}")
    assert receptors.channels == NAMES
    bands = Bands.uniform(60, 380, 740)
    # The integral of a Gaussian.
    np.testing.assert_allclose(
        receptors.response_in(bands).sum(axis=1)[1:-1], 20.0 * np.sqrt(2 * np.pi), rtol=2e-3
    )


def test_false_colours_are_means_over_white(file):
    receptors = parse_receptors(f"file:{file}")
    shown = parse_false_colour("n690, N540+N570 ,N420", receptors)
    assert shown == FalseColour((("N690",), ("N540", "N570"), ("N420",)))
    white = np.arange(1.0, 11.0)
    matrix = shown.matrix(receptors, white)
    np.testing.assert_allclose(matrix @ white, 1.0)
    assert matrix[1] @ (white * np.isin(NAMES, ["N570"])) == pytest.approx(0.5)
    assert parse_false_colour("", receptors).legend == {
        "R": "N690+N660+N630+N600", "G": "N570+N540+N510", "B": "N480+N450+N420",
    }  # fmt: skip


def test_two_receptors_share_what_is_shown(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("wavelength_nm,S,L\n400,1,0\n500,1,1\n600,0,1\n")
    receptors = parse_receptors(f"file:{path}")
    assert parse_false_colour("", receptors).legend == {"R": "L", "G": "S", "B": "S"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wavelength_nm,A\n400,1\n500,-1\n", "row 500 nm, column A: -1 is negative"),
        ("wavelength_nm,A,B\n400,1,0\n500,1,0\n", "B is zero at every wavelength"),
        ("wavelength_nm\n400\n500\n", "no column beside wavelength_nm"),
        ("wavelength_nm,A.B\n400,1\n500,1\n", "column 'A.B': name it with letters"),
        ("wavelength_nm,A\n400,nan\n500,1\n", "nan"),
    ],
)
def test_what_is_no_receptor_is_refused(text, message, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        parse_receptors(f"file:{path}")


def test_what_cannot_be_shown_or_seen_is_refused(file):
    receptors = parse_receptors(f"file:{file}")
    with pytest.raises(InputError, match="name what is shown as red, green and blue"):
        parse_false_colour("N690,N420", receptors)
    with pytest.raises(InputError, match="receptor of eye"):
        parse_false_colour("N690,N421,N420", receptors)
    with pytest.raises(InputError, match="give file:PATH"):
        parse_receptors("cie1931")
    beyond = Bands.uniform(3, 750, 800)
    with pytest.raises(InputError, match="N420 sees nothing of the bands, 758.333 to 791.667 nm"):
        receptors.response_in(beyond)
    with pytest.warns(DataWarning) as said:
        receptors.warn_doubts(beyond)
    assert "cover 0.0% of the least covered channel of eye" in str(said[0].message)
    assert "3 band(s) outside" in str(said[1].message)


def test_a_camera_says_which_of_its_columns_it_does_not_read(tmp_path):
    path = tmp_path / "four.csv"
    path.write_text("wavelength_nm,R,G,B,NIR\n400,0,0,1,0\n550,0,1,0,0\n700,1,0,0,1\n")
    with pytest.warns(DataWarning, match="column NIR is not read.*--receptors file:"):
        assert parse_sensor(f"file:{path}").sensitivity.values.shape == (3, 3)
