"""The panel's Auto: writes settings, says why, and brings back what it had left out."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.tests.scene import scenes

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


@pytest.fixture
def scene():
    scenes._cube("ball", (0.0, 6.0, -5.0)).data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    water = bpy.context.scene.underwater
    water.surface = "waves"
    return bpy.context.scene


def test_auto_writes_settings_and_says_why(scene):
    water, panel = scene.underwater, scene.underwater_panel
    panel.target_delta_e = 4.0
    assert bpy.ops.underwater.auto() == {"FINISHED"}
    assert water.bands <= 6
    assert water.surface != "waves"
    assert "waves and caustics: off" in panel.decisions


@pytest.mark.slow
def test_a_stricter_auto_brings_back_what_was_left_out(scene):
    water, panel = scene.underwater, scene.underwater_panel
    panel.quality, panel.target_delta_e = "REALTIME", 10.0
    bpy.ops.underwater.auto()
    assert water.surface == "flat"
    panel.quality = "REFERENCE"
    bpy.ops.underwater.auto()
    assert water.surface == "waves"


@pytest.mark.slow
def test_what_the_user_changes_since_is_the_users(scene):
    water, panel = scene.underwater, scene.underwater_panel
    panel.quality, panel.target_delta_e = "REALTIME", 10.0
    bpy.ops.underwater.auto()
    water.surface = "none"
    panel.quality = "REFERENCE"
    bpy.ops.underwater.auto()
    assert water.surface == "none"


def test_auto_refuses_a_scene_without_camera(scene):
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match="no active camera"):
        bpy.ops.underwater.auto()
