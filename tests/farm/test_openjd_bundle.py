"""A bundle is a valid job: checked by openjd-model and openjd-cli, read by AWS Deadline Cloud's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import bpy
import pytest
from deadline.client.job_bundle import loader
from deadline.client.job_bundle.parameters import apply_job_parameters, read_job_bundle_parameters
from deadline.client.job_bundle.submission import AssetReferences
from openjd.model import (
    StepParameterSpaceIterator,
    create_job,
    decode_job_template,
    preprocess_job_parameters,
)
from underwater_spectral.jobs.command_line import parse_numbers
from underwater_spectral.jobs.farm import farm_bundle, openjd_template
from underwater_spectral.jobs.farm.openjd_template import DEVELOP, RENDER, FarmJob
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.errors import InputError

EXTENSIONS = ["TASK_CHUNKING"]
JOB = FarmJob(
    Path("/shot/reef.blend"), Path("/shot/out"), (1, 2, 3, 7), passes=9, memory=3e9, gpu=True
)


def _job(job: FarmJob, folder: Path, **values):
    """Instantiate a template as a scheduler does."""
    template = decode_job_template(
        template=openjd_template.template(job), supported_extensions=EXTENSIONS
    )
    given = {"Scene": str(job.scene), "OutputDir": str(job.out), **values}
    parameters = preprocess_job_parameters(
        job_template=template,
        job_parameter_values=given,
        job_template_dir=folder,
        current_working_dir=folder,
    )
    return create_job(job_template=template, job_parameter_values=parameters)


def _tasks(job, name: str) -> list[dict[str, str]]:
    step = next(step for step in job.steps if step.name == name)
    space = StepParameterSpaceIterator(space=step.parameterSpace)
    return [{key: value.value for key, value in task.items()} for task in space]


@pytest.mark.parametrize(("passes", "frames"), [("1", "1"), ("4", "2"), ("100", "100")])
@pytest.mark.parametrize("cameras", [(), ("Left", "Right eye")])
def test_every_pass_is_rendered_once_and_every_frame_developed_once(
    tmp_path, passes, frames, cameras
):
    job = replace(JOB, cameras=cameras)
    made = _job(job, tmp_path, PassesPerTask=passes, FramesPerTask=frames)
    rendered = [
        (task.get("Camera"), int(task["Frame"]), number)
        for task in _tasks(made, RENDER)
        for number in parse_numbers(task["Pass"])
    ]
    views = [(camera, frame) for camera in cameras or (None,) for frame in JOB.frames]
    assert sorted(rendered) == sorted((*view, number) for view in views for number in range(9))
    developed = [
        (task.get("Camera"), frame)
        for task in _tasks(made, DEVELOP)
        for frame in parse_numbers(task["Frame"])
    ]
    assert sorted(developed) == sorted(views)


def test_development_waits_for_the_passes_and_both_can_be_interrupted(tmp_path):
    render, develop = _job(JOB, tmp_path).steps
    assert [item.dependsOn for item in develop.dependencies] == [RENDER]
    for step in (render, develop):
        action = step.script.actions.onRun
        assert action.timeout > 3600
        assert action.cancelation.mode.value == "NOTIFY_THEN_TERMINATE"
        assert action.cancelation.notifyPeriodInSeconds == 30
    needs = {item.name: item.min for item in render.hostRequirements.amounts}
    assert needs["amount.worker.memory"] > 3e9 / 2**20
    assert needs["amount.worker.gpu"] == 1
    assert needs["amount.worker.vcpu"] == 2
    names = [item.name for item in develop.hostRequirements.amounts]
    assert names == ["amount.worker.memory", "amount.worker.vcpu"]


@pytest.mark.parametrize(("given", "system"), [({}, "linux"), ({"System": "windows"}, "windows")])
def test_workers_of_one_system_are_asked_for(tmp_path, given, system):
    for step in _job(JOB, tmp_path, **given).steps:
        (needed,) = step.hostRequirements.attributes
        assert (needed.name, needed.anyOf) == ("attr.worker.os.family", [system])


def test_a_session_installs_the_extension_into_a_profile_of_its_own(tmp_path):
    (extension,) = _job(JOB, tmp_path).jobEnvironments
    for name in ("RESOURCES", "CONFIG", "EXTENSIONS"):
        place = extension.variables[f"BLENDER_USER_{name}"]
        assert str(place).startswith("{{Session.WorkingDirectory}}/")
    install = extension.script.actions.onEnter
    assert install.args[-1] == "{{Param.Extension}}"


def test_braces_in_a_file_name_are_no_parameter():
    job = replace(JOB, scene=Path("/shot/{{Param.Frames}}" + 200 * "x" + ".blend"))
    template = decode_job_template(
        template=openjd_template.template(job), supported_extensions=EXTENSIONS
    )
    assert len(template.name) == 128


@pytest.fixture
def saved(empty_blender, tmp_path, monkeypatch) -> Path:
    """A saved scene with a texture, numbered pictures, tiles and a linked mesh."""
    monkeypatch.setattr(farm_bundle, "write_extension", lambda path: path.write_bytes(b"a zip"))
    for name in ("sand.png", "foam_0001.png", "foam_0002.png", "rock.1001.png", "rock.1002.png"):
        (tmp_path / name).touch()
    mesh = bpy.data.meshes.new("coral")
    mesh.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "corals.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "corals.blend"), link=True) as (_, wanted):
        wanted.meshes = ["coral"]
    item = bpy.data.objects.new("coral", bpy.data.meshes["coral"])
    bpy.context.scene.collection.objects.link(item)
    for name, source in (
        ("sand.png", "FILE"),
        ("foam_0001.png", "SEQUENCE"),
        ("rock.<UDIM>.png", "TILED"),
    ):
        image = bpy.data.images.new(name, 4, 4)
        image.source, image.filepath, image.use_fake_user = source, str(tmp_path / name), True
    path = tmp_path / "reef.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return path


def _settings(folder: Path) -> SceneSettings:
    for name in ("water.csv", "cameras.txt"):
        (folder / name).touch()
    return SceneSettings(
        water=f"file:{folder / 'water.csv'}", sensor=f"file:{folder / 'cameras.txt'}#D90"
    )


def _bundle(saved: Path) -> Path:
    job = replace(JOB, scene=saved, out=saved.parent / "out")

    def plan(path: Path) -> FarmJob:
        path.write_text("{}")
        return job

    folder = saved.parent / "bundle"
    assert farm_bundle.write_bundle(folder, _settings(saved.parent), plan) == job
    return folder


def test_a_bundle_holds_the_job_and_lists_what_goes_along(saved):
    folder = _bundle(saved)
    names = {"README.md", "asset_references.json", "manifest.json", "parameter_values.json"}
    names |= {"template.json", "underwater_spectral.zip"}
    assert {path.name for path in folder.iterdir()} == names
    assert {path.name for path in folder.parent.glob(".bundle*")} == set()
    assets = json.loads((folder / "asset_references.json").read_text())["assetReferences"]
    files = {
        Path(path).relative_to(saved.parent).as_posix() for path in assets["inputs"]["filenames"]
    }
    textures = {"sand.png", "foam_0001.png", "foam_0002.png", "rock.1001.png", "rock.1002.png"}
    assert files == {"reef.blend", "corals.blend", "water.csv", "cameras.txt", *textures}
    assert assets["outputs"]["directories"] == [str(saved.parent / "out")]
    assert str(saved) in (folder / "README.md").read_text()
    # Written again, it takes the place of the earlier one.
    (folder / "template.json").write_text("old")
    assert json.loads((_bundle(saved) / "template.json").read_text())["steps"]


def test_openjd_checks_and_sums_up_a_bundle(saved):
    folder = _bundle(saved)

    def openjd(*arguments: str) -> str:
        command = [sys.executable, "-m", "openjd", *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    template = str(folder / "template.json")
    assert "passes validation" in openjd("check", template)
    values = json.loads((folder / "parameter_values.json").read_text())["parameterValues"]
    given = [part for item in values for part in ("-p", f"{item['name']}={item['value']}")]
    summary = json.loads(openjd("summary", template, *given, "--output", "json"))
    assert summary["total_tasks"] == 4 * 9 + 4
    assert summary["name"] == "Underwater reef"


def test_deadline_cloud_reads_a_bundle_and_finds_its_files(saved):
    folder = str(_bundle(saved))
    assert loader.is_job_bundle_dir(folder)
    loader.validate_directory_symlink_containment(folder)
    read = loader.read_yaml_or_json_object(folder, "asset_references", required=True)
    assets = AssetReferences.from_dict(read)
    parameters = read_job_bundle_parameters(folder)
    values = {item["name"]: item.get("value", item.get("default")) for item in parameters}
    assert values["Scene"] == str(saved)
    assert values["Manifest"] == str(Path(folder).resolve() / "manifest.json")
    assert values["Extension"] == str(Path(folder).resolve() / "underwater_spectral.zip")
    apply_job_parameters([], folder, parameters, assets)
    along = {os.path.realpath(path) for path in assets.input_filenames}
    assert {values["Manifest"], values["Extension"]} <= along
    assert str(saved) in assets.input_filenames
    assert assets.output_directories == {str(saved.parent / "out")}
    assert all(Path(path).is_file() for path in assets.input_filenames)


def _refused(folder: Path, settings: SceneSettings | None = None) -> str:
    def plan(_: Path) -> FarmJob:
        raise AssertionError("planned before everything was looked at")

    with pytest.raises(InputError) as caught:
        farm_bundle.write_bundle(folder, settings or SceneSettings(), plan)
    return str(caught.value)


def test_a_file_that_was_never_saved_is_refused(empty_blender, tmp_path):
    assert "never saved" in _refused(tmp_path / "bundle")
    assert not (tmp_path / "bundle").exists()


@pytest.mark.parametrize("name", ["sand.png", "foam_*", "rock.*", "corals.blend"])
def test_a_missing_file_of_the_scene_is_named(saved, name):
    for path in saved.parent.glob(name):
        path.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    message = _refused(saved.parent / "bundle")
    assert "reef.blend reads files that are not there: " in message
    assert name.partition("*")[0] in message
    assert "External Data" in message
    assert not (saved.parent / "bundle").exists()


def test_a_missing_sound_or_an_unbaked_simulation_keeps_no_picture_from_rendering(saved):
    bpy.data.sounds.load("//waves.wav", check_existing=False).use_fake_user = True
    item = bpy.data.objects["coral"]
    item.data = bpy.data.meshes.new("own")
    item.modifiers.new("ocean", "OCEAN").filepath = "//not baked/"
    bpy.ops.wm.save_mainfile()
    assert (_bundle(saved) / "template.json").exists()


def test_a_missing_table_is_named_with_its_option(saved):
    gone = saved.parent / "gone.csv"
    message = _refused(saved.parent / "bundle", SceneSettings(sensor=f"file:{gone}"))
    assert f"--sensor ({gone})" in message


def test_a_packed_texture_needs_no_file(saved):
    image = bpy.data.images.new("packed", 4, 4)
    image.use_fake_user = True
    image.pack()
    image.filepath = "//gone.png"
    bpy.ops.wm.save_mainfile()
    assert (_bundle(saved) / "template.json").exists()


@pytest.mark.parametrize("kind", ["folder", "file"])
def test_what_is_no_bundle_is_left_alone(saved, kind):
    folder = saved.parent / "mine"
    if kind == "folder":
        folder.mkdir()
        (folder / "thesis.txt").write_text("precious")
    else:
        folder.write_text("precious")
    assert "choose another folder" in _refused(folder)
    kept = folder / "thesis.txt" if kind == "folder" else folder
    assert kept.read_text() == "precious"


def test_nothing_is_left_of_a_bundle_that_could_not_be_planned(saved):
    def plan(_: Path) -> FarmJob:
        raise InputError("the camera is above the water")

    folder = _bundle(saved)
    before = (folder / "template.json").read_text()
    with pytest.raises(InputError, match="above the water"):
        farm_bundle.write_bundle(folder, SceneSettings(), plan)
    assert (folder / "template.json").read_text() == before
    assert sorted(path.name for path in folder.parent.glob(".bundle*")) == []
