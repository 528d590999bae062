"""Lamps of a scene in its water: their power, their light, their shadows, and what goes wrong."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.scene import marks, stored_lamps
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.readers import cameras, dark_lamps, lamp_records, lamp_shadows, lamps
from underwater_spectral.scene.readers.lamp_shadows import LampShadowCache
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import lamp_rigs, water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.lamps.grouping import grouped
from underwater_spectral.uw_spectral.lamps.lamp import ray_past_lamp
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.virtual_point_lights import COUNT
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import ABSOLUTE, RELATIVE, full_sun
from underwater_spectral.uw_spectral.spectra.reflectance import emission_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture

BANDS = Bands.uniform(3)
DEPTH = 20.0
NIGHT = SceneSettings(water="jerlov:IB", bands=3, sunlight=0.0, samples=8, surface="none")
SIZE = 24


@pytest.fixture
def scene(registered):
    """A camera at 20 m that looks along y, at a matt white wall 4 m away."""
    scene = registered
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler.x = (0.0, 0.0, -DEPTH), math.pi / 2
    scene.collection.objects.link(camera)
    scene.camera = camera
    render = scene.render
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    scenes.wall("wall", (0.0, 4.0, -DEPTH), 8.0)
    return scene


def _lamp(place, power=100.0, kind="POINT", colour=(1.0, 1.0, 1.0)):
    light = bpy.data.lights.new("Lamp", kind)
    light.energy, light.color, light.shadow_soft_size = power, colour, 0.02
    item = bpy.data.objects.new("Lamp", light)
    item.location = place
    item.rotation_euler.x = math.pi / 2
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


def _by(engine, scene, chosen=NIGHT, **arguments):
    """Bands of a picture, shape (SIZE, SIZE, 3), top row first."""
    bpy.context.view_layer.update()
    plan, camera = render_plan.make_plan(chosen), scene.camera
    depth = cameras.camera_depth(camera, math.inf)
    extent = water_body.water_extent(scene, plan.column, depth)
    if engine == "cycles":
        opened = engines.cycles_bands(scene, camera, plan, extent, seed=1)
    else:
        opened = engines.eevee_bands(scene, camera, plan, extent, depth)
    out = np.zeros((SIZE, SIZE, 3))
    folder = arguments["folder"]
    with opened as water:
        draw = water.frame(plan, depth)
        for number, bands in enumerate(water.passes):
            draw(bands, folder / f"{number}.exr")
            out[..., list(bands)] = read_exr(folder / f"{number}.exr")[0][..., : len(bands)]
    return plan, out


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["eevee", "cycles"])
def test_a_lamp_has_the_intensity_of_its_watts(scene, tmp_path, engine):
    """W → radiant intensity: P/4π over 4π sr, in water that only absorbs, within 1 %."""
    _lamp((0.0, 1.0, -DEPTH))
    chosen = {"scattering_factor": 0.0, "samples": 64}
    plan, picture = _by(engine, scene, dataclasses.replace(NIGHT, **chosen), folder=tmp_path)
    a, middle = plan.column.absorption, slice(SIZE // 2 - 1, SIZE // 2 + 1)
    intensity = 100.0 / (4 * math.pi) * emission_basis(plan.bands).sum(axis=1)
    reflectance = render_plan.uplift_basis(plan.bands) @ (0.8, 0.8, 0.8)
    wanted = reflectance / math.pi * intensity / 9.0 * np.exp(-a * (3.0 + 4.0))
    assert picture[middle, middle].mean(axis=(0, 1)) == pytest.approx(wanted, rel=0.01)


def test_light_in_the_water_is_the_formula(scene, tmp_path):
    bpy.data.objects.remove(bpy.data.objects["wall"])
    spot = _lamp((0.7, 0.5, -DEPTH + 0.4), kind="SPOT")
    spot.data.spot_size = math.radians(80)
    plan, picture = _by("eevee", scene, folder=tmp_path)
    (lamp,) = lamps.plan_lamps(scene, plan).lamps
    water = lamp_water(plan.column.absorption, plan.column.scattering, plan.phase)
    half = math.tan(scene.camera.data.angle / 2)
    at = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    x, z = np.meshgrid(half * at, -half * at)
    w = np.stack([x, np.ones_like(x), z]) / np.sqrt(1 + x**2 + z**2)
    ray = ray_past_lamp(lamp, (0.0, 0.0, -DEPTH), tuple(w[..., None]), 1e3)
    wanted = sum(lamp_light(lamp, ray, water))
    assert np.median(np.abs(picture / wanted - 1.0)) < 3e-3
    assert np.quantile(np.abs(picture / wanted - 1.0), 0.95) < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("sunlight", [0.0, pytest.param(1.0, marks=pytest.mark.slow)])
def test_shadows_of_two_lamps_are_told_apart(scene, tmp_path, sunlight):
    """A screen keeps the red lamp from the wall's middle, and not the blue one.

    The sun stands before the wall: its light must not be taken for that of a lamp.
    """
    red = _lamp((-1.5, 1.0, -DEPTH), colour=(1.0, 0.0, 0.0), power=2e4)
    blue = _lamp((1.5, 1.0, -DEPTH), colour=(0.0, 0.0, 1.0), power=2e4)
    chosen = {"scattering_factor": 0.0, "sunlight": sunlight, "diffuse_shadows": False}
    chosen |= {"sun_zenith": 60.0, "sun_azimuth": 90.0}
    settings = dataclasses.replace(NIGHT, **chosen)
    pictures = {}
    scenes.wall("screen", (-0.75, 2.5, -DEPTH), 0.7, 0.0)
    for name, shining in (("both", (red, blue)), ("blue", (blue,)), ("none", ())):
        for item in (red, blue):
            item.hide_render = item not in shining
        pictures[name] = _by("eevee", scene, settings, folder=tmp_path)[1]
    middle = slice(SIZE // 2 - 1, SIZE // 2 + 1)
    both, blue_only, dark = (pictures[n][middle, middle].mean((0, 1)) for n in pictures)
    assert both - dark == pytest.approx(blue_only - dark, rel=0.01)
    # Beside the shadow the red one shines.
    beside = {name: picture[SIZE // 2, -3, 2] for name, picture in pictures.items()}
    assert beside["both"] - beside["blue"] > 0.2 * (beside["both"] - beside["none"])
    assert beside["both"] - beside["none"] > 0


@pytest.mark.slow
def test_a_lamp_that_shines_away_is_dark(scene, tmp_path):
    """EEVEE would draw what casts its shadows: a lamp of one channel, a bright spot."""
    spot = _lamp((0.03, 2.0, -DEPTH + 0.03), kind="SPOT")
    spot.data.shadow_soft_size = 0.1
    pictures = []
    for spot.visible_camera in (False, True):
        pictures.append(_by("eevee", scene, folder=tmp_path)[1])
    assert pictures[1] == pytest.approx(pictures[0], rel=0.01)


@pytest.mark.slow
def test_a_metal_ball_shows_the_image_of_a_lamp(scene, tmp_path):
    """All light of its highlight is that of the image in a convex mirror, focal length R/2.

    A second lamp, behind a screen, has none.
    """
    bpy.data.objects.remove(bpy.data.objects["wall"])
    radius, away, r = 0.2, 4.0, 3.0
    metal = scenes.principled("metal", (0.8, 0.8, 0.8, 1.0))
    shader = metal.node_tree.nodes["Principled BSDF"].inputs
    shader["Metallic"].default_value, shader["Roughness"].default_value = 1.0, 0.3
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=96, ring_count=48, radius=radius, location=(0.0, away, -DEPTH)
    )
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(metal)
    turn = math.radians(40.0)
    for side in (-1.0, 1.0):
        _lamp((side * r * math.sin(turn), away - r * math.cos(turn), -DEPTH))
    middle = (0.5 * r * math.sin(turn), away - 0.5 * r * math.cos(turn), -DEPTH)
    scenes.wall("screen", middle, 0.5, 0.0)
    scene.camera.data.angle = angle = 2.0 * math.atan(1.1 * radius / away)
    chosen = {"scattering_factor": 0.0, "diffuse_shadows": False, "samples": 64}
    plan, picture = _by("eevee", scene, dataclasses.replace(NIGHT, **chosen), folder=tmp_path)
    seen = picture.sum(axis=(0, 1)) * (2.0 * math.tan(angle / 2) / SIZE) ** 2
    intensity = 100.0 / (4 * math.pi) * emission_basis(plan.bands).sum(axis=1)
    image = intensity * (radius / 2) ** 2 / (r - radius / 2) ** 2 / (away - radius / 2) ** 2
    reflectance = render_plan.uplift_basis(plan.bands) @ (0.8, 0.8, 0.8)
    a, length = plan.column.absorption, r + away - 2.0 * radius
    assert seen == pytest.approx(reflectance * image * np.exp(-a * length), rel=0.04)


@pytest.mark.slow
def test_extremes_are_finite(scene, tmp_path):
    """At the camera, on its ray, behind the wall, above water, on an object, near, far, dark."""
    for place, power in (
        ((0.0, 0.0, -DEPTH), 10.0),
        ((0.0, 2.0, -DEPTH), 10.0),
        ((0.0, 6.0, -DEPTH), 10.0),
        ((0.0, 0.0, 3.0), 10.0),
        ((1.0, 4.0, -DEPTH), 10.0),
        ((0.0, 1e-3, -DEPTH), 10.0),
        ((0.0, 1e3, -DEPTH), 1e6),
        ((1.0, 1.0, -DEPTH), 0.0),
    ):
        _lamp(place, power)
    _, picture = _by("eevee", scene, folder=tmp_path)
    assert np.isfinite(picture).all()
    assert (picture >= 0).all()
    assert picture.max() > 0


@pytest.mark.slow
def test_a_hundred_lamps_are_finite(scene, tmp_path):
    for index in range(100):
        _lamp((0.1 * (index % 10) - 0.5, 1.0, -DEPTH + 0.1 * (index // 10) - 0.5), 1.0)
    _, picture = _by("eevee", scene, folder=tmp_path)
    assert np.isfinite(picture).all()
    assert picture.max() > 0


def test_objects_keep_light_from_the_water_behind_them(scene):
    """The wall does, but not one without a shadow, nor the water's own objects."""
    _lamp((0.0, 1.0, -DEPTH))

    def lit(*place):
        found = LampShadowCache().of(scene, lamps.lamps_of(scene, BANDS, RELATIVE))
        return float(np.ravel(found.lamps[0].lit(tuple(np.array([[x]]) for x in place)))[0])

    assert lit(0.0, 2.9, 0.0) == 1.0
    assert lit(0.0, 3.4, 0.0) == 0.0
    assert lit(0.0, -9.0, 0.0) == 1.0
    wall = bpy.data.objects["wall"]
    wall.visible_shadow = False
    assert lit(0.0, 3.4, 0.0) == 1.0
    wall.visible_shadow = True
    wall[MARK] = True
    assert lit(0.0, 3.4, 0.0) == 1.0


