"""Examples are built as scenes of their own, wet and ready, and go with one undo."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.examples.scenes import SCENES
from underwater_spectral.scene.session import is_live
from underwater_spectral.scene.viewport import preview_depths, problems
from underwater_spectral.ui import example_scenes


def test_every_scene_of_the_examples_is_offered():
    assert set(example_scenes.EXAMPLES) == set(SCENES)


@pytest.mark.slow
def test_an_example_is_a_wet_scene_of_its_own_and_is_undone():
    bpy.context.preferences.edit.use_global_undo = True
    first = bpy.context.scene.name
    bpy.ops.ed.undo_push(message="start")
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("scenes", "objects", "materials")}
    assert bpy.ops.underwater.add_example("EXEC_DEFAULT", True, example="pool") == {"FINISHED"}
    scene = bpy.context.window.scene
    assert scene.name == "Pool Test Tank"
    assert is_live(scene)
    assert problems.problem(scene) == ""
    assert preview_depths.camera_depth(scene) == pytest.approx(1.3)
    assert scene.underwater.exposure == "auto-picture"
    assert {f"Target {d:g} m" for d in (2, 4, 6, 8, 10)} <= {o.name for o in scene.objects}
    assert first in bpy.data.scenes
    bpy.ops.ed.undo()
    assert bpy.context.window.scene.name == first
    after = {kind: len(getattr(bpy.data, kind)) for kind in before}
    assert after == before


@pytest.mark.parametrize(
    "name", ["reef", *(pytest.param(n, marks=pytest.mark.slow) for n in ("wreck", "cave"))]
)
def test_examples_choose_their_cameras_and_settings(name, monkeypatch):
    """In the coarsest detail: what the panel builds is measured in docs/measured/new_user.md."""
    monkeypatch.setattr(example_scenes, "_DETAIL", "draft")
    others = set(bpy.context.scene.objects)
    scene = example_scenes.build(bpy.context, name)
    example = example_scenes.EXAMPLES[name]
    assert scene.camera.name == example.camera
    for setting, value in example.settings.items():
        assert getattr(scene.underwater, setting) == pytest.approx(value)
    assert preview_depths.camera_depth(scene) > 0
    assert any(o.type == "LIGHT" for o in scene.objects) == bool(example.rig)
    assert not others & set(scene.objects)
