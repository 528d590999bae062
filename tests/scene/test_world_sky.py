"""A scene's own world as the sky: what it brings is what the water gets, in every mode."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.jobs import batch
from underwater_spectral.jobs.farm import farm_bundle
from underwater_spectral.jobs.manifest_files import read_manifest
from underwater_spectral.scene import marks, stored_settings
from underwater_spectral.scene.engines import world_picture
from underwater_spectral.scene.unsupported import unsupported
from underwater_spectral.scene.viewport import (
    changes,
    first_settings,
    live,
    live_water,
    problems,
)
from underwater_spectral.settings.render_plan import forget_files, plan_of
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, skies
from underwater_spectral.tests.uw_spectral.transfer.sky_pictures import KNOWN_SKIES, NOON
from underwater_spectral.ui import previews
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from underwater_spectral.uw_spectral.transfer.sky_picture import SkyPicture

WORLD = SceneSettings(sky_picture="world", surface="flat", phase="hg:0.9", bands=3)


@pytest.fixture
def quick(monkeypatch):
    """Draw worlds in few pixels."""
    monkeypatch.setattr(world_picture, "_ROWS", 64)
    monkeypatch.setattr(world_picture, "_COLUMNS", 128)


@pytest.fixture
def drawings(monkeypatch):
    """Return a list of the worlds that are drawn from now on."""
    found, draw = [], world_picture._draw

    def noted(scene, world, path):
        found.append(world.name)
        return draw(scene, world, path)

    monkeypatch.setattr(world_picture, "_draw", noted)
    return found


def _picture(scene, folder):
    found = world_picture.drawn(scene, WORLD, folder)
    return SkyPicture.read(found.sky_picture.removeprefix("file:"))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", KNOWN_SKIES)
def test_direct_and_diffuse_light_of_a_world_are_those_of_its_picture(name, tmp_path):
    known = KNOWN_SKIES[name]
    skies.with_picture(bpy.context.scene, known, tmp_path / "sky.exr")
    drawn = _picture(bpy.context.scene, tmp_path)
    assert drawn.sun_irradiance == pytest.approx(known.sun_irradiance, rel=0.02)
    assert drawn.without_sun.irradiance == pytest.approx(known.diffuse_irradiance, rel=0.02)


def test_the_sun_of_a_sky_texture_is_found_where_it_stands_and_all_of_it_is_cut_out(tmp_path):
    scene = bpy.context.scene
    texture = skies.world(scene, "ShaderNodeTexSky")
    skies.strength(scene).default_value = 0.1
    texture.sun_elevation, texture.sun_rotation = math.radians(35.0), math.radians(200.0)
    drawn = _picture(scene, tmp_path)
    high, round_ = math.radians(35.0), math.radians(90.0 - 200.0)
    towards = math.cos(high) * math.cos(round_), math.cos(high) * math.sin(round_), math.sin(high)
    assert np.negative(drawn.sun) == pytest.approx(towards, abs=2e-3)
    texture.sun_disc = False
    alone = _picture(scene, tmp_path)
    assert alone.sun_irradiance.tolist() == [0.0, 0.0, 0.0]
    assert drawn.without_sun.irradiance == pytest.approx(alone.irradiance, rel=0.02)
    assert drawn.sun_irradiance == pytest.approx(drawn.irradiance - alone.irradiance, rel=0.02)


def test_a_world_is_drawn_again_where_it_looks_otherwise_and_only_there(quick, drawings, tmp_path):
    scene = bpy.context.scene
    mapping = skies.with_picture(scene, NOON, tmp_path / "sky.exr")
    tree = scene.world.node_tree
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    shown = tree.nodes["Background"].inputs["Color"]
    kept = shown.links[0].from_socket
    tree.links.new(kept, ramp.inputs["Factor"])
    changes = (
        lambda: setattr(skies.strength(scene), "default_value", 2.0),
        lambda: mapping.inputs["Rotation"].default_value.__setitem__(2, 1.0),
        lambda: tree.links.new(ramp.outputs["Color"], shown),
        lambda: setattr(ramp.color_ramp.elements[0], "color", (0.5, 0.2, 0.1, 1.0)),
        lambda: setattr(shown.links[0], "is_muted", True),
        lambda: tree.links.new(kept, shown),
        lambda: setattr(kept.node, "interpolation", "Closest"),
    )
    _picture(scene, tmp_path)
    for count, change in enumerate(changes, start=1):
        change()
        mapping.location.x += 10.0  # in the editor
        found = [world_picture.drawn(scene, WORLD, tmp_path) for _ in range(2)]
        assert found[0] == found[1]
        assert len(drawings) == count + 1
    assert len({path.name for path in tmp_path.glob("sky_*.exr")}) == len(changes) + 1


def test_twice_the_strength_is_twice_the_light_and_a_turn_turns_it(quick, tmp_path):
    scene = bpy.context.scene
    mapping = skies.with_picture(scene, NOON, tmp_path / "sky.exr")

    def column():
        return plan_of(world_picture.drawn(scene, WORLD, tmp_path)).column

    one = column()
    skies.strength(scene).default_value = 2.0
    two = column()
    mapping.inputs["Rotation"].default_value[2] = -math.radians(90.0)
    turned = column()
    assert two.sun_irradiance == pytest.approx(2.0 * one.sun_irradiance, rel=1e-3)
    assert two.sky_radiance == pytest.approx(2.0 * one.sky_radiance, rel=1e-3)
    assert turned.sun_irradiance == pytest.approx(two.sun_irradiance, rel=0.01)
    x, y, z = two.sun_direction
    assert turned.sun_direction == pytest.approx([-y, x, z], abs=5e-3)


def test_a_linked_world_lights_the_water_and_its_volume_is_left_out(quick, tmp_path):
    scene = bpy.context.scene
    skies.world(scene)
    skies.strength(scene).default_value = 0.5
    tree = scene.world.node_tree
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    volume.inputs["Density"].default_value = 100.0
    tree.links.new(volume.outputs[0], tree.nodes["World Output"].inputs["Volume"])
    assert any("volume of world" in note for note in unsupported(scene, "world"))
    bpy.data.libraries.write(str(tmp_path / "sky.blend"), {scene.world})
    bpy.data.worlds.remove(scene.world)
    with bpy.data.libraries.load(str(tmp_path / "sky.blend"), link=True) as (_, wanted):
        wanted.worlds = ["Sky"]
    scene.world = bpy.data.worlds["Sky"]
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("worlds", "scenes", "cameras")}
    assert _picture(scene, tmp_path).radiance == pytest.approx(
        0.5 * tree_colour(scene) * np.ones((64, 128, 3)), rel=1e-4
    )
    assert before == {kind: len(getattr(bpy.data, kind)) for kind in before}


def tree_colour(scene):
    return scene.world.node_tree.nodes["Background"].inputs["Color"].default_value[0]


def test_worlds_that_cannot_light_the_water_are_refused_by_name(quick, tmp_path):
    scene = bpy.context.scene
    scene.world = None
    with pytest.raises(InputError, match="has no world"):
        _picture(scene, tmp_path)
    skies.world(scene)
    skies.strength(scene).default_value = 0.0
    with pytest.raises(InputError, match="the sky of world 'Sky' is black above the horizon"):
        _picture(scene, tmp_path)
    scene.world.node_tree.nodes.clear()  # nor has it an output
    with pytest.raises(InputError, match="is black above the horizon"):
        _picture(scene, tmp_path)
    skies.with_picture(scene, NOON, tmp_path / "lost.exr")
    (tmp_path / "lost.exr").unlink()
    with pytest.raises(InputError, match=r"the file of its picture 'lost.exr' is missing"):
        _picture(scene, tmp_path)


def test_what_of_a_world_does_not_light_the_water_is_said():
    scene = bpy.context.scene
    skies.world(scene, "ShaderNodeTexSky")
    (said,) = unsupported(scene)
    assert "does not light the water" in said
    assert unsupported(scene, "world") == ()
    scene.world.node_tree.nodes.new("ShaderNodeLightPath")
    (said,) = unsupported(scene, "world")
    assert "what cameras see" in said


@pytest.mark.parametrize(("kind", "chosen"), [("", ""), ("ShaderNodeTexSky", "world")])
def test_a_sky_lights_the_first_picture_and_a_grey_world_does_not(registered, kind, chosen):
    scene = bpy.context.scene
    skies.world(scene, kind)
    first_settings.start(scene, None)
    assert stored_settings.stored_settings(scene).sky_picture == chosen


def test_the_sun_that_is_found_is_said_and_that_there_is_another(tmp_path):
    def note(*pictures):
        path = tmp_path / "sky.exr"
        write_rgb_exr(path, sum(pictures).astype(np.float32))
        forget_files()
        return plan_of(replace(WORLD, sky_picture=f"file:{path}")).sky_note

    noon, other = NOON.picture(), replace(NOON, azimuth=-100.0, sun_colour=(0.5, 0.4, 0.3))
    assert note(noon).endswith(
        "55.0° high, shines towards 40° and brings 88 % of the light below the surface"
    )
    assert note(noon, other.picture()).endswith(
        "; another bright spot of it lights as sky does, without shadows"
    )
    assert note(KNOWN_SKIES["cloudy"].picture()).endswith("no sun was found in it")


def test_settings_of_a_world_that_nobody_has_drawn_are_refused():
    with pytest.raises(InputError, match="Add Water"):
        plan_of(WORLD)


@pytest.fixture
def lit(registered, quick, tmp_path):
    """A scene whose live water a picture lights."""
    scene = bpy.context.scene
    scene.camera = scenes.add_camera((0.0, 0.0, -4.0), (1.2, 0.0, 0.0))
    mapping = skies.with_picture(scene, NOON, tmp_path / "sky.exr")
    for name in ("sky_picture", "surface", "phase"):
        setattr(scene.underwater, name, getattr(WORLD, name))
    scene.underwater.exposure = "0"
    return scene, mapping


def _texels(scene, name):
    image = marks.part(scene, name)
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found.reshape(*image.size[::-1], 4)[..., :3]


def test_live_water_follows_its_world_which_is_drawn_once(lit, drawings):
    scene, _ = lit
    notes = live.add(scene)
    (said,) = [note for note in notes if "54.9° high, shines towards 40°" in note]
    assert "the picture of the sky sky_Sky_" in said
    assert drawings == ["Sky"]
    before, light = (_texels(scene, name) for name in ("uw_sky", "uw_table"))
    known = plan_of(world_picture.known(scene, WORLD)).column.sky_picture
    assert before[::-1] == pytest.approx(known.radiance, rel=1e-3)
    scene.camera.location.x = 1.0
    live.update(scene)
    assert drawings == ["Sky"]
    own = scene[marks.OWN_WORLD]
    own.node_tree.nodes["Background"].inputs["Strength"].default_value = 2.0
    bpy.context.view_layer.update()
    assert drawings == ["Sky", "Sky"]
    assert _texels(scene, "uw_sky") == pytest.approx(2.0 * before, rel=1e-3)
    assert _texels(scene, "uw_table").mean() > light.mean()
    live.remove(scene)
    assert scene.world == own
    assert not [image for image in bpy.data.images if "UW" in image.name]


def test_live_water_has_the_light_of_keyframes_and_of_values_that_have_none_yet(lit):
    scene, _ = lit
    live.add(scene)
    plain = _texels(scene, "uw_sky")
    socket = scene[marks.OWN_WORLD].node_tree.nodes["Background"].inputs["Strength"]
    for frame, value in ((1, 1.0), (3, 3.0)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    bpy.context.view_layer.update()
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        assert _texels(scene, "uw_sky") == pytest.approx(socket.default_value * plain, rel=1e-3)
    assert socket.default_value == 3.0
    socket.default_value = 5.0
    live.update(scene)
    assert _texels(scene, "uw_sky") == pytest.approx(5.0 * plain, rel=1e-3)


def test_read_outs_are_those_of_the_world_once_it_is_drawn(lit, tmp_path):
    scene, _ = lit
    formula = previews.compute(scene).readouts.euphotic_depth
    scene.underwater.sky_picture = ""
    assert previews.compute(scene).readouts.euphotic_depth == formula
    scene.underwater.sky_picture = "world"
    live.add(scene)
    assert previews.compute(scene).readouts.euphotic_depth != pytest.approx(formula, rel=1e-3)
    (tmp_path / "sky.exr").unlink()
    assert "is missing" in previews.compute(scene).error


def test_in_a_window_a_world_is_drawn_at_rest_and_a_render_without_it_is_said(
    lit, drawings, monkeypatch
):
    scene, _ = lit
    live.add(scene)
    plain = _texels(scene, "uw_sky")
    monkeypatch.setattr(live_water, "_in_background", lambda: False)
    own = scene[marks.OWN_WORLD]
    own.node_tree.nodes["Background"].inputs["Strength"].default_value = 3.0
    live.update(scene, hasty=True)
    assert drawings == ["Sky"]
    assert changes.is_stale(scene)
    assert problems.problem(scene) == ""
    monkeypatch.setattr(live_water, "_is_rendering", lambda: True)
    live.update(scene)
    assert drawings == ["Sky"]
    assert "the world has changed" in problems.problem(scene)
    monkeypatch.setattr(live_water, "_is_rendering", lambda: False)
    live.update(scene)
    assert drawings == ["Sky", "Sky"]
    assert problems.problem(scene) == ""
    assert not changes.is_stale(scene)
    assert _texels(scene, "uw_sky") == pytest.approx(3.0 * plain, rel=1e-3)


def test_each_frame_of_a_job_has_the_world_of_its_time(quick, tmp_path):
    scene = bpy.context.scene
    grey_scene.build_scene(5.0, 16, 9)
    skies.with_picture(scene, NOON, tmp_path / "sky.exr")
    socket = skies.strength(scene)
    for frame, value in ((1, 1.0), (3, 3.0)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    arguments = [tmp_path / "scene.blend", "--sky-picture", "world", "--frames", "1-3", "--plan"]
    arguments += [tmp_path / "out" / "job.json", "--out", tmp_path / "out", "--phase", "hg:0.9"]
    arguments += ["--engine", "eevee", "--bands", 3, "--surface", "flat"]
    assert batch.main([str(a) for a in arguments], inside_blender=False) == 0
    text = (tmp_path / "out" / "job.json").read_text()
    assert str(tmp_path) not in json.dumps(json.loads(text)["changes"])  # it may be moved
    planned = read_manifest(tmp_path / "out" / "job.json")
    places = [planned.settings_of(frame).sky_picture for frame in (1, 2, 3)]
    E = [SkyPicture.read(x.removeprefix("file:")).irradiance.sum() for x in places]
    assert E[2] == pytest.approx(3.0 * E[0], rel=1e-3)
    assert E[0] < E[1] < E[2]
    assert len({planned.key(view, 0) for view in planned.views}) == 3
    goes_along = farm_bundle.farm_job(planned).tables
    assert {f"file:{path}" for path in goes_along} == set(places)
    other = replace(planned, changes={**planned.changes, 2: {}})
    assert other.key(other.views[1], 0) != planned.key(planned.views[1], 0)


@pytest.mark.parametrize(
    "engine",
    [
        ["--engine", "cycles", "--samples", "8", "--no-denoise"],
        pytest.param(["--engine", "eevee", "--mode", "realtime"], marks=pytest.mark.slow),
    ],
    ids=["cycles", "eevee"],
)
def test_pictures_of_a_job_have_the_sky_of_their_frames(engine, quick, tmp_path):
    """Cycles kept the picture of the first one."""
    scene = bpy.context.scene
    scene.camera = scenes.add_camera((0.0, 0.0, -2.0), (2.6, 0.0, 0.5))
    scene.render.resolution_x, scene.render.resolution_y = 16, 9
    skies.world(scene, "ShaderNodeTexSky").sun_disc = False
    for frame, value in ((1, 0.2), (2, 0.6)):
        skies.strength(scene).default_value = value
        skies.strength(scene).keyframe_insert("default_value", frame=frame)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    arguments = [tmp_path / "scene.blend", "--sky-picture", "world", "--frames", "1-2", "--bands"]
    arguments += [3, "--surface", "flat", "--exposure", -2, "--out", tmp_path, *engine]
    assert batch.main([str(a) for a in arguments], inside_blender=False) == 0
    one, other = (read_exr(tmp_path / f"000{frame}.exr")[0][..., :3] for frame in (1, 2))
    assert other.mean() == pytest.approx(3.0 * one.mean(), rel=0.01)


def _blocks(pixels):
    """Means of three by three pixels."""
    rows, columns = pixels.shape[:2]
    return pixels.reshape(rows // 3, 3, columns // 3, 3, 3).mean(axis=(1, 3))


def _rendered(blend: Path, out: Path, *more: object) -> np.ndarray:
    arguments = [blend, "--sky-picture", "world", "--out", out, "--surface", "flat", "--bands", 3]
    arguments += ["--floor-depth", 8, "--floor-reflectance", 0.3, "--exposure", 0, *more]
    assert batch.main([str(a) for a in arguments], inside_blender=False) == 0
    return read_exr(out / "0001.exr")[0][..., :3].astype(np.float64)


def _looking_up(sky, folder: Path, turn: float = 0.0) -> Path:
    scene = bpy.context.scene
    mapping = skies.with_picture(scene, sky, folder / "sky.exr")
    mapping.inputs["Rotation"].default_value[2] = -turn
    scene.camera = scenes.add_camera((0.0, 0.0, -4.0), (math.radians(110.0), 0.0, 0.5 + turn))
    scene.camera.data.angle = math.radians(125.0)
    scene.render.resolution_x, scene.render.resolution_y = 36, 27
    scene.cycles.pixel_filter_type = "BOX"
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    return folder / "scene.blend"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["noon", "coloured"])
def test_eevee_and_cycles_agree_about_what_is_seen_of_a_sky_and_by_its_light(name, tmp_path):
    blend = _looking_up(KNOWN_SKIES[name], tmp_path)
    traced = ["--engine", "cycles", "--samples", 256, "--no-denoise"]
    wanted = _blocks(_rendered(blend, tmp_path / "c", *traced))
    for mode in ("bands", "realtime"):
        seen = _blocks(_rendered(blend, tmp_path / mode, "--engine", "eevee", "--mode", mode))
        apart = delta_e_CIE2000_images(np.clip(seen, 0, 1), np.clip(wanted, 0, 1))
        assert np.median(apart) < 1.5
        assert seen.mean() == pytest.approx(wanted.mean(), rel=0.03)


@pytest.mark.slow
def test_a_sky_and_a_camera_that_turn_together_show_the_same(tmp_path):
    pictures = []
    for turn in (0.0, 2.0):
        folder = tmp_path / str(turn)
        folder.mkdir()
        blend = _looking_up(NOON, folder, turn)
        pictures.append(_rendered(blend, folder, "--engine", "eevee", "--mode", "realtime"))
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert pictures[1] == pytest.approx(pictures[0], rel=0.02, abs=2e-3)
