"""Live water follows the settings, the camera and the frame, and leaves no trace."""

from __future__ import annotations

import functools

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_tables, realtime_values
from underwater_spectral.scene import marks, sources, stored_settings
from underwater_spectral.scene.materials import wet_trees
from underwater_spectral.scene.materials.inserted import has_inserted, own_input
from underwater_spectral.scene.session import is_live
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.viewport import changes, live, live_scenes, problems, submerging
from underwater_spectral.scene.water import occlusion
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings.render_plan import make_plan, plan_of
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.ui import live_updates
from underwater_spectral.uw_spectral.imaging.description import REFERENCE_BANDS
from underwater_spectral.uw_spectral.transfer import water_column
from underwater_spectral.uw_spectral.water.inelastic_processes import EXCITATION

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


@pytest.fixture(autouse=True)
def _registered(registered):
    return registered


def _scene():
    """One ball before a camera at 5 m, with quick settings."""
    scene = bpy.context.scene
    item = scenes._cube("ball", (0.0, 6.0, -5.0))
    item.data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    scene.underwater.phase = "hg:0.924"
    bpy.context.view_layer.update()
    return scene


def _shown(name="camera depth"):
    return bpy.data.node_groups[realtime_values.NAME].nodes[name].outputs[0].default_value


def _numbers():
    """Every number of UW Values, and of the tables."""
    nodes = bpy.data.node_groups[realtime_values.NAME].nodes
    sockets = [s for n in nodes for s in (*n.inputs, *n.outputs) if hasattr(s, "default_value")]
    return np.concatenate([*(np.ravel(s.default_value) for s in sockets), _texels()])


def _texels():
    """All of the tables of the water in the scene."""
    image = marks.part(bpy.context.scene, "uw_table")
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found


def _groups():
    return {g.name: [n.as_pointer() for n in g.nodes] for g in bpy.data.node_groups}


def _expected(scene, depth):
    """Water that is added afresh."""
    plan = make_plan(stored_settings.stored_settings(scene).in_mode("realtime"))
    return eevee_water(plan, scene, Eye(scene.camera, depth), plan.reduction(depth).weights)


def _assert_shows(scene, depth):
    expected = _expected(scene, depth)
    np.testing.assert_array_equal(
        _texels(), realtime_tables.pixels(expected.projected).ravel(), strict=True
    )
    assert _shown() == pytest.approx(depth)


@pytest.mark.slow
def test_haste_takes_few_bands_and_rest_takes_all():
    scene = _scene()
    live.add(scene)
    scene.underwater.sun_zenith = 50.0
    whole = _texels()
    assert not changes.is_stale(scene)
    with live_updates.transaction():
        scene.underwater.sun_zenith = 20.0
        live.update(scene, hasty=True)
        few = _texels()
        assert changes.is_stale(scene)
    assert not changes.is_stale(scene)
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(_texels(), few)
    _assert_shows(scene, 5.0)
    scene.underwater.sun_zenith = 50.0
    np.testing.assert_array_equal(_texels(), whole)


CHANGES = {
    "water": "jerlov:5C",
    "second_water_fraction": 0.4,
    "absorption_factor": 1.7,
    "scattering_factor": 2.0,
    "sensor": "ARRI D21",
    "sun_zenith": 55.0,
    "sun_azimuth": 120.0,
    "white_balance": "depth",
    "exposure": "-1.5",
    "illuminant": "clear-sky",
    "irradiance": "below",
    "sky_radiance": 0.1,
    "refractive_index": 1.33,
    "range_start": 420.0,
    "water_source": "williamson2022",
}


@pytest.mark.slow
def test_every_link_of_the_water_is_valid():
    scene = _scene()
    lamp = bpy.data.objects.new("torch", bpy.data.lights.new("torch", "SPOT"))
    scene.collection.objects.link(lamp)
    scene.underwater.surface = "waves"
    live.add(scene)
    trees = [
        *bpy.data.node_groups,
        *(m.node_tree for m in bpy.data.materials),
        scene.world.node_tree,
    ]
    assert sum(len(tree.links) for tree in trees) > 1000
    assert all(link.is_valid for tree in trees for link in tree.links)


