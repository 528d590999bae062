"""Foam in Cycles: its radiance from the air and from the water."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.terms.cycles_frames import CyclesFrames
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.occlusion import Cache
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.surface import wave_patterns
from underwater_spectral.uw_spectral.surface.whitecaps import Foam
from underwater_spectral.uw_spectral.transfer.above_water import light_in_air

from . import snapshot

CHOSEN = SceneSettings(
    water="jerlov:IB", phase="hg:0.9", bands=3, surface="waves", wind_speed=2.0, samples=64,
    wave_resolution=64, raised_waves=True, whitecaps=True, sun_zenith=40.0, sky="uniform",
)  # fmt: skip


@pytest.fixture
def camera(empty_blender):
    item = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    item.data.angle = 0.3
    empty_blender.collection.objects.link(item)
    empty_blender.camera = item
    empty_blender.render.resolution_x = empty_blender.render.resolution_y = 12
    empty_blender.render.resolution_percentage = 100
    return item


def _seen(camera, height: float, turn: float) -> tuple[np.ndarray, render_plan.RenderPlan]:
    """Mean picture of a sea that is all foam."""
    scene, plan = bpy.context.scene, render_plan.make_plan(CHOSEN)
    camera.location, camera.rotation_euler = (0.0, 0.0, height), (math.radians(turn), 0.0, 0.0)
    bpy.context.view_layer.update()
    before = snapshot.snapshot()
    extent = water_body.water_extent(scene, plan.column, max(-height, 0.0))
    with engines.cycles_bands(scene, camera, plan, extent, seed=1) as engine:
        image = grey_scene.band_image(engine, plan, max(-height, 0.0))
    assert snapshot.differences(before, snapshot.snapshot()) == []
    return image.mean(axis=(0, 1)), plan


@pytest.fixture
def foamy(monkeypatch):
    monkeypatch.setattr(wave_patterns, "_foam", lambda _: Foam(-10.0, 1.0))


@pytest.mark.slow
def test_from_above_it_reflects_sun_and_sky(camera, foamy):
    seen, plan = _seen(camera, 2.0, 0.0)
    light = light_in_air(plan.column)
    E = light.sun * math.cos(math.radians(40.0)) + light.sky
    reflectance = 0.55 * np.interp(plan.bands.centres, [555.0, 670.0], [1.0, 0.889])
    np.testing.assert_allclose(seen, reflectance / math.pi * E, rtol=0.05)


@pytest.mark.slow
def test_from_below_it_glows(camera, foamy):
    seen, plan = _seen(camera, -0.2, 180.0)
    light, column = light_in_air(plan.column), plan.column
    E = light.sun * math.cos(math.radians(40.0)) + light.sky
    transmittance = np.exp(-0.2 * column.absorption)
    np.testing.assert_allclose(seen, 0.45 / math.pi * E * transmittance, rtol=0.05)


def test_values_of_foam_are_there_only_with_it(camera, empty_blender):
    for foam in (False, True):
        plan = render_plan.make_plan(replace(CHOSEN, whitecaps=foam))
        extent = water_body.water_extent(empty_blender, plan.column, 2.0)
        frames = CyclesFrames(empty_blender, camera, extent, (), Cache(of_job=True))
        frames.add(plan)
        values = frames.bring(plan).values
        frames.remove()
        assert ("uw_foam_below" in values) == foam
