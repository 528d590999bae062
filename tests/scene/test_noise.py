"""Pictures of Cycles are rendered until their noise is what is wanted."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import batch, render_job
from underwater_spectral.jobs.manifest_files import read_manifest
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

LOOK = ["--resolution", "32", "18", "--phase", "hg:0.8", "--floor-depth", "9", "--bands", "9"]
FAST = [*LOOK, "--no-denoise"]


@pytest.fixture
def blend(tmp_path) -> Path:
    scenes.varied_scene()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _noise(out: Path) -> dict:
    return json.loads((out / "0001.json").read_text())["noise"]


def _files(out: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in (out / "passes").rglob("*_part_*.exr")}


@pytest.mark.slow
def test_the_noise_is_what_is_said_and_heavy_bands_have_more_samples(blend, tmp_path, capsys):
    out, truth = tmp_path / "out", tmp_path / "truth"
    assert _run(blend, *FAST, "--noise", 4, "--samples", 256, "--out", out) == 0
    found = _noise(out)
    assert found["wanted_delta_e"] == 4.0
    assert 3.0 < found["reached_delta_e"] <= 4.0
    assert f"note: noise: ΔE2000 {found['reached_delta_e']:.3g}" in capsys.readouterr().out
    assert _run(blend, *FAST, "--samples", 400, "--seed", 5, "--out", truth) == 0
    picture, independent = (read_exr(folder / "0001.exr")[0] for folder in (out, truth))
    error = delta_e_CIE2000_images(picture, independent).mean()
    assert found["reached_delta_e"] == pytest.approx(error, rel=0.25)
    # 400 to 500, to 600 and to 700 nm: the sensor weighs the middle most.
    samples = found["samples"]
    assert samples[1] > np.mean(samples)
    record = json.loads((out / "0001.json").read_text())
    assert [sum(part["samples"]) for part in record["parts"]] == samples


@pytest.mark.slow
def test_a_job_that_was_stopped_ends_as_if_it_had_not_been(blend, tmp_path):
    whole, out = tmp_path / "whole", tmp_path / "out"
    options = [blend, *FAST, "--noise", 6, "--samples", 128]
    assert _run(*options, "--out", whole) == 0
    assert _run(*options, "--out", out) == 0
    np.testing.assert_array_equal(*(read_exr(f / "0001.exr")[0] for f in (whole, out)))
    # As if it had been stopped in the third round of one pass.
    for path in (out / "passes" / "0001").glob("pass_0[12]_part_*.exr"):
        if int(path.stem[-2:]) > 4:
            path.unlink()
    (out / "0001.json").unlink()
    before = _files(out)
    assert _run(*options, "--resume", "--out", out) == 0
    np.testing.assert_array_equal(*(read_exr(f / "0001.exr")[0] for f in (whole, out)))
    assert {path: time for path, time in _files(out).items() if path in before} == before
    assert _noise(out) == _noise(whole)
    # Less noise goes on with what is there; another picture of it is developed without rendering.
    before = _files(out)
    options[options.index(6)] = 5
    assert _run(*options, "--resume", "--out", out) == 0
    assert _noise(out)["reached_delta_e"] <= 5
    after = _files(out)
    assert len(after) > len(before)
    assert {path: after[path] for path in before} == before
    manifest = read_manifest(out / "job.json")
    (out / "0001.exr").unlink()
    assert list(render_job.develop(manifest, manifest.views, print)) == list(manifest.views)
    assert (out / "0001.exr").is_file()
    assert _files(out) == after


def test_a_noise_that_is_not_reached_is_said(blend, tmp_path, capsys):
    out = tmp_path / "out"
    assert _run(blend, *LOOK, "--noise", 0.1, "--samples", 16, "--out", out) == 0
    said = capsys.readouterr().out
    assert "the most that --samples allows; 0.1 was wanted: about --samples" in said
    found, record = _noise(out), json.loads((out / "0001.json").read_text())
    assert found["reached_delta_e"] > 0.1
    assert found["samples"] == [16, 16, 16]
    assert any(note.startswith("noise: ") for note in record["notes"])
    assert "guided by albedo and normal" in record["denoised"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--plan", "job.json"], "--plan: with --noise"),
        (["--bundle", "farm"], "--bundle: with --noise"),
        (["--parts", 2], "--parts: --noise has parts of its own"),
        (["--engine", "eevee"], "--noise: eevee has no such noise"),
    ],
)
def test_where_noise_cannot_be_wanted_it_is_refused(blend, tmp_path, capsys, options, said):
    options = [tmp_path / x if x in ("job.json", "farm") else x for x in options]
    assert _run(blend, *FAST, "--noise", 1, *options, "--out", tmp_path / "out") == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_others_cannot_join(blend, tmp_path, capsys):
    out = tmp_path / "out"
    assert _run(blend, *FAST, "--noise", 50, "--samples", 8, "--out", out) == 0
    for options in (["--from"], ["--status"]):
        assert _run(*options, out / "job.json") == 2
        assert f"{options[0]}: with --noise" in capsys.readouterr().err
    assert _run("--from", out / "job.json", "--develop") == 0


def test_data_sets_have_samples(tmp_path, blend, capsys):
    spec = tmp_path / "set.toml"
    spec.write_text(
        "title = 'Discs'\nlicence = 'CC0-1.0'\nseed = 5\n"
        "[water]\nname = 'jerlov:IB'\n[sun]\nzenith = 30\n[scene]\nfile = 'scene.blend'\n"
        "[render]\nengine = 'cycles'\nnoise = 1.0\n"
        "[[camera]]\nname = 'probe'\nwidth = 16\nheight = 12\nfocal = [15, 16]\ncentre = [8, 6]\n"
        "[[poses]]\nname = 'around'\nkind = 'orbit'\ntarget = [0, 0, -3]\nradius = 3\ncount = 2\n"
        "elevation = 25\nstart = 0\narc = 30\n[[rig]]\nname = 'sun alone'\n"
        "[splits]\ntrain = 1\nval = 0\ntest = 0\n[output]\nlayers = 'position'\n"
    )
    assert _run("--dataset", spec, "--out", tmp_path / "out") == 2
    assert "--noise: the views of a data set" in capsys.readouterr().err
