"""Files that lamps read: part of a job, carried along, moved with it, and missed by name."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import bpy
import pytest
from underwater_spectral.jobs import batch, manifest_files, path_mapping
from underwater_spectral.jobs import manifest as manifests
from underwater_spectral.jobs.farm import farm_bundle
from underwater_spectral.jobs.farm.openjd_template import FarmJob
from underwater_spectral.jobs.stage import Place, Stage, StageCamera, StageLamp
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.readers.lamp_files import lamp_files
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.manifests import small_manifest
from underwater_spectral.uw_spectral.errors import InputError

FAST = ["--samples", 2, "--resolution", 16, 9, "--phase", "hg:0.8", "--bands", 3]
IES = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 20\n0 45 90\n0\n{} 50 0\n"
LIGHT = "wavelength_nm,power\n300,1\n830,{}\n"


@pytest.fixture
def night(tmp_path, empty_blender) -> Path:
    """A torch whose spectrum and profile are files, named once by whole path, once by the .blend's.

    The camera and the torch move; a second lamp belongs to the air.
    """
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    (tmp_path / "torch.ies").write_text(IES.format(100))
    (tmp_path / "warm.csv").write_text(LIGHT.format(3))
    scene = bpy.context.scene
    box = scenes._cube("box", (0.0, 6.0, -5.0))
    box.data.materials.append(scenes.principled("paint"))
    camera = scenes.add_camera()
    light = bpy.data.lights.new("Torch", "SPOT")
    light.energy, light.shadow_soft_size = 900.0, 0.04
    own = light.underwater
    own.spectrum, own.unit = f"file:{tmp_path / 'warm.csv'}", "lm"
    own.profile = "//torch.ies"
    torch = bpy.data.objects.new("Torch", light)
    scene.collection.objects.link(torch)
    torch.rotation_euler.x = math.pi / 2
    for frame in (1, 2):
        torch.location = (0.5 * frame, 0.0, -5.0)
        torch.keyframe_insert("location", frame=frame)
    dry = bpy.data.objects.new("Lantern", bpy.data.lights.new("Lantern", "POINT"))
    dry.data.underwater.in_water, dry.data.underwater.profile = False, "//gone.ies"
    scene.collection.objects.link(dry)
    scene.camera = camera
    path = tmp_path / "night.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), relative_remap=False)
    return path


def _run(*arguments: object) -> int:
    return batch.main([str(part) for part in arguments], inside_blender=False)


def _plan(night: Path, name: str = "job", *options: object) -> Path:
    path = night.with_name(f"{name}.json")
    arguments = [night, *FAST, "--frames", "1-3", *options]
    assert _run(*arguments, "--out", night.with_name("out"), "--plan", path) == 0
    return path


@pytest.mark.parametrize(
    ("name", "text", "which"),
    [("torch.ies", IES.format(200), "profile"), ("warm.csv", LIGHT.format(4), "spectrum")],
    ids=["ies", "csv"],
)
def test_a_changed_table_of_a_lamp_is_another_job(night, capsys, name, text, which):
    before = manifest_files.read_manifest(path := _plan(night))
    whole = night.with_name(name).read_text()
    night.with_name(name).write_text(text)
    after = manifest_files.read_manifest(_plan(night, "other"))
    keys = [job.key(job.views[0], 0) for job in (before, after)]
    assert keys[0] != keys[1]
    assert [text for text in manifests.differences(before, after) if which in text]
    assert _run("--from", path, "--passes", 0) == 2
    message = capsys.readouterr().err
    assert f"the {which} of lamp 'Torch', " in message
    assert f"{name} has changed" in message
    night.with_name(name).write_text(whole)
    again = manifest_files.read_manifest(_plan(night, "again"))
    assert again.key(again.views[0], 0) == keys[0]


@pytest.mark.parametrize("name", ["torch.ies", "warm.csv"])
def test_a_missing_table_of_a_lamp_is_named(night, capsys, name):
    path = _plan(night)
    night.with_name(name).unlink()
    assert _run("--from", path, "--passes", 0) == 2
    message = capsys.readouterr().err
    assert "of lamp 'Torch', " in message
    assert f"{name} is missing" in message
    arguments = [night, *FAST, "--out", night.with_name("out"), "--plan", night.with_name("2.json")]
    assert _run(*arguments) == 2
    message = capsys.readouterr().err
    assert "lamp 'Torch': " in message
    assert name in message
    assert not night.with_name("2.json").exists()


def _bundle(night: Path) -> Path:
    bpy.ops.wm.open_mainfile(filepath=str(night))
    job = FarmJob(night, night.with_name("out"), (1,), passes=1, memory=1e9, gpu=False)

    def plan(path: Path) -> FarmJob:
        path.write_text("{}")
        return job

    folder = night.with_name("bundle")
    farm_bundle.write_bundle(folder, SceneSettings(), plan)
    return folder


def test_a_bundle_carries_the_tables_of_lamps(night):
    found = json.loads((_bundle(night) / "asset_references.json").read_text())
    files = found["assetReferences"]["inputs"]["filenames"]
    for name in ("torch.ies", "warm.csv"):
        assert str(night.with_name(name)) in files


@pytest.mark.parametrize("name", ["torch.ies", "warm.csv"])
def test_no_bundle_without_the_tables_of_lamps(night, name):
    night.with_name(name).unlink()
    with pytest.raises(InputError, match=f"not there: lamp 'Torch' .*{name}"):
        _bundle(night)
    assert not night.with_name("bundle").exists()


def test_tables_of_lamps_come_from_where_they_lie_now(night):
    path = _plan(night)
    here = night.with_name("here")
    here.mkdir()
    night.with_name("warm.csv").rename(here / "warm.csv")
    rule = path_mapping.PathRule(night.parent / "warm.csv", here / "warm.csv")
    mapping = path_mapping.PathMapping((rule,))
    bpy.ops.wm.open_mainfile(filepath=str(night))
    path_mapping.apply_to_scene(mapping)
    found = {file.setting: file for file in lamp_files()}
    assert found["spectrum"].path == str(here / "warm.csv")
    assert found["profile"].whole == night.with_name("torch.ies")
    assert bpy.data.lights["Torch"].underwater.spectrum == f"file:{here / 'warm.csv'}"
    rules = {"source_path_format": "POSIX", "source_path": str(rule.source)}
    rules["destination_path"] = str(rule.destination)
    listed = night.with_name("rules.json")
    listed.write_text(json.dumps({"version": "pathmapping-1.0", "path_mapping_rules": [rules]}))
    arguments = ["--from", path, "--passes", 0, "--frames", 1]
    assert _run(*arguments) == 2
    assert _run(*arguments, "--path-mapping", listed) == 0


def test_a_lamp_of_a_library_reads_beside_the_library(night):
    shelf = night.with_name("shelf")
    shelf.mkdir()
    library = shelf / "lamps.blend"
    bpy.ops.wm.open_mainfile(filepath=str(night))
    bpy.data.libraries.write(str(library), {bpy.data.lights["Torch"]})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.lights = ["Torch"]
    (light,) = bpy.data.lights
    item = bpy.data.objects.new("hung", light)
    bpy.context.scene.collection.objects.link(item)
    files = {file.setting: file for file in lamp_files()}
    assert files["profile"].whole == shelf / "torch.ies"
    files["profile"].move("/elsewhere/torch.ies")
    assert light.underwater.profile == "/elsewhere/torch.ies"


def test_records_and_plans_hold_the_lamps_of_their_frame(night):
    manifest = manifest_files.read_manifest(_plan(night))
    # At frame 3 nothing has moved since frame 2.
    assert list(manifest.lamps) == [1, 2]
    dark, torch = manifest.lamps_of(3)
    assert (dark["name"], torch["name"]) == ("Lantern", "Torch")
    assert dark["left_out"].startswith("it belongs to the air")
    assert "left_out" not in torch
    assert torch["kind"] == "spot"
    assert torch["spectrum"] == f"file:{night.with_name('warm.csv')}"
    assert (torch["power"], torch["unit"], torch["profile"]) == (900.0, "lm", "//torch.ies")
    assert torch["position"] == pytest.approx([1.0, 0.0, -5.0])
    assert torch["axis"] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert torch["radius"] == pytest.approx(0.04)
    assert manifest.lamps_of(1)[1]["position"][0] == pytest.approx(0.5)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("layers", [pytest.param("none", id="picture"), "range"])
def test_the_record_of_a_picture_lists_its_lamps(night, layers):
    out = night.with_name("out")
    assert _run(night, *FAST, "--layers", layers, "--frames", 2, "--out", out) == 0
    record = json.loads((out / "0002.json").read_text())
    torch = record["lamps"][1]
    assert torch["position"][0] == pytest.approx(1.0)
    if layers == "none":
        return
    (truth,) = [json.loads(path.read_text()) for path in out.rglob("*truth*.json")]
    (seen,) = truth["lamps"]
    for name, value in torch.items():
        exact = isinstance(value, str | dict | None)
        assert seen[name] == (value if exact else pytest.approx(value)), name
    assert len(seen["radiant_intensity"]) == 3
    assert min(seen["radiant_intensity"]) > 0


def test_tables_of_a_stage_count_by_content_and_are_moved(tmp_path):
    lamp = StageLamp(9.0, "W", f"file:{tmp_path / 'a.csv'}", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 0.0)
    camera = StageCamera("a", 8, 8, 9.0, 9.0, 4.0, 4.0)
    places = {1: Place(((1.0, 0.0, 0.0, 0.0),) * 4)}
    stage = Stage(camera, 1, (replace(lamp, sha256="1"), replace(lamp, emission="led")), places)
    planned = small_manifest(tmp_path / "out", stage=stage)
    manifest_files.write_manifest(tmp_path / "job.json", planned)
    assert "file:a.csv" in (tmp_path / "job.json").read_text()
    assert manifest_files.read_manifest(tmp_path / "job.json") == planned
    rule = path_mapping.PathRule(tmp_path, Path("/mnt"))
    placed = path_mapping.PathMapping((rule,)).apply_to_manifest(planned)
    assert placed.stage is not None
    assert [x.emission for x in placed.stage.lamps] == ["file:/mnt/a.csv", "led"]
    key = planned.key(planned.views[0], 0)
    assert placed.key(placed.views[0], 0) == key
    other = replace(stage, lamps=(replace(lamp, sha256="2"), stage.lamps[1]))
    changed = replace(planned, stage=other)
    assert changed.key(changed.views[0], 0) != key
