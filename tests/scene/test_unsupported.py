"""What a scene asks for is supported, or it is said: in the log, the record and the panel."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Euler, Vector
from underwater_spectral.jobs import batch
from underwater_spectral.scene import colour_space, temporary, unsupported
from underwater_spectral.scene.readers import cameras, own_seabed, pinhole, surroundings
from underwater_spectral.scene.viewport import live, problems
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, read_spectral_exr

pytestmark = pytest.mark.usefixtures("registered")

ROOT = Path(__file__).resolve().parents[2]
FAST = ["--samples", "1", "--resolution", "32", "18", "--phase", "hg:0.8", "--no-scene-floor"]
EEVEE = ["--engine", "eevee", "--mode", "realtime", "--no-diffuse-shadows"]
BLUE = (0.0, 0.0, 1.0, 1.0)


def _scene() -> bpy.types.Scene:
    """A wall of a pure colour, 2 m before a camera in 3 m of water."""
    scene = bpy.context.scene
    scenes.add_camera((0.0, 0.0, -3.0), (np.pi / 2, 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(size=9.0, location=(0.0, 2.0, -3.0), rotation=(1.2, 0.0, 0.0))
    bpy.context.object.data.materials.append(scenes.principled("Blue", BLUE))
    return scene


def _group(kind: str) -> bpy.types.NodeTree:
    return bpy.data.node_groups.new("User", kind)


def _strip(scene):
    editor = scene.sequence_editor_create()
    editor.strips.new_effect("x", "COLOR", 1, 1, length=5)


def _second_layer(scene):
    scene.view_layers.new("Other")


def _item(scene):
    """The wall, or something where there is none."""
    there = [item for item in scene.objects if item.type == "MESH"]
    return there[0] if there else scenes._cube("thing", (0.0, -9.0, -3.0))


def _held_collection(scene):
    held = bpy.data.collections.new("Held")
    scene.collection.children.link(held)
    held.objects.link(_item(scene))
    scene.view_layers[0].layer_collection.children["Held"].holdout = True


def _cut(scene):
    camera = bpy.data.objects.new("Cut", bpy.data.cameras.new("Cut"))
    camera.location = (0.0, -5.0, -2.0)
    scene.collection.objects.link(camera)
    before = scene.camera
    scene.timeline_markers.new("cut", frame=1).camera = camera
    scene.camera = before  # Blender has followed the marker


def _set(scene):
    scene.background_set = bpy.data.scenes.new("Stage")
    cube = scenes._cube("in the set", (0.0, 1.5, -3.0))
    scene.collection.objects.unlink(cube)
    scene.background_set.collection.objects.link(cube)


def _strokes(scene):
    data = bpy.data.grease_pencils.new("Lines")
    drawing = data.layers.new("lines").frames.new(1).drawing
    drawing.add_strokes([2])
    for point, x in zip(drawing.strokes[0].points, (-1.0, 1.0), strict=True):
        point.position, point.radius = (x, 1.5, -3.0), 0.3
    scene.collection.objects.link(bpy.data.objects.new("Lines", data))


def _linked_lamp(scene):
    """Above the water, so that it changes nothing itself."""
    lamp = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "POINT"))
    lamp.location.z = 5.0
    scene.collection.objects.link(lamp)
    lamp.light_linking.receiver_collection = bpy.data.collections.new("Lit")


def _world(scene):
    scene.world = world = bpy.data.worlds.new("Studio sky")
    nodes, links = world.node_tree.nodes, world.node_tree.links
    output = world.node_tree.get_output_node("ALL")
    for maker, source, target in (
        ("ShaderNodeTexEnvironment", "Color", nodes["Background"].inputs["Color"]),
        ("ShaderNodeVolumePrincipled", "Volume", output.inputs["Volume"]),
    ):
        links.new(nodes.new(maker).outputs[source], target)


def _left_out(scene):
    scene.view_layers[0].use_solid = scene.view_layers[0].use_volumes = False


def _views(scene):
    scene.render.use_multiview, scene.render.views_format = True, "MULTIVIEW"


def _probe(scene):
    probe = bpy.data.objects.new("Baked", bpy.data.lightprobes.new("Baked", "VOLUME"))
    scene.collection.objects.link(probe)


ASKED = {
    "light probe 'Baked'": _probe,
    "leaves out solid and volumes": _left_out,
    "holdout of collection 'Held'": _held_collection,
    "holdout '": lambda s: setattr(_item(s), "is_holdout", True),
    "shadow catcher '": lambda s: setattr(_item(s), "is_shadow_catcher", True),
    "background set 'Stage'": _set,
    "Grease Pencil 'Lines'": _strokes,
    "light linking of lamp 'Key'": _linked_lamp,
    "sky of world 'Studio sky'": _world,
    "views by the names of cameras": _views,
    "not 'Other'": _second_layer,
    "compositor": lambda s: setattr(s, "compositing_node_group", _group("CompositorNodeTree")),
    "sequencer": _strip,
    "Freestyle": lambda s: setattr(s.render, "use_freestyle", True),
    "material override 'Clay'": lambda s: setattr(
        s.view_layers[0], "material_override", bpy.data.materials.new("Clay")
    ),
    "world override 'Studio'": lambda s: setattr(
        s.view_layers[0], "world_override", bpy.data.worlds.new("Studio")
    ),
    "exposure 2 and gamma 1": lambda s: setattr(s.view_settings, "exposure", 2.0),
    "white balance": lambda s: setattr(s.view_settings, "use_white_balance", True),
}


@pytest.mark.parametrize("words", ASKED)
def test_each_is_said_by_itself(words):
    scene = bpy.context.scene
    scene.render.use_compositing = scene.render.use_sequencer = True
    assert unsupported.unsupported(scene) == ()
    ASKED[words](scene)
    note, *more = unsupported.unsupported(scene)
    assert words in note
    assert [words for words in more if "volume of world" not in words] == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_clip_distances_that_eevee_cannot_draw_are_kept_off_and_said(kind, tmp_path):
    """From 10⁻⁴ to 5000 m the light of the water was lost, in silence."""
    found = []
    camera = scenes.add_camera((0.0, 0.0, -3.0), (np.pi / 2, 0.0, 0.0))
    camera.data.type = kind
    path = tmp_path / "a.blend"
    for start, end in ((0.1, 1000.0), (1e-4, 5000.0), (0.1, 1e8)):
        camera.data.clip_start, camera.data.clip_end = start, end
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        assert _run(path, *FAST, *EEVEE, "--bands", "3", "--out", tmp_path / f"{start} {end}") == 0
        camera = bpy.context.scene.camera
        assert camera.data.clip_end == pytest.approx(end)
        found.append(read_exr(tmp_path / f"{start} {end}" / "0001.exr")[0])
        notes = json.loads((tmp_path / f"{start} {end}" / "0001.json").read_text())["notes"]
        assert any("raise Clip Start" in note for note in notes) == (end > 1000.0)
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=0.01)


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def test_all_of_it_changes_no_picture_and_is_in_log_and_record(tmp_path, capfd):
    """The sky that a view layer has switched off is the water, and comes back."""
    scene = _scene()
    scene.camera.data.clip_end = 50.0
    rendered = []
    for asked in (False, True):
        if asked:
            for ask in ASKED.values():
                ask(scene)
            _cut(scene)
            layer = scene.view_layers[0]
            layer.use_sky = False
            layer.samples = 3
        path = tmp_path / f"{asked}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        scene = bpy.context.scene
        for engine in (EEVEE, ["--engine", "cycles", "--bands", "3"]):
            out = tmp_path / f"{asked} {engine[1]}"
            assert _run(path, *FAST, *engine, "--out", out) == 0
            rendered.append(read_exr(out / "0001.exr")[0])
            notes = json.loads((out / "0001.json").read_text())["notes"]
            assert [words for words in ASKED if any(words in n for n in notes)] == (
                list(ASKED) if asked else []
            )
            log = capfd.readouterr()
            for words in ("white balance", "markers switch cameras ('Cut')"):
                assert (words in log.out + log.err) == asked
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
    plain, asked = rendered[:2], rendered[2:]
    for one, other in zip(plain, asked, strict=True):
        assert one.max() > 0.05
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("space", ["ACEScg", "Linear Rec.2020"])
def test_a_file_in_another_working_space_gives_the_same_light(space, tmp_path, capfd):
    """By the band, of a pure blue: the file says other numbers for the same colour."""
    _scene()
    found = []
    for name in ("Linear Rec.709", space):
        if name == space:
            bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=True)
            shown = bpy.data.materials["Blue"].node_tree.nodes["Principled BSDF"]
            assert shown.inputs["Base Color"].default_value[0] > 0.04
        path = tmp_path / "scene.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        out = tmp_path / name
        job = ["--engine", "cycles", "--bands", "6", "--out", out]
        assert _run(path, *FAST, *job) == 0
        log = capfd.readouterr()
        assert (f"converted from {space}" in log.out + log.err) == (name == space)
        found.append(read_spectral_exr(out / "0001_spectral.exr")[0])
        assert colour_space.is_rec709()
        bpy.ops.wm.open_mainfile(filepath=str(path))
    plain, other = found
    wall = plain.mean(axis=2) > 0.1 * plain.mean()
    np.testing.assert_allclose(other[wall].mean(axis=0), plain[wall].mean(axis=0), rtol=0.01)


def test_colours_that_would_stay_behind_are_named(tmp_path, capfd):
    _scene()
    tree = bpy.data.materials["Blue"].node_tree
    tree.nodes["Principled BSDF"].inputs["Base Color"].keyframe_insert("default_value", frame=1)
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert _run(path, *FAST, *EEVEE, "--out", tmp_path / "out") == 2
    said = capfd.readouterr().err
    assert "'Blue'" in said
    assert "animated" in said
    # Strength and roughness may be animated: they are no colours.
    bpy.ops.wm.open_mainfile(filepath=str(path))
    tree = bpy.data.materials["Blue"].node_tree
    tree.animation_data_clear()
    tree.nodes["Principled BSDF"].inputs["Roughness"].keyframe_insert("default_value", frame=1)
    assert "ACEScg" in colour_space.bring_to_rec709()


@pytest.mark.slow
def test_the_viewport_asks_for_it():
    scene = _scene()
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    with pytest.raises(InputError, match="Working Space"):
        live.add(scene)
    bpy.ops.wm.set_working_color_space(working_space="Linear Rec.709", convert_colors=True)
    live.add(scene)


@pytest.mark.slow
def test_the_aces_configuration_renders_the_same_picture(tmp_path):
    """It comes with OpenColorIO, and has other names for nearly everything."""
    _scene()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    pictures = []
    for config in ("", "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"):
        out = tmp_path / (config[-4:] or "plain")
        job = [path, *FAST, *EEVEE, "--out", out]
        if config:
            command = [str(part) for part in (sys.executable, ROOT / "render_bands.py", *job)]
            environment = {**os.environ, "OCIO": config}
            done = subprocess.run(command, env=environment, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
        else:
            assert _run(*job) == 0
        pictures.append(read_exr(out / "0001.exr")[0])
        header = oiio.ImageBuf(str(out / "0001.exr")).spec()
        assert header.get_string_attribute("oiio:ColorSpace") == "lin_rec709_scene"
        assert (out / "0001.png").is_file()
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=0.01, atol=1e-3)


@pytest.mark.parametrize("size", list(itertools.product((1.0, -2.0), repeat=3)))
def test_rays_of_a_camera_of_any_scale_go_where_it_looks(size):
    """By Blender's own projection."""
    camera = scenes.add_camera((1.0, 2.0, -3.0), Euler((1.1, 0.2, 0.7)))
    camera.scale = size
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 160, 90
    rays = cameras.camera_rays(scene, camera, 4, 3)
    for number, (origin, direction) in enumerate(rays):
        seen = world_to_camera_view(scene, camera, origin + 5.0 * direction)
        row, column = divmod(number, 4)
        assert seen.x == pytest.approx((column + 0.5) / 4, abs=1e-4)
        assert seen.y == pytest.approx(1.0 - (row + 0.5) / 3, abs=1e-4)
        assert seen.z > 0
    if np.prod(size) < 0:
        with pytest.raises(InputError, match="mirrored"):
            pinhole.require_pinhole(camera)
        return
    pinhole.require_pinhole(camera)
    pose = pinhole.pose_of(camera)
    ahead = Vector((0.3, 0.2, -1.0))
    place = Vector(pose[:3, :3] @ np.array(ahead) + pose[:3, 3])
    lens = pinhole.pinhole_of(scene, camera)
    seen = world_to_camera_view(scene, camera, place)
    assert seen.x * 160 == pytest.approx(lens.fx * 0.3 + lens.cx, abs=1e-2)
    assert (1.0 - seen.y) * 90 == pytest.approx(lens.cy - lens.fy * 0.2, abs=1e-2)


