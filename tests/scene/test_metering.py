"""Exposure by the picture: what it says, in jobs and live, and where it does not apply."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_tables, realtime_values
from underwater_spectral.scene import (
    live,
    metering,
    planning,
    scene_water,
    settings,
    stored_settings,
)
from underwater_spectral.scene.render_plan import plan_of
from underwater_spectral.scene.settings import SceneSettings
from underwater_spectral.tests.scene import scenes

DEPTH = 5.0
CHOSEN = SceneSettings(exposure="auto-picture", phase="hg:0.924", bands=4)


@pytest.fixture(autouse=True)
def _scene(registered):
    item = scenes._cube("ball", (0.0, 6.0, -DEPTH))
    item.data.materials.append(scenes.principled("paint", (0.8, 0.8, 0.8, 1.0)))
    scenes.add_camera()
    bpy.context.view_layer.update()
    return registered


def _stops(chosen, lit=None):
    scene = bpy.context.scene
    return metering.metered(scene, scene.camera, plan_of(chosen), DEPTH, lit)


def test_the_picture_is_exposed_to_middle_grey(monkeypatch):
    """The mean of what was metered, times the gain, is middle grey, by the table of rays."""
    seen = {}

    def spy(Y, share):
        seen["mean"] = float(np.asarray(Y) @ share)
        seen["bright"] = float(np.quantile(Y, 0.98))
        return np.log2(min(0.18 / seen["mean"], 1.0 / seen["bright"]))

    monkeypatch.setattr("underwater_spectral.quality.metering.metered_stops", spy)
    stops = _stops(CHOSEN)
    assert seen["mean"] * 2**stops <= 0.18 * 1.0001
    assert seen["bright"] * 2**stops <= 1.0001
    assert max(seen["mean"] * 2**stops / 0.18, seen["bright"] * 2**stops) == pytest.approx(1.0)


def test_less_light_asks_for_more_stops_and_compensation_adds_to_it():
    full = _stops(CHOSEN)
    assert _stops(replace(CHOSEN, sunlight=0.25)) == pytest.approx(full + 2.0, abs=1e-6)
    assert _stops(replace(CHOSEN, exposure_compensation=1.5)) == pytest.approx(full + 1.5)


def test_other_exposures_and_a_camera_in_the_air_are_not_metered():
    assert _stops(replace(CHOSEN, exposure="auto")) is None
    assert _stops(replace(CHOSEN, exposure="2")) is None
    bpy.context.scene.camera.location.z = 1.0
    bpy.context.view_layer.update()
    assert _stops(CHOSEN) is None


def test_at_night_lamps_are_metered_and_nothing_is_no_error():
    dark = replace(CHOSEN, sunlight=0.0)
    assert _stops(dark) is None
    light = bpy.data.lights.new("torch", "POINT")
    light.energy = 10.0
    lamp = bpy.data.objects.new("torch", light)
    lamp.location = (0.0, 0.5, -DEPTH + 0.3)
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    lit = plan_of(dark).lamplight(scene, scene.camera)
    weak = _stops(dark, lit)
    light.energy = 40.0
    bpy.context.view_layer.update()
    # Lamps are all the light: four times as strong is two stops less.
    assert weak - _stops(dark, lit) == pytest.approx(2.0, abs=1e-3)


def _texels(scene):
    image = scene_water.part(scene, "uw_table")
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found


def test_live_water_and_a_job_expose_alike():
    scene = bpy.context.scene
    for name in ("exposure", "phase", "bands"):
        setattr(scene.underwater, name, getattr(CHOSEN, name))
    chosen = stored_settings.stored_settings(scene)
    plan, stops = plan_of(chosen), _stops(chosen)
    expected = plan.reduction(DEPTH, None, stops).weights
    assert not np.allclose(expected, plan.reduction(DEPTH).weights, rtol=0.1)
    job = settings.job(settings.parse(["--engine", "eevee", "--mode", "realtime"]))
    manifest = planning.plan_job(scene, lambda: stored_settings.stored_settings(scene), job)
    np.testing.assert_allclose(manifest.developments[0].weights, expected)
    water = plan.realtime(scene, DEPTH, expected)
    rows = realtime_values.rows(water.numbers, water.shape)
    live.add(scene)
    np.testing.assert_array_equal(
        _texels(scene), realtime_tables.pixels(water.table, rows).ravel().astype(np.float32)
    )
    # The camera turns away from the ball: another picture, another exposure.
    before = _texels(scene)
    scene.camera.rotation_euler.x -= 1.0
    bpy.context.view_layer.update()
    assert not np.array_equal(_texels(scene), before)
