"""The panel renders what the batch renders, keeps passes, and brings the water back."""

from __future__ import annotations

import functools
import json
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import job_files
from underwater_spectral.scene.engines.exr_output import write_float_exr
from underwater_spectral.scene.readers.external_files import external_files
from underwater_spectral.scene.session import is_live
from underwater_spectral.scene.stored_settings import stored_settings
from underwater_spectral.scene.viewport import live, preview_depths, problems
from underwater_spectral.settings.render_plan import forget_files, plan_of
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.ui import previews, render_operators
from underwater_spectral.ui.render_operators import Render, RenderReference
from underwater_spectral.uw_spectral.spectra.colour_rendering import srgb_encode
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, write_png

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


ROOT = Path(__file__).resolve().parents[2]


def _scene(out):
    scene = bpy.context.scene
    item = scenes._cube("ball", (0.0, 6.0, -5.0))
    item.data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    water, panel = scene.underwater, scene.underwater_panel
    water.phase, water.bands, water.samples, water.sensor = "hg:0.924", 6, 2, "ARRI D21"
    water.surface, water.diffuse_shadows = "none", False  # quick to build
    panel.quality, panel.output = "REFERENCE", str(out)
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return scene


def test_panel_and_command_line_write_equal_files(tmp_path):
    scene = _scene(tmp_path / "panel")
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    live.add(scene)
    assert bpy.ops.underwater.render() == {"FINISHED"}
    assert is_live(scene)
    command = [sys.executable, str(ROOT / "render_bands.py"), path, "--out", tmp_path / "batch"]
    subprocess.run(command, check=True)
    panel, batch = tmp_path / "panel", tmp_path / "batch"
    written = sorted(item.relative_to(panel) for item in panel.rglob("*") if item.is_file())
    assert written == sorted(item.relative_to(batch) for item in batch.rglob("*") if item.is_file())
    assert len(written) == 9
    for name in written:
        if name.suffix == ".exr":  # the header holds the time
            first, second = read_exr(panel / name), read_exr(batch / name)
            assert np.array_equal(first[0], second[0]), name
            assert first[1] == second[1]
        elif name.suffix == ".png":
            assert (panel / name).read_bytes() == (batch / name).read_bytes()
    records = [json.loads((folder / "0001.json").read_text()) for folder in (panel, batch)]
    for record in records:
        # Where it went and how long it took; the command line named the file and no frames.
        for key in ("out", "frames"):
            del record["job"][key]
        for item in record["passes"]:
            assert item.pop("seconds") > 0
    assert records[0] == records[1]
    jobs = [json.loads((folder / "job.json").read_text()) for folder in (panel, batch)]
    assert jobs[0] == jobs[1]


@pytest.mark.slow
def test_live_water_shows_layers(tmp_path):
    scene, profile = _scene(tmp_path / "out"), tmp_path / "profile.csv"
    profile.write_text("depth_m,cdom\n0,0.02\n4,0.5\n")
    live.add(scene)
    scene.underwater.water, scene.underwater.shafts = f"file:{profile}", True
    live.update(scene)
    assert not problems.problem(scene)
    assert any("shafts of light" in note for note in plan_of(stored_settings(scene)).notes)
    pictures = previews.compute(scene)
    assert not pictures.error
    # At 5 m the read-outs are those of the water with much CDOM.
    profile.write_text("depth_m,cdom\n0,0.5\n4,0.5\n")
    forget_files()
    same = previews.compute(scene).readouts
    assert pictures.readouts.visibility == pytest.approx(same.visibility, rel=0.02)
    assert np.all(pictures.readouts.transmitted_light.values > same.transmitted_light.values)
    assert bpy.ops.underwater.render() == {"FINISHED"}
    assert is_live(scene)
    assert (tmp_path / "out" / "0001.exr").exists()