def test_shadows_are_computed_again_where_something_moved(scene, monkeypatch):
    """Else they are those of before; what is kept changes nothing."""
    one, other = _lamp((0.0, 1.0, -DEPTH)), _lamp((0.5, 1.5, -DEPTH))
    wall, cache, traced = bpy.data.objects["wall"], LampShadowCache(), []
    first = lamp_shadows.Meshes.first

    def noted(self, *rays):
        traced.append(1)
        return first(self, *rays)

    monkeypatch.setattr(lamp_shadows.Meshes, "first", noted)

    def moved(item=None, step=0.25):
        if item is not None:
            item.location.y += step
        bpy.context.view_layer.update()
        found, before = lamps.lamps_of(scene, BANDS, RELATIVE), len(traced)
        now = cache.of(scene, found).lamps
        count = len(traced) - before
        for lamp, fresh in zip(now, LampShadowCache().of(scene, found).lamps, strict=True):
            assert (lamp.shadow is None) == (fresh.shadow is None)
            if lamp.shadow is not None:
                np.testing.assert_array_equal(lamp.shadow.values, fresh.shadow.values)
        return count

    assert [moved(), moved(), moved(one), moved(wall), moved()] == [2, 0, 1, 2, 0]
    wall.data.vertices[0].co.x += 1.0
    wall.data.update()
    assert moved() == 2
    # A lamp that is out has none, and one that shines again has its own.
    other.data.energy = 0.0
    assert moved() == 0
    other.data.energy = 10.0
    assert moved() == 1


