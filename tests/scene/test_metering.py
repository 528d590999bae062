"""Exposure by the picture: what it says, in jobs and live, and where it does not apply."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import command_line, planning
from underwater_spectral.node_groups import realtime_tables
from underwater_spectral.scene import marks, stored_settings
from underwater_spectral.scene.readers import cameras
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import metering
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings.render_plan import plan_of
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.colour_rendering import luminance
from underwater_spectral.uw_spectral.surface.refraction import seen_from_air
from underwater_spectral.uw_spectral.transfer.above_water import leaving_fraction

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

    def spy(Y, fraction):
        seen["mean"] = float(np.asarray(Y) @ fraction)
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


def test_other_exposures_are_not_metered():
    assert _stops(replace(CHOSEN, exposure="auto")) is None
    assert _stops(replace(CHOSEN, exposure="2")) is None


def _from_air(tilt, height=1.0, chosen=CHOSEN):
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler = (0.0, -60.0, height), (tilt, 0.0, 0.0)
    bpy.context.view_layer.update()
    return metering.metered(bpy.context.scene, camera, plan_of(chosen), 0.0, None)


def test_from_the_air_mirrored_sky_and_the_light_of_the_water_are_metered():
    chosen = replace(CHOSEN, surface="flat", sky="clear", sky_radiance=0.05)
    plan = plan_of(chosen)
    sky, n = plan.column.skylight, plan.column.refractive_index
    stops = _from_air(0.0, chosen=chosen)
    pairs = cameras.camera_rays(bpy.context.scene, bpy.context.scene.camera, 32, 18)
    v = tuple(np.array([direction[:] for _, direction in pairs]).T[..., None])
    R, w, mirrored = seen_from_air(v, (0.0, 0.0, 1.0), n)
    below = plan.solved_field(16).radiance(0.0, tuple(component[:, 0] for component in w))
    seen = R * sky.radiance(mirrored) + leaving_fraction(R, n) * below
    mean = luminance(plan.viewpoint(0.0, 0.0).reduction.apply(seen)).mean()
    assert stops == pytest.approx(np.log2(0.18 / mean), abs=0.03)
    # The sky alone: what the water is does not count.
    up = _from_air(np.pi, chosen=chosen)
    assert up == pytest.approx(_from_air(np.pi, chosen=replace(chosen, water="jerlov:9C")))
    assert up < stops - 1.0


def test_what_lies_under_water_is_metered_from_the_air_and_at_the_waterline():
    deep, shallow = CHOSEN, replace(CHOSEN, floor_depth=2.0, floor_reflectance="0.5")
    for tilt, height in ((0.3, 1.0), (1.4, 0.0)):
        assert _from_air(tilt, height, shallow) < _from_air(tilt, height, deep) - 0.5
    # No surface mirrors or darkens what the glass has under water.
    flat = replace(shallow, surface="flat")
    assert _from_air(0.6, 0.0, flat) < _from_air(0.6, 0.5, flat) - 0.5


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
    lit = metering.lamplight(scene, scene.camera, plan_of(dark))
    weak = _stops(dark, lit)
    light.energy = 40.0
    bpy.context.view_layer.update()
    # Lamps are all the light: four times as strong is two stops less.
    assert weak - _stops(dark, lit) == pytest.approx(2.0, abs=1e-3)


def _texels(scene):
    image = marks.part(scene, "uw_table")
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found


@pytest.mark.slow
def test_live_water_and_a_job_expose_alike():
    scene = bpy.context.scene
    for name in ("exposure", "phase", "bands"):
        setattr(scene.underwater, name, getattr(CHOSEN, name))
    chosen = stored_settings.stored_settings(scene)
    plan, stops = plan_of(chosen), _stops(chosen)
    expected = plan.reduction(DEPTH, None, stops).weights
    assert not np.allclose(expected, plan.reduction(DEPTH).weights, rtol=0.1)
    job = command_line.job(command_line.parse(["--engine", "eevee", "--mode", "realtime"]))
    manifest = planning.plan_job(scene, lambda: stored_settings.stored_settings(scene), job)
    np.testing.assert_allclose(manifest.developments[0].weights, expected)
    water = eevee_water(plan, scene, Eye(scene.camera, DEPTH), expected)
    live.add(scene)
    np.testing.assert_array_equal(_texels(scene), realtime_tables.pixels(water.projected).ravel())
    # The camera turns away from the ball: another picture, another exposure.
    before = _texels(scene)
    scene.camera.rotation_euler.x -= 1.0
    bpy.context.view_layer.update()
    assert not np.array_equal(_texels(scene), before)
