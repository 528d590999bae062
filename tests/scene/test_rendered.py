"""What renders show decides, not what the viewport shows or what lies in the file."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import batch, planning
from underwater_spectral.scene import contents
from underwater_spectral.scene.as_rendered import as_rendered
from underwater_spectral.scene.materials.mean_colours import mean_colour, mean_surface
from underwater_spectral.scene.readers import dark_lamps, lamps, surroundings
from underwater_spectral.scene.readers.lamp_shadows import LampShadowCache
from underwater_spectral.scene.readers.ray_casting import Meshes
from underwater_spectral.scene.readers.surface_samples import visible_triangles
from underwater_spectral.scene.readers.surroundings import has_objects, look_around
from underwater_spectral.scene.readers.visible_meshes import visible_meshes
from underwater_spectral.scene.water import giving_back, scene_water
from underwater_spectral.scene.water.water_body import scene_reach
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import RELATIVE
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.usefixtures("registered")

HIDDEN = {
    "the object": lambda item, _: setattr(item, "hide_render", True),
    "the collection": lambda _, part: setattr(part.collection, "hide_render", True),
    "left out of the layer": lambda _, part: setattr(part, "exclude", True),
}
IN_VIEWPORT = {
    "the object": lambda item, _: setattr(item, "hide_viewport", True),
    "the eye": lambda item, _: item.hide_set(True),
    "the collection": lambda _, part: setattr(part.collection, "hide_viewport", True),
}


def _in_collection(item):
    """Move an object into a collection of its own and return its place in the view layer."""
    scene = bpy.context.scene
    own = bpy.data.collections.new("own")
    scene.collection.children.link(own)
    for owner in list(item.users_collection):
        owner.objects.unlink(item)
    own.objects.link(item)
    bpy.context.view_layer.update()
    return bpy.context.view_layer.layer_collection.children["own"]


def _lamp(**changes):
    light = bpy.data.lights.new("Lamp", "POINT")
    item = bpy.data.objects.new("Lamp", light)
    item.location = (0.0, 3.0, -4.0)
    bpy.context.scene.collection.objects.link(item)
    for name, value in changes.items():
        setattr(light, name, value)
    return item


def _shown(**options):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return sum(len(shown.arrays.triangles) for shown in visible_meshes(depsgraph, **options))


@pytest.mark.parametrize("where", HIDDEN)
def test_lamps_that_blender_does_not_render_light_nothing(where):
    scene = bpy.context.scene
    item = _lamp()
    assert dark_lamps.objects_of(scene) == [item]
    HIDDEN[where](item, _in_collection(item))
    bpy.context.view_layer.update()
    assert dark_lamps.objects_of(scene) == []


def test_lamps_of_a_collection_that_is_left_out_shine_where_they_are_instanced():
    scene = bpy.context.scene
    item = _lamp()
    _in_collection(item).exclude = True
    empty = bpy.data.objects.new("group", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["own"]
    scene.collection.objects.link(empty)
    empty.location.x = 3.0
    bpy.context.view_layer.update()
    (found,) = lamps.lamps_of(scene, Bands.uniform(3), RELATIVE).shown
    assert (found.item, found.instancer) == (item, empty)
    assert found.place.translation.x == item.location.x + 3.0
    empty.hide_render = True
    bpy.context.view_layer.update()
    assert dark_lamps.objects_of(scene) == []


@pytest.mark.parametrize("where", HIDDEN)
def test_objects_that_are_not_rendered_do_nothing(where):
    scene = bpy.context.scene
    cutter = scenes._cube("cutter", (500.0, 0.0, -5.0))
    part = _in_collection(cutter)
    assert _shown() == 12
    assert scene_reach(scene).radius > 400.0
    HIDDEN[where](cutter, part)
    bpy.context.view_layer.update()
    assert _shown() == 0
    assert not has_objects(scene)
    assert scene_reach(scene).radius == 0.0
    found = look_around(scene, None, 0.1)
    assert len(found.surfaces) == 0


@pytest.mark.parametrize("where", IN_VIEWPORT)
def test_objects_that_only_the_viewport_hides_count_in_jobs(where):
    scene = bpy.context.scene
    rock = scenes._cube("rock", (0.0, 5.0, -5.0))
    part = _in_collection(rock)
    IN_VIEWPORT[where](rock, part)
    bpy.context.view_layer.update()
    before = snapshot.snapshot()
    assert _shown() == 0
    with as_rendered(scene):
        assert _shown() == 12
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.parametrize("viewport", [False, True], ids=["render", "both"])
def test_a_keyed_switch_of_a_modifier_is_followed_through_the_frames(viewport):
    """As renders have it, whatever is keyed for the viewport; afterwards all is as it was."""
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    item, scene = bpy.context.object, bpy.context.scene
    modifier = item.modifiers.new("Row", "ARRAY")
    modifier.count = 3
    for frame, shown in ((1, False), (2, True), (3, False)):
        modifier.show_render = shown
        modifier.keyframe_insert("show_render", frame=frame)
        if viewport:
            modifier.show_viewport = not shown
            modifier.keyframe_insert("show_viewport", frame=frame)
    scene.frame_set(1)
    before = modifier.show_viewport
    with as_rendered(scene):
        for frame, faces in ((1, 1), (2, 3), (3, 1), (2, 3)):
            scene.frame_set(frame)
            mesh = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            assert len(mesh.polygons) == faces
        scene.frame_set(1)
    assert modifier.show_viewport == before
    scene.frame_set(2)
    assert modifier.show_viewport == (not viewport)


def test_an_instancer_hides_what_it_shows_and_sources_need_not_be_shown():
    scene = bpy.context.scene
    rock = scenes._cube("rock", (0.0, 0.0, 0.0))
    _in_collection(rock).exclude = True
    empty = bpy.data.objects.new("group", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["own"]
    empty.location = (300.0, 0.0, -5.0)
    scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    assert _shown() == 12
    assert scene_reach(scene).radius > 299.0
    empty.hide_render = True
    bpy.context.view_layer.update()
    assert _shown() == 0


def test_objects_without_shadow_shade_nothing():
    ghost = scenes._cube("ghost", (0.0, 5.0, -5.0))
    ghost.visible_shadow = False
    bpy.context.view_layer.update()
    assert (_shown(), _shown(ray="shadow"), _shown(ray="camera")) == (12, 0, 12)
    ghost.visible_shadow, ghost.visible_camera = True, False
    bpy.context.view_layer.update()
    assert (_shown(ray="shadow"), _shown(ray="camera")) == (12, 0)


def _volume(tree, output):
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])


def _clear(tree, output):
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], output.inputs[0])


def _glass(tree, output):
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    shader.inputs["Transmission Weight"].default_value = 1.0
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


@pytest.mark.parametrize("kind", [_volume, _clear, _glass])
def test_what_light_goes_through_shades_nothing(kind):
    scene = bpy.context.scene
    both = scenes._cube("both", (0.0, 3.0, -4.0))
    both.scale = (4.0, 0.1, 4.0)
    material, tree, output = scenes._material("clear")
    kind(tree, output)
    both.data.materials.append(material)
    bpy.context.view_layer.update()
    assert (_shown(), _shown(ray="shadow")) == (12, 0)
    both.data.materials.append(scenes.principled("opaque"))
    both.data.polygons[0].material_index = 1
    bpy.context.view_layer.update()
    assert _shown(ray="shadow") == 2
    both.data.polygons[0].material_index = 0
    _lamp().location = (0.0, 0.0, -4.0)
    bpy.context.view_layer.update()
    found = lamps.lamps_of(scene, Bands.uniform(3), RELATIVE)
    (seen,) = LampShadowCache().of(scene, found).seen
    assert np.isinf(seen.distances).all()
    rays = np.array([[0.0, 0.0, -4.0]]), np.array([[0.0, 1.0, 0.0]]), np.array([np.inf])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert Meshes(depsgraph, (), "camera").first(*rays) == [None]
    assert Meshes(depsgraph).first(*rays) != [None]


def test_the_shader_that_is_rendered_gives_the_mean_colour():
    """Not the first of the node list, nor one that no output shows."""
    material, tree, output = scenes._material("paint")
    stray, used, glow = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("BsdfDiffuse", "BsdfDiffuse", "Emission")
    )
    stray.inputs["Color"].default_value = (0.0, 0.0, 1.0, 1.0)
    used.inputs["Color"].default_value = (0.6, 0.2, 0.1, 1.0)
    tree.links.new(used.outputs[0], output.inputs["Surface"])
    assert mean_colour(material) == pytest.approx((0.6, 0.2, 0.1))
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    tree.links.new(used.outputs[0], mix.inputs[1])
    tree.links.new(stray.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    assert mean_colour(material) == pytest.approx((0.45, 0.15, 0.325))
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    tree.links.new(clear.outputs[0], mix.inputs[2])
    surface = mean_surface(material)
    assert surface.colour == pytest.approx((0.6, 0.2, 0.1))
    assert surface.coverage == pytest.approx(0.75)
    tree.links.new(glow.outputs[0], output.inputs["Surface"])
    assert mean_colour(material) == (0.0, 0.0, 0.0)


def test_mean_colours_follow_groups_and_masks():
    material = scenes.grouped()
    assert mean_colour(material) == pytest.approx((0.1, 0.3, 0.7))
    leaf = scenes.textured()
    tree = leaf.node_tree
    texture, shader = tree.nodes["Image Texture"], tree.nodes["Principled BSDF"]
    image = bpy.data.images.new("leaf", 4, 4, alpha=True)
    image.pixels[:] = [0.2, 0.4, 0.1, 1.0] * 4 + [0.2, 0.4, 0.1, 0.0] * 12
    texture.image = image
    tree.links.new(texture.outputs["Alpha"], shader.inputs["Alpha"])
    assert mean_surface(leaf).coverage == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize(
    ("low", "high", "fraction"), [(0.35, 0.68, 0.455), (0.45, 0.6, 0.385), (0.4, 0.5, 0.737)]
)
def test_patches_of_noise_count_by_what_they_cover(low, high, fraction):
    """Shares are those of 65 536 pixels of the texture, as Cycles renders it."""
    material = scenes.textured()
    tree = material.node_tree
    noise, mapped, mix = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "MapRange", "Mix")
    )
    mapped.inputs["From Min"].default_value, mapped.inputs["From Max"].default_value = low, high
    mix.data_type = "RGBA"
    one, other = (i for i in mix.inputs if i.type == "RGBA")
    one.default_value, other.default_value = (0.0, 0.1, 0.5, 1.0), (1.0, 0.3, 0.5, 1.0)
    tree.links.new(noise.outputs[0], mapped.inputs["Value"])
    tree.links.new(mapped.outputs[0], mix.inputs[0])
    result = next(o for o in mix.outputs if o.type == "RGBA")
    tree.links.new(result, tree.nodes["Principled BSDF"].inputs["Base Color"])
    expected = (fraction, 0.1 + 0.2 * fraction, 0.5)
    assert mean_colour(material) == pytest.approx(expected, abs=0.003)


def test_what_an_attribute_of_the_mesh_mixes_has_its_colour_where_it_is():
    """The inside of a cave, painted brighter than the outside, was in between."""
    material = scenes.textured()
    tree = material.node_tree
    mask, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Attribute", "Mix"))
    mask.attribute_name = "inside"
    mix.data_type = "RGBA"
    one, other = (i for i in mix.inputs if i.type == "RGBA")
    one.default_value, other.default_value = (0.0, 0.1, 0.2, 1.0), (0.4, 0.5, 0.6, 1.0)
    tree.links.new(next(o for o in mask.outputs if o.type == "VALUE"), mix.inputs[0])
    result = next(o for o in mix.outputs if o.type == "RGBA")
    tree.links.new(result, tree.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=1, size=2.0)
    mesh = bpy.context.object.data
    mesh.materials.append(material)
    inside = mesh.attributes.new("inside", "FLOAT", "POINT")
    inside.data.foreach_set("value", [float(v.co.x > 0.1) for v in mesh.vertices])
    bpy.context.view_layer.update()
    (surface,) = visible_triangles(bpy.context.evaluated_depsgraph_get())
    x = surface.corners[:, :, 0]
    colours = surface.colours[surface.arrays.parts]
    assert colours[x.max(axis=1) < 0.1] == pytest.approx(np.array([[0.0, 0.1, 0.2]] * 8))
    assert colours[x.min(axis=1) > 0.1] == pytest.approx(np.array([[0.4, 0.5, 0.6]] * 6))
    bpy.context.object.data = mesh.copy()
    bpy.context.object.data.attributes.remove(bpy.context.object.data.attributes["inside"])
    bpy.context.view_layer.update()
    (surface,) = visible_triangles(bpy.context.evaluated_depsgraph_get())
    assert surface.colours[surface.arrays.parts] == pytest.approx(np.array([[0.0, 0.1, 0.2]] * 16))


def test_an_eye_just_under_the_surface_stays_where_it_is(monkeypatch):
    """A level view 2 cm deep sees the seabed below it; it was sought 3e7 m behind."""
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=40.0, location=(0.0, 0.0, -5.0))
    camera = scenes.add_camera((0.0, 0.0, -0.02), (np.pi / 2, 0.0, 0.0))
    bpy.context.view_layer.update()
    ground = look_around(scene, camera, 0.1).ground
    assert ground is not None
    assert ground.depth == pytest.approx(5.0, abs=0.3)


def _night(tmp_path, *, keyed):
    """Green by Cycles and by EEVEE; of two frames, if the lamp is keyed to go out in the second."""
    bpy.data.batch_remove(bpy.data.objects)
    surface = scenes._cube("thing", (0.0, 5.0, -5.0))
    surface.data.materials.append(scenes.principled("white", (1.0, 1.0, 1.0, 1.0)))
    scenes.add_camera((0.0, 0.0, -5.0), (np.pi / 2, 0.0, 0.0))
    item = _lamp(energy=500.0)
    for frame in (1, 2) if keyed else ():
        item.hide_render = frame == 2
        item.keyframe_insert("hide_render", frame=frame)
    path = tmp_path / f"night{keyed}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    found = []
    cycles = ("--engine", "cycles", "--samples", "256")
    frames = (1, 2) if keyed else (1,)
    for engine in (cycles, ("--engine", "eevee", "--mode", "realtime", "--samples", "4")):
        out = tmp_path / f"{engine[1]}{keyed}"
        options = ["--bands", "3", "--sunlight", "0", "--exposure", "0"]
        options += ["--frames", f"1-{frames[-1]}", "--resolution", "16", "9", "--phase", "hg:0.8"]
        options += ["--surface", "none", "--layers", "none", "--out", str(out)]
        assert batch.main([str(path), *engine, *options], inside_blender=False) == 0
        found.append([read_exr(out / f"000{n}.exr")[0][..., 1].mean() for n in frames])
    return np.array(found)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_a_keyframed_lamp_goes_out_and_is_not_lit_twice(tmp_path):
    """Blender's own lamp came back with the next frame, four times too bright in Cycles."""
    still, keyed = _night(tmp_path, keyed=False), _night(tmp_path, keyed=True)
    assert keyed[:, 0] == pytest.approx(still[:, 0], rel=0.02)
    assert (keyed[:, 1] < 1e-3 * still[:, 0]).all()