def test_what_lamps_light_throws_light_back(scene):
    """The wall does, in the colour that it has now, also where maps are kept."""
    _lamp((0.0, 1.0, -DEPTH))
    (node,) = (n for n in bpy.data.materials["wall"].node_tree.nodes if n.type == "BSDF_DIFFUSE")
    water = lamp_water([0.1] * 3, [0.1] * 3, seawater_mixture([1.0] * 3, [0.02] * 3))
    cache = LampShadowCache()

    def virtual(colour):
        node.inputs["Color"].default_value = (*colour, 1.0)
        bpy.context.view_layer.update()
        found = cache.of(scene, lamps.lamps_of(scene, BANDS, RELATIVE))
        assert found.virtual == ()
        return found.with_virtual_lights(water, BANDS, (0.0, 0.0, -DEPTH)).virtual

    white, red, black = (virtual(c) for c in ((0.8,) * 3, (0.8, 0.0, 0.0), (0.0,) * 3))
    assert len(white) == len(red) == len(black) == COUNT
    for one in white:
        assert one.position[1] == pytest.approx(4.0, abs=1e-3)
        assert one.axis == pytest.approx((0.0, -1.0, 0.0), abs=1e-3)
    power = [sum(one.intensity for one in made) for made in (white, red, black)]
    assert np.all(power[0] > 0)
    assert 0.8 * power[0][2] < power[1][2] < power[0][2]
    assert power[1][0] < 0.2 * power[0][0]
    assert not np.any(power[2])


