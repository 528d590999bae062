"""Pictures of sensors of any number of channels."""

import json

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.jobs import batch
from underwater_spectral.uw_spectral.spectra.receptors import parse_receptors
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, read_spectral_exr

REALTIME = ("--engine", "eevee", "--mode", "realtime")
PEAKS = np.arange(420, 660, 20)


@pytest.fixture
def eye(tmp_path):
    """A file of twelve receptors."""
    wavelengths = np.arange(380, 741, 5)
    table = np.exp(-(((wavelengths[:, None] - PEAKS) / 15.0) ** 2) / 2)
    names = ",".join(("wavelength_nm", *(f"N{peak}" for peak in PEAKS)))
    path = tmp_path / "eye.csv"
    np.savetxt(path, np.column_stack([wavelengths, table]), "%.9g", ",", header=names, comments="")
    return f"file:{path}"


def _shown(path):
    """Linear colours of a PNG."""
    codes = oiio.ImageInput.open(str(path)).read_image("float")
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def _run(*arguments):
    return batch.main([str(a) for a in arguments], inside_blender=False)


def test_twelve_channels_are_the_bands_through_twelve_sensitivities(blend, eye, tmp_path):
    out = tmp_path / "out"
    size = (
        "--resolution",
        32,
        18,
        "--samples",
        1,
        "--bands",
        12,
        "--range",
        370,
        700,
        "--no-denoise",
    )
    shown = ("--receptors", eye, "--false-colour", "N640,N520+N540,N420", "--exposure", 0)
    assert _run(blend, *size, *shown, "--out", out) == 0
    radiance, bands, _ = read_spectral_exr(out / "0001_spectral.exr")
    expected = radiance.astype(np.float64) @ parse_receptors(eye).response_in(bands).T
    found, names = read_exr(out / "0001_receptors.exr")
    assert names == [f"N{peak}" for peak in PEAKS]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * expected.max())
    tiff = oiio.ImageInput.open(str(out / "0001_receptors.tiff"))
    assert tiff.spec().getattribute("ImageDescription") == ", ".join(names)
    np.testing.assert_array_equal(tiff.read_image("float"), found)

    record = json.loads((out / "0001.json").read_text())["receptors"]
    assert record["channels"] == names
    legend = record["false_colour"]
    assert (legend["R"], legend["G"], legend["B"]) == ("N640", "N520+N540", "N420")
    parts = found / np.array(legend["white"]) * 2.0 ** legend["stops"]
    colours = np.stack([parts[..., 11], parts[..., 5:7].mean(axis=-1), parts[..., 0]], axis=-1)
    assert legend["stops"] == pytest.approx(0.0, abs=1e-9)
    codes = _shown(out / "0001_receptors.png")
    np.testing.assert_allclose(codes, np.clip(colours, 0, 1), atol=0.01)

    again = ("--from", out / "job.json", "--develop", "--false-colour", "N420,N520,N640")
    assert _run(*again, "--out", tmp_path / "again") == 0
    swapped = _shown(tmp_path / "again" / "0001_receptors.png")
    np.testing.assert_allclose(swapped[..., ::2], codes[..., 2::-2], atol=1e-6)


def test_at_night_the_light_of_lamps_is_white(blend, eye, tmp_path):
    lamp = bpy.data.objects.new("torch", bpy.data.lights.new("torch", "POINT"))
    lamp.location, lamp.data.energy = (0.5, 0.0, -5.0), 100.0
    bpy.context.scene.collection.objects.link(lamp)
    bpy.ops.wm.save_mainfile()
    options = ("--resolution", 16, 9, "--samples", 1, "--bands", 12, "--range", 370, 700)
    night = ("--sunlight", 0, "--white-balance", "depth", "--receptors", eye)
    assert _run(blend, *options, *night, "--out", tmp_path / "out") == 0
    record = json.loads((tmp_path / "out" / "0001.json").read_text())["receptors"]
    assert min(record["false_colour"]["white"]) > 0.0
    picture = json.loads((tmp_path / "out" / "0001.json").read_text())
    assert f"{record['false_colour']['stops']:+.2f} stops" in str(picture)


def test_real_time_refuses_them_before_it_renders(blend, eye, tmp_path, capsys):
    out = tmp_path / "out"
    assert _run(blend, *REALTIME, "--receptors", eye, "--out", out) == 2
    assert "--receptors: real time draws the colours of the sensor alone" in capsys.readouterr().err
    assert _run(blend, "--receptors", "file:none.csv", "--out", out) == 2
    assert "cannot read none.csv" in capsys.readouterr().err
