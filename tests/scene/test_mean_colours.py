"""What materials show in the mean, against Cycles, which draws them."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.materials import mean_colours
from underwater_spectral.scene.materials.mean_colours import mean_colour
from underwater_spectral.scene.readers import surroundings, unknown_colours
from underwater_spectral.scene.readers.ray_casting import Meshes
from underwater_spectral.scene.readers.surface_samples import visible_triangles
from underwater_spectral.scene.readers.visible_meshes import visible_meshes
from underwater_spectral.scene.water.occlusion import Cache
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.shown_kinds import KINDS, Kind
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.usefixtures("properties")


def _plane(kind, folder):
    """Return the tree of a plane of a kind, its colour and alpha; it is turned and moved."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=2.0)
    item = bpy.context.object
    item.location, item.rotation_euler, item.scale = (0.4, 0.2, 0.0), (0.0, 0.0, 0.0), (1.5, 1, 1)
    material = bpy.data.materials.new("shown")
    item.data.materials.append(material)
    tree = material.node_tree
    tree.nodes.clear()
    colour, alpha = KINDS[kind](Kind(tree, item.data, folder))
    shader, output = (
        tree.nodes.new(f"ShaderNode{x}") for x in ("BsdfPrincipled", "OutputMaterial")
    )
    tree.links.new(colour, shader.inputs["Base Color"])
    if alpha is not None:
        tree.links.new(alpha, shader.inputs["Alpha"])
    tree.links.new(shader.outputs[0], output.inputs[0])
    return tree, colour, alpha


def _shown(ray="camera"):
    """Mean colour of what covers, and coverage, of what the add-on sees."""
    bpy.context.view_layer.update()
    (shown,) = visible_meshes(bpy.context.evaluated_depsgraph_get(), (), ray)
    fractions = np.bincount(shown.arrays.parts, minlength=len(shown.means)) / len(
        shown.arrays.parts
    )
    coverage = sum(s * mean.coverage for s, mean in zip(fractions, shown.means, strict=True))
    colour = sum(
        s * mean.coverage * np.array(mean.colour)
        for s, mean in zip(fractions, shown.means, strict=True)
    )
    return colour / coverage, coverage


def _drawn(tree, colour, alpha, path):
    """Return the same as Cycles draws it from above, glowing in its colour."""
    glow, clear, mix = (
        tree.nodes.new(f"ShaderNode{x}") for x in ("Emission", "BsdfTransparent", "MixShader")
    )
    mix.inputs[0].default_value = 1.0
    held = tree.nodes.new("ShaderNodeVectorMath")
    held.operation = "MAXIMUM"  # as shaders hold their colours
    tree.links.new(colour, held.inputs[0])
    tree.links.new(held.outputs[0], glow.inputs[0])
    if alpha is not None:
        tree.links.new(alpha, mix.inputs[0])
    for n, node in enumerate((clear, glow)):
        tree.links.new(node.outputs[0], mix.inputs[n + 1])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs[0])
    scene = bpy.context.scene
    item, data = bpy.context.object, bpy.data.cameras.new("above")
    camera = bpy.data.objects.new("above", data)
    camera.location, data.type, data.ortho_scale = (*item.location[:2], 5.0), "ORTHO", 3.0
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    scene.render.film_transparent = True
    scene.render.resolution_x, scene.render.resolution_y = 96, 64
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    bpy.data.objects.remove(camera)
    mean = read_exr(path)[0].astype(np.float64).mean(axis=(0, 1))
    return mean[:3] / mean[3], mean[3]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("kind", KINDS)
def test_the_mean_of_what_a_mesh_shows_is_that_of_its_picture(kind, tmp_path):
    drawn_in = _plane(kind, tmp_path)
    colour, coverage = _shown()
    drawn, covered = _drawn(*drawn_in, tmp_path / "drawn.exr")
    assert coverage == pytest.approx(covered, abs=0.01)
    # 512 points of a picture of much contrast; of what is cut off at its borders few are left.
    assert colour == pytest.approx(drawn, abs=0.07 * drawn.max() if "clip" not in kind else 0.01)


def test_meshes_of_one_material_have_means_of_their_own():
    """Two sheets with a picture of which each shows one half."""
    image = bpy.data.images.new("halves", 2, 1, float_buffer=True)
    image.pixels[:] = [0.1, 0.2, 0.3, 1.0, 0.7, 0.6, 0.5, 1.0]
    material = scenes.textured()
    texture = material.node_tree.nodes["Image Texture"]
    texture.image, texture.interpolation = image, "Closest"
    for x, left in ((0.0, 0.0), (5.0, 0.5)):
        bpy.ops.mesh.primitive_plane_add(size=2.0, location=(x, 0.0, -4.0))
        mesh = bpy.context.object.data
        mesh.materials.append(material)
        for point in mesh.uv_layers[0].uv:
            point.vector = (left + 0.01 + 0.48 * point.vector[0], point.vector[1])
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = sorted(surface.colours[0].tolist() for surface in visible_triangles(depsgraph))
    np.testing.assert_allclose(found, [[0.1, 0.2, 0.3], [0.7, 0.6, 0.5]], atol=1e-3)
    rays = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]] * 2)
    hits = Meshes(depsgraph, (), "camera").first(*rays, np.full(2, np.inf))
    np.testing.assert_allclose([hit.colour for hit in hits], found, atol=1e-3)