def test_changes_arrive_without_new_nodes():
    scene = _scene()
    scene.underwater.diffuse_shadows = False  # computed anew with each, for a second
    live.add(scene)
    _assert_shows(scene, 5.0)
    scene.underwater.second_water = "jerlov:III"
    built = _groups()
    for name, value in CHANGES.items():
        before = _numbers()
        setattr(scene.underwater, name, value)
        assert problems.problem(scene) == ""
        assert not np.array_equal(_numbers(), before), name
        _assert_shows(scene, 5.0)
    assert _groups() == built


def test_what_was_drawn_in_haste_is_packed_at_rest():
    """Also where haste leaves nothing else to be done: few bands, and no occlusion."""
    scene = _scene()
    scene.underwater.bands, scene.underwater.diffuse_shadows = 4, False
    live.add(scene)
    image = marks.part(scene, "uw_table")
    with live_updates.transaction():
        scene.underwater.sun_zenith = 20.0
        live.update(scene, hasty=True)
        assert image.is_dirty
        assert changes.is_stale(scene)
    assert not changes.is_stale(scene)
    assert not image.is_dirty


@pytest.mark.slow
def test_what_begins_to_glow_gets_other_nodes():
    scene = _scene()
    live.add(scene)
    assert not changes.has_new_kinds(scene)
    shader = bpy.data.materials["paint"].node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Strength"].default_value = 2.0
    assert changes.has_new_kinds(scene)
    live.update(scene)
    assert not changes.has_new_kinds(scene)


def test_the_camera_is_followed():
    scene = _scene()
    live.add(scene)
    scene.camera.location.z = -8.0
    bpy.context.view_layer.update()
    _assert_shows(scene, 8.0)


@pytest.mark.slow
def test_another_shape_builds_other_nodes():
    scene = _scene()
    live.add(scene)
    scene.underwater.bands = 5
    _assert_shows(scene, 5.0)
    scene.underwater.sky, scene.underwater.sky_radiance = "clear", 0.2
    _assert_shows(scene, 5.0)
    scene.underwater.floor_depth = 9.0
    assert any(o.name.startswith("UW Floor") for o in scene.objects)
    scene.underwater.floor_depth = 7.0
    floor = next(o for o in scene.objects if o.name.startswith("UW Floor"))
    assert floor.location.z == pytest.approx(-7.0)
    assert not floor.hide_render
    scene.underwater.floor_depth = 0.0
    assert all(o.hide_render for o in scene.objects if o.name.startswith("UW Floor"))


def test_keyframes_work_in_playback():
    scene = _scene()
    for frame, fraction, zenith in ((1, 0.0, 10.0), (11, 1.0, 60.0)):
        scene.underwater.second_water_fraction = fraction
        scene.underwater.sun_zenith = zenith
        scene.underwater.keyframe_insert("second_water_fraction", frame=frame)
        scene.underwater.keyframe_insert("sun_zenith", frame=frame)
        scene.camera.location.z = -4.0 - 4.0 * fraction
        scene.camera.keyframe_insert("location", frame=frame)
    scene.underwater.second_water = "jerlov:7C"
    live.add(scene)
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        _assert_shows(scene, -scene.camera.matrix_world.translation.z)
    assert -scene.camera.matrix_world.translation.z == pytest.approx(8.0)


def test_removal_restores_every_value():
    scene = scenes.varied_scene()
    scene.underwater.phase = "hg:0.924"
    scene.view_settings.view_transform = "AgX"
    bpy.context.view_layer.update()
    scene.underwater.shafts = True
    before = snapshot.snapshot()
    live.add(scene)
    assert is_live(scene)
    assert scene.view_settings.view_transform == "Standard"
    live.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_water_survives_save_and_reload(tmp_path):
    scene = _scene()
    live.add(scene)
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    scene.underwater.water = "jerlov:I"
    _assert_shows(scene, 5.0)
    live.remove(scene)
    assert not marks.has_water(scene)


