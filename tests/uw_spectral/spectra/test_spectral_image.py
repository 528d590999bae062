"""Images on disk: exact round trips, whole or not at all, clear errors."""

from __future__ import annotations

import os

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.spectral_image import (
    read_exr,
    read_spectral_exr,
    replacing,
    spectral_channels,
    write_exr,
    write_png,
    write_rgb_exr,
    write_spectral_exr,
)


@pytest.mark.parametrize("count", [1, 8, 31])
def test_spectral_round_trip_is_exact(tmp_path, count):
    bands = Bands.uniform(count, 395, 705)
    pixels = np.random.default_rng(count).lognormal(sigma=5, size=(5, 7, count)).astype(np.float32)
    path = tmp_path / "bands.exr"
    write_spectral_exr(path, pixels, bands, {"water": "Jerlov IB"}, "sr^-1")
    found, found_bands, units = read_spectral_exr(path)
    assert np.array_equal(found, pixels)
    assert np.array_equal(found_bands.centres, bands.centres)
    assert np.array_equal(found_bands.widths, bands.widths)
    assert units == "sr^-1"


def test_layout_of_fichet_2021(tmp_path):
    import OpenImageIO as oiio

    path = tmp_path / "bands.exr"
    write_spectral_exr(path, np.ones((1, 1, 2)), Bands.at_wavelengths([450.0, 512.5]))
    spec = oiio.ImageInput.open(str(path)).spec()
    assert set(spec.channelnames) == {"S0.450,0nm", "S0.512,5nm"}
    assert spec.get_string_attribute("spectralLayoutVersion") == "1.0"
    assert spec.get_string_attribute("emissiveUnits") == "W.m^-2.sr^-1.nm^-1"
    assert spectral_channels(Bands.uniform(2)) == ["S0.475,0nm", "S0.625,0nm"]


def test_png_is_srgb(tmp_path):
    import OpenImageIO as oiio

    path = tmp_path / "picture.png"
    write_png(path, np.array([[[0.0, 0.5, 1.0], [np.nan, -1.0, 9.0]]]))
    codes = oiio.ImageInput.open(str(path)).read_image("uint8")
    assert codes[0, 0].tolist() == [0, 188, 255]
    assert codes[0, 1].tolist() == [0, 0, 255]


@pytest.mark.parametrize("keep", [0, 10, 0.5, 0.99])
def test_truncation_is_seen(tmp_path, keep):
    path = tmp_path / "image.exr"
    write_rgb_exr(path, np.random.default_rng(1).random((40, 60, 3)))
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole)) if keep < 1 else keep])
    with pytest.raises(InputError, match="damaged"):
        read_exr(path)


def test_missing_and_foreign_files(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_exr(tmp_path / "none.exr")
    write_rgb_exr(tmp_path / "rgb.exr", np.ones((2, 2, 3)))
    with pytest.raises(InputError, match="has no spectral channels"):
        read_spectral_exr(tmp_path / "rgb.exr")


def test_nothing_half_written_is_left(tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(InputError, match="is not a folder; create it first"):
        write_exr(tmp_path / "none" / "x.exr", np.ones((1, 1, 1)), ("Y",))
    with pytest.raises(InputError, match="for 2 channels"):
        write_exr(path, np.ones((1, 1, 1)), ("R", "G"))


def test_processes_of_one_number_write_under_names_of_their_own(tmp_path):
    """Containers share numbers of processes and a folder; the number is what a sweep goes by."""
    path = tmp_path / "pass_00.exr"
    with replacing(path) as one, replacing(path) as other:
        assert one != other
        one.write_text("one")
        other.write_text("other")
        assert set(tmp_path.glob(f".pass_00.{os.getpid()}.*")) == {one, other}
    assert path.read_text() == "one"
    assert list(tmp_path.iterdir()) == [path]
