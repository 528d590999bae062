"""The asset library: it opens, all in it are assets, and its groups give the optics' numbers."""

from __future__ import annotations

import json
import math
import runpy
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral import registration
from underwater_spectral.scene import contents, marks, stored_settings
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.readers import dark_lamps
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tools import asset_groups
from underwater_spectral.ui import dropped_assets, preferences
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water import JERLOV_TYPES
from underwater_spectral.validation.closed_form import PlainLight, TwoStreamWater, plain_water

ROOT = Path(__file__).resolve().parent.parent
LOADED = ("worlds", "node_groups", "collections", "objects")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The library, built as for the zip, and its assets by kind of data-block."""
    folder = tmp_path_factory.mktemp("assets")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.unregister()
    registration.register()
    tool = runpy.run_path(str(ROOT / "tools" / "build_assets.py"), run_name="tool")
    tool["build"](folder)
    registration.unregister()
    stored_settings.register()
    return folder / tool["FILE"]


@pytest.fixture
def loaded(library, registered):
    """Assets by name, appended to an empty file."""
    with bpy.data.libraries.load(str(library), assets_only=True) as (there, here):
        for kind in LOADED:
            setattr(here, kind, list(getattr(there, kind)))
    return {item.name: item for kind in LOADED for item in getattr(here, kind)}


def _seen(tree, output, tmp_path, **inputs):
    """Render a plane that shines with an output of a shader group; return its colour."""
    scene = bpy.context.scene
    material = bpy.data.materials.new("shows")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    group, shader, end = (
        nodes.new(f"ShaderNode{kind}") for kind in ("Group", "Emission", "OutputMaterial")
    )
    group.node_tree = tree
    for name, value in inputs.items():
        group.inputs[name.replace("_", " ")].default_value = value
    links.new(group.outputs[output], shader.inputs["Color"])
    links.new(shader.outputs[0], end.inputs["Surface"])
    bpy.ops.mesh.primitive_plane_add(size=4.0, location=(0.0, 0.0, -3.0))
    plane = bpy.context.object
    plane.data.materials.append(material)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.location = (0.0, 0.0, -1.0)
    scene.render.resolution_x = scene.render.resolution_y = 8
    with cycles_settings.reference_settings(
        scene, camera, samples=1, seed=0, bounces=1, device="cpu"
    ):
        exr_output.write_float_exr(scene, tmp_path / "readers.exr")
    bpy.data.objects.remove(plane)
    bpy.data.objects.remove(camera)
    return read_exr(tmp_path / "readers.exr")[0].mean(axis=(0, 1)).astype(np.float64)


def test_every_asset_has_name_words_and_picture(loaded):
    assert len(loaded) >= 35
    catalogues = {item.asset_data.catalog_id for item in loaded.values()}
    assert len(catalogues) == 6
    for name, item in loaded.items():
        assert len(item.asset_data.description) > 20, name
        assert item.asset_data.author, name
        pixels = np.empty(4 * math.prod(item.preview.image_size), np.float32)
        item.preview.image_pixels_float.foreach_get(pixels)
        rgb = pixels.reshape(-1, 4)[:, :3]
        assert rgb.max() - rgb.min() > 0.02, name
    assert "uw_node" not in {key for g in bpy.data.node_groups for key in g.keys()}  # noqa: SIM118
    assert not [n.name for g in bpy.data.node_groups for n in g.nodes if "uw_node" in n]


def test_the_catalogues_are_named_in_their_file(library, loaded):
    text = (library.parent / "blender_assets.cats.txt").read_text(encoding="utf-8")
    for item in loaded.values():
        assert item.asset_data.catalog_id in text


def test_sockets_have_words_and_units(loaded):
    for name, group in loaded.items():
        if isinstance(group, bpy.types.ShaderNodeTree):
            for socket in group.interface.items_tree:
                assert socket.description, (name, socket.name)


@pytest.mark.parametrize("kind", ["IB", "3C"])
def test_water_groups_give_the_numbers_of_the_optics(loaded, tmp_path, kind):
    wavelengths = sorted(asset_groups.WAVELENGTHS)
    plan = render_plan.plan_of(
        SceneSettings(
            water=f"jerlov:{kind}", phase="hg:0.9", wavelengths=",".join(map(str, wavelengths))
        )
    )
    tree = loaded[f"Water Jerlov {kind}"]
    P, w = 4.0, (0.0, 0.8, -0.6)
    passed = _seen(tree, "Transmittance", tmp_path, Distance=P)
    c = (plan.column.absorption + plan.column.scattering)[::-1]
    assert passed == pytest.approx(np.exp(-c * P), rel=1e-3)
    path = _seen(tree, "Path Radiance", tmp_path, Distance=P, Direction=w, Camera_Depth=5.0)
    column, phase = plan.column, plan.phase
    water = plain_water(
        TwoStreamWater(column.absorption, column.scattering, phase.chi1, phase.chi2),
        PlainLight(column.sun_irradiance, column.sky_radiance, column.sun_direction.tolist()),
        y_o=5.0, y_f=1e3, r=0.0,
        index=column.refractive_index if column.reflects else 1.0,
    )  # fmt: skip
    assert path == pytest.approx(water.elastic.path(5.0, w, P)[::-1], rel=2e-3)


def test_transmittance_and_colour_groups(loaded, tmp_path):
    seen = _seen(
        loaded["Transmittance"], "Transmittance", tmp_path, Distance=2.0, Extinction=(1, 0.5, 0.1)
    )
    assert seen == pytest.approx(np.exp([-2.0, -1.0, -0.2]), rel=1e-4)
    colours = [_seen(loaded["Jerlov Colour"], "Colour", tmp_path, Type=t) for t in (0.0, 0.5, 1.0)]
    assert colours[1] == pytest.approx((colours[0] + colours[2]) / 2, rel=1e-3)
    turbid = _seen(loaded["Jerlov Colour"], "Colour", tmp_path, Type=len(JERLOV_TYPES) - 1.0)
    assert colours[0][2] > colours[0][0]
    assert turbid[1] > turbid[2]  # coastal water is green


def test_caustics_are_as_bright_as_flat_water_on_average(loaded, tmp_path):
    flat = _seen(loaded["Caustic Light"], "Sunlight", tmp_path, Strength=0.0)
    assert flat == pytest.approx(1.0)
    group = loaded["Caustic Light"]
    image = next(n.image for n in group.nodes if n.bl_idname == "ShaderNodeTexImage")
    assert tuple(image.size) == (128, 128)
    pixels = np.empty(4 * 128 * 128, np.float32)
    image.pixels.foreach_get(pixels)
    layers = pixels.reshape(-1, 4)
    assert layers.mean(axis=0) == pytest.approx(np.ones(4), abs=0.02)
    assert layers.std(axis=0).max() > 0.1


def test_a_world_that_is_dropped_brings_its_water(loaded):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location.z = -3.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    assert not dropped_assets.take_over(scene)
    world = loaded["Harbour"]
    given = json.loads(world[dropped_assets.SETTINGS])
    assert given["water"] == "jerlov:7C"
    scene.world = world
    assert dropped_assets.take_over(scene)
    assert scene.underwater.water == "jerlov:7C"
    assert scene.underwater.floor_depth == pytest.approx(8.0)
    assert marks.has_water(scene)
    assert not dropped_assets.take_over(scene)
    bpy.ops.underwater.remove_water()
    assert scene.world == world
    assert not dropped_assets.take_over(scene)


def test_lamps_of_a_rig_keep_what_they_are(loaded):
    rig = loaded["Four ROV Lights"]
    lights = [item for item in rig.objects if item.type == "LIGHT"]
    assert len(lights) == 4
    assert {light.parent.name for light in lights} == {"Four ROV Lights Rig"}
    assert all(light.data.underwater.unit == "lm" for light in lights)


def test_a_rig_that_is_dropped_becomes_lamps_of_the_scene(loaded):
    scene = bpy.context.scene
    dropped = bpy.data.objects.new("Torch", None)
    dropped.instance_type, dropped.instance_collection = "COLLECTION", loaded["Torch"]
    dropped.location = (1.0, 2.0, -3.0)
    scene.collection.objects.link(dropped)
    bpy.context.view_layer.update()
    assert len(dark_lamps.objects_of(scene)) == 1  # of the instance
    (torch,) = dropped_assets.hang_lamps(scene)
    bpy.context.view_layer.update()
    assert dark_lamps.objects_of(scene) == [torch]
    assert torch.parent == dropped
    assert (torch.matrix_world.translation - dropped.location).length < 0.5
    assert torch.data.underwater.unit == "lm"
    assert dropped.instance_collection is None
    assert "Torch" not in bpy.data.collections
    assert dropped_assets.hang_lamps(scene) == []


def _specks():
    """Places of instanced particles, sorted, shape (n, 3)."""
    bpy.context.view_layer.update()
    instances = bpy.context.evaluated_depsgraph_get().object_instances
    places = [tuple(x.matrix_world.translation) for x in instances if x.is_instance]
    return np.array(sorted(places))


def test_particles_are_the_same_wherever_they_are_dropped(loaded):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (3.0, -2.0, -6.0)
    camera.rotation_euler = (math.pi / 2, 0.0, 0.0)
    snow = loaded["Snow"]
    for item in (camera, snow):
        scene.collection.objects.link(item)
    scene.camera = camera
    places = _specks()
    assert len(places) > 50
    snow.location, snow.rotation_euler, snow.scale = (5.0, 1.0, -3.0), (0.3, 0.5, 1.0), (2, 2, 2)
    np.testing.assert_allclose(_specks(), places, atol=1e-4)
    assert np.linalg.norm(places - camera.location, axis=1).max() < 40.0
    tree = snow.modifiers[0].node_group
    name = tree.interface.items_tree["Times"].identifier
    getattr(snow.modifiers[0].properties.inputs, name).value = 3.0
    snow.update_tag()
    assert len(_specks()) == pytest.approx(3 * len(places), rel=0.2)
    assert snow.active_material in contents.materials(scene)


def test_a_mesh_that_particles_are_dropped_on_stays(loaded):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location.z = -6.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_cube_add(location=(0.0, 3.0, -6.0))
    cube = bpy.context.object
    cube.modifiers.new("silt", "NODES").node_group = loaded["Silt"].modifiers[0].node_group
    assert len(_specks()) > 50
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert len(cube.evaluated_get(depsgraph).data.vertices) == 8


def test_one_click_adds_the_library(library, registered, monkeypatch, tmp_path):
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = {item.name for item in libraries}
    monkeypatch.setattr(preferences, "ASSETS", tmp_path)
    with pytest.raises(RuntimeError, match="is missing"):
        bpy.ops.underwater.add_assets()
    monkeypatch.setattr(preferences, "ASSETS", library.parent)
    for _ in range(2):
        assert bpy.ops.underwater.add_assets() == {"FINISHED"}
        assert {item.name for item in libraries} == before | {preferences.LIBRARY}
    found = preferences.library()
    assert found is not None
    assert Path(found.path) == library.parent
    libraries.remove(found)