class _Modal:
    """An operator as a window drives it: Blender gives operators to nobody else."""

    invoke, modal, cancel = Render.invoke, Render.modal, Render.cancel
    _passes, _end, _stop = Render._passes, Render._end, Render._stop

    def __init__(self, *, resume=False, operator=Render):
        self.resume, self.reports = resume, []
        self.job = functools.partial(operator.job, self)
        self.stopped = operator.stopped
        self.shown, self.calls = [], []
        manager = SimpleNamespace(
            event_timer_add=lambda *_, **__: self.calls.append("timer added") or "timer",
            event_timer_remove=lambda timer: self.calls.append(f"{timer} removed"),
            modal_handler_add=lambda _: self.calls.append("handler added"),
            progress_begin=lambda *_: self.calls.append("progress begun"),
            progress_update=lambda fraction: self.shown.append(round(fraction, 3)),
            progress_end=lambda: self.calls.append("progress ended"),
            windows=[],
        )
        workspace = SimpleNamespace(status_text_set=lambda text: self.shown.append(text))
        self.context = SimpleNamespace(
            scene=bpy.context.scene, window_manager=manager, window=None, workspace=workspace
        )

    def report(self, kinds, text):
        self.reports.append((*kinds, text))

    def start(self):
        return self.invoke(self.context, None)

    def event(self, kind):
        return self.modal(self.context, SimpleNamespace(type=kind))


BEGUN = ["timer added", "handler added", "progress begun"]
ENDED = ["timer removed", "progress ended"]


def _live(tmp_path):
    scene = _scene(tmp_path)
    scene.frame_set(3)
    live.add(scene)
    return scene, snapshot.snapshot()


@pytest.mark.slow
def test_the_window_renders_a_pass_at_each_tick(tmp_path):
    scene, before = _live(tmp_path)
    modal = _Modal()
    assert modal.start() == {"RUNNING_MODAL"}
    assert modal.calls == BEGUN
    assert is_live(scene), "the water makes way at the first pass, not before"
    assert modal.event("MOUSEMOVE") == {"RUNNING_MODAL"}
    assert not (tmp_path / "passes").exists()
    assert modal.event("TIMER") == {"RUNNING_MODAL"}
    assert not is_live(scene)
    assert {p.name for p in (tmp_path / "passes" / "0003").iterdir()} == {
        "pass_00.exr", "pass_00_layers.exr",
    }  # fmt: skip
    assert modal.event("TIMER") == {"RUNNING_MODAL"}
    assert modal.event("TIMER") == {"FINISHED"}
    assert modal.calls == [*BEGUN, *ENDED]
    shown = [
        re.sub(r"; \d+:\d\d:\d\d left", "", x) if isinstance(x, str) else x for x in modal.shown
    ]
    assert shown == [
        "Underwater: first pass; Esc stops",
        0.5, "Underwater: frame 3, pass 1 of 2; Esc stops",
        1.0, "Underwater: frame 3, pass 2 of 2; Esc stops",
        None,
    ]  # fmt: skip
    assert modal.reports == [("INFO", f"1 frame(s) in {tmp_path}")]
    (picture,) = _pictures()
    assert picture.name == f"{tmp_path.name} Camera 0003"
    bpy.data.images.remove(picture)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.slow
def test_esc_within_a_pass_stops_as_between_passes(tmp_path):
    _, before = _live(tmp_path)
    modal = _Modal()
    modal.start()
    modal.event("TIMER")

    def cancel(*_):  # what Blender calls when Esc ends a render
        for handler in list(bpy.app.handlers.render_cancel):
            handler(bpy.context.scene, None)

    bpy.app.handlers.render_pre.append(cancel)
    try:
        assert modal.event("TIMER") == {"CANCELLED"}
    finally:
        bpy.app.handlers.render_pre.remove(cancel)
    assert modal.reports == [("WARNING", "Stopped; Continue goes on with the finished passes")]
    assert modal.calls == [*BEGUN, *ENDED]
    assert [p.name for p in (tmp_path / "passes" / "0003").glob("pass_??.exr")] == ["pass_00.exr"]
    assert snapshot.differences(before, snapshot.snapshot()) == []


