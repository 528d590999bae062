"""Files, linked data and bakes that a scene needs and that are not there are named before a job."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import bpy
import pytest
from underwater_spectral.jobs import batch, job_files
from underwater_spectral.scene import scripts, unlit_scans
from underwater_spectral.scene.readers import missing_data
from underwater_spectral.scene.unsupported import unsupported_of_camera
from underwater_spectral.tests.scene import scenes

SMALL = ["--samples", 1, "--resolution", 8, 8, "--phase", "hg:0.8", "--bands", 2]


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _picture(path: Path) -> bpy.types.Image:
    image = bpy.data.images.new(path.name, 4, 4)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
    return bpy.data.images.load(str(path))


def _textured(item: bpy.types.Object, image: bpy.types.Image) -> bpy.types.Node:
    material = bpy.data.materials.new(image.name)
    item.data.materials.append(material)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def _object(name: str) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add(location=(0.0, 3.0, -5.0))
    bpy.context.object.name = name
    return bpy.context.object


def _library(folder: Path, name: str) -> Path:
    """A file with a collection *Reef*, which an empty of the open scene instances."""
    path, reef = folder / f"{name}.blend", bpy.data.collections.new("Reef")
    reef.objects.link(bpy.data.objects.new("rock", bpy.data.meshes.new("rock")))
    bpy.data.libraries.write(str(path), {reef})
    for block in (*reef.objects, reef):
        bpy.data.batch_remove([block])
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.collections = ["Reef"]
    holder = bpy.data.objects.new(name, None)
    holder.instance_type, holder.instance_collection = "COLLECTION", wanted.collections[0]
    bpy.context.collection.objects.link(holder)
    return path


@pytest.fixture
def lacking(tmp_path, empty_blender) -> Path:
    """A scene that lacks one of each; and some that nothing rendered needs."""
    scenes.add_camera((0.0, 0.0, -5.0), (1.57, 0.0, 0.0))
    shown, hidden = _object("shown"), _object("hidden")
    hidden.hide_render = True
    gone = ("sand.png", "tile.1002.png", "fish0002.png", "cave.png", "sky.png", "behind.png")
    (tmp_path / "broken.png").write_text("version https://git-lfs.github.com/spec/v1\n")
    for name in ("tile.1001.png", "fish0001.png", "fish0003.png", "fish0004.png"):
        _picture(tmp_path / name)
    _textured(shown, _picture(tmp_path / "sand.png"))
    _textured(shown, bpy.data.images.load(str(tmp_path / "broken.png")))
    tiles = bpy.data.images["tile.1001.png"]
    tiles.source, tiles.filepath = "TILED", str(tmp_path / "tile.<UDIM>.png")
    _picture(tmp_path / "tile.1002.png")
    tiles.tiles.new(1002)
    _textured(shown, tiles)
    _picture(tmp_path / "fish0002.png")
    fish = bpy.data.images["fish0001.png"]
    fish.source = "SEQUENCE"
    _textured(shown, fish).image_user.frame_duration = 4
    _textured(hidden, _picture(tmp_path / "cave.png"))
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.node_tree.nodes.new("ShaderNodeTexEnvironment").image = _picture(tmp_path / "sky.png")
    behind = bpy.context.scene.camera.data.background_images.new()
    behind.image = _picture(tmp_path / "behind.png")
    packed = _picture(tmp_path / "packed.png")
    packed.pack()
    _textured(shown, packed)
    shown.modifiers.new("old", "MESH_CACHE").filepath = str(tmp_path / "wave.mdd")
    volume = bpy.data.volumes.new("silt")
    volume.filepath = str(tmp_path / "silt.vdb")
    bpy.context.collection.objects.link(bpy.data.objects.new("silt", volume))
    (tmp_path / "noise.wav").write_bytes(b"RIFF")
    bpy.data.sounds.load(str(tmp_path / "noise.wav"))
    libraries = [_library(tmp_path, name) for name in ("lost", "other")]
    blend = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    for name in (*gone, "packed.png", "noise.wav", "lost.blend"):
        (tmp_path / name).unlink()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.data.libraries.write(str(libraries[1]), set())
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    return blend


def test_what_is_missing_is_named_with_its_path(lacking):
    found = missing_data.missing_data(bpy.context.scene, range(1, 4))
    folder = lacking.parent
    for words in (
        f"image 'sand.png': {folder / 'sand.png'} is not there",
        f"{folder / 'broken.png'} is no picture",
        f"{folder / 'tile.1002.png'} is not there",
        f"{folder / 'fish0002.png'} is not there",
        f"object 'shown': {folder / 'wave.mdd'} is not there",
        f"volume 'silt': {folder / 'silt.vdb'} is not there",
        f"collection 'Reef' is linked from {folder / 'lost.blend'}, which is not there",
        f"collection 'Reef' is linked from {folder / 'other.blend'}, which does not hold it",
    ):
        assert sum(words in note for note in found) == 1, (words, found)
    assert len(found) == 8, found
    assert "noise.wav" not in str([item.path for item in job_files.scene_files()])
    bpy.context.scene.view_layers[0].layer_collection.exclude = False
    for item in bpy.context.scene.objects:
        item.hide_render = item.type != "CAMERA"
    assert not missing_data.missing_data(bpy.context.scene, (1,))


def test_log_and_record_name_it_and_other_machines_get_no_such_job(lacking, tmp_path, capfd):
    for option in ("--plan", "--bundle"):
        assert _run(lacking, *SMALL, option, tmp_path / "elsewhere") == 2
        assert "sand.png" in capfd.readouterr().err
    assert _run(lacking, *SMALL, "--out", tmp_path / "out") == 0
    said = capfd.readouterr()
    notes = json.loads((tmp_path / "out" / "0001.json").read_text())["notes"]
    for name in ("sand.png", "lost.blend", "silt.vdb"):
        assert str(tmp_path / name) in said.out + said.err
        assert any(str(tmp_path / name) in note for note in notes)


def test_simulations_that_are_not_baked_are_named(tmp_path, empty_blender):
    item = _object("sail")
    item.modifiers.new("c", "CLOTH")
    assert "cloth of object 'sail': it is not baked" in missing_data.not_baked(bpy.context.scene)[0]
    blend = tmp_path / "sail.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    cache = item.modifiers["c"].point_cache
    cache.frame_end, cache.use_disk_cache = 2, True
    with bpy.context.temp_override(object=item, active_object=item, point_cache=cache):
        bpy.ops.ptcache.bake(bake=True)
    assert not missing_data.not_baked(bpy.context.scene)
    shutil.rmtree(tmp_path / "blendcache_sail")
    assert "blendcache_sail" in missing_data.not_baked(bpy.context.scene)[0]
    item.hide_render = True
    assert not missing_data.not_baked(bpy.context.scene)


def test_errors_of_geometry_nodes_are_passed_on(empty_blender):
    item = _object("field")
    tree = bpy.data.node_groups.new("read", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    reader = tree.nodes.new("GeometryNodeImportPLY")
    reader.inputs[0].default_value = "/nowhere/reef.ply"
    end = tree.nodes.new("NodeGroupOutput")
    tree.links.new(reader.outputs[0], end.inputs[0])
    item.modifiers.new("n", "NODES").node_group = tree
    assert any("'field'" in note for note in missing_data.node_errors(bpy.context.scene))


@pytest.fixture
def driven(tmp_path, empty_blender) -> Path:
    scenes.varied_scene()
    text = bpy.data.texts.new("names.py")
    text.write("import bpy\nbpy.app.driver_namespace['deep'] = lambda frame: -5.0 - frame\n")
    text.use_module = True
    for place, words in enumerate(("frame * 0.0", "deep(frame) + 0.0")):
        item = bpy.data.objects.new(f"driven{place}", None)
        bpy.context.collection.objects.link(item)
        item.driver_add("location", 2).driver.expression = words
    path = tmp_path / "driven.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_python_that_may_not_run_is_named_and_a_switch_trusts_it(driven, tmp_path, capfd):
    def notes(*options):
        out = tmp_path / "_".join(("out", *options))
        assert _run(driven, *SMALL, *options, "--out", out) == 0
        said, record = capfd.readouterr(), json.loads((out / "0001.json").read_text())
        return said.out + said.err, record["notes"], json.loads((out / "job.json").read_text())

    said, held, job = notes()
    still = [note for note in held if "driven1" in note or "names.py" in note]
    assert len(still) == 2
    assert all(note in said and scripts.TRUST in note for note in still)
    assert not any("driven0" in note for note in held)
    assert not job["output"]["scripts"]
    said, trusted, job = notes(scripts.TRUST)
    assert not any("driven" in note or "names.py" in note for note in trusted)
    assert f"{scripts.TRUST}: Python of {driven} runs" in said
    assert job["output"]["scripts"]
    assert bpy.data.objects["driven1"].matrix_world.translation.z == -6.0


@pytest.mark.slow
def test_workers_let_python_run_where_the_plan_did(driven, tmp_path, capfd):
    plan, bundle = tmp_path / "plan.json", tmp_path / "bundle"
    assert _run(driven, *SMALL, scripts.TRUST, "--plan", plan, "--out", tmp_path / "out") == 0
    assert _run("--from", plan) == 2
    assert f"add {scripts.TRUST}" in capfd.readouterr().err
    assert _run("--from", plan, scripts.TRUST) == 0
    assert _run(driven, *SMALL, scripts.TRUST, "--bundle", bundle) == 0
    assert scripts.TRUST in (bundle / "template.json").read_text()
    assert _run(driven, *SMALL, "--bundle", bundle) == 0
    assert scripts.TRUST not in (bundle / "template.json").read_text()


def test_unlit_scans_and_far_cameras_are_named(empty_blender):
    scene, item = bpy.context.scene, _object("scan")
    node = _textured(item, bpy.data.images.new("photo", 4, 4))
    tree = node.id_data
    assert not unlit_scans.notes(scene)
    bsdf, end = tree.nodes["Principled BSDF"], tree.get_output_node("ALL")
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.outputs[0], glow.inputs[0])
    tree.links.new(glow.outputs[0], end.inputs[0])
    tree.nodes.remove(bsdf)
    mix, clear = (tree.nodes.new(f"ShaderNode{x}") for x in ("MixShader", "BsdfTransparent"))
    for one, other in ((clear, mix.inputs[1]), (glow, mix.inputs[2]), (mix, end.inputs[0])):
        tree.links.new(one.outputs[0], other)
    (note,) = unlit_scans.notes(scene)
    assert "'photo'" in note
    item.hide_render = True
    assert not unlit_scans.notes(scene)
    camera = scenes.add_camera((500_000.0, 0.0, -5.0), (0.0, 0.0, 0.0))
    bpy.context.view_layer.update()
    (note,) = unsupported_of_camera(scene, camera, traced=True)
    assert "5e+05 m from the origin" in note
    assert "31 mm" in note
    camera.location.x = 5_000.0
    bpy.context.view_layer.update()
    assert not unsupported_of_camera(scene, camera, traced=True)


def test_a_driver_with_an_error_is_named(empty_blender):
    item = bpy.data.objects.new("broken", None)
    bpy.context.collection.objects.link(item)
    item.driver_add("location", 0).driver.expression = "frame +"
    bpy.context.scene.frame_set(2)
    (note,) = scripts.notes()
    assert "'broken'" in note
    assert "mend it" in note