def test_water_that_is_taken_out_leaves_a_keyframed_lamp_as_it_was():
    scene = bpy.context.scene
    item = _lamp()
    scenes.add_camera()
    item.keyframe_insert("hide_render", frame=1)
    bpy.context.view_layer.update()
    before = snapshot.snapshot()
    scene_water._hide_lamps(scene)
    assert item["uw_unseen"]
    assert not item.visible_diffuse
    assert item.data.diffuse_factor == 0.0
    giving_back.let_go()
    assert snapshot.differences(before, snapshot.snapshot()) == []


# --- What is linked ---------------------------------------------------------------------------


def _linked(tmp_path, kind):
    """A scene that shows a material, a group in one, or a lamp of another file."""
    scenes.add_camera()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "empty.blend"))
    material = scenes.grouped()
    name, library = material.name, tmp_path / "library.blend"
    group = bpy.data.node_groups["paint"]
    lamp = bpy.data.objects.new("torch", bpy.data.lights.new("torch", "POINT"))
    bpy.data.libraries.write(str(library), {material, group, lamp})
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "empty.blend"))
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.materials = [name] if kind == "material" else []
        wanted.node_groups = ["paint"] if kind == "node group" else []
        wanted.objects = ["torch"] if kind == "lamp" else []
    ball = scenes._cube("ball", (0.0, 5.0, -5.0))
    if kind == "material":
        ball.data.materials.append(wanted.materials[0])
    elif kind == "node group":
        own = scenes.grouped()
        own.node_tree.nodes["Group"].node_tree = wanted.node_groups[0]
        ball.data.materials.append(own)
    else:
        bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return ball


