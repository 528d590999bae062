"""Plumes of bubbles below the foam of a frame."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.readers import clouds, moving_surface
from underwater_spectral.scene.water import new_plumes
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.surface.plumes import FADES

BREAKING = SceneSettings(
    surface="waves", wind_speed=12.0, wave_resolution=128, raised_waves=True, whitecaps=True
)

pytestmark = pytest.mark.usefixtures("properties")


@pytest.fixture
def scene():
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -3.0), (math.radians(110.0), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.fps, scene.frame_start, scene.frame_end = 10, 1, 200
    scene.frame_set(50)
    bpy.context.view_layer.update()
    return scene


def test_plumes_are_below_the_foam_of_the_frame_and_thin_out(scene):
    found = new_plumes.add_plumes(scene, BREAKING, 2)
    assert len(found) == 2
    assert scene.frame_current == 50
    waves = moving_surface.heights(scene, BREAKING)
    fresh = []
    for item in found:
        x, y, z = item.location
        around = np.hypot(*np.meshgrid(*[np.linspace(-1.0, 1.0, 21)] * 2)) < 1.0
        sides = np.meshgrid(x + np.linspace(-1.0, 1.0, 21), y + np.linspace(-1.0, 1.0, 21))
        assert (waves.foam_fraction(*sides) * around).max() > 0.3
        assert z < 0.0
        fresh.append(item.underwater.concentration)
    air = []
    for frame in (120, 135):
        scene.frame_set(frame)
        air.append(np.array([item.underwater.concentration for item in found]))
    assert air[1] / air[0] == pytest.approx(math.exp(-1.5 / FADES), rel=0.02)
    for frame in (44, 145):
        scene.frame_set(frame)
        assert [item.underwater.concentration for item in found] == pytest.approx([0.0, 0.0])
    scene.frame_set(50)
    assert [x["constituent"] for x in clouds.records(scene)] == ["bubbles"] * 2
    assert [x["concentration"] for x in clouds.records(scene)] == pytest.approx(fresh, rel=1e-5)


def test_they_may_stay_as_they_are(scene):
    (item,) = new_plumes.add_plumes(scene, BREAKING, 1, keyed=False)
    assert item.animation_data is None


@pytest.mark.parametrize("lacking", ["whitecaps", "raised_waves"])
def test_a_sea_without_foam_has_none(scene, lacking):
    with pytest.raises(InputError, match="no foam; switch on"):
        new_plumes.add_plumes(scene, replace(BREAKING, **{lacking: False}), 1)
    with pytest.raises(InputError, match="or more wind"):
        new_plumes.add_plumes(scene, replace(BREAKING, wind_speed=2.0), 1)
