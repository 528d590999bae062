"""Raw files of renders: their noise is the detector's, and developers open them."""

from __future__ import annotations

import itertools
import json

import numpy as np
import OpenImageIO as oiio
import pytest
import rawpy
from underwater_spectral.jobs import batch
from underwater_spectral.uw_spectral.detector import Detector
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

SIZE = (320, 180)
ISO, READ = 400.0, 9.0


def _run(*arguments):
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _raw(blend, out, *options):
    fixed = ("--resolution", *SIZE, "--samples", 1, "--bands", 3, "--sensor", "Nikon D7000")
    taken = ("--iso", ISO, "--read-noise", READ, "--no-diffuse-shadows")
    assert _run(blend, *fixed, *taken, "--engine", "eevee", *options, "--out", out) == 0


def _pair(out):
    files = (oiio.ImageInput.open(str(out / f"000{frame}.tiff")) for frame in (1, 2))
    return [file.read_image("uint16").astype(np.float64) for file in files]


@pytest.mark.slow
def test_noise_of_a_rendered_raw_file_is_the_detectors(blend, tmp_path):
    """By pairs of pictures of the same scene, as EMVA 1288 takes them."""
    out = tmp_path / "light"
    _raw(blend, out, "--raw", "tiff", "--frames", "1-2", "--exposure-compensation", 3.5)
    one, two = _pair(out)
    detector = Detector(read_noise=READ)
    K, black = detector.gain_at(ISO), detector.black_level
    means, halves = (one + two) / 2.0 - black, (one - two) ** 2 / 2.0
    inside = means < 0.7 * (2**detector.bits - 1 - black)
    assert inside.mean() > 0.9
    assert means[inside].max() > 1000.0
    levels = np.quantile(means[inside], np.linspace(0.0, 1.0, 5))
    for low, high in itertools.pairwise(levels):
        here = inside & (means >= low) & (means <= high)
        expected = (K * READ) ** 2 + 1.0 / 12.0 + K * means[here].mean()
        assert halves[here].mean() == pytest.approx(expected, rel=0.02)
    # What they count is the picture: the white of it fills half of the range.
    record = json.loads((out / "0001.json").read_text())["raw"]
    linear = read_exr(out / "0001.exr")[0].astype(np.float64)
    channels = linear @ np.linalg.inv(np.array(record["to_linear_rec709"])).T
    electrons = np.clip(channels / record["saturation"], 0.0, 1.0) * detector.full_well
    dark = detector.dark_current * record["exposure_time"]
    assert means[inside].mean() == pytest.approx(K * (electrons + dark)[inside].mean(), rel=0.005)


@pytest.mark.slow
def test_a_dark_frame_is_the_read_noise(blend, tmp_path):
    _raw(blend, tmp_path, "--raw", "tiff", "--frames", "1-2", "--sunlight", 0, "--exposure", 0)
    one, two = _pair(tmp_path)
    detector = Detector(read_noise=READ)
    spread = np.sqrt(((one - two) ** 2).mean() / 2.0)
    expected = np.sqrt((detector.gain_at(ISO) * READ) ** 2 + 1.0 / 12.0)
    assert spread == pytest.approx(expected, rel=0.02)
    assert one.mean() == pytest.approx(detector.black_level, abs=0.1)


def test_a_mosaic_needs_a_camera(blend, tmp_path, capsys):
    assert _run(blend, "--raw", "dng", "--samples", 1, "--out", tmp_path / "out") == 2
    assert "has no mosaic" in capsys.readouterr().err


def test_finished_passes_are_developed_to_raw_files(blend, tmp_path):
    _raw(blend, tmp_path / "out")
    assert not list((tmp_path / "out").glob("*.dng"))
    again = ("--from", tmp_path / "out" / "job.json", "--develop", "--raw", "dng")
    assert _run(*again, "--out", tmp_path / "raw") == 0
    with rawpy.imread(str(tmp_path / "raw" / "0001.dng")) as raw:
        assert raw.raw_image.shape == SIZE[::-1]