@pytest.mark.parametrize("kind", ["material", "node group", "lamp"])
def test_what_is_linked_and_would_stay_dry_is_refused_in_a_window(kind, tmp_path):
    ball = _linked(tmp_path, kind)
    with pytest.raises(InputError, match=rf"{kind} .*library.blend.*make it local"):
        contents.require_local(bpy.context.scene)
    if kind == "lamp":
        return
    # What is not rendered does not matter.
    ball.hide_render = True
    contents.require_local(bpy.context.scene)


def _asset(how: str) -> None:
    """A red ball and a lamp of another file, by a link of one kind or another."""
    scene = bpy.context.scene
    with bpy.data.libraries.load("//asset.blend", link=how != "appended", relative=True) as (_, to):
        to.collections = ["Asset"]
    found = bpy.data.collections["Asset"]
    if how == "instance":
        item = bpy.data.objects.new("Asset", None)
        item.instance_type, item.instance_collection = "COLLECTION", found
        scene.collection.objects.link(item)
        return
    scene.collection.children.link(found)
    if how == "override":
        found.override_hierarchy_create(scene, bpy.context.view_layer)
        scene.collection.children.unlink(found)


@pytest.mark.parametrize("engine", ["cycles", pytest.param("eevee", marks=pytest.mark.slow)])
def test_what_is_linked_renders_as_if_it_were_local(engine, tmp_path, capfd):
    """A texture beside the library, too."""
    asset = bpy.data.collections.new("Asset")
    ball = scenes._cube("ball", (0.0, 4.0, -5.0))
    bpy.context.scene.collection.objects.unlink(ball)
    ball.data.materials.append(scenes.textured())
    image = next(n.image for n in ball.data.materials[0].node_tree.nodes if n.type == "TEX_IMAGE")
    (tmp_path / "textures").mkdir()
    image.filepath_raw, image.file_format = str(tmp_path / "textures" / "paint.png"), "PNG"
    image.save()
    image.filepath = image.filepath_raw
    asset.objects.link(ball)
    lamp = bpy.data.objects.new("torch", bpy.data.lights.new("torch", "POINT"))
    lamp.location, lamp.data.energy = (1.0, 1.0, -5.0), 900.0
    asset.objects.link(lamp)
    bpy.data.libraries.write(
        str(tmp_path / "asset.blend"), {asset}, path_remap="RELATIVE_ALL", fake_user=True
    )
    rendered = {}
    ways = ("appended", "objects", "override", "instance")
    for how in ways if engine == "cycles" else ways[::2]:
        bpy.ops.wm.read_homefile(use_empty=True)
        scenes.add_camera()
        path = tmp_path / f"{how}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        _asset(how)
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        out = tmp_path / f"out {how}"
        options = ["--engine", engine, "--bands", "3", "--samples", "2", "--phase", "hg:0.8"]
        options += ["--resolution", "32", "18", "--no-diffuse-shadows", "--out", str(out)]
        assert batch.main([str(path), *options], inside_blender=False) == 0
        rendered[how] = read_exr(out / "0001.exr")[0]
        log = capfd.readouterr()
        assert ("asset.blend is rendered as if it were local" in log.out + log.err) == (
            how != "appended"
        )
    local = rendered.pop("appended")
    assert local.std() > 0.01
    # Of an instance the lamp is not taken, and that is said.
    rendered.pop("instance", None)
    for how, picture in rendered.items():
        np.testing.assert_array_equal(picture, local, err_msg=how)


