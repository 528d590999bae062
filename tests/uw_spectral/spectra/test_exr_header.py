"""The header of an EXR, read without its pixels."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.spectra.exr_header import read_header
from underwater_spectral.uw_spectral.spectra.spectral_image import write_exr, write_rgb_exr


@pytest.mark.parametrize("height", [1, 9, 16, 17, 40])
def test_a_whole_image_and_every_cut_of_it(tmp_path, height):
    path = tmp_path / "image.exr"
    pixels = np.random.default_rng(1).random((height, 7, 3))
    write_rgb_exr(path, pixels, {"note": "ein Wert – 1"})
    header = read_header(path)
    assert header is not None
    assert (header.size, header.text["note"], header.whole) == ((7, height), "ein Wert – 1", True)
    content = path.read_bytes()
    for cut in (*range(0, len(content), 37), len(content) - 1):
        path.write_bytes(content[:cut])
        cropped = read_header(path)
        assert cropped is None or not cropped.whole


def test_a_long_text(tmp_path):
    path = tmp_path / "image.exr"
    write_rgb_exr(path, np.zeros((3, 3, 3)), {"note": "x" * 100000})
    header = read_header(path)
    assert header is not None
    assert len(header.text["note"]) == 100000


def test_a_long_name(tmp_path):
    path = tmp_path / "image.exr"
    write_exr(path, np.zeros((3, 3, 1)), ["B_multiple_bands.433,3333333333333nm"], {"note": "x"})
    header = read_header(path)
    assert header is not None
    assert (header.size, header.text["note"], header.whole) == ((3, 3), "x", True)


@pytest.mark.parametrize("content", [b"", b"not an image", bytes(1000), b"\x76\x2f\x31\x01" * 9])
def test_what_is_no_image(tmp_path, content):
    path = tmp_path / "image.exr"
    path.write_bytes(content)
    assert read_header(path) is None
    assert read_header(tmp_path) is None
    assert read_header(tmp_path / "none.exr") is None