def test_a_seabed_of_a_quarter_of_an_atlas_has_the_colours_of_that_quarter(monkeypatch):
    """Black that it does not show made pictures .57 times as bright."""
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    pixels = np.zeros((8, 8, 4), np.float32)
    pixels[:4, :4], pixels[..., 3] = (0.5, 0.4, 0.3, 1.0), 1.0
    image = bpy.data.images.new("atlas", 8, 8, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    bpy.ops.mesh.primitive_plane_add(size=40.0, location=(0.0, 0.0, -5.0))
    mesh = bpy.context.object.data
    for point in mesh.uv_layers[0].uv:
        point.vector = (0.01 + 0.42 * point.vector[0], 0.01 + 0.42 * point.vector[1])
    mesh.materials.append(scenes.textured())
    texture = mesh.materials[0].node_tree.nodes["Image Texture"]
    texture.image, texture.interpolation = image, "Closest"
    camera = scenes.add_camera((0.0, 0.0, -0.02), (math.pi / 2, 0.0, 0.0))
    bpy.context.view_layer.update()
    ground = surroundings.look_around(bpy.context.scene, camera, 0.1).ground
    assert ground is not None
    assert ground.colour == pytest.approx((0.5, 0.4, 0.3), abs=0.006)


def test_what_looks_pictures_up_is_not_stored_and_updates_no_scene(tmp_path):
    """In a window live water would follow such updates with another look, without end."""
    textured, updates = scenes.textured(), []
    mean_colour(textured)
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(lambda *_: updates.append(1))
    mean_colour(textured)
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.pop()
    assert updates == []
    path = str(tmp_path / "stored.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    with bpy.data.libraries.load(path) as (stored, _):
        assert stored.textures == []


@pytest.mark.parametrize(
    ("node", "into", "said"),
    [
        ("ShaderNodeTexMagic", "Base Color", True),
        ("ShaderNodeTexMagic", "Roughness", False),  # decides nothing that is thrown back
        ("ShaderNodeTexChecker", "Base Color", False),
    ],
)
def test_a_colour_that_is_a_guess_is_said(node, into, said, monkeypatch):
    """Of the seabed, in a job and while water is live."""
    monkeypatch.setattr(surroundings, "_COARSE", 2000)
    scene, camera = bpy.context.scene, scenes.add_camera((0.0, 0.0, -3.0))
    bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, 0.0, -5.0))
    material = scenes.principled("Sand", (0.5, 0.5, 0.5, 1.0))
    tree = material.node_tree
    source = tree.nodes.new(node)
    tree.links.new(source.outputs[0], tree.nodes["Principled BSDF"].inputs[into])
    bpy.context.object.data.materials.append(material)
    bpy.context.view_layer.update()
    column = make_plan(SceneSettings(bands=3)).column
    kept = Cache()
    kept.look(scene, camera, column)
    found = unknown_colours.notes(kept.looked)
    assert len(found) == said
    assert all("'Sand' (Magic Texture)" in note and "0.5" in note for note in found)


def test_a_guess_that_changes_nothing_is_not_said():
    material = scenes.principled("Even", (0.5, 0.5, 0.5, 1.0))
    tree = material.node_tree
    mix, source = tree.nodes.new("ShaderNodeMix"), tree.nodes.new("ShaderNodeTexMagic")
    mix.data_type = "RGBA"
    one, other = (i for i in mix.inputs if i.type == "RGBA")
    one.default_value, other.default_value = (0.4, 0.4, 0.4, 1.0), (0.42, 0.4, 0.4, 1.0)
    tree.links.new(source.outputs[1], mix.inputs[0])
    colour = next(o for o in mix.outputs if o.type == "RGBA")
    tree.links.new(colour, tree.nodes["Principled BSDF"].inputs["Base Color"])
    assert mean_colours.mean_surface(material).unknown == ()
    other.default_value = (0.8, 0.4, 0.4, 1.0)
    assert mean_colours.mean_surface(material).unknown == ("Magic Texture",)


@pytest.mark.parametrize(("metallic", "coverage", "colour"), [(0.0, 0.4, 0.0), (1.0, 1.0, 0.36)])
def test_metals_let_nothing_through_and_faces_the_root_of_their_colour(metallic, coverage, colour):
    """A body has two faces: both together leave the colour."""
    material = bpy.data.materials.new("pane")
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (0.36, 0.36, 0.36, 1.0)
    inputs["Transmission Weight"].default_value = 1.0
    inputs["Metallic"].default_value = metallic
    found = mean_colours.mean_surface(material)
    assert found.coverage == pytest.approx(coverage)
    assert found.colour == pytest.approx((colour,) * 3)