# --- How far the water reaches ----------------------------------------------------------------


def _extent(*arguments):
    from underwater_spectral.jobs import command_line
    from underwater_spectral.scene import stored_settings

    options = command_line.parse([str(a) for a in arguments])
    scene = bpy.context.scene
    stored = stored_settings.stored_settings
    job = command_line.job(options)
    return planning.plan_job(
        scene, lambda: command_line.merge(stored(scene), options), job
    ).output.extent


def test_the_water_reaches_as_far_as_every_frame_and_camera(tmp_path):
    """A camera that goes 0, 200 m, 0 was dry in the middle; one beside the scene always."""
    fast = ("scene.blend", "--bands", 3, "--frames", "1-3", "--exposure", 0, "--water", "jerlov:9C")
    near = scenes.add_camera((0.0, 0.0, -5.0))
    bpy.ops.mesh.primitive_plane_add(size=10.0, location=(0.0, 0.0, -8.0))
    width, bottom = _extent(*fast)
    for frame, x in ((1, 0.0), (2, 200.0), (3, 0.0)):
        near.location.x = x
        near.keyframe_insert("location", frame=frame)
    assert _extent(*fast)[0] == pytest.approx(width - np.hypot(5.0, 5.0) + 200.0)
    near.animation_data_clear()
    near.location.x = 0.0
    surface = scenes._cube("swimmer", (0.0, 0.0, -5.0))
    for frame, z in ((1, -5.0), (2, -90.0), (3, -5.0)):
        surface.location.z = z
        surface.keyframe_insert("location", frame=frame)
    assert _extent(*fast)[1] == pytest.approx(bottom - 8.0 + 91.0)
    surface.animation_data_clear()
    surface.location.z = -5.0
    far = scenes.add_camera((0.0, 120.0, -5.0))
    assert far.name != near.name
    both = _extent(*fast, "--cameras", f"{near.name},{far.name}")
    assert both[0] == pytest.approx(width - np.hypot(5.0, 5.0) + 120.0)