def test_another_engine_with_live_water_is_said():
    scene = _scene()
    live.add(scene)
    assert problems.problem(scene) == ""
    scene.render.engine = "CYCLES"
    assert "Cycles" in problems.problem(scene)
    assert "Reference" in problems.problem(scene)
    scene.render.engine = "BLENDER_EEVEE"
    assert problems.problem(scene) == ""
    live.remove(scene)
    scene.render.engine = "CYCLES"
    assert problems.problem(scene) == ""


@pytest.mark.parametrize(
    ("depth", "colour", "said"),
    [(9.0, 0.2, ""), (9.4, 0.24, ""), (14.0, 0.2, "14 m deep"), (9.0, 0.6, "reflects 0.6"),
     (0.0, 0.2, "")],
)  # fmt: skip
def test_a_floor_against_the_scenes_own_seabed_is_said(depth, colour, said, monkeypatch):
    """Sand of 60 m at 9 m, that reflects a fifth; added floors that are it, or are not."""
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)  # as users have it
    scene = bpy.context.scene
    camera = scenes.add_camera((0.0, 0.0, -4.0))
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 0.0, -9.0))
    bpy.context.object.data.materials.append(scenes.principled("Sand", (0.2, 0.2, 0.2, 1.0)))
    plan = make_plan(SceneSettings(bands=4, floor_depth=depth, floor_reflectance=str(colour)))
    clearest = float(plan.column.attenuation.min())
    ground = surroundings.look_around(scene, camera, clearest).ground
    note = own_seabed.floor_note(plan, ground)
    assert bool(note) == bool(said)
    assert said in note
    assert not note or "9 m deep" in note