@pytest.mark.slow
def test_camera_above_the_water_is_shown_from_there():
    scene = _scene()
    scene.camera.location.z = 3.0
    bpy.context.view_layer.update()
    live.add(scene)
    assert problems.problem(scene) == ""
    assert _shown() == 0.0
    submerging.lower(scene, 8.0)
    bpy.context.view_layer.update()
    assert problems.problem(scene) == ""
    assert _shown() == pytest.approx(5.0)
    assert bpy.data.objects["ball"].matrix_world.translation.z == pytest.approx(-13.0)


def test_no_camera_and_a_floor_above_it_are_messages():
    scene = _scene()
    scene.underwater.floor_depth = 3.0
    assert "below the floor" in problems.problem(scene)
    bpy.data.objects.remove(scene.camera)
    assert "no active camera" in problems.problem(scene)
    live.add(scene)
    live.remove(scene)


def test_bad_settings_are_a_message_and_leave_the_water():
    scene = _scene()
    live.add(scene)
    before = _numbers()
    scene.underwater.water = "jerlov:X"
    assert "Jerlov type" in problems.problem(scene)
    assert np.array_equal(_numbers(), before)
    scene.underwater.water = "jerlov:I"
    assert problems.problem(scene) == ""


@pytest.mark.slow
def test_two_scenes_show_their_own_water():
    scene = _scene()
    other = bpy.data.scenes.new("other")
    other.underwater.phase, other.underwater.water = "hg:0.924", "jerlov:7C"
    live.add(scene)
    shown = _numbers()
    live.add(other)
    other.underwater.absorption_factor = 2.0
    assert live.update(other)
    assert problems.problem(other).startswith("The scene has no active camera")
    assert np.array_equal(_numbers(), shown)
    live.remove(scene)
    assert is_live(other)
    assert marks.has_water(other)
    live.remove(other)
    assert not bpy.data.node_groups


@pytest.mark.slow
def test_scenes_that_share_materials_are_dry_while_one_renders():
    scene = _scene()
    live.add(scene)
    other, third = (bpy.data.scenes.new(name) for name in ("other", "third"))
    other.collection.objects.link(bpy.data.objects["ball"])
    third.underwater.phase = "hg:0.924"
    live.add(third)
    tree = bpy.data.materials["paint"].node_tree
    with live_scenes.suspended(other):
        assert not is_live(scene)
        assert is_live(third)
        assert len(tree.nodes) == 2
    assert is_live(scene)
    assert len(tree.nodes) > 2


@pytest.mark.slow
def test_materials_of_two_scenes_stay_wet_when_one_gives_its_water_up():
    scene = _scene()
    other = bpy.data.scenes.new("other")
    other.underwater.phase = "hg:0.924"
    other.collection.objects.link(bpy.data.objects["ball"])
    live.add(scene)
    assert any("show its water" in note for note in live.add(other))
    tree = bpy.data.materials["paint"].node_tree
    assert live_scenes.take_out(scene) == []
    assert not is_live(scene)
    assert is_live(other)
    assert len(tree.nodes) > 2
    assert live_scenes.take_out(other) == []
    assert len(tree.nodes) == 2
    assert not bpy.data.node_groups


def test_suspended_water_comes_back():
    scene = _scene()
    live.add(scene)
    with live_scenes.suspended(scene):
        assert not is_live(scene)
    assert is_live(scene)
    _assert_shows(scene, 5.0)


def test_edited_colours_are_followed():
    scene = _scene()
    live.add(scene)
    tree = bpy.data.materials["paint"].node_tree
    tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    bpy.context.view_layer.update()
    copies = [n for n in tree.nodes if "uw_source" in n and len(n.inputs) == 3]
    assert [i.default_value for i in copies[0].inputs] == pytest.approx([0.1, 0.2, 0.3])