def test_powers_in_lumen_and_watt(scene):
    item = _lamp((0.0, 1.0, -DEPTH), 683.0)
    own = item.data.underwater
    own.spectrum, own.unit = "file:" + str(_green(bpy.app.tempdir)), "lm"
    (absolute,) = lamps.lamps_of(scene, Bands.uniform(3), ABSOLUTE).lamps
    # 683 lm at 555 nm are 1 W, in a triangle of 2 nm within a band of 100 nm.
    assert absolute.intensity == pytest.approx([0.0, 0.01 / (4 * math.pi), 0.0], rel=2e-3)
    (relative,) = lamps.lamps_of(scene, Bands.uniform(3), RELATIVE).lamps
    assert relative.intensity * full_sun() == pytest.approx(absolute.intensity)


def _green(folder):
    path = f"{folder}/green.csv"
    with open(path, "w") as file:  # noqa: PTH123
        file.write("wavelength_nm,power\n300,0\n554,0\n555,1\n556,0\n830,0\n")
    return path


def test_a_spectrum_that_cannot_be_used_names_the_lamp(scene):
    _lamp((0.0, 1.0, -DEPTH)).data.underwater.spectrum = "sodium lamp of my aunt"
    with pytest.raises(InputError, match="lamp 'Lamp': .*emission"):
        lamps.lamps_of(scene, BANDS, RELATIVE)


