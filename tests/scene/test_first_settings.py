"""The default file of Blender: one button, and a picture that can be seen."""

from __future__ import annotations

import warnings
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.quality.picture import Optics, picture
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.readers import dark_lamps, view_tracing
from underwater_spectral.scene.viewport import first_settings, preview_depths
from underwater_spectral.scene.water import metering
from underwater_spectral.settings.render_plan import plan_of
from underwater_spectral.uw_spectral.spectra.colour_rendering import luminance, srgb_encode
from underwater_spectral.uw_spectral.spectra.tone import camera_curve


@pytest.fixture
def default_file(registered):
    """Blender's own first file: a cube, a lamp and a camera, all about z = 0."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


def _places(scene):
    return {item.name: tuple(item.matrix_world.translation) for item in scene.objects}


def test_the_default_cube_is_lowered_lit_and_exposed(default_file):
    scene = default_file
    before = _places(scene)
    assert first_settings.is_dry(scene)
    first_settings.start(scene, 3.0)
    assert preview_depths.camera_depth(scene) == pytest.approx(3.0)
    chosen = stored_settings.stored_settings(scene)
    assert (chosen.surface, chosen.exposure) == ("waves", "auto-picture")
    # The floor lies where the cube ends.
    assert chosen.floor_depth == pytest.approx(3.0 + before["Camera"][2] + 1.0, abs=2e-3)
    plan, depth = plan_of(chosen), preview_depths.camera_depth(scene)
    stops = metering.metered(scene, scene.camera, plan, depth, None)
    column = plan.column
    light = plan.viewpoint(depth).field
    seen = view_tracing.trace_view(scene, scene.camera, column, light, rays=300)
    flat = Optics(plan_of(replace(chosen, surface="flat")).viewpoint(depth, stops))
    colours = picture(flat, seen).without()
    shown = srgb_encode(camera_curve(chosen.tone)(np.maximum(colours, 0.0)))
    mean = float(seen.pixels @ shown.mean(axis=1))
    assert 0.25 < mean < 0.6
    assert float(seen.pixels @ (luminance(colours) > 1.0)) <= 0.03
    # The picture spans a good part of the display's range.
    spread = np.quantile(shown.mean(axis=1), [0.05, 0.98])
    assert spread[1] - spread[0] > 0.12


def test_lamps_of_a_dry_scene_stay_in_the_air_and_are_named(default_file):
    scene = default_file
    first_settings.start(scene, 3.0)
    lamp = scene.objects["Light"]
    assert lamp.matrix_world.translation.z < 0
    assert dark_lamps.objects_of(scene) == []
    assert "belongs to the air" in dark_lamps.left_out(scene)[lamp]
    lamp.data.underwater.in_water = True
    assert dark_lamps.objects_of(scene) == [lamp]


def test_a_scene_built_for_water_stays_where_it_is(default_file):
    scene = default_file
    scene.objects["Cube"].location.z = -4.0
    bpy.context.view_layer.update()
    before = _places(scene)
    assert not first_settings.is_dry(scene)
    first_settings.start(scene, 3.0)
    bpy.context.view_layer.update()
    assert _places(scene) == before
    assert dark_lamps.objects_of(scene) == []
    assert "above the water" in dark_lamps.left_out(scene)[scene.objects["Light"]]


@pytest.mark.slow
def test_the_scene_may_be_left_alone_and_grounds_of_its_own_are(default_file):
    scene = default_file
    before = _places(scene)
    first_settings.start(scene, None)
    bpy.context.view_layer.update()
    assert _places(scene) == before
    assert scene.underwater.floor_depth == 0.0
    scene.underwater.property_unset("surface")
    scene.objects["Cube"].scale = (30.0, 30.0, 1.0)
    bpy.context.view_layer.update()
    first_settings.start(scene, 3.0)
    assert scene.underwater.floor_depth == 0.0


@pytest.mark.slow
def test_add_water_leaves_settings_alone_that_are_there(default_file):
    scene = default_file
    scene.underwater.water, scene.underwater.phase = "jerlov:II", "hg:0.9"
    before = _places(scene)
    assert bpy.ops.underwater.add_water() == {"FINISHED"}
    bpy.context.view_layer.update()
    now = _places(scene)
    assert {name: now[name] for name in before} == before
    assert (scene.underwater.exposure, scene.underwater.surface) == ("auto", "none")