def _pictures():
    return [image for image in bpy.data.images if "underwater_picture" in image]


def test_a_picture_is_shown_as_it_is_in_its_file_and_read_again(tmp_path):
    path = tmp_path / "0001.png"
    for level in (0.2, 0.7):
        write_png(path, np.full((4, 6, 3), level, np.float32))
        image = render_operators.load_picture(path, "out Camera 0001")
        assert _pictures() == [image]
        shown = np.array(image.pixels[:3])
        assert shown == pytest.approx(srgb_encode([level] * 3), abs=0.003)
    assert image.colorspace_settings.name == "sRGB"
    assert not image.use_view_as_render
    render_operators.load_picture(path, "out Camera 0002")
    assert len(_pictures()) == 2


def test_a_picture_that_is_shown_is_no_file_of_a_job(tmp_path):
    """A job of the same .blend was refused for another picture, or for none, in the folder."""
    path = tmp_path / "0001.png"
    write_png(path, np.zeros((2, 2, 3), np.float32))
    image = render_operators.load_picture(path, "ours")
    assert job_files.scene_files() == ()
    assert path not in external_files().files
    # Unless something is made of it.
    material = bpy.data.materials.new("poster")
    material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    assert [item.path for item in job_files.scene_files()] == [str(path)]
    assert path in external_files().files


def test_an_open_image_editor_is_used_unless_it_is_for_something_else(tmp_path):
    path = tmp_path / "0001.png"
    write_png(path, np.zeros((2, 2, 3), np.float32))
    ours, others = render_operators.load_picture(path, "ours"), bpy.data.images.new("other", 2, 2)

    def space(image, mode="VIEW", *, pinned=False):
        return SimpleNamespace(image=image, mode=mode, use_image_pin=pinned)

    def window(*spaces, kind="IMAGE_EDITOR"):
        areas = [SimpleNamespace(type="IMAGE_EDITOR", ui_type=kind, spaces=[x]) for x in spaces]
        return SimpleNamespace(screen=SimpleNamespace(areas=areas))

    free, shown, painting = space(others), space(ours), space(None, "PAINT")
    pinned, unwrapped = space(others, pinned=True), window(space(None), kind="UV")
    assert render_operators.picture_editor([]) is None
    assert render_operators.picture_editor([window(painting, pinned), unwrapped]) is None
    assert render_operators.picture_editor([window(painting, free)]) is free
    assert render_operators.picture_editor([window(free), window(shown)]) is shown
    render_operators.show_picture(SimpleNamespace(windows=[window(painting, free)]), ours)
    assert free.image == ours
    assert painting.image is None


@pytest.mark.slow
def test_the_reference_is_rendered_beside_what_the_panel_renders(tmp_path):
    scene, before = _live(tmp_path)
    panel = scene.underwater_panel
    panel.quality, panel.animation = "REALTIME", True
    scene.underwater.bands = 3
    modal = _Modal(operator=RenderReference)
    modal.start()
    while modal.event("TIMER") == {"RUNNING_MODAL"}:
        pass
    assert modal.reports == [("INFO", f"1 frame(s) in {tmp_path / 'reference'}")]
    record = json.loads((tmp_path / "reference" / "0003.json").read_text())
    assert record["job"]["engine"] == "cycles"
    assert record["job"]["frames"] == [3]
    assert not (tmp_path / "0003.json").exists()
    (picture,) = _pictures()
    assert picture.name == "reference Camera 0003"
    assert is_live(scene)
    assert panel.quality == "REALTIME"
    assert before


