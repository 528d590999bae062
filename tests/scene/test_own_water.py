"""Water of a scene's own is named; what only looks a little like it is not."""

from __future__ import annotations

import json

import bpy
import pytest
from underwater_spectral.jobs import batch
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.materials import own_water
from underwater_spectral.scene.unsupported import unsupported
from underwater_spectral.scene.viewport import live
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.usefixtures("registered")


def _plane(size, z, node, **inputs):
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0.0, 0.0, z))
    item, material = bpy.context.object, bpy.data.materials.new("Sea")
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(node), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    target = "Volume" if "Volume" in node else "Surface"
    tree.links.new(shader.outputs[0], output.inputs[target])
    item.data.materials.append(material)
    return item


def _fog(size):
    item = _plane(1.0, -5.0, "ShaderNodeVolumePrincipled")
    item.data.clear_geometry()
    s = size / 2.0
    corners = [(x, y, z) for x in (-s, s) for y in (-s, s) for z in (-s, s)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    item.data.from_pydata(corners, [], faces)
    item.location.x = 0.5


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: _plane(80.0, 0.3, "ShaderNodeBsdfGlass"), "looks like a water surface"),
        (
            lambda: _plane(80.0, 0.0, "ShaderNodeBsdfPrincipled", Transmission_Weight=1.0),
            "looks like a water surface",
        ),
        (lambda: _fog(40.0), "has a volume, and the camera is in it"),
        (lambda: _plane(80.0, 0.0, "ShaderNodeBsdfPrincipled"), ""),
        (lambda: _plane(80.0, -9.0, "ShaderNodeBsdfGlass"), ""),
        (lambda: _plane(2.0, 0.0, "ShaderNodeBsdfGlass"), ""),
        (lambda: _fog(0.5), ""),
    ],
    ids=["glass", "transmission", "body", "matte", "deep", "small", "aside"],
)
def test_it_is_named(make, words):
    scenes.add_camera((0.0, 0.0, -5.0))
    make()
    bpy.context.view_layer.update()
    found = [note for note in unsupported(bpy.context.scene) if own_water.ADVICE in note]
    assert len(found) == bool(words)
    assert all(words in note and "'Plane'" in note for note in found)


def test_it_is_hidden_in_a_job_that_is_asked_to(tmp_path):
    """The picture is that of the scene without it; that is said, and nothing stays hidden."""
    scenes.add_camera((0.0, 0.0, -5.0))
    _plane(80.0, 0.3, "ShaderNodeBsdfGlass")
    pictures, notes = [], []
    for name, options in (("hidden", ["--hide-own-water"]), ("drawn", []), ("gone", [])):
        path, out = tmp_path / f"{name}.blend", tmp_path / name
        if name == "gone":
            bpy.data.objects.remove(bpy.context.scene.objects["Plane"])
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        job = ["--engine", "cycles", "--bands", "3", "--samples", "4", "--resolution", "16", "9"]
        job += ["--phase", "hg:0.8", "--no-denoise", "--exposure", "0", *options]
        assert batch.main([str(path), *job, "--out", str(out)], inside_blender=False) == 0
        pictures.append(read_exr(out / "0001.exr")[0])
        notes.append("; ".join(json.loads((out / "0001.json").read_text())["notes"]))
        assert all(not item.hide_render for item in bpy.context.scene.objects)
        bpy.ops.wm.open_mainfile(filepath=str(path))
    hidden, drawn, gone = pictures
    assert (hidden == gone).all()
    assert drawn.mean() < 0.8 * gone.mean()
    assert [own_water.ADVICE in note for note in notes] == [False, True, False]
    assert ["left out" in note and "'Plane'" in note for note in notes] == [True, False, False]


@pytest.mark.slow
def test_it_is_hidden_while_there_is_live_water_and_comes_back():
    scene = bpy.context.scene
    scenes.add_camera((0.0, 0.0, -5.0))
    sea = _plane(80.0, 0.3, "ShaderNodeBsdfGlass")
    getattr(scene, stored_settings.PROPERTY).hide_own_water = True
    live.add(scene)
    assert sea.hide_render
    assert sea.hide_viewport
    assert any("left out" in note and "'Plane'" in note for note in unsupported(scene))
    getattr(scene, stored_settings.PROPERTY).hide_own_water = False
    live.update(scene)
    assert not sea.hide_render
    getattr(scene, stored_settings.PROPERTY).hide_own_water = True
    live.update(scene)
    assert sea.hide_render
    live.remove(scene)
    assert not sea.hide_render
    assert not sea.hide_viewport
