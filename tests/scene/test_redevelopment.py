"""Finished passes are developed again by their manifest alone, as if they had been rendered so."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.jobs import batch
from underwater_spectral.jobs.manifest import Output
from underwater_spectral.jobs.picture_files import files_of
from underwater_spectral.jobs.redevelopment import redeveloped
from underwater_spectral.scene import stored_settings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.manifests import small_manifest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

FAST = ["--samples", 2, "--resolution", 16, 9, "--phase", "hg:0.8", "--bands", 3]
OTHER = ["--sensor", "Nikon D7000", "--white-balance", "depth", "--tone", "agx", "--no-denoise"]


@pytest.fixture
def torch(tmp_path, empty_blender) -> Path:
    """Two cameras in water that gets greener, and a torch that shines as one of them exposes."""
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    scene = bpy.context.scene
    box = scenes._cube("box", (0.0, 8.0, -12.0))
    box.data.materials.append(scenes.principled("paint"))
    for name, y in (("far", 0.0), ("near", 5.0)):
        scenes.add_camera((0.0, y, -12.0)).name = name
    light = bpy.data.lights.new("torch", "POINT")
    light.energy = 500.0
    lamp = bpy.data.objects.new("torch", light)
    lamp.location = (0.0, 6.0, -11.0)
    scene.collection.objects.link(lamp)
    for frame, chlorophyll in ((1, 0.5), (2, 1.0)):
        scene.underwater.chlorophyll = chlorophyll
        scene.underwater.keyframe_insert("chlorophyll", frame=frame)
    path = tmp_path / "torch.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _contents(folder: Path) -> dict[str, bytes]:
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


JOB = [*FAST, "--water", "constituents", "--frames", "1-2", "--cameras", "near,far"]


@pytest.mark.slow
def test_it_is_the_picture_that_another_sensor_would_have_made(torch, capsys):
    """Pixels, layers and records are those of a render with these options; the job stays whole."""
    job, again, direct = (torch.with_name(name) for name in ("job", "again", "direct"))
    options = [*JOB, "--layers", "I"]
    assert _run(torch, *options, "--out", job) == 0
    assert _run(torch, *options, *OTHER, "--out", direct) == 0
    before = _contents(job)
    torch.unlink()
    assert _run("--from", job / "job.json", "--develop", *OTHER, "--out", again) == 0
    assert "4 picture(s)" in capsys.readouterr().out
    assert _contents(job) == before
    made = _contents(again)
    assert set(made) == {name for name in _contents(direct) if "passes/" not in name}
    for name in made:
        if name.endswith(".exr"):
            found = read_exr(again / name)[0]
            assert np.array_equal(found, read_exr(direct / name)[0]), name
            assert name.endswith("_spectral.exr") == np.array_equal(found, read_exr(job / name)[0])
        elif name.endswith(".png"):
            assert made[name] == (direct / name).read_bytes()
    records = [json.loads((x / "near" / "0002.json").read_text()) for x in (again, direct)]
    for part in ("settings", "development", "sources", "denoised", "key"):
        assert records[0][part] == records[1][part], part
    assert records[0]["passes"][0]["file"] == "../job/near/passes/0002/pass_00.exr"
    # Once more the same, or a part of it, is no other job; another sensor is.
    assert _run("--from", again / "job.json", "--develop", "--frames", 2) == 0
    assert _contents(again).keys() == made.keys()
    changed = ["--from", again / "job.json", "--develop", "--sensor", "ARRI D21"]
    assert _run(*changed, "--out", again) == _run(*changed, "--out", job) == 2
    assert capsys.readouterr().err.count("nothing is overwritten") == 2
    assert _run(*changed, "--out", torch.with_name("third")) == 0
    assert (torch.with_name("third") / "far" / "0001.png").exists()


@pytest.mark.slow
def test_exposure_by_the_picture_stays_what_the_scene_asked_for(torch):
    """Both by the stops that the job metered, to which a compensation is added."""
    job, again = torch.with_name("job"), torch.with_name("again")
    assert _run(torch, *JOB[:-4], "--frames", 1, "--exposure", "auto-picture", "--out", job) == 0
    changed = ["--from", job / "job.json", "--develop", "--out", again, "--no-denoise"]
    assert _run(*changed, "--exposure-compensation", 1) == 0
    found = [json.loads((x / "0001.json").read_text())["development"]["weights"]
             for x in (job, again)]  # fmt: skip
    assert np.array(found[1]) == pytest.approx(2.0 * np.array(found[0]), rel=1e-12)


@pytest.mark.slow
def test_what_cannot_be_developed_again(torch, capsys):
    job, out = torch.with_name("job"), torch.with_name("again")
    assert _run(torch, *FAST, "--out", job) == 0
    develop = ["--from", job / "job.json", "--develop"]
    taken = torch.with_name("taken")
    taken.mkdir()
    (taken / "0001.exr").touch()
    for options, message in (
        (["--sensor", "ARRI D21"], "--sensor: to develop otherwise, name an --out of its own"),
        (["--denoise"], "--denoise: to develop otherwise, name an --out of its own"),
        (["--sensor", "ARRI D21", "--out", job], "holds the job's own pictures"),
        (["--bands", 4, "--out", out], "--bands: the manifest decides"),
        (["--exposure", "auto-picture", "--out", out], "does not know what the picture asks for"),
        (["--sensor", "file:none.csv", "--out", out], "none.csv"),
        (["--sensor", "ARRI D21", "--out", taken], "0001.exr is there; name another --out"),
    ):
        assert _run(*develop, *options) == 2, options
        assert message in capsys.readouterr().err
        assert not out.exists()
    assert _run(*develop, "--tone", "agx", "--out", out) == 0
    assert _run("--from", out / "job.json") == 2
    assert "only develops; the passes are those of" in capsys.readouterr().err
    assert _run("--from", job / "job.json", "--tone", "agx", "--out", out) == 2
    assert "--tone: the manifest decides" in capsys.readouterr().err


def test_a_picture_of_real_time_keeps_its_sensor_and_takes_another_tone(tmp_path):
    drawn = Output("eevee", "realtime", "cpu", (8, 8, 100), 0, False, None, (50.0, 60.0), ())
    job = small_manifest(tmp_path / "job", output=drawn)
    with pytest.raises(InputError, match="--sensor: passes of realtime are colours of the sensor"):
        redeveloped(job, {"sensor": "ARRI D21"}, None, tmp_path / "again")
    made = redeveloped(job, {"tone": "agx"}, None, tmp_path / "again")
    (view,) = made.views
    assert made.developments == job.developments
    assert made.key(view, 0) == job.key(view, 0)
    assert made.pass_path(view, 0) == job.pass_path(view, 0)
    assert files_of(made, view).picture == tmp_path / "again" / "0001.exr"


@pytest.mark.slow
def test_the_header_of_a_picture_names_the_camera_and_nothing_of_ours(torch):
    out = torch.with_name("job")
    assert _run(torch, *FAST, "--camera", "far", "--out", out) == 0
    spec = oiio.ImageBuf(str(out / "0001.exr")).spec()
    found = {item.name: item.value for item in spec.extra_attribs}
    assert found["Camera"] == "far"
    assert found["colorInteropID"] == "lin_rec709_scene"
    texts = " ".join(str(value) for name, value in found.items() if name != "oiio:SourcePath")
    assert "UW " not in texts
    assert str(torch.parent) not in texts