@pytest.fixture
def solved(monkeypatch):
    """Bands, streams and modes of the light fields that are solved, and whether they glow."""
    found, solve = [], water_column.solve_discrete_ordinates

    def counted(layers, *arguments, **options):
        glows = layers[0].emission is not None
        found.append((len(layers[0].absorption), options["streams"], options["modes"], glows))
        return solve(layers, *arguments, **options)

    for kept in (water_column._few_streams, water_column._many_streams):
        kept.cache_clear()
    monkeypatch.setattr(water_column, "solve_discrete_ordinates", counted)
    return found


KINDS = {
    "plain": ({}, set()),
    "depth balance": ({"white_balance": "depth"}, set()),
    "inelastic": ({"water": "case:baltic", "inelastic": "all"}, {len(EXCITATION)}),
    "optimised": ({"band_placement": "optimised", "bands": 6}, {REFERENCE_BANDS}),
}
QUICK = {
    ("plain", "waves"),
    ("depth balance", "none"),
    ("inelastic", "flat"),
    ("optimised", "none"),
}


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("surface", "settings", "others"),
    [
        pytest.param(
            surface, *KINDS[kind], id=f"{kind}, {surface}",
            marks=() if (kind, surface) in QUICK else pytest.mark.slow,
        )
        for kind in KINDS
        for surface in ("none", "flat", "waves")
    ],
)  # fmt: skip
def test_a_change_solves_the_light_field_of_its_bands_once(solved, surface, settings, others):
    scene = _scene()
    for name, value in {"surface": surface, "wave_resolution": 16, **settings}.items():
        setattr(scene.underwater, name, value)
    live.add(scene)
    solved.clear()
    scene.underwater.scattering_factor = 1.0625
    assert problems.problem(scene) == ""
    drawn = stored_settings.stored_settings(scene).in_mode("realtime").bands
    assert len(set(solved)) == len(solved)
    assert {bands for bands, *_ in solved} == {drawn, min(drawn, occlusion.MOST_BANDS), *others}


@pytest.mark.slow
def test_a_preset_solves_the_light_field_once(solved, monkeypatch):
    scene = _scene()
    live.add(scene)
    built = _groups()
    update = live.update
    with monkeypatch.context() as patch:
        patch.setattr(live, "update", lambda *_, **__: True)
        for name, value in {"water": "jerlov:3C", "sun_zenith": 21.0, "sensor": "ARRI D21"}.items():
            setattr(scene.underwater, name, value)
    solved.clear()
    update(scene)
    asked = list(solved)
    assert {bands for bands, *_ in asked} == {40, occlusion.MOST_BANDS}
    assert len(set(asked)) == len(asked)
    _assert_shows(scene, 5.0)
    assert solved == asked  # what is compared with knows the field
    assert _groups() == built


@pytest.mark.slow
def test_an_edited_file_counts_once_the_water_is_built_anew(tmp_path):
    path = tmp_path / "water.csv"

    def write(b):
        path.write_text(f"wavelength_nm,a,b\n300,0.05,{b}\n800,0.5,{b}\n")

    scene = _scene()
    write(0.1)
    scene.underwater.water = f"file:{path}"
    live.add(scene)
    before = _numbers()
    write(0.3)
    live.update(scene)
    assert np.array_equal(_numbers(), before)
    live_scenes.rebuild(scene)
    assert not np.array_equal(_numbers(), before)
    _assert_shows(scene, 5.0)
    write(0.2)
    new_job = make_plan(stored_settings.stored_settings(scene))
    assert new_job.column.scattering == pytest.approx(0.2)


def test_plans_of_a_view_are_plans():
    chosen = stored_settings.stored_settings(_scene())
    own, shared = make_plan(chosen), plan_of(chosen)
    found = shared.viewpoint(5.0).reduction.weights
    assert found == pytest.approx(own.reduction(5.0).weights, rel=1e-12)
    assert shared.column.absorption == pytest.approx(own.column.absorption)


def _picture(scene, path):
    scene.render.engine = "BLENDER_EEVEE"
    scene.render.resolution_x, scene.render.resolution_y = 32, 18
    scene.eevee.taa_render_samples = 1
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels).reshape(18, 32, 4)[..., :3]
    bpy.data.images.remove(image)
    return pixels