def test_a_lamp_above_the_water_shines_into_it_and_says_how(scene):
    item = _lamp((0.0, 1.0, 2.0))
    assert "above the water" in dark_lamps.left_out(scene)[item]
    item.data.underwater.from_above = True
    assert dark_lamps.left_out(scene) == {}
    found = lamps.lamps_of(scene, BANDS, RELATIVE)
    assert "above the water" in found.notes[0]
    assert "above the water" in " ".join(dark_lamps.diagnostics(item))
    assert lamp_records.records(scene)[0]["through_surface"]
    assert lamp_records.records(scene)[0]["position"] == pytest.approx([0.0, 1.0, 2.0])
    assert found.from_air
    (lamp,) = found.lamps
    assert lamp.position == pytest.approx((0.0, 1.0, 1.34 * 2.0))
    assert lamp.own_place == pytest.approx((0.0, 1.0, 2.0))
    item.location.z = -1.0
    bpy.context.view_layer.update()
    found = lamps.lamps_of(scene, BANDS, RELATIVE)
    assert (found.lamps[0].dry, found.notes, found.from_air) == (0.0, (), False)
    item.keyframe_insert("location", frame=1)
    assert lamps.lamps_of(scene, BANDS, RELATIVE).from_air
    item.data.underwater.in_water = False
    found = lamps.lamps_of(scene, BANDS, RELATIVE)
    assert found.lamps == ()
    assert "belongs to the air" in found.notes[0]


def test_without_a_surface_light_from_above_goes_straight(scene):
    _lamp((0.0, 1.0, 2.0)).data.underwater.from_above = True
    (lamp,) = lamps.plan_lamps(scene, render_plan.make_plan(NIGHT)).lamps
    assert lamp.position == pytest.approx((0.0, 1.0, 2.0))
    assert float(lamp.profile.value(1.0) * lamp.intensity.max()) > 0
    flat = dataclasses.replace(NIGHT, surface="flat")
    (refracted,) = lamps.plan_lamps(scene, render_plan.make_plan(flat)).lamps
    assert refracted.position[2] > 2.6


