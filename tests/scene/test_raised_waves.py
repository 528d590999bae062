"""Waves with height in a scene: the waterline on the glass, and the meshes of Cycles."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.readers import moving_surface, waterline
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings

from . import snapshot

CHOSEN = SceneSettings(
    water="jerlov:IB", phase="hg:0.9", bands=3, surface="waves", wind_speed=5.0, samples=1,
    wave_resolution=64, raised_waves=True, swell_height=0.8, swell_length=12.0,
    swell_direction=90.0, floor_depth=6.0,
)  # fmt: skip
SHAPE = 9, 16


@pytest.fixture
def camera(empty_blender):
    """Level, looking along +y."""
    item = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    item.rotation_euler = (math.radians(90.0), 0.0, 0.0)
    empty_blender.collection.objects.link(item)
    empty_blender.camera = item
    empty_blender.render.resolution_x, empty_blender.render.resolution_y = SHAPE[::-1]
    empty_blender.render.resolution_percentage = 100
    return item


def _put(camera: bpy.types.Object, height: float) -> None:
    camera.location = (0.4, 0.7, height)
    bpy.context.view_layer.update()


def test_the_waterline_follows_the_waves(camera):
    scene = bpy.context.scene
    waves = moving_surface.heights(scene, CHOSEN)
    level = float(waves.elevation(0.4, 0.7))
    assert abs(level) > 0.1  # a level surface would leave the camera dry, or drown it
    _put(camera, level)
    assert waterline.splits(scene, camera, waves)
    assert not waterline.splits(scene, camera)
    found = waterline.glass_heights(scene, camera, SHAPE, waves)
    half = 0.1 * math.tan(camera.data.angle / 2)
    right = half * ((np.arange(16) + 0.5) / 8.0 - 1.0)
    up = half * (4.5 - np.arange(9) - 0.5) / 8.0
    wanted = level + up[:, None] - waves.elevation(0.4 + right, 0.8)
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_the_waves_decide_in_which_medium_a_camera_is(camera):
    scene = bpy.context.scene
    crest = float(moving_surface.heights(scene, CHOSEN).elevation(0.4, 0.7))
    for height, in_air in ((crest - 0.2, False), (crest + 0.2, True)):
        _put(camera, height)
        assert moving_surface.view_from_air(scene, camera, CHOSEN).in_air == in_air
    flat = replace(CHOSEN, raised_waves=False)
    _put(camera, -0.5)  # in a trough it may be in the air; a plane has none
    assert moving_surface.view_from_air(scene, camera, CHOSEN) is not None
    assert moving_surface.view_from_air(scene, camera, flat) is None
    _put(camera, -5.0)
    assert moving_surface.view_from_air(scene, camera, CHOSEN) is None


@pytest.mark.slow
def test_meshes_of_cycles_follow_the_waves_and_leave(camera):
    scene, plan = bpy.context.scene, render_plan.make_plan(CHOSEN)
    _put(camera, -2.0)
    before = snapshot.snapshot()
    extent = water_body.water_extent(scene, plan.column, 2.0)
    waves = moving_surface.heights(scene, CHOSEN)
    with engines.cycles_bands(scene, camera, plan, extent, seed=1) as engine:
        engine.frame(plan, 2.0)
        found = [item for item in scene.objects if item.name.startswith(("UW Surf", "UW Wat"))]
        assert len(found) == 2
        for item in found:
            places = np.array([v.co[:] for v in item.data.vertices][:5000])
            places += np.array(item.location)
            away = np.hypot(places[:, 0] - 0.4, places[:, 1] - 0.7)
            assert away.max() < 60.0
            gap = waves.elevation(places[:, 0], places[:, 1]) - places[:, 2]
            np.testing.assert_allclose(gap, gap[0], atol=1e-5)
            assert 0.0 <= gap[0] + 1e-6 <= 0.011
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_what_is_not_drawn_right_is_said(camera):
    def said(height: float, chosen: SceneSettings = CHOSEN, **options: bool) -> str:
        _put(camera, height)
        return " ".join(moving_surface.limits(camera, chosen, **({"eevee": True} | options)))

    caustics, level, trough = "move no caustics", "as a level surface", "behind a trough"
    for height, wanted in (
        (-8.0, {caustics, trough}), (0.0, {caustics, level, trough}), (8.0, {caustics, level})
    ):  # fmt: skip
        found = said(height)
        assert {part for part in (caustics, level, trough) if part in found} == wanted
    _put(camera, 8.0)
    dives = moving_surface.limits(camera, CHOSEN, [(0.0, 0.0, -2.0)], eevee=True)
    assert any(trough in line for line in dives)
    assert said(0.0, eevee=False).endswith(f"waves longer than 10 m and the swell {caustics}")
    assert "no waterline" in said(0.0, live=True)
    assert not said(0.0, replace(CHOSEN, raised_waves=False))
    assert not said(0.0, replace(CHOSEN, surface="flat"))


def _trough(waves) -> tuple[float, float]:
    """Lowest place ahead of the camera."""
    x, y = np.meshgrid(np.linspace(-0.4, 1.2, 9), np.linspace(3.0, 6.0, 13))
    at = np.argmin(waves.elevation(x, y))
    return float(x.flat[at]), float(y.flat[at])


@pytest.mark.slow
def test_what_floats_in_a_trough_and_nothing_from_the_deep_is_seen_in_the_air(camera):
    """Everything is red; light from below has lost its red."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    waves = moving_surface.heights(scene, CHOSEN)
    x, y = _trough(waves)
    level = float(waves.elevation(x, y))
    assert level < -0.1
    red = bpy.data.materials.new("red")
    red.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.0, 0.0, 1)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(x, y, level), segments=48)
    bpy.context.object.data.materials.append(red)
    bpy.ops.mesh.primitive_plane_add(size=80.0, location=(0.0, 0.0, -5.9))
    bpy.context.object.data.materials.append(red)
    eye = (0.4, 0.7, float(waves.elevation(0.4, 0.7)) + 0.5)
    _put(camera, eye[2])
    camera.rotation_euler.x = math.radians(80.0)
    bpy.context.view_layer.update()
    plan = render_plan.make_plan(replace(CHOSEN, samples=4))
    extent = water_body.water_extent(scene, plan.column, 0.0)
    with engines.eevee_bands(scene, camera, plan, extent, 0.0) as engine:
        found = plan.reduction(0.0).apply(grey_scene.band_image(engine, plan, 0.0))
    seen = found[..., 0] > 2.0 * found[..., 2]
    away = math.dist((x, y, level), eye)
    pixels = 96 / (2 * math.tan(camera.data.angle / 2)) * 0.3 / away
    # A half ball from a little above: half a disc and half the ellipse of its waterline.
    steep = (eye[2] - level) / away
    assert seen.sum() == pytest.approx(math.pi / 2 * pixels**2 * (1 + steep), rel=0.15)
    assert not red.get("uw_transparent_shadow")
    assert red.use_transparent_shadow


@pytest.mark.slow
@pytest.mark.usefixtures("properties")
def test_the_viewport_says_what_it_does_not_show(camera):
    scene = bpy.context.scene
    _put(camera, -2.0)
    stored = scene.underwater
    stored.surface, stored.raised_waves, stored.wave_resolution = "waves", True, 64
    notes = live.add(scene)
    live.remove(scene)
    assert any("no waterline" in note for note in notes)
