"""Jobs that are split: whatever the cut, the pictures are those of one process, bit by bit."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path, PureWindowsPath

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import (
    band_passes,
    batch,
    claims,
    command_line,
    job_files,
    job_status,
    manifest_files,
    path_mapping,
    picture_files,
    planning,
    render_job,
    work,
)
from underwater_spectral.jobs import manifest as manifests
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.readers import external_files
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.manifests import small_manifest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr

ROOT = Path(__file__).resolve().parents[2]
FAST = ["--samples", 2, "--resolution", 16, 9, "--phase", "hg:0.8", "--bands", 4]
EEVEE = ["--engine", "eevee", "--frames", "1-2"]
DIVE = [*FAST, "--water", "constituents", "--frames", "1-3"]


@pytest.fixture
def dive(tmp_path, empty_blender) -> Path:
    """A camera that sinks and a box that moves, in water that gets greener."""
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    scene = bpy.context.scene
    box = scenes._cube("box", (0.0, 8.0, -6.0))
    box.data.materials.append(scenes.principled("paint"))
    camera = scenes.add_camera()
    for frame, fraction in ((1, 0.0), (4, 1.0)):
        camera.location.z, box.location.x = -5.0 - fraction, fraction
        camera.keyframe_insert("location", frame=frame)
        box.keyframe_insert("location", frame=frame)
        scene.underwater.chlorophyll = 0.5 + fraction
        scene.underwater.keyframe_insert("chlorophyll", frame=frame)
    path = tmp_path / "dive.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _worker(*arguments: object) -> subprocess.Popen:
    script = [sys.executable, ROOT / "render_bands.py", *arguments]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        list(map(str, script)), stdout=subprocess.PIPE, text=True, env=environment
    )


def _finish(*workers: subprocess.Popen) -> list[str]:
    printed = [worker.communicate(timeout=240)[0] for worker in workers]
    assert [worker.returncode for worker in workers] == [0] * len(workers), printed
    return printed


def _assert_equal(folder: Path, other: Path) -> None:
    """Every picture of two folders, bit by bit; no claim or temporary file is left."""
    names = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    assert names == sorted(path.relative_to(other) for path in other.rglob("*") if path.is_file())
    assert any(name.suffix == ".exr" for name in names)
    for name in names:
        assert not name.name.startswith(".")
        if name.suffix == ".exr":
            assert np.array_equal(read_exr(folder / name)[0], read_exr(other / name)[0]), name
        elif name.suffix == ".png":
            assert (folder / name).read_bytes() == (other / name).read_bytes(), name


def _planned(dive: Path, *options: object, out: str = "split") -> Path:
    path = dive.with_name(f"{out}.json")
    arguments = [dive, *DIVE, *options, "--out", dive.with_name(out), "--plan", path]
    assert _run(*arguments) == 0
    assert not dive.with_name(out).exists()
    return path


def test_folders_of_cameras_of_like_names_differ():
    folders = [camera.folder for camera in manifests.folders(["Left/eye", "Left eye"])]
    assert folders == ["Left_eye", "Left_eye_2"]


def test_a_plan_brings_its_own_folder(dive):
    path = dive.with_name("plans") / "of today" / "job.json"
    assert _run(dive, *DIVE, "--out", dive.with_name("results"), "--plan", path) == 0
    assert json.loads(path.read_text())["scene"] == "../../dive.blend"
    assert not dive.with_name("results").exists()


def _rendered(dive: Path, *options: object) -> Path:
    assert _run(dive, *DIVE, *options, "--out", dive.with_name("whole")) == 0
    return dive.with_name("whole")


# --- The same pictures ------------------------------------------------------------------------


def test_passes_and_frames_in_other_processes_give_the_same_pictures(dive):
    path = _planned(dive)
    # The last pass of the last frame first, two workers at once, then the rest.
    _finish(_worker("--from", path, "--frames", 3, "--passes", 1))
    workers = [_worker(dive, "--from", path), _worker("--from", path, "--progress", "openjd")]
    printed = _finish(*workers)
    counts = [re.search(r"done: (\d+) pass", text) for text in printed]
    assert sum(int(count[1]) for count in counts if count) >= 5
    assert "openjd_progress: " in printed[1]
    assert _run("--from", path, "--develop") == 0
    _assert_equal(_rendered(dive), dive.with_name("split"))
    record = json.loads((dive.with_name("split") / "0002.json").read_text())
    assert all(item["seconds"] > 0 for item in record["passes"])
    whole = json.loads((dive.with_name("whole") / "0002.json").read_text())
    for other in (record, whole):
        del other["job"]["out"]
        for item in other["passes"]:
            del item["seconds"]
    assert record == whole


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        ["--surface", "waves", "--wave-resolution", 32, "--floor-depth", 9],
        ["--band-placement", "optimised", "--bands", 6],
        ["--inelastic", "raman"],
        [*EEVEE, "--mode", "bands"],
        [*EEVEE, "--mode", "realtime"],
        [*EEVEE, "--mode", "realtime", "--shafts"],
    ],
    ids=["waves", "optimised", "raman", "eevee", "realtime", "shafts"],
)
def test_a_dive_that_is_cut_at_every_frame_is_the_uncut_one(dive, options):
    path = _planned(dive, *options)
    for frame in reversed(json.loads(path.read_text())["frames"]):
        _finish(_worker("--from", path, "--frames", frame))
    _finish(_worker("--from", path, "--develop"))
    whole = dive.with_name("whole")
    # As the workers, without the coarse occlusion of tests.
    _finish(_worker(dive, *DIVE, *options, "--out", whole))
    if "--shafts" not in options:
        _assert_equal(whole, dive.with_name("split"))
        return
    # EEVEE samples a volume otherwise where it has drawn a frame before.
    for name in ("0001.exr", "0002.exr"):
        one, other = (read_exr(folder / name)[0] for folder in (whole, dive.with_name("split")))
        np.testing.assert_allclose(one, other, atol=2e-3 * one.max())


def _until(there: Callable[[], object], *workers: subprocess.Popen) -> None:
    deadline = time.monotonic() + 120
    while not there():
        assert all(worker.poll() is None for worker in workers)
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize("others", [0, 1])
def test_a_worker_that_is_killed_loses_its_pass_which_others_render(dive, others):
    options = ["--frames", 1, "--samples", 1500, "--resolution", 32, 18]
    path, out = _planned(dive, *options), dive.with_name("split")
    worker = _worker("--from", path)
    _until(lambda: list(out.rglob(".pass_00.claim")), worker)
    rest = [_worker("--from", path) for _ in range(others)]
    if others:
        _until(lambda: list(out.rglob(".pass_01.claim")), worker, *rest)
    time.sleep(0.2)
    worker.send_signal(signal.SIGKILL)
    worker.communicate()
    assert not list(out.rglob("pass_00.exr"))
    assert list(out.rglob(".pass_00.claim"))
    # With another at work it renders that pass too, else one that is started later.
    _finish(*rest or [_worker("--from", path)])
    assert not list(out.rglob(".*"))
    assert _run("--from", path, "--develop") == 0
    _assert_equal(_rendered(dive, *options), out)


def test_several_cameras_share_bands_and_exposure(dive, capsys):
    bpy.ops.wm.open_mainfile(filepath=str(dive))
    first = bpy.context.scene.camera
    first.name = "Left/eye"
    second = first.copy()
    second.name, second.location.x = "Right", 0.3
    second.animation_data_clear()
    second.location.z = -7.0
    bpy.context.scene.collection.objects.link(second)
    bpy.ops.wm.save_as_mainfile(filepath=str(dive))
    cameras = ["--cameras", "Left/eye,Right", "--frames", "1-2"]
    path, whole = _planned(dive, *cameras), _rendered(dive, *cameras)
    assert _run("--from", path, "--cameras", "Right") == 0
    assert _run("--from", path) == 0
    assert _run("--from", path, "--develop") == 0
    _assert_equal(whole, dive.with_name("split"))
    left, right = (
        json.loads((whole / name / "0002.json").read_text()) for name in ("Left_eye", "Right")
    )
    assert left["development"] == right["development"]
    assert left["camera_depth_m"] < right["camera_depth_m"] == 7.0
    alone = dive.with_name("alone")
    assert _run(dive, *DIVE, "--frames", 2, "--camera", "Left/eye", "--out", alone) == 0
    # Its water reaches less deep than that for both cameras.
    pictures = (read_exr(folder / "0002.exr")[0] for folder in (alone, whole / "Left_eye"))
    assert np.allclose(*pictures, rtol=1e-3, atol=1e-5)
    assert _run("--from", path, "--cameras", "Middle") == 2
    assert "--cameras: the job has no cameras Middle; there are: Left/eye, Right" in (
        capsys.readouterr().err
    )


def test_parts_of_a_pass_are_averaged_and_their_variance_is_recorded(dive, capsys):
    options = ["--frames", 1, "--samples", 7, "--parts", 3]
    path, out = _planned(dive, *options), dive.with_name("split")
    assert _run("--from", path, "--passes", "1,3-5") == 0
    assert _run("--from", path) == 0
    assert _run("--from", path, "--develop") == 0
    _assert_equal(_rendered(dive, *options), out)
    folder = out / "passes" / "0001"
    parts = np.stack([read_exr(folder / f"pass_00_part_{n:02d}.exr")[0] for n in range(3)])
    assert len({part.tobytes() for part in parts}) == 3
    weights = np.full((3, 1, 1, 1), 1 / 3)
    mean = (parts * weights).sum(axis=0)
    assert np.allclose(read_exr(folder / "pass_00.exr")[0], mean, rtol=1e-6)
    recorded = json.loads((out / "0001.json").read_text())["parts"]
    assert recorded[0]["samples"] == [3, 3, 3]
    variance = (weights * (parts - mean) ** 2).sum(axis=0) / 2
    assert np.allclose(recorded[0]["variance_of_the_mean"], variance.mean(axis=(0, 1)), rtol=1e-4)
    capsys.readouterr()
    for more, message in (
        (["--parts", 8], "--parts: 8 parts of 7 samples; take fewer"),
        (["--parts", 0], "--parts: 0 is not 1 or more"),
        (["--engine", "eevee", "--mode", "realtime"], "the noise of eevee has no seed"),
    ):
        assert _run(dive, *DIVE, *options, *more, "--out", out) == 2
        assert message in capsys.readouterr().err


def test_resume_goes_on_with_more_frames_of_animated_water(dive):
    out = dive.with_name("whole")
    assert _run(dive, *DIVE, "--frames", "1-2", "--out", out) == 0
    stamp = (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns
    assert _run(dive, *DIVE, "--frames", "1-3", "--out", out, "--resume") == 0
    assert (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns == stamp
    assert (out / "0003.png").exists()


def test_the_manifest_keeps_the_frames_of_before(dive, capsys):
    """A job that went on with other frames alone forgot those that were there."""
    whole, grown = dive.with_name("whole"), dive.with_name("grown")
    lines = [*FAST, "--water", "constituents", "--frames"]
    assert _run(dive, *lines, "1-4", "--out", whole) == 0
    assert _run(dive, *lines, "3-4", "--out", grown) == 0
    assert _run(dive, *lines, "1-2", "--out", grown, "--resume") == 0
    one, other = (manifest_files.read_manifest(path / "job.json") for path in (whole, grown))
    assert other.frames == one.frames == (1, 2, 3, 4)
    assert other.changes.keys() == one.changes.keys() == {2, 3, 4}
    keys = [[job.view_key(view) for view in job.views] for job in (one, other)]
    assert keys[0] == keys[1]
    assert all(picture_files.is_developed(other, view) for view in other.views)


def _folder(path: Path) -> Path:
    path.mkdir(parents=True, exist_ok=True)
    return path


def test_two_jobs_in_one_folder_do_not_mix(dive, capsys, monkeypatch):
    out = dive.with_name("out")
    arguments = [*FAST, "--out", out]
    with claims.claimed(_folder(out) / "job.json"):
        _refused(capsys, "another process renders into this folder", dive, *arguments)
    path = out / "passes" / "0001" / "pass_01.exr"
    _folder(path.parent)
    with claims.claimed(path):
        _refused(capsys, "another process renders", dive, *arguments)
    assert not (out / "job.json").exists()
    # One that writes nevertheless, such as a worker between two passes.
    other = dive.with_name("other")
    assert _run(dive, *FAST, "--water", "jerlov:9C", "--out", other) == 0
    typical = work.render

    def overtaken(*given, **named):
        for step in typical(*given, **named):
            mine = step.file.path
            shutil.copy(other / mine.relative_to(out), mine)
            yield step

    monkeypatch.setattr(work, "render", overtaken)
    _refused(capsys, "no longer the pass that was rendered", dive, *arguments)
    assert not (out / "0001.png").exists()


@pytest.mark.slow
def test_a_job_with_fewer_outputs_leaves_none_of_another(dive):
    out = dive.with_name("out")
    more = ["--layers", "range", "--raw", "dng", "--no-denoise", "--sensor", "Nikon D7000"]
    assert _run(dive, *FAST, *more, "--out", out) == 0
    before = {path.name for path in out.iterdir()}
    assert before >= {"0001_layers.exr", "0001_truth.json", "0001.dng", "0001_spectral.exr"}
    assert _run(dive, *FAST, *more[:2], "--no-denoise", "--out", out, "--resume") == 0
    assert before - {path.name for path in out.iterdir()} == {"0001.dng"}
    assert _run(dive, *FAST, "--water", "jerlov:9C", "--out", out) == 0
    left = {"0001.exr", "0001.json", "0001.png", "0001_spectral.exr", "job.json", "passes"}
    assert {path.name for path in out.iterdir()} == left
    assert _run(dive, *FAST, *more, "--out", out) == 0
    render_job.begin(manifest_files.read_manifest(out / "job.json"), resume=False)
    assert {path.name for path in out.iterdir()} == {"job.json", "passes"}


def test_a_damaged_manifest_loses_no_pass(dive, capsys):
    out = dive.with_name("out")
    assert _run(dive, *FAST, "--out", out) == 0
    stamp = (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns
    (out / "job.json").write_text("{")
    _refused(capsys, "Move it out of the folder", dive, *FAST, "--out", out, "--resume")
    (out / "job.json").rename(out / "aside")
    assert _run(dive, *FAST, "--out", out, "--resume") == 0
    assert (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns == stamp


def test_what_an_earlier_job_left_is_not_taken_for_a_pass_of_this_one(dive):
    """As when a render that began anew was stopped, and is resumed."""
    out = dive.with_name("whole")
    options = [*DIVE, "--frames", "1-2", "--out", out]
    assert _run(dive, *options, "--chlorophyll", 3) == 0
    path = out / "passes" / "0002" / "pass_01.exr"
    old = path.read_bytes()
    assert _run(dive, *options) == 0
    wanted = read_exr(path)[0]
    path.write_bytes(old)
    assert _run(dive, *options, "--resume") == 0
    assert np.array_equal(read_exr(path)[0], wanted)


# --- Bad input --------------------------------------------------------------------------------


def _refused(capsys, message: str, *arguments: object) -> None:
    capsys.readouterr()
    assert _run(*arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert "Traceback" not in printed


def _edit(path: Path, **changes: object) -> None:
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_a_worker_refuses_another_job(dive, capsys):
    table = dive.with_name("water.csv")
    table.write_text("wavelength_nm,a,b\n400,0.1,0.2\n700,0.4,0.2\n")
    image = bpy.data.images.new("paint", 2, 2)
    image.filepath_raw, image.file_format = str(dive.with_name("paint.png")), "PNG"
    image.save()
    bpy.ops.wm.open_mainfile(filepath=str(dive))
    loaded = bpy.data.images.load(str(dive.with_name("paint.png")))
    loaded.use_fake_user = True
    bpy.ops.file.make_paths_relative()
    bpy.ops.wm.save_as_mainfile(filepath=str(dive))
    path = _planned(dive, "--frames", 1, "--water", f"file:{table}")
    whole, out = path.read_text(), dive.with_name("split")
    content = json.loads(whole)
    assert content["settings"]["water"] == "file:water.csv"
    assert content["scene"] == "dive.blend"
    version = content["versions"]["the extension"]
    for versions, message in (
        ({"Blender": "5.3.0"}, "Blender is 5.2.3 LTS, not 5.3.0"),
        ({"the extension": "9.9"}, f"the extension is {version}, not 9.9"),
        ({"the source of the extension": "0"}, "the source of the extension is"),
    ):
        _edit(path, versions={**content["versions"], **versions})
        _refused(capsys, message, "--from", path)
        _refused(capsys, message, "--from", path, "--develop")
    path.write_text(whole)
    kept = table.read_text()
    table.write_text(kept.replace("0.4", "0.5"))
    _refused(capsys, "water.csv (--water) has changed. Bring it back", "--from", path)
    table.unlink()
    _refused(capsys, "water.csv (--water) is missing", "--from", path)
    table.write_text(kept)
    dive.with_name("paint.png").rename(dive.with_name("gone.png"))
    _refused(capsys, "paint.png is missing", "--from", path)
    _refused(capsys, "paint.png: missing; put it back", dive, *FAST, "--plan", path)
    assert path.read_text() == whole
    dive.with_name("gone.png").rename(dive.with_name("paint.png"))
    scene = dive.read_bytes()
    bpy.context.scene.render.fps = 30
    bpy.ops.wm.save_as_mainfile(filepath=str(dive))
    _refused(capsys, "dive.blend is not the file that was planned", "--from", path)
    dive.unlink()
    _refused(capsys, "is not there; copy it, or name it before --from", "--from", path)
    dive.write_bytes(scene)
    assert not out.exists()
    moved = dive.parent / "elsewhere"
    moved.mkdir()
    for name in ("dive.blend", "water.csv", "paint.png", "split.json"):
        dive.with_name(name).rename(moved / name)
    assert _run("--from", moved / "split.json", "--passes", 0) == 0
    assert (moved / "split" / "passes" / "0001" / "pass_00.exr").exists()


def test_a_folder_of_another_job_is_left_alone(dive, capsys):
    path = _planned(dive, "--frames", 1)
    assert _run("--from", path, "--passes", 0) == 0
    other = dive.with_name("other.json")
    arguments = [dive, *DIVE, "--frames", 1, "--out", dive.with_name("split"), "--plan", other]
    assert _run(*arguments, "--samples", 3) == 0
    before = {p: p.read_bytes() for p in dive.with_name("split").rglob("*") if p.is_file()}
    message = "holds another job, with other values of samples; plan with another --out"
    _refused(capsys, message, "--from", other)
    assert before == {p: p.read_bytes() for p in before}
    # Another sensor is another development of the same passes.
    assert _run(*arguments, "--sensor", "ARRI D21") == 0
    assert _run("--from", other) == 0
    assert _run("--from", other, "--develop") == 0


def test_truncated_passes_are_seen_and_rendered_again(dive, capsys):
    path = _planned(dive, "--frames", 1)
    assert _run("--from", path) == 0
    broken = dive.with_name("split") / "passes" / "0001" / "pass_01.exr"
    whole = broken.read_bytes()
    broken.write_bytes(whole[:-10])
    capsys.readouterr()
    assert _run("--status", path, "--json") == 0
    status = json.loads(capsys.readouterr().out)
    assert (status["passes"], status["done"], status["broken"]) == (2, 1, 1)
    assert status["seconds_left"] > 0
    assert status["unfinished"][0]["pass"] == 1
    _refused(capsys, "not developed, passes are missing: frame 1 of Camera, 1", "--from", path,
             "--develop")  # fmt: skip
    assert not (dive.with_name("split") / "0001.png").exists()
    assert _run("--from", path) == 0
    assert _run("--status", path) == 0
    assert "2 of 2 passes done, 0 of 1 pictures" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is damaged or not a manifest"),
        (b"\xff\xfe", "is damaged or not a manifest"),
        (b"[1]", "is damaged or not a manifest"),
        (b'{"bands": 8}', "is damaged or not a manifest"),
        (b'{"kind": "underwater-spectral job", "format": 99}',
         "has format 99, and this extension reads 1; use the version of the extension"),
        (b'{"kind": "underwater-spectral job", "format": 1}', "is damaged (KeyError"),
        (None, "cannot read"),
    ],
)  # fmt: skip
def test_what_is_no_manifest(tmp_path, capsys, content, message):
    path = tmp_path / "job.json"
    if content is not None:
        path.write_bytes(content)
    for step in (["--from", path], ["--from", path, "--develop"], ["--status", path]):
        _refused(capsys, message, *step)


@pytest.mark.parametrize(
    "changes",
    [
        {"views": []},
        {"views": [[1, "Nobody", 5.0, 0]]},
        {"views": [[1, "Camera", 5.0, 7]]},
        {"output": {}},
        {"settings": {"water": "jerlov:IB", "unknown": 1}},
        {"passes": [{"bands": "x"}]},
        {"changes": {"x": {}}},
    ],
)
def test_manifests_that_do_not_hold_together(tmp_path, changes):
    path = tmp_path / "job.json"
    manifest_files.write_manifest(path, small_manifest(tmp_path / "out"))
    _edit(path, **changes)
    with pytest.raises(InputError, match="is damaged .* write it again with --plan"):
        manifest_files.read_manifest(path)


def test_a_manifest_is_read_as_it_was_written(tmp_path):
    written = small_manifest(tmp_path / "out", 3, ("A", "B"), 2)
    manifest_files.write_manifest(tmp_path / "job.json", written)
    read = manifest_files.read_manifest(tmp_path / "job.json")
    assert read == written
    assert read.key(read.views[1], 1) == written.key(written.views[1], 1)
    assert len({read.key(view, number) for view, number in read.tasks()}) == 12


@pytest.mark.parametrize(("engine", "alike"), [("cycles", True), ("eevee", False)])
def test_a_pass_of_eevee_is_that_of_a_path_of_the_camera(tmp_path, engine, alike):
    """Its occlusion is computed for all frames of the job; a still camera has one place."""
    made = small_manifest(tmp_path, 3)
    made = dataclasses.replace(made, output=dataclasses.replace(made.output, engine=engine))
    shorter = dataclasses.replace(made, frames=(1, 2), views=made.views[:2])
    assert (made.key(made.views[0], 0) == shorter.key(made.views[0], 0)) == alike
    eye = made.views[0].eye
    still, fewer = (
        dataclasses.replace(job, views=tuple(dataclasses.replace(v, eye=eye) for v in job.views))
        for job in (made, shorter)
    )
    assert still.key(still.views[0], 0) == fewer.key(fewer.views[0], 0)


def test_options_that_the_manifest_decides_are_refused(tmp_path, capsys):
    path = tmp_path / "job.json"
    manifest_files.write_manifest(path, small_manifest(tmp_path / "out"))
    decided = ["--bands", 3, "--engine", "cycles", "--seed", 2]
    _refused(capsys, "--bands, --engine, --seed: the manifest decides", "--from", path, *decided)
    _refused(capsys, "--passes needs --from", "--passes", "1")
    _refused(capsys, "--develop needs --from", "--develop")
    _refused(capsys, "--json needs --status", "--json")
    _refused(capsys, "not allowed with argument", "--from", path, "--status", path)


def test_a_disk_that_is_full_and_a_folder_that_is_read_only(dive, capsys, monkeypatch):
    path = _planned(dive, "--frames", 1)

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(claims.json, "dump", full)
        _refused(capsys, "No space left on device; choose another --out, or make room", "--from",
                 path)  # fmt: skip
    with monkeypatch.context() as patch:
        patch.setattr(band_passes, "write_rgb_exr", lambda path, *_: Path(path).mkdir(mode=0))
        patch.setattr(Path, "mkdir", full)
        _refused(capsys, "No space left on device; choose another --out", "--from", path)
    assert not list(dive.with_name("split").rglob("*.exr"))
    assert not list(dive.with_name("split").rglob(".*.claim"))
    _refused(capsys, "cannot write to /proc/none", "--from", path, "--out", "/proc/none")
    _refused(
        capsys, "cannot write /proc/none/job.json", dive, *FAST, "--plan", "/proc/none/job.json"
    )
    assert _run("--from", path) == 0


def test_inside_blender_the_open_scene_counts(dive, capsys):
    path = _planned(dive, "--frames", 1)
    bpy.ops.wm.open_mainfile(filepath=str(dive))
    arguments = ["--from", str(path), "--passes", "0"]
    assert batch.main(arguments, inside_blender=True) == 0
    assert (dive.with_name("split") / "passes" / "0001" / "pass_00.exr").exists()
    assert batch.main([str(dive), *arguments], inside_blender=True) == 2
    assert "name one, before -P or --command" in capsys.readouterr().err
    bpy.context.scene.render.fps = 12
    bpy.ops.wm.save_as_mainfile(filepath=str(dive.with_name("other.blend")))
    assert batch.main(arguments, inside_blender=True) == 2
    assert "other.blend is not the file that was planned" in capsys.readouterr().err


def test_pixels_that_rot_are_rendered_again_by_who_answers_for_them(dive, capsys):
    path = _planned(dive, "--frames", 1)
    assert _run("--from", path) == 0
    rotten = dive.with_name("split") / "passes" / "0001" / "pass_01.exr"
    whole = rotten.read_bytes()
    rotten.write_bytes(whole[:-400] + bytes(300) + whole[-100:])
    message = "passes are missing: frame 1 of Camera, 1; render them with --from and --frames"
    _refused(capsys, message, "--from", path, "--develop")
    assert _run("--from", path, "--frames", 1) == 0
    assert rotten.read_bytes() != whole[:-400] + bytes(300) + whole[-100:]
    assert _run("--from", path, "--develop") == 0


def test_failures_are_told_in_the_words_of_a_farm(tmp_path, capsys):
    arguments = ["--from", tmp_path / "none.json", "--progress", "openjd"]
    assert _run(*arguments) == 2
    assert "openjd_fail: cannot read" in capsys.readouterr().out


def test_a_missing_gpu_is_named(dive, capsys):
    bpy.ops.wm.open_mainfile(filepath=str(dive))
    devices = bpy.context.preferences.addons["cycles"].preferences.get_device_list("CUDA") or ()
    if any(item[1] != "CPU" for item in devices):
        return
    out = dive.with_name("gpu")
    _refused(capsys, "--device gpu: Cycles finds no GPU here", dive, *FAST, "--device", "gpu",
             "--out", out)  # fmt: skip
    assert not list(out.rglob("*.exr"))
    _refused(capsys, "--device: eevee cannot be told", dive, *FAST, "--engine", "eevee",
             "--device", "cpu", "--out", out)  # fmt: skip
    assert _run(dive, *FAST, "--device", "cpu", "--out", out) == 0


# --- Claims -----------------------------------------------------------------------------------


def test_one_worker_at_a_time_has_a_pass(tmp_path):
    path = tmp_path / "pass_00.exr"
    with claims.claimed(path) as first:
        assert first
        with claims.claimed(path) as second:
            assert not second
        with claims.claimed(path, force=True) as third:
            assert third
        assert not claims.claim_path(path).exists()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "age", "taken"),
    [
        ({}, 0, False),
        ({"pid": 2**22 + 1}, 0, True),
        ({"started": "1"}, 0, True),
        ({"host": "elsewhere", "pid": 2**22 + 1}, 0, False),
        ({"host": "elsewhere"}, claims.TIMEOUT + 60, True),
        # A container or a clone of this name.
        ({"machine": "another", "pid": 2**22 + 1}, 0, False),
        ({"machine": "another"}, claims.TIMEOUT + 60, True),
        (None, 0, False),
        (None, 60, True),
    ],
)
def test_the_claim_of_a_dead_worker_is_taken_over(tmp_path, changes, age, taken):
    path = tmp_path / "pass_00.exr"
    place = claims.claim_path(path)
    with claims.claimed(path):
        content = json.loads(place.read_text())
    place.write_text("" if changes is None else json.dumps(content | changes))
    left = tmp_path / f".pass_00.{(content | (changes or {}))['pid']}.raw.exr"
    left.write_text("half a pass")
    os.utime(place, (time.time() - age,) * 2)
    assert claims.is_living(place) == (not taken)
    with claims.claimed(path) as ours:
        assert ours == taken
    assert place.exists() == (not taken)
    assert left.exists() == (not taken or changes is None)


@pytest.mark.parametrize("hours", [-13, 13])
def test_the_clock_of_a_machine_does_not_age_claims(tmp_path, monkeypatch, hours):
    """What dates the files of a shared folder is the clock of its server."""
    path, right = tmp_path / "pass_00.exr", time.time
    monkeypatch.setattr(time, "time", lambda: right() + hours * 3600)
    place = claims.claim_path(path)
    with claims.claimed(path):
        content = json.loads(place.read_text())
    place.write_text(json.dumps(content | {"host": "elsewhere"}))
    for age, taken in ((60, False), (claims.TIMEOUT + 60, True)):
        os.utime(place, (right() - age,) * 2)
        with claims.claimed(path) as ours:
            assert ours == taken
    assert list(tmp_path.iterdir()) == []


# --- Large jobs -------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("water", ["still", "keyframed", "keyframed under waves"])
def test_ten_thousand_passes(tmp_path, empty_blender, record_property, water):
    scenes.add_camera()
    camera = bpy.context.scene.camera
    for frame, depth in ((1, -1.0), (3334, -30.0)):
        camera.location.z = depth
        camera.keyframe_insert("location", frame=frame)
    scene, chosen = bpy.context.scene, SceneSettings(phase="hg:0.8")

    def now() -> SceneSettings:
        if water == "still":
            return chosen
        greener = replace(chosen, water="constituents", chlorophyll=scene.frame_current / 1000)
        return replace(greener, surface="waves") if "waves" in water else greener

    arguments = ["--frames", "1-3334", "--resolution", "8", "8", "--out", str(tmp_path / "out")]
    job = command_line.job(command_line.parse(arguments))
    start = time.perf_counter()
    planned = planning.plan_job(scene, now, job)
    manifest_files.write_manifest(tmp_path / "job.json", planned)
    record_property("plan_s", time.perf_counter() - start)
    start = time.perf_counter()
    read = manifest_files.read_manifest(tmp_path / "job.json")
    record_property("read_s", time.perf_counter() - start)
    assert read.views == planned.views
    tasks = list(read.tasks())
    assert len(tasks) == 10002
    pattern, whole = b"0" * 64, tmp_path / "one.exr"
    stamp = json.dumps({"key": pattern.decode(), "seconds": 2.0, "notes": []})
    write_rgb_exr(whole, np.zeros((*read.output.size[::-1], 3)), {"underwaterPass": stamp})
    content = whole.read_bytes()
    for view, number in tasks[:-2]:
        path = read.pass_path(view, number)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.replace(pattern, read.key(view, number).encode()))
    read = manifest_files.read_manifest(tmp_path / "job.json")
    start = time.perf_counter()
    status = job_status.status_of(read)
    record_property("status_s", time.perf_counter() - start)
    record_property("bytes", (tmp_path / "job.json").stat().st_size)
    assert (status.total, status.done) == (10002, 10000)
    assert status.seconds_left == pytest.approx(4.0)


def test_tables_on_a_windows_drive_are_moved_by_a_rule(tmp_path):
    """The folder of the manifest was put before them, so that no rule fitted."""
    job = small_manifest(
        tmp_path / "out",
        settings={**dataclasses.asdict(SceneSettings()), "water": r"file:D:\tables\w.csv"},
        files=(manifests.ExternalFile("the table", r"D:\tables\w.csv", "0", "water"),),
    )
    manifest_files.write_manifest(tmp_path / "job.json", job)
    found = manifest_files.read_manifest(tmp_path / "job.json")
    rule = path_mapping.PathRule(PureWindowsPath("d:/tables"), Path("/mnt/tables"))
    moved = path_mapping.PathMapping((rule,)).apply_to_manifest(found)
    assert moved.settings["water"] == "file:/mnt/tables/w.csv"
    assert moved.files[0].path == "/mnt/tables/w.csv"


def test_libraries_that_are_packed_are_not_missed(tmp_path, empty_blender):
    """Blender 5 packs linked data-blocks, each in a library of its own beside the empty first."""
    library = tmp_path / "corals.blend"
    mesh = bpy.data.meshes.new("coral")
    bpy.data.libraries.write(str(library), {mesh})
    bpy.data.meshes.remove(mesh)
    with bpy.data.libraries.load(str(library), link=True, pack=True) as (_, wanted):
        wanted.meshes = ["coral"]
    item = bpy.data.objects.new("coral", wanted.meshes[0])
    bpy.context.scene.collection.objects.link(item)
    library.unlink()
    assert job_files.scene_files() == ()
    assert external_files.external_files().missing == ()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "reef.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "reef.blend"))
    assert job_files.scene_files() == ()
    assert bpy.data.objects["coral"].data is not None