@pytest.mark.parametrize("engine", [pytest.param("eevee", marks=pytest.mark.slow), "cycles"])
def test_a_lamp_in_the_air_lights_the_bottom_by_snell_and_fresnel(scene, tmp_path, engine):
    """Straight below it by n², (1 - R), and a source n H above the water; it only absorbs there."""
    wall, depth, height = bpy.data.objects["wall"], 3.0, 2.0
    wall.location, wall.rotation_euler = (0.0, 0.0, -depth), (0.0, 0.0, 0.0)
    scene.camera.location, scene.camera.rotation_euler.x = (0.0, 0.0, -1.0), 0.0
    scene.camera.data.angle = math.radians(10)
    item = _lamp((0.0, 0.0, height))
    item.rotation_euler.x, item.data.underwater.from_above = 0.0, True
    # The wall fills just half of what is around it: as a seabed it would go on for ever.
    chosen = {"scattering_factor": 0.0, "samples": 64, "surface": "flat", "scene_floor": False}
    plan, picture = _by(engine, scene, dataclasses.replace(NIGHT, **chosen), folder=tmp_path)
    n, a = plan.column.refractive_index, plan.column.absorption
    intensity = 100.0 / (4 * math.pi) * emission_basis(plan.bands).sum(axis=1)
    through = 1.0 - ((n - 1.0) / (n + 1.0)) ** 2
    E = intensity * through * n * n / (n * height + depth) ** 2
    reflectance = render_plan.uplift_basis(plan.bands) @ (0.8, 0.8, 0.8)
    wanted = reflectance / math.pi * E * np.exp(-a * (depth + depth - 1.0))
    middle = slice(SIZE // 2 - 3, SIZE // 2 + 3)
    assert picture[middle, middle].mean(axis=(0, 1)) == pytest.approx(wanted, rel=0.02)


def test_a_deck_keeps_light_from_the_water_and_a_housing_above_does_not(scene):
    item = _lamp((0.0, 0.0, 2.0))
    item.rotation_euler.x, item.data.underwater.from_above = 0.0, True
    bpy.data.objects.remove(bpy.data.objects["wall"])

    def lit():
        bpy.context.view_layer.update()
        found = LampShadowCache().of(scene, lamps.lamps_of(scene, BANDS, RELATIVE))
        (lamp,) = found.lamps
        below = (0.0, 0.0, -2.0 - lamp.position[2])
        return float(np.ravel(lamp.lit(tuple(np.array([[x]]) for x in below)))[0])

    assert lit() == 1.0
    body = scenes.wall("thing", (0.0, 0.0, 2.3), 1.0)
    body.rotation_euler.x = 0.0
    assert lit() == 1.0
    body.location.z = 1.0
    assert lit() == 0.0


@pytest.mark.slow
def test_a_strobe_follows_its_keyframes_and_its_parent(scene):
    item = _lamp((0.0, 1.0, -DEPTH), 50.0)
    item.data.keyframe_insert("energy", frame=1)
    item.data.energy = 0.0
    item.data.keyframe_insert("energy", frame=2)
    carrier = bpy.data.objects.new("carrier", None)
    scene.collection.objects.link(carrier)
    item.parent = carrier
    carrier.keyframe_insert("location", frame=1)
    carrier.location.x = 3.0
    carrier.keyframe_insert("location", frame=2)
    scene.frame_set(1)
    live.add(scene)
    try:
        found = []
        for frame in (1, 2):
            scene.frame_set(frame)
            (lamp,) = lamps.lamps_of(scene, BANDS, RELATIVE).lamps
            (follower,) = marks.followers(scene)
            bpy.context.view_layer.update()
            found += [lamp.position[0], follower.matrix_world.translation.x]
            assert bool(lamp.intensity.any()) == (frame == 1)
    finally:
        live.remove(scene)
    assert found == pytest.approx([0.0, 0.0, 3.0, 3.0], abs=1e-6)


@pytest.mark.slow
def test_lamps_light_nothing_by_themselves_and_get_their_factors_back(scene):
    item = _lamp((0.0, 1.0, -DEPTH))
    item.data.diffuse_factor = 0.5
    live.add(scene)
    assert item.data.diffuse_factor == 0.0
    assert not item.hide_viewport
    live.remove(scene)
    assert item.data.diffuse_factor == 0.5
    assert not item.hide_render


def test_what_lamps_store_is_part_of_their_state(scene):
    item = _lamp((0.0, 1.0, -DEPTH))
    before = lamps.state(scene)
    item.data.underwater.spectrum = "led"
    assert lamps.state(scene) != before
    assert stored_lamps.stored_lamp(item.data).spectrum == "led"


@pytest.mark.parametrize("name", list(lamp_rigs.RIGS))
def test_rigs_hang_on_the_camera_and_meet_before_it(scene, name):
    rig = lamp_rigs.RIGS[name]
    made = lamp_rigs.add_rig(scene, name)
    scene.camera.location.x = 7.0
    bpy.context.view_layer.update()
    found = lamps.lamps_of(scene, BANDS, RELATIVE)
    assert len(found.lamps) == len(made) == len(rig.places)
    aim = np.array([7.0, rig.aim, -DEPTH])
    for lamp, (_, _, back) in zip(found.lamps, rig.places, strict=True):
        towards = aim - np.array([0.0, back, 0.0]) - np.array(lamp.position)
        assert np.array(lamp.axis) @ towards / np.linalg.norm(towards) > 0.9999
        assert lamp.intensity.all()


def test_a_rig_needs_a_camera_and_a_name(registered):
    with pytest.raises(InputError, match="no camera"):
        lamp_rigs.add_rig(registered, "torch")
    scenes.add_camera()
    with pytest.raises(InputError, match="rov2"):
        lamp_rigs.add_rig(registered, "lighthouse")


def test_groups_do_not_change_when_a_rig_moves():
    rig = np.array(lamp_rigs.RIGS["rov4"].places)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    first = grouped(rig, 2)
    for shift in np.random.default_rng(2).uniform(-100, 100, (20, 3)):
        assert grouped((rig @ turn.T + shift).astype(np.float32), 2) == first