@pytest.mark.slow
def test_a_render_sees_values_that_were_written_quickly_and_keyframes(tmp_path):
    scene = _scene()
    for frame, factor in ((1, 1.0), (2, 4.0)):
        scene.underwater.scattering_factor = factor
        scene.underwater.keyframe_insert("scattering_factor", frame=frame)
    scene.underwater.exposure = "0"
    scene.frame_set(1)
    live.add(scene)
    take = functools.partial(_picture, scene)
    first = take(tmp_path / "first.png")
    scene.frame_set(2)
    second = take(tmp_path / "second.png")
    assert np.abs(first - second).max() > 0.02
    scene.frame_set(1)
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.filepath = str(tmp_path / "animation_")
    bpy.ops.render.render(animation=True)
    for frame, still in ((1, first), (2, second)):
        image = bpy.data.images.load(str(tmp_path / f"animation_{frame:04d}.png"))
        pixels = np.array(image.pixels).reshape(18, 32, 4)[..., :3]
        assert pixels == pytest.approx(still, abs=2 / 255)


@pytest.mark.slow
def test_the_number_of_bands_changes_no_nodes():
    scene = _scene()
    scene.underwater.bands = 6
    live.add(scene)
    before = _groups()
    scene.underwater.bands = 80
    live.update(scene)
    assert not problems.problem(scene)
    assert _groups() == before


@pytest.mark.slow
def test_the_water_goes_along_with_a_camera_that_travels():
    """Shafts ended where the scene did when the water was put in."""
    scene = _scene()
    scene.underwater.shafts = True
    live.add(scene)

    def width():
        (body,) = marks.bodies(scene)
        return max(corner[0] for corner in body.bound_box)

    before = width()
    scene.camera.location.x = 3.0
    bpy.context.view_layer.update()
    assert live.update(scene)
    assert width() == before
    scene.camera.location.x = before + 40.0
    bpy.context.view_layer.update()
    assert live.update(scene)
    assert width() > before + 40.0 + 20.0
    live.remove(scene)


def test_what_is_linked_in_a_material_and_what_has_no_shader_gets_wet_while_live():
    """A texture into the colour of one that is wet; an object whose material gives nothing."""
    scene = _scene()
    live.add(scene)
    paint = bpy.data.materials["paint"]
    tree = paint.node_tree
    checker = tree.nodes.new("ShaderNodeTexChecker")
    assert not wet_trees.is_rewired(paint)
    colour = tree.nodes["Principled BSDF"].inputs["Base Color"]
    tree.links.new(checker.outputs[0], colour)
    assert wet_trees.is_rewired(paint)
    made = {}
    for name, volume in (("black", False), ("mist", True)):
        material = made[name] = bpy.data.materials.new(name)
        material.node_tree.nodes.clear()
        output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
        if volume:
            fog = material.node_tree.nodes.new("ShaderNodeVolumePrincipled")
            material.node_tree.links.new(fog.outputs[0], output.inputs["Volume"])
        scenes._cube(name, (2.0, 6.0, -5.0)).data.materials.append(material)
        assert wet_trees.is_dry(material)
    bpy.context.view_layer.update()
    live.update(scene)
    assert not wet_trees.is_rewired(paint)
    assert wet_trees.surface_node(tree) is not None or has_inserted(colour)
    (link,) = own_input(colour).links
    assert link.from_node == checker
    assert wet_trees.surface_node(made["black"].node_tree) is not None
    assert not any(map(wet_trees.is_dry, made.values()))
    live.remove(scene)
    (link,) = colour.links
    assert link.from_node == checker
    assert len(made["black"].node_tree.nodes) == 1


@pytest.mark.slow
def test_water_of_another_build_is_said_until_it_is_built_anew(monkeypatch):
    scene = _scene()
    live.add(scene)
    assert problems.standing_notes(scene) == []
    monkeypatch.setattr(sources, "source_digest", lambda: "another")
    (note,) = problems.standing_notes(scene)
    assert "Refresh Water" in note
    live_scenes.rebuild(scene)
    assert problems.standing_notes(scene) == []
    live.remove(scene)
    assert problems.standing_notes(scene) == []