@pytest.mark.parametrize("kind", ["PANO", "CUSTOM"])
def test_a_panorama_is_said_for_eevee_alone(kind):
    camera = scenes.add_camera()
    scene = bpy.context.scene
    assert unsupported.unsupported_of_camera(scene, camera, traced=False) == ()
    camera.data.type = kind
    (note,) = unsupported.unsupported_of_camera(scene, camera, traced=False)
    assert "'Camera' as a perspective one" in note
    assert unsupported.unsupported_of_camera(scene, camera, traced=True) == ()


def test_what_light_probes_have_baked_does_not_light_the_water():
    """It would brighten a picture by some percent."""
    scene = _scene()
    _probe(scene)
    with temporary.render_settings(scene, []):
        assert scene.objects["Baked"].hide_render
    assert not scene.objects["Baked"].hide_render


def test_colours_that_blender_takes_for_numbers_are_named():
    scene = _scene()
    _item(scene).data.color_attributes.new("painted", "FLOAT_COLOR", "POINT")
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    assert "float colour attributes of 'Plane' were not" in colour_space.bring_to_rec709()
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    for mesh in bpy.data.meshes:
        for found in list(mesh.color_attributes):
            mesh.color_attributes.remove(found)
    assert "float" not in colour_space.bring_to_rec709()