@pytest.mark.parametrize("how", ["ESC", pytest.param("cancel", marks=pytest.mark.slow)])
def test_stopping_restores_the_scene_and_continue_goes_on(tmp_path, how):
    scene, _ = _live(tmp_path)
    panel = scene.underwater_panel
    panel.animation, scene.frame_start, scene.frame_end = True, 1, 1
    before = snapshot.snapshot()
    modal = _Modal()
    modal.start()
    modal.event("TIMER")
    assert scene.frame_current == 1
    if how == "ESC":
        assert modal.event("ESC") == {"CANCELLED"}
        assert modal.reports == [("WARNING", "Stopped; Continue goes on with the finished passes")]
    else:
        modal.cancel(modal.context)  # Blender's own end, such as closing the window
    assert modal.calls == [*BEGUN, *ENDED]
    assert modal.shown[-1] is None
    assert is_live(scene)
    assert scene.frame_current == 3
    assert snapshot.differences(before, snapshot.snapshot()) == []
    again = _Modal(resume=True)
    again.start()
    while again.event("TIMER") == {"RUNNING_MODAL"}:
        pass
    seconds = [p["seconds"] for p in json.loads((tmp_path / "0001.json").read_text())["passes"]]
    assert seconds[0] is None
    assert seconds[1] > 0


@pytest.mark.slow
def test_stopping_before_the_first_pass_changes_nothing(tmp_path):
    _, before = _live(tmp_path)
    modal = _Modal()
    modal.start()
    assert modal.event("ESC") == {"CANCELLED"}
    assert modal.calls == [*BEGUN, *ENDED]
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_a_folder_beside_a_file_that_was_never_saved_is_refused(tmp_path, monkeypatch):
    """The pictures went into the folder that Blender was started in."""
    _scene(tmp_path).underwater_panel.output = "//underwater"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RuntimeError, match="which was never saved; save it, or choose another"):
        bpy.ops.underwater.render()
    assert not list(tmp_path.iterdir())


def test_an_error_ends_the_render_of_a_window(tmp_path):
    scene, _ = _live(tmp_path)
    scene.underwater.sensor = "ARRI D20"
    bpy.context.view_layer.update()
    modal = _Modal()
    modal.start()
    assert modal.event("TIMER") == {"CANCELLED"}
    ((kind, text),) = modal.reports
    assert kind == "ERROR"
    assert "unknown sensor 'ARRI D20'" in text
    assert modal.calls == [*BEGUN, *ENDED]
    assert is_live(scene)


def test_add_submerge_remove_with_undo(tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    scene = _scene(tmp_path)
    scene.camera.location.z = 3.0
    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.underwater.add_water("EXEC_DEFAULT", True) == {"FINISHED"}
    assert bpy.ops.underwater.submerge("EXEC_DEFAULT", True, depth=4.0) == {"FINISHED"}
    assert preview_depths.camera_depth(bpy.context.scene) == pytest.approx(4.0)
    assert problems.problem(bpy.context.scene) == ""
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert not is_live(scene)
    assert not bpy.data.node_groups
    assert scene.camera.delta_location.z == 0.0


@pytest.mark.slow
def test_blenders_own_render_is_the_picture_of_a_real_time_job(tmp_path):
    scene = _scene(tmp_path)
    panel, render = scene.underwater_panel, scene.render
    panel.quality, scene.underwater.samples, scene.eevee.taa_render_samples = "REALTIME", 32, 32
    render.resolution_x, render.resolution_y = 48, 27
    live.add(scene)
    assert bpy.ops.underwater.render() == {"FINISHED"}
    assert not problems.problem(scene)
    # What is out of gamut EEVEE cuts, and jobs bring back; no screen shows it.
    of_job = np.maximum(read_exr(tmp_path / "0001.exr")[0], 0.0)
    write_float_exr(scene, tmp_path / "own.exr")
    own = read_exr(tmp_path / "own.exr")[0]
    for area in (np.s_[:6, :], np.s_[10:16, 20:28]):  # open water, and the cube
        assert own[area].mean(axis=(0, 1)) == pytest.approx(
            of_job[area].mean(axis=(0, 1)), rel=0.01
        )
    assert np.abs(own - of_job).mean() < 0.01 * of_job.mean()
