"""Waves go into a scene, follow the frame, and leave without a trace."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs.command_line import merge, parse
from underwater_spectral.node_groups import realtime_values, realtime_waves
from underwater_spectral.scene.readers import moving_surface
from underwater_spectral.scene.terms import waves
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.water import realtime, scene_water, water_body
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
QUICK = {"bands": 3, "phase": "hg:0.9", "wave_tile": 2.0, "wave_resolution": 16}
OPTIONS = [
    *("--surface", "waves", "--wind", "7", "--wind-direction", "90"),
    *("--wave-seed", "4", "--fetch", "2"),
]


def _water(scene, **changes):
    plan = make_plan(SceneSettings(**({"surface": "waves"} | QUICK | changes)))
    water = eevee_water(plan, scene, Eye(scene.camera, 5.0), np.ones((3, len(plan.bands))))
    return waves.with_waves(scene, plan, water)


def _add(scene, water):
    realtime.add_realtime(scene, water, water_body.WaterExtent(50.0, 20.0))


def _pixels(name="UW Caustics"):
    image = bpy.data.images[name]
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values


def _scene():
    scene = bpy.context.scene
    scenes._cube("ball", (0.0, 6.0, -5.0)).data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    return scene


@pytest.mark.slow  # waves leave as all real-time water does
def test_removal_restores_every_value():
    scene = scenes.varied_scene()
    bpy.context.view_layer.update()  # drivers write what they compute
    before = snapshot.snapshot()
    _add(scene, _water(scene, shafts=True))
    assert "UW Caustics" in bpy.data.images
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.slow
def test_nothing_is_built_for_a_flat_surface():
    scene = _scene()
    _add(scene, _water(scene, surface="flat"))
    assert "UW Caustics" not in bpy.data.images
    names = {n.name for n in bpy.data.node_groups[realtime_values.NAME].nodes}
    assert not any(name.startswith(("wave", "caustic", "glitter")) for name in names)


def test_the_pattern_follows_the_frame_and_only_the_frame():
    scene = _scene()
    scene.frame_set(10)
    _add(scene, _water(scene))
    first = _pixels()
    assert first.mean() == pytest.approx(1.0, abs=1e-4)
    nodes = [n.as_pointer() for n in bpy.data.node_groups[realtime_values.NAME].nodes]
    scene.frame_set(50)
    realtime.set_values(scene, _water(scene, wind_speed=7.0))
    assert np.abs(_pixels() - first).max() > 0.1
    scene.frame_set(10)
    realtime.set_values(scene, _water(scene))
    assert np.array_equal(_pixels(), first)
    assert nodes == [n.as_pointer() for n in bpy.data.node_groups[realtime_values.NAME].nodes]


@pytest.mark.slow
def test_images_are_saved_with_the_file(tmp_path):
    scene = _scene()
    _add(scene, _water(scene))
    realtime.keep_images(scene)
    wanted, slopes = _pixels(), _pixels("UW Slopes")
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert np.array_equal(_pixels(), wanted)
    assert np.array_equal(_pixels("UW Slopes"), slopes)
    image = bpy.data.images["UW Caustics"]
    assert image.is_float
    assert image.colorspace_settings.is_data


def test_bands_are_chosen_from_the_contrast():
    scene = _scene()
    water = _water(scene, bands=6)
    part = water.in_channels(channels_of_bands(water.column.bands, (3, 4, 5)))
    assert realtime_waves.WaveShape in part.shape
    fraction = part.projected.caustics / part.projected.sunlit
    deepest = fraction[:, :, -1, 0]
    contrast = water.term(waves.WaveTerm).contrast
    assert deepest == pytest.approx(np.tile(contrast[-1, 3:], (len(deepest), 1)))


def test_strength_scales_the_contrast():
    scene = _scene()
    one, none = (_water(scene, caustics=x) for x in (1.0, 0.0))
    assert np.all(none.projected.caustics == 0.0)
    assert none.numbers.single[realtime_waves.CAUSTIC_STRENGTH] == 0.0
    assert np.abs(one.projected.caustics / one.projected.sunlit)[:3, :, 5, 0].min() > 0.2


def test_time_of_the_waves():
    scene = bpy.context.scene
    scene.render.fps, scene.frame_current = 25, 50
    assert moving_surface.wave_time(scene, SceneSettings()) == pytest.approx(2.0)
    assert moving_surface.wave_time(scene, SceneSettings(wave_time_scale=0.5)) == pytest.approx(1.0)
    # As all else, they go slower where time is stretched.
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 200
    assert moving_surface.wave_time(scene, SceneSettings()) == pytest.approx(1.0)


def test_options():
    given = parse(OPTIONS)
    sea = moving_surface.sea_of(merge(SceneSettings(), given))
    assert (sea.wind_speed, sea.wind_direction, sea.seed, sea.fetch) == (7.0, 90.0, 4, 2000.0)
    with pytest.raises(InputError, match="--wind: 50 is outside 0 to 40"):
        merge(SceneSettings(), parse(["--wind", "50"]))
