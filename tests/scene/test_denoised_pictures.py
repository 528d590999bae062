"""Pictures of Cycles are denoised as they are developed; what is measured is not."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.datasets.layer_file import read_layers
from underwater_spectral.jobs import batch, command_line, development
from underwater_spectral.jobs.development import Guides
from underwater_spectral.scene.engines.denoising_guides import ALBEDO, NORMAL
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr

FAST = ["--samples", "4", "--resolution", "48", "27", "--phase", "hg:0.8", "--floor-depth", "9"]
SIZE = (64, 96)


@pytest.fixture
def blend(tmp_path) -> Path:
    scenes.varied_scene()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _job(*arguments: str):
    return command_line.job(command_line.parse(arguments))


def test_noise_goes_and_negative_colours_stay(tmp_path):
    random = np.random.default_rng(1)
    # Stripes of four pixels, which the noise nearly hides.
    stripes = np.where(np.arange(SIZE[1]) // 4 % 2, 0.25, 0.45)[None, :, None]
    radiance = np.broadcast_to(stripes, (*SIZE, 3))
    noisy = radiance * random.gamma(2.0, 0.5, size=(*SIZE, 3))
    weights = np.array([[0.3, -0.8, 0.2], [0.1, 1.0, 0.3], [0.0, 0.2, 1.0]])
    path = tmp_path / "0.exr"
    write_rgb_exr(path, noisy)
    guides = Guides(radiance, np.zeros((*SIZE, 3)))
    found, without = (
        development.develop([path], weights, [(0, 1, 2)], denoise=True, guides=chosen)
        for chosen in (guides, None)
    )
    truth = radiance @ weights.T
    assert truth[..., 0].max() < 0.0
    raw = noisy @ weights.T
    for channel in range(3):
        errors = [np.abs(x - truth)[..., channel].mean() for x in (found, without, raw)]
        assert errors[0] < 0.15 * errors[2]
        assert errors[0] < 0.5 * errors[1]
        assert found[..., channel].mean() == pytest.approx(truth[..., channel].mean(), rel=0.1)


@pytest.mark.slow
def test_a_picture_is_denoised_and_what_is_measured_is_not(blend, tmp_path, capsys):
    raw, out = tmp_path / "raw", tmp_path / "out"
    options = [blend, *FAST, "--bands", 4, "--layers", "I"]
    assert _run(*options, "--no-denoise", "--out", raw) == 0
    assert _run(*options, "--out", out) == 0
    for name in ("0001_spectral.exr", "passes/0001/pass_00.exr", "passes/0001/pass_01.exr"):
        np.testing.assert_array_equal(read_exr(out / name)[0], read_exr(raw / name)[0])
    layers = [read_layers(folder / "0001_layers.exr") for folder in (out, raw)]
    np.testing.assert_array_equal(*(found["I"] for found in layers))
    assert set(layers[0].layers) == {"I", "I_bands"}  # the guides are no layers of the picture
    noisy, clean = (read_exr(folder / "0001.exr")[0] for folder in (raw, out))
    assert np.abs(np.diff(clean, axis=1)).mean() < 0.7 * np.abs(np.diff(noisy, axis=1)).mean()
    assert clean.mean() == pytest.approx(noisy.mean(), rel=0.05)
    records = [json.loads((folder / "0001.json").read_text()) for folder in (out, raw)]
    assert "guided by albedo and normal" in records[0]["denoised"]
    assert records[1]["denoised"] == ""
    assert "without guides" not in capsys.readouterr().out

    # Developed again from what is there, both ways.
    times = {path: path.stat().st_mtime_ns for path in (out / "passes").rglob("*.exr")}
    assert _run(*options, "--no-denoise", "--resume", "--out", out) == 0
    np.testing.assert_array_equal(read_exr(out / "0001.exr")[0], noisy)
    assert _run(*options, "--resume", "--out", out) == 0
    np.testing.assert_array_equal(read_exr(out / "0001.exr")[0], clean)
    assert {path: path.stat().st_mtime_ns for path in (out / "passes").rglob("*.exr")} == times


def test_guides_are_those_of_all_bands_and_parts(blend, tmp_path):
    out = tmp_path / "out"
    assert _run(blend, *FAST, "--bands", 4, "--parts", 2, "--out", out) == 0
    files = sorted((out / "passes" / "0001").glob("*_layers.exr"))
    assert len(files) == 4
    first = read_layers(files[0])
    for name, least in ((ALBEDO, 0.3), (NORMAL, 0.1)):
        assert first[name].shape == (27, 48, 3)
        assert np.abs(first[name]).max() > least
    assert "guided" in json.loads((out / "0001.json").read_text())["denoised"]


def test_passes_without_guides_and_particles_are_said(blend, tmp_path, capsys):
    out = tmp_path / "out"
    options = [blend, *FAST, "--bands", 3, "--snow", 50, "--out", out]
    assert _run(*options, "--no-denoise") == 0
    assert "denoised" not in capsys.readouterr().out
    noisy = read_exr(out / "0001.exr")[0]
    assert _run(*options, "--resume") == 0
    said = capsys.readouterr().out
    assert "note: denoised without guides" in said
    assert "note: denoised: faint particles" in said
    record = json.loads((out / "0001.json").read_text())
    assert record["denoised"].endswith("without guides")
    assert sum("denoised" in note for note in record["notes"]) == 2
    assert np.abs(read_exr(out / "0001.exr")[0] - noisy).max() > 0.0


def test_what_is_denoised_unless_it_is_said():
    assert _job().denoise
    assert not _job("--no-denoise").denoise
    assert not _job("--engine", "eevee").denoise
    assert not _job("--dataset", "reef.toml").denoise
    assert _job("--dataset", "reef.toml", "--denoise").denoise
    with pytest.raises(InputError, match="--denoise: eevee"):
        _job("--engine", "eevee", "--denoise")
