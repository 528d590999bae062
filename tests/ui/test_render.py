"""The panel renders what the batch renders, keeps passes, and brings the water back."""

from __future__ import annotations

import functools

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import live, render_job, settings, stored_settings
from underwater_spectral.scene.session import is_live
from underwater_spectral.tests.scene import scenes
from underwater_spectral.ui import property_group as panel_group
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


def _scene(out):
    scene = bpy.context.scene
    item = scenes._cube("ball", (0.0, 6.0, -5.0))
    item.data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    water, panel = scene.underwater, scene.underwater_panel
    water.phase, water.bands, water.samples, water.sensor = "hg:0.924", 6, 2, "ARRI D21"
    panel.quality, panel.output = "REFERENCE", str(out)
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return scene


def test_panel_and_command_line_give_the_same_picture(tmp_path):
    scene = _scene(tmp_path / "panel")
    live.add(scene)
    assert bpy.ops.underwater.render() == {"FINISHED"}
    assert is_live(scene)
    live.remove(scene)
    options = settings.parse(["--out", str(tmp_path / "batch"), "--frames", "1"])
    stored = functools.partial(stored_settings.stored_settings, scene)
    job = settings.job(options)
    for _ in render_job.render(scene, lambda: settings.merge(stored(), options), job, print):
        pass
    for name in ("0001.exr", "0001_spectral.exr"):
        panel, batch = (read_exr(tmp_path / folder / name)[0] for folder in ("panel", "batch"))
        assert np.array_equal(panel, batch)


def test_stopping_keeps_passes_and_continue_uses_them(tmp_path):
    scene = _scene(tmp_path)
    live.add(scene)

    def steps(*, resume):
        stored = functools.partial(stored_settings.stored_settings, scene)
        job = panel_group.job(scene, resume=resume)
        with live.suspended(scene):
            yield from render_job.render(scene, stored, job, print)

    first = steps(resume=False)
    step = next(first)
    assert (step.number, step.total) == (1, 2)
    first.close()
    assert is_live(scene)
    assert (tmp_path / "passes" / "0001" / "pass_00.exr").exists()
    kept = [step.rendered.seconds is None for step in steps(resume=True)]
    assert kept == [True, False]
    assert (tmp_path / "0001.png").exists()


def test_camera_above_the_water_is_reported(tmp_path):
    scene = _scene(tmp_path)
    scene.camera.location.z = 2.0
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="above the water"):
        bpy.ops.underwater.render()


def test_add_submerge_remove_with_undo(tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    scene = _scene(tmp_path)
    scene.camera.location.z = 3.0
    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.underwater.add_water("EXEC_DEFAULT", True) == {"FINISHED"}
    assert bpy.ops.underwater.submerge("EXEC_DEFAULT", True, depth=4.0) == {"FINISHED"}
    assert live.camera_depth(bpy.context.scene) == pytest.approx(4.0)
    assert live.problem(bpy.context.scene) == ""
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert not is_live(scene)
    assert not bpy.data.node_groups
    assert scene.camera.delta_location.z == 0.0
