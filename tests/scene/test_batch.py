"""The batch, end to end: files, resume after a kill, and messages about bad input."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import (
    batch,
    command_line,
    manifest,
    manifest_files,
    picture_files,
    planning,
    render_job,
)
from underwater_spectral.scene import sources
from underwater_spectral.scene.readers import picture_size, pinhole
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, read_spectral_exr

ROOT = Path(__file__).resolve().parent.parent.parent
FAST = ["--samples", "2", "--resolution", "32", "18", "--phase", "hg:0.8", "--floor-depth", "9"]


@pytest.fixture
def blend(tmp_path) -> Path:
    scenes.varied_scene()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def test_writes_picture_spectra_and_record(blend, tmp_path, capfd):
    out = tmp_path / "out"
    options = ["--bands", 4, "--sensor", "ARRI D21", "--no-denoise"]
    assert _run(blend, *FAST, *options, "--out", out) == 0
    assert {p.name for p in out.iterdir()} == {
        "0001.exr", "0001.json", "0001.png", "0001_spectral.exr", "job.json", "passes",
    }  # fmt: skip
    radiance, bands, _ = read_spectral_exr(out / "0001_spectral.exr")
    assert bands.centres.tolist() == [437.5, 512.5, 587.5, 662.5]
    record = json.loads((out / "0001.json").read_text())
    weights = np.array(record["development"]["weights"])
    rgb = read_exr(out / "0001.exr")[0]
    assert rgb.shape == (18, 32, 3)
    assert np.abs(rgb - radiance @ weights.T).max() <= 1e-5 * np.abs(rgb).max()
    assert rgb.max() > 0
    assert [p["bands_nm"] for p in record["passes"]] == [[437.5, 512.5, 587.5], [662.5]]
    assert all(p["seconds"] > 0 for p in record["passes"])
    assert record["settings"]["sensor"] == "ARRI D21"
    assert "Solonenko" in record["sources"]["water"]
    assert "pass 2 of 2, 0:00:00 left" in capfd.readouterr().out


def _record(blend, out, *arguments):
    small = ["--samples", 1, "--resolution", 8, 8, "--phase", "hg:0.8", "--bands", 2]
    assert _run(blend, *small, *arguments, "--out", out) == 0
    return json.loads((out / "0001.json").read_text())


@pytest.mark.slow
def test_the_record_holds_nothing_that_plays_no_part(blend, tmp_path):
    unused = ["--second-water", "jerlov:9C", "--wind", 9]
    record = _record(blend, tmp_path / "plain", "--no-scene-floor", *unused)
    settings = record["settings"]
    assert settings["water"] == "jerlov:IB"
    assert not settings.keys() & {
        "chlorophyll", "cdom", "minerals", "detritus", "second_water", "second_water_fraction",
        "wind_speed", "floor_reflectance", "shafts", "field",
    }  # fmt: skip
    assert not record.keys() & {"deeper_layers", "particles"}
    assert record["lamps"], "they shine in this water"
    assert "floor_reflectance" not in record["bands"]
    told = json.dumps(record["notes"])
    assert "by inverting Kd" in told
    assert "waves with height" not in told
    assert not any(word in told for word in ("9C", "3C", "5C", "Kd0", "KdH"))

    mixed = [
        "--chlorophyll",
        7,
        "--second-water-share",
        0.5,
        "--surface",
        "waves",
        "--raised-waves",
        "--floor-depth",
        9,
    ]
    record = _record(blend, tmp_path / "used", "--water", "constituents", *unused, *mixed)
    settings = record["settings"]
    assert settings["chlorophyll"] == 7
    assert settings["second_water"] == "jerlov:9C"
    assert settings["wind_speed"] == 9
    assert settings["water_source"] == "solonenko2015"
    assert "floor_reflectance" in settings.keys() & record["bands"].keys()
    assert any("the swell move no caustics" in note for note in record["notes"])

    record = _record(blend, tmp_path / "bio", "--water", "bio:chl=1")
    assert "water_source" not in record["settings"]
    assert "olonenko" not in json.dumps(record)


PROFILE = """# a cast
depth_m,wavelength_nm,a,b
0,400,0.05,0.1
0,700,0.6,0.1
4,400,0.3,0.4
4,700,0.8,0.3
"""


def test_water_over_depth_goes_into_the_picture_and_its_record(blend, tmp_path, capsys):
    out, table = tmp_path / "out", _csv(tmp_path, PROFILE, "profile.csv")
    arguments = [blend, *FAST, "--bands", 2, "--water", table]
    assert _run(*arguments, "--out", out) == 0
    record = json.loads((out / "0001.json").read_text())
    first = record["bands"]
    (deeper,) = record["deeper_layers"]
    assert deeper["top_m"] == 2.0
    assert deeper["water"] == "profile.csv at 4 m"
    assert first["absorption_per_m"] == pytest.approx([0.05 + 0.55 / 4, 0.05 + 0.55 * 3 / 4])
    assert deeper["absorption_per_m"] == pytest.approx([0.425, 0.675])
    assert deeper["scattering_per_m"] == pytest.approx([0.375, 0.325])
    assert record["sources"]["water"] == "a cast"
    # The camera, at 5 m, sees the deeper water, under the light that the clear one leaves.
    alone = [row for row in PROFILE.splitlines() if not row.startswith("0,")]
    table = _csv(
        tmp_path, "\n".join(row.removeprefix("4,") for row in alone).replace("depth_m,", "")
    )
    assert _run(blend, *FAST, "--bands", 2, "--water", table, "--out", tmp_path / "alone") == 0
    layered, alone = (
        read_spectral_exr(folder / "0001_spectral.exr")[0].mean(axis=(0, 1))
        for folder in (out, tmp_path / "alone")
    )
    assert np.all(layered > 1.2 * alone)
    capsys.readouterr()
    options = "--band-placement", "optimised", "--out", tmp_path / "refused"
    assert _run(*arguments, *options) == 2
    assert "one layer only, and this has 2; leave them" in capsys.readouterr().err


def test_scene_is_as_before(blend, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    before = snapshot.snapshot()
    assert _run(blend, *FAST, "--bands", 3, "--surface", "flat", "--out", tmp_path / "out") == 0
    unchanged = [
        line
        for line in snapshot.differences(before, snapshot.snapshot())
        if ".resolution_" not in line and ".underwater" not in line
    ]
    assert unchanged == []


def test_sensor_is_changed_without_rendering(blend, tmp_path):
    out = tmp_path / "out"
    assert _run(blend, *FAST, "--bands", 3, "--out", out) == 0
    first = read_exr(out / "0001.exr")[0]
    stamp = (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns
    assert _run(blend, *FAST, "--bands", 3, "--out", out, "--resume", "--sensor", "ARRI D21") == 0
    assert (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns == stamp
    assert not np.allclose(read_exr(out / "0001.exr")[0], first)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("damage", [b"", b"not an image", None])
def test_damaged_pass_is_rendered_again(blend, tmp_path, damage):
    out = tmp_path / "out"
    arguments = [blend, *FAST, "--bands", 4, "--out", out]
    assert _run(*arguments) == 0
    path = out / "passes" / "0001" / "pass_01.exr"
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    assert _run(*arguments, "--resume") == 0
    assert np.isfinite(read_exr(path)[0]).all()
    record = json.loads((out / "0001.json").read_text())
    assert [p["seconds"] is None for p in record["passes"]] == [True, False]


@pytest.mark.slow  # a data set that was killed is tried with every change
def test_killed_batch_resumes_to_the_same_pictures(blend, tmp_path):
    options = ["--bands", "9", "--frames", "1-2", *FAST, "--samples", "48"]
    script = [sys.executable, str(ROOT / "render_bands.py"), str(blend), *options]
    killed = tmp_path / "killed"
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(
        [*script, "--out", str(killed)], stdout=subprocess.DEVNULL, env=environment
    )
    deadline = time.monotonic() + 240
    while len(list((killed / "passes").glob("*/pass_*.exr"))) < 2:
        assert process.poll() is None, "the batch ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (killed / "0002.json").exists()
    assert subprocess.call([*script, "--out", str(killed), "--resume"]) == 0
    assert _run(blend, *options, "--out", tmp_path / "whole") == 0
    for path in sorted((tmp_path / "whole").rglob("*.exr")):
        other = killed / path.relative_to(tmp_path / "whole")
        assert np.array_equal(read_exr(path)[0], read_exr(other)[0]), path.name
    pngs = [(tmp_path / folder / "0002.png").read_bytes() for folder in ("whole", "killed")]
    assert pngs[0] == pngs[1]
    kept = json.loads((killed / "0001.json").read_text())["passes"]
    assert kept[0]["seconds"] is None


def test_resume_with_other_settings_is_refused(blend, tmp_path, capsys):
    out = tmp_path / "out"
    assert _run(blend, *FAST, "--bands", 3, "--out", out) == 0
    assert _run(blend, *FAST, "--bands", 6, "--out", out, "--resume") == 2
    assert "other values of bands; use the same ones, or another --out" in capsys.readouterr().err


def _csv(tmp_path: Path, text: str, name: str = "table.csv") -> str:
    path = tmp_path / name
    path.write_text(text)
    return f"file:{path}"


_TABLES = {
    "--water": "wavelength_nm,a,b\n400,{0},0.2\n700,{0},0.2\n",
    "--second-water": "wavelength_nm,a,b\n400,{0},0.2\n700,{0},0.2\n",
    "--illuminant": "wavelength_nm,irradiance\n300,{0}\n800,1.0\n",
    "--floor-reflectance": "wavelength_nm,reflectance\n300,{0}\n800,0.2\n",
}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("option", _TABLES)
def test_resume_with_an_edited_table_is_refused(blend, tmp_path, capsys, option):
    out = tmp_path / "out"
    table = _csv(tmp_path, _TABLES[option].format(0.1), "tab#le.csv")
    arguments = [blend, *FAST, "--bands", 3, option, table, "--out", out]
    assert _run(*arguments) == 0
    assert _run(*arguments, "--resume") == 0
    _csv(tmp_path, _TABLES[option].format(0.3), "tab#le.csv")
    capsys.readouterr()
    assert _run(*arguments, "--resume") == 2
    path = table.removeprefix("file:")
    wanted = f"with other values of the table {path} ({option}); use the same ones, or another"
    assert wanted in capsys.readouterr().err


@pytest.mark.slow
def test_a_water_of_seabass_counts_by_its_content_and_a_sensor_only_where_it_is_used(
    blend, tmp_path, capsys
):
    sensors = "wavelength_nm,R,G,B\n400,{0},0.2,0.9\n550,0.3,0.9,0.1\n700,0.9,0.1,0.05\n"
    station = tmp_path / "station.sb"
    text = "/begin_header\n/fields=wavelength,a,b\n/delimiter=comma\n/end_header\n"
    text += "400,0.1,0.2\n700,0.6,0.2\n"
    _csv(tmp_path, sensors.format(0.1))
    options = command_line.parse(
        ["--sensor", f"file:{tmp_path}/table.csv", "--water", f"file:{station}"]
    )
    chosen = command_line.merge(SceneSettings(), options)
    bpy.ops.wm.open_mainfile(filepath=str(blend))

    def planned(mode):
        job = replace(command_line.job(options), engine="eevee", mode=mode)
        return planning.plan_job(bpy.context.scene, lambda: chosen, job)

    station.write_text(text)
    bands, realtime = planned("bands"), planned("realtime")
    _csv(tmp_path, sensors.format(0.2))
    assert not manifest.differences(bands, planned("bands"))
    assert manifest.differences(realtime, planned("realtime")) == [
        f"the table {tmp_path}/table.csv (--sensor)"
    ]
    station.write_text(text.replace("/end_header", "/end_header ", 1))
    assert manifest.differences(bands, planned("bands"))


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ((100000, 100000), "100000 × 100000 pixels; Blender renders 4 to 65536 a side, and every "
         "band of a picture of this size would take 80 GB of memory"),
        ((2, 18), "Blender renders 4 to 65536 a side"),
    ],
)  # fmt: skip
def test_sizes_that_blender_cannot_render_are_refused(blend, tmp_path, capsys, size, message):
    assert _run(blend, "--out", tmp_path / "out", "--resolution", *size) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_frame_that_no_memory_holds_is_refused(blend, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(picture_size, "physical_memory", lambda: 2e10)
    arguments = [blend, "--resolution", 20000, 20000, "--out", tmp_path / "out"]
    assert _run(*arguments) == 2
    assert (
        "20000 × 20000 pixels in 8 bands takes at least 32 GB of memory, and this machine has "
        "20 GB; lower --resolution or --bands"
    ) in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_this_machine_has_memory():
    assert 1e8 < picture_size.physical_memory() < 1e15


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--water", "jerlov:1B"], "unknown Jerlov type '1B'. Near names: IB"),
        (["--water", "jerlov:7C", "--water-source", "williamson2022"], "has no Jerlov 7C"),
        (["--water", "IB"], "write jerlov:IB, bio:"),
        (["--water", "file:none.csv"], "cannot read none.csv"),
        (["--sensor", "ARRI D20"], "unknown sensor 'ARRI D20'. Near names: ARRI D21"),
        (["--illuminant", "d56"], "unknown illuminant 'd56'"),
        (["--phase", "hg:1.2"], "g must be between -1 and 1"),
        (["--range", "400", "800"], "is known from 300 to 700 nm, but 750 nm"),
        (["--wavelengths", "450,red"], "--wavelengths: '450,red' is not a list of numbers"),
        (["--exposure", "bright"], "--exposure: 'bright' is neither 'auto', 'auto-picture' nor a"),
        (["--floor-reflectance", "2"], "reflectance 2 is not between 0 and 1"),
        (["--camera", "Cam"], "no camera 'Cam' in 'Scene'; there are: Camera"),
        (["--floor-depth", "4"], "the floor at 4 m is above camera 'Camera', which is at 5 m"),
        (["--exposure", "2000"], "--exposure: 2000 is outside -60 to 60 stops"),
        (["--seed", "99999999999"], "--seed: 99999999999 is not 0 to 2147483647"),
        (["--seed", "-1"], "--seed: -1 is not 0"),
        (["--cameras", ","], "--cameras: ',' names none"),
        (["--out", ""], "'' is no path"),
        (["--plan", "/proc/plan.json"], "cannot write /proc/plan.json"),
        (["--plan", "/sys/none/plan.json"], "cannot write /sys/none/plan.json"),
        (["--plan", "/tmp"], "cannot write /tmp"),
        (["--bundle", "/proc/none"], "cannot write /proc/none"),
        (["--scene", "Scen"], "unknown scene 'Scen'. Near names: Scene"),
        (["--frames", "1-9:0"], "the step of '1-9:0' is 1 or more"),
        (["--frames", "9999999999"], "goes beyond 1048574"),
        (["--frames", ","], "',' names none"),
        (["--mode", "realtime"], "--mode realtime and --shafts need --engine eevee"),
        (["--out", "/proc/none/here"], "cannot write to /proc/none/here"),
    ],
)
def test_bad_options_end_with_one_clear_line(blend, tmp_path, capsys, options, message):
    arguments = [*FAST, "--bands", "4", "--out", tmp_path / "out", *options]
    assert _run(blend, *arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert "Traceback" not in printed


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("wavelength_nm,a,b\n400,0.1,0.2\n700,-0.3,0.2\n", "-0.3"),
        ("wavelength_nm,a,b\n400,0.1,0.2\n700,nan,0.2\n", "line 3, column a: 'nan'"),
        ("wavelength_nm,alpha,beta\n400,0.1,0.2\n", "column a, b is missing"),
        ("wavelength_nm,a,b\n450,0.1,0.2\n600,0.3,0.2\n", "is known from 450 to 600 nm"),
        ("", "holds no table"),
    ],
)
def test_bad_water_tables_name_the_place(blend, tmp_path, capsys, table, message):
    assert _run(blend, "--water", _csv(tmp_path, table), "--out", tmp_path / "out") == 2
    assert message in capsys.readouterr().err


def test_a_scene_is_named_and_others_are_said(blend, tmp_path, capfd):
    other = bpy.data.scenes.new("Other")
    (camera,) = (item for item in bpy.data.objects if item.type == "CAMERA")
    other.camera = camera.copy()
    other.collection.objects.link(other.camera)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    arguments = [blend, *FAST, "--bands", 2, "--out"]
    assert _run(*arguments, tmp_path / "one") == 0
    assert "only scene 'Scene' of the file is rendered, not 'Other'" in capfd.readouterr().out
    plan = tmp_path / "plan.json"
    assert _run(*arguments, tmp_path / "two", "--scene", "Other", "--plan", plan) == 0
    capfd.readouterr()
    assert _run("--from", plan) == 0
    assert bpy.context.scene.name == "Other"
    assert "only scene 'Other' of the file is rendered" in capfd.readouterr().out


def test_no_camera(blend, tmp_path, capsys):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    bpy.data.objects.remove(bpy.context.scene.camera)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert _run(blend, "--out", tmp_path / "out") == 2
    assert "has no active camera; add one" in capsys.readouterr().err


def test_missing_and_broken_scenes(tmp_path, capfd):
    assert _run(tmp_path / "none.blend", "--out", tmp_path / "out") == 2
    assert "there is no such file" in capfd.readouterr().err
    broken = tmp_path / "broken.blend"
    broken.write_bytes(b"BLENDER")
    assert _run(broken, "--out", tmp_path / "out") == 2
    assert f"cannot open {broken}" in capfd.readouterr().err


def test_lists(capsys):
    assert _run("--list-waters") == 0
    assert "solonenko2015: jerlov:I, jerlov:IA" in capsys.readouterr().out
    assert _run("--list-sensors") == 0
    assert len(capsys.readouterr().out.splitlines()) >= 54


@pytest.mark.slow
def test_a_picture_of_a_part_of_the_size_is_whole(blend, tmp_path, capsys):
    """100 × 50 at 29 % are 29 × 14 pixels; 28 were waited for, so a resume never ended."""
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 100, 50
    bpy.context.scene.render.resolution_percentage = 29
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    out, few = tmp_path / "out", [*FAST[:2], *FAST[5:], "--bands", 3]
    assert _run(blend, *few, "--layers", "range", "--out", out) == 0
    assert read_exr(out / "0001.exr")[0].shape == (14, 29, 3)
    camera = bpy.data.objects["Camera"]
    assert pinhole.pinhole_of(bpy.context.scene, camera).height == 14
    when = (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns
    assert _run(blend, *few, "--layers", "range", "--out", out, "--resume") == 0
    assert (out / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns == when
    assert _run("--from", out / "job.json", "--develop") == 0


@pytest.mark.slow_but_first
@pytest.mark.parametrize("exposure", ["auto", "auto-picture", "1.5"])
def test_the_record_tells_the_exposure_that_was_used(blend, tmp_path, exposure):
    """It said +0.00 stops whatever was used."""
    found = {}
    for text in ("0", exposure):
        out = tmp_path / text
        assert _run(blend, *FAST, "--bands", 3, "--exposure", text, "--out", out) == 0
        found[text] = json.loads((out / "0001.json").read_text())["development"]
    plain, exposed = found["0"], found[exposure]
    gain = np.array(exposed["weights"]).sum() / np.array(plain["weights"]).sum()
    assert plain["description"].endswith("; +0.00 stops")
    assert exposed["description"].endswith(f"; {np.log2(gain):+.2f} stops")
    assert abs(np.log2(gain)) > 0.1


def test_folders_with_braces_and_frames_below_zero(blend, tmp_path):
    out = tmp_path / "a {frame} {b}}"
    few = [*FAST, "--bands", 3, "--out", out]
    assert _run(blend, *few, "--frames", "-2--1") == 0
    assert {path.name for path in out.glob("*.png")} == {"-002.png", "-001.png"}
    assert _run("--from", out / "job.json", "--develop", "--frames", "-1") == 0


def test_results_of_another_version_are_not_gone_on_with(blend, tmp_path, capsys, monkeypatch):
    """It may draw otherwise, or know better how far the water reaches."""
    arguments = [blend, *FAST, "--bands", 3, "--out", tmp_path / "out"]
    assert _run(*arguments) == 0
    monkeypatch.setattr(sources, "source_digest", lambda: "another")
    assert _run(*arguments, "--resume") == 2
    assert "the source of the extension" in capsys.readouterr().err


def test_a_new_render_forgets_the_records_of_the_old_one(blend, tmp_path, monkeypatch):
    """A record says that a picture is done: it must not outlive the passes."""
    out = tmp_path / "out"
    assert _run(blend, *FAST, "--bands", 3, "--out", out) == 0
    job = manifest_files.read_manifest(out / "job.json")
    (view,) = job.views
    assert picture_files.is_developed(job, view)
    other = replace(job, settings={**job.settings, "tone": "agx"})
    assert not picture_files.is_developed(other, view)
    render_job.begin(job, resume=False)
    assert not (out / "0001.json").exists()
    assert not picture_files.is_developed(job, view)