def test_what_is_only_indirect_is_unseen_while_it_is_rendered():
    """In both engines, of which one knows the switch."""
    scene = _scene()
    wall = _item(scene)
    behind = bpy.data.collections.new("Behind")
    scene.collection.children.link(behind)
    behind.objects.link(wall)
    part = scene.view_layers[0].layer_collection.children["Behind"]
    part.indirect_only = True
    assert unsupported.unsupported(scene) == ()
    with temporary.render_settings(scene, []):
        assert not wall.visible_camera
    assert wall.visible_camera
    assert part.indirect_only


def test_a_reference_takes_no_shortcuts_that_the_scene_has(tmp_path):
    """Part of the samples, and volumes by steps."""
    scene = _scene()
    path = tmp_path / "scene.blend"
    found = []
    for short in (False, True):
        if short:
            scene.cycles.use_sample_subset, scene.cycles.sample_subset_length = True, 1
            scene.cycles.volume_biased, scene.cycles.scrambling_distance = True, 0.5
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        out = tmp_path / str(short)
        job = ["--engine", "cycles", "--bands", "3", "--samples", "4", "--out", out]
        assert _run(path, *FAST[2:], *job) == 0
        found.append(read_exr(out / "0001.exr")[0])
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
    np.testing.assert_array_equal(*found)
    assert scene.cycles.use_sample_subset


def test_meshes_that_glow_are_named():
    """EEVEE gives none of their light to other objects."""
    scene = _scene()
    assert not any("glows" in note for note in unsupported.unsupported(scene))
    panel = scenes._cube("panel", (0.0, 1.0, -3.0))
    panel.data.materials.append(scenes.glow(5.0))
    (said,) = [note for note in unsupported.unsupported(scene) if "glows" in note]
    assert said.startswith("'panel': ")
    assert "lights nothing" in said
    panel.hide_render = True
    assert not any("glows" in note for note in unsupported.unsupported(scene))
