"""Layers of a picture, written and read."""

from __future__ import annotations

import json

import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.datasets.layer_file import (
    ATTRIBUTE,
    FrameLayers,
    LayerImage,
    bands_name,
    read_layers,
    write_layers,
)
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.layers import LAYERS, parse_layers
from underwater_spectral.uw_spectral.spectra.spectral_image import write_rgb_exr

RNG = np.random.default_rng(3)


def _frame() -> FrameLayers:
    depth = np.full((4, 5, 1), 12.3456789, np.float32)
    depth[0, 0] = np.inf
    return FrameLayers(
        {
            "D": LayerImage(RNG.random((4, 5, 3)), ("R", "G", "B"), "W m^-2 sr^-1", "direct"),
            bands_name("D"): LayerImage(RNG.random((4, 5, 2)), ("475,0nm", "625,0nm"), "1"),
            "range": LayerImage(depth, units="m", whole=True),
            "B": LayerImage(np.full((4, 5, 3), 1e-6), ("R", "G", "B")),
        },
        {"frame": 7, "instances": {"1": "rock"}},
        {"cryptomatte/abc1234/name": "CryptoObject"},
    )


def test_layers_come_back_with_their_units(tmp_path):
    path, frame = tmp_path / "0007_layers.exr", _frame()
    write_layers(path, frame)
    found = read_layers(path)
    assert list(found.layers) == ["D", "D_bands", "range", "B"]
    np.testing.assert_array_equal(found["range"], frame["range"])
    assert found["range"].shape == (4, 5)
    np.testing.assert_allclose(found["D"], frame["D"], rtol=5e-4)
    np.testing.assert_allclose(found.bands("D"), frame.bands("D"), rtol=5e-4)
    np.testing.assert_array_equal(found["B"], np.float32(1e-6))
    assert [x.units for x in found.layers.values()] == [x.units for x in frame.layers.values()]
    assert found.layers["D"].text == "direct"
    assert found.instances == {1: "rock"}
    assert found.header["frame"] == 7
    assert found.attributes == {"cryptomatte/abc1234/name": "CryptoObject"}
    assert "J" not in found
    with pytest.raises(InputError, match="there is no 'J'"):
        found["J"]


def test_channels_have_the_documented_names_and_digits(tmp_path):
    write_layers(tmp_path / "a.exr", _frame())
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    kinds = dict(zip(spec.channelnames, map(str, spec.channelformats), strict=True))
    assert kinds == {
        "D.R": "half", "D.G": "half", "D.B": "half",
        "D_bands.475,0nm": "half", "D_bands.625,0nm": "half",
        "range": "float",
        "B.R": "float", "B.G": "float", "B.B": "float",
    }  # fmt: skip
    header = json.loads(spec.get_string_attribute(ATTRIBUTE))
    assert header["layers"]["range"] == {"channels": [""], "units": "m", "text": ""}


def test_what_is_no_file_of_layers_is_refused(tmp_path):
    write_rgb_exr(tmp_path / "a.exr", np.ones((2, 2, 3)))
    with pytest.raises(InputError, match="holds no layers"):
        read_layers(tmp_path / "a.exr")
    with pytest.raises(InputError, match="no such file"):
        read_layers(tmp_path / "b.exr")
    with pytest.raises(InputError, match="there are no layers"):
        write_layers(tmp_path / "a.exr", FrameLayers({}))
    with pytest.raises(InputError, match="different sizes"):
        FrameLayers({"a": LayerImage(np.ones((1, 2, 1))), "b": LayerImage(np.ones((2, 2, 1)))})
    with pytest.raises(InputError, match=r"shape \(2, 2\) for 1"):
        LayerImage(np.ones((2, 2)))


def test_the_table_of_layers():
    assert parse_layers(" none ") == parse_layers("") == ()
    assert parse_layers("all") == tuple(layer.name for layer in LAYERS)
    for text in ("J,depth", "all,J", "none,J"):
        with pytest.raises(InputError, match="is not one of I, J, D"):
            parse_layers(text)
