"""A seabed of the scene's own at the added floor: no light is lost, and it is what is seen."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import marks
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.readers import surroundings
from underwater_spectral.scene.viewport import live, live_scenes, problems
from underwater_spectral.scene.water import continued_seabed, seabed, water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

FLOOR, DEPTH = 6.0, 3.0
SAND, GREY = (0.6, 0.3, 0.1), 0.3
EXTENT = water_body.WaterExtent(100.0, FLOOR + 1.0)
# Image means of as many samples as below repeat within a third of it.
NOISE = {"cycles": 0.01, "bands": 0.005, "realtime": 0.005}


def _plane(half_width, height=0.0, slope=0.0, colour=SAND):
    """Level or sloping ground, ``height`` m above the floor at the origin."""
    item = water_body.plane("ground", half_width, 0.0)
    item.location.z, item.rotation_euler.x = height - FLOOR, math.radians(slope)
    material = scenes.principled("sand", (*colour, 1.0))
    shader = material.node_tree.nodes["Principled BSDF"].inputs
    shader["Specular IOR Level"].default_value, shader["Roughness"].default_value = 0.0, 1.0
    item.data.materials.append(material)
    bpy.context.scene.collection.objects.link(item)
    return item


def _pictures(mode, tmp_path, *hidden):
    """Pictures of the scene in water, one with each of the objects hidden by name or none."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    camera = scenes.add_camera((0.0, 0.0, -DEPTH), (math.radians(75.0), 0.0, 0.0))
    bpy.context.view_layer.update()
    samples = 32 if mode == "cycles" else 4
    plan = render_plan.make_plan(
        SceneSettings(
            phase="hg:0.8", bands=3, samples=samples, surface="none", floor_depth=FLOOR,
            floor_reflectance=str(GREY),
        )
    )  # fmt: skip
    if mode == "cycles":
        opened = engines.cycles_bands(scene, camera, plan, EXTENT, seed=1)
    else:
        engine_of = engines.eevee_bands if mode == "bands" else engines.eevee_realtime
        opened = engine_of(scene, camera, plan, EXTENT, DEPTH)
    found = []
    with opened as engine:
        for name in hidden:
            if name is not None:
                bpy.data.objects[name].hide_render = True
            engine.frame(plan, DEPTH)(engine.passes[0], tmp_path / "a.exr")
            found.append(read_exr(tmp_path / "a.exr")[0].astype(np.float64))
            if name is not None:
                bpy.data.objects[name].hide_render = False
    return found


def _near(picture):
    """Mean of each channel where the ground is 5 to 12 m away."""
    return picture[18:].mean(axis=(0, 1))


def _in_modes(quick, *rows):
    """All modes with all rows; of EEVEE's, which compile shaders, those not named are slow."""
    return [
        pytest.param(
            mode,
            *row,
            marks=() if mode == "cycles" or (mode, row[0]) in quick else pytest.mark.slow,
        )
        for mode in NOISE
        for row in rows
    ]


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("mode", "height"),
    _in_modes(
        {("bands", -0.1)},
        *((height,) for height in (0.0, 0.001, -0.001, 0.1, -0.1)),
    ),
)
def test_the_scenes_own_seabed_is_what_is_seen(mode, height, tmp_path):
    _plane(40.0, height)
    both, own = _pictures(mode, tmp_path, None, "UW Floor")
    assert _near(both) == pytest.approx(_near(own), rel=NOISE[mode])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "slope", "covered"),
    _in_modes({("bands", -3.0)}, (3.0, "UW Floor"), (-3.0, "ground")),
)
def test_a_slope_through_the_floor_hides_it_or_is_hidden(mode, slope, covered, tmp_path):
    _plane(40.0, slope=slope)
    both, seen = _pictures(mode, tmp_path, None, covered)
    assert _near(both) == pytest.approx(_near(seen), rel=NOISE[mode])


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "half_width"), _in_modes({("bands", 8.0)}, (8.0,)))
def test_the_added_floor_goes_on_beyond_the_border(mode, half_width, tmp_path):
    """With one reflectance there is no telling where the scene's own seabed ends."""
    _plane(half_width, colour=(GREY,) * 3)
    both, added = _pictures(mode, tmp_path, None, "ground")
    assert both.mean(axis=(0, 1)) == pytest.approx(added.mean(axis=(0, 1)), rel=NOISE[mode])
    horizon = np.s_[4:12]
    assert both[horizon].mean() == pytest.approx(added[horizon].mean(), rel=2 * NOISE[mode])


def _clear_depth():
    bpy.context.view_layer.update()
    return seabed.clear_depth(bpy.context.scene, FLOOR)


def test_only_level_ground_at_the_floor_moves_it():
    assert _clear_depth() == FLOOR
    box = scenes._cube("box", (0.0, 0.0, -FLOOR + 1.0))  # stands on the floor
    assert _clear_depth() == FLOOR
    box.scale.z = -1.0
    assert _clear_depth() == FLOOR
    ground = _plane(5.0, 0.005)
    assert _clear_depth() == pytest.approx(FLOOR + 0.005, abs=1e-5)
    ground.rotation_euler.x = math.pi  # faces down, but can be seen from above
    assert _clear_depth() == pytest.approx(FLOOR + 0.005, abs=1e-5)
    ground.rotation_euler.x = math.radians(4.0)  # leaves the floor
    assert _clear_depth() == FLOOR
    ground.rotation_euler.x = 0.0
    ground.location.z = -FLOOR - 0.15
    assert _clear_depth() == pytest.approx(FLOOR + 0.16, abs=1e-5)
    ground.location.z = -FLOOR - 0.5  # the added floor covers it
    assert _clear_depth() == FLOOR
    ground.location.z = -FLOOR
    ground.hide_render = True
    assert _clear_depth() == FLOOR


def test_instances_and_modifiers_count():
    ground = _plane(5.0)
    wave = ground.modifiers.new("up", "DISPLACE")
    wave.mid_level, wave.strength = 0.0, 0.05
    assert _clear_depth() == FLOOR
    ground.instance_type = "NONE"
    group = bpy.data.collections.new("group")
    group.objects.link(_plane(5.0, colour=SAND))
    bpy.context.scene.collection.objects.unlink(group.objects[0])
    instance = bpy.data.objects.new("instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", group
    instance.location.z = -0.1
    bpy.context.scene.collection.objects.link(instance)
    assert _clear_depth() == pytest.approx(FLOOR + 0.11, abs=1e-5)


def test_objects_that_were_just_deleted_do_no_harm():
    """Blender's own list of instances still holds them until the scene is evaluated."""
    ground = _plane(5.0)
    others = [scenes._cube(f"cube {i}", (0.0, 0.0, -FLOOR)) for i in range(50)]
    expected = _clear_depth()
    for item in others:
        bpy.data.batch_remove([item, item.data])
    bpy.data.objects.remove(bpy.data.objects.new("another", None))
    assert seabed.clear_depth(bpy.context.scene, FLOOR) == expected
    bpy.data.objects.remove(ground)
    assert seabed.clear_depth(bpy.context.scene, FLOOR) == FLOOR


def _own(plan, camera):
    return _around(plan, camera).ground


def _around(plan, camera):
    bpy.context.view_layer.update()
    return surroundings.look_around(bpy.context.scene, camera, float(plan.column.attenuation.min()))


def _block(name, location, size):
    item = scenes._cube(name, location)
    item.scale = [x / 2.0 for x in size]
    return item


@pytest.fixture
def diver(empty_blender, monkeypatch):
    """A camera over nothing yet, in clear water."""
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)  # as users have it
    plan = render_plan.make_plan(SceneSettings(bands=3, phase="hg:0.8", surface="none"))
    camera = scenes.add_camera((0.0, -2.0, -DEPTH), (math.radians(75.0), 0.0, 0.0))
    return lambda: _own(plan, camera)


def test_the_floor_that_continues_a_flat_seabed_lies_just_under_it(diver):
    _plane(18.0, 0.02)
    ground = diver()
    assert ground.depth == pytest.approx(FLOOR)
    assert FLOOR - 0.02 < ground.bottom < FLOOR


def test_it_lies_under_the_lowest_place_of_a_hilly_one_and_not_under_objects(diver):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=60, y_subdivisions=60, size=36.0)
    hills = bpy.context.object
    hills.location.z = -FLOOR
    for vertex in hills.data.vertices:
        vertex.co.z = 0.5 * math.sin(vertex.co.x / 2.0)
    _block("wreck", (3.0, 4.0, -FLOOR), (9.0, 3.0, 4.0))
    _block("piles", (-3.0, 4.0, -FLOOR), (0.5, 0.5, 8.0))
    lowest = -FLOOR + min(v.co.z for v in hills.data.vertices)
    assert -diver().bottom == pytest.approx(lowest - 0.01, abs=1e-4)


def test_a_closed_seabed_counts_by_its_upper_side(diver):
    _block("slab", (0.0, 0.0, -FLOOR - 1.5), (30.0, 30.0, 3.0))
    assert diver().bottom == pytest.approx(FLOOR + 0.01, abs=1e-4)


@pytest.mark.parametrize(
    ("size", "is_seabed"),
    [((30.0, 6.0, 5.0), False), ((2.5, 1.4, 0.1), False), ((30.0, 30.0, 0.4), True)],
    ids=["hull", "pool table", "sand"],
)
def test_a_hull_and_a_table_are_no_seabed(diver, size, is_seabed):
    _block("thing", (0.0, -2.0, -FLOOR - size[2] / 2.0), size)
    assert (diver() is not None) == is_seabed


@pytest.mark.parametrize(
    ("size", "is_close"), [(2.5, False), (8.0, True), (12.0, True), (60.0, False)]
)
@pytest.mark.parametrize("floor", [True, False])
def test_a_seabed_that_cells_decide_about_is_said(
    empty_blender, monkeypatch, size, is_close, floor
):
    """By its area it is one, by cells that reach beyond what is looked at it is none."""
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)  # as users have it
    settings = SceneSettings(bands=3, phase="hg:0.8", surface="none", scene_floor=floor)
    plan = render_plan.make_plan(settings)
    camera = scenes.add_camera((0.0, 0.0, -DEPTH), (math.radians(75.0), 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0.0, 0.0, -FLOOR))
    around = _around(plan, camera)
    assert around.is_close_decision == is_close
    notes = [note for note in continued_seabed.notes(plan, around) if "about half" in note]
    assert len(notes) == (is_close and floor)
    assert all("is not taken" in note for note in notes)
    assert continued_seabed.notes(plan, None) == []


def test_a_hull_over_sand_leaves_the_seabed_to_the_sand(diver):
    _plane(20.0, -3.0)
    _block("hull", (0.0, -2.0, -FLOOR - 1.0), (30.0, 6.0, 4.0))
    assert diver().bottom == pytest.approx(FLOOR + 3.01, abs=1e-3)


def _open_water(mode, tmp_path, **changes):
    """Mean radiance level into the water over bright sand of 20 m that ends close by."""
    scene = bpy.context.scene
    _plane(10.0, colour=(0.6,) * 3)
    scene.render.resolution_x, scene.render.resolution_y = 32, 18
    camera = scenes.add_camera((0.0, 4.0, -DEPTH), (math.radians(90.0), 0.0, 0.0))
    bpy.context.view_layer.update()
    plan = render_plan.make_plan(
        SceneSettings(**{
            "phase": "hg:0.8", "bands": 3, "surface": "none", "diffuse_shadows": False,
            "samples": 64 if mode == "cycles" else 4,
        } | changes)
    )  # fmt: skip
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    if mode == "cycles":
        opened = engines.cycles_bands(scene, camera, plan, extent, seed=1)
    else:
        opened = engines.eevee_bands(scene, camera, plan, extent, DEPTH)
    with opened as engine:
        engine.frame(plan, DEPTH)(engine.passes[0], tmp_path / "a.exr")
        floor = next((o for o in scene.objects if marks.FLOOR_DEPTH in o), None)
        shown = floor is not None and not floor.hide_render
    return read_exr(tmp_path / "a.exr")[0].astype(np.float64), shown


@pytest.mark.slow
def test_open_water_beyond_the_border_is_the_same_in_both_engines(tmp_path):
    """It was 1.7 times as bright in EEVEE, and the floor ended in the picture."""
    found = {}
    for mode in ("cycles", "bands"):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        found[mode], shown = _open_water(mode, tmp_path)
        assert shown
    for rows in (np.s_[:8], np.s_[11:]):  # into the water, and over the border
        eevee, cycles = (found[mode][rows].mean(axis=(0, 1)) for mode in ("bands", "cycles"))
        assert eevee == pytest.approx(cycles, rel=0.03)


@pytest.mark.parametrize("mode", ["cycles", pytest.param("bands", marks=pytest.mark.slow)])
def test_a_seabed_that_ends_ends(mode, tmp_path):
    """With --no-scene-floor, and in the light too."""
    ended, shown = _open_water(mode, tmp_path, scene_floor=False)
    assert not shown
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    goes_on, shown = _open_water(mode, tmp_path)
    assert shown
    below = np.s_[11:]
    assert goes_on[below].mean() > 1.5 * ended[below].mean()
    assert goes_on[:8].mean() > 1.2 * ended[:8].mean()


def test_live_water_continues_the_seabed(registered, monkeypatch):
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    scene = bpy.context.scene
    ground = _plane(18.0)
    scenes.add_camera((0.0, 4.0, -DEPTH), (math.radians(90.0), 0.0, 0.0))
    water = scene.underwater
    water.bands, water.phase, water.diffuse_shadows = 3, "hg:0.8", False
    live.add(scene)
    (floor,) = (item for item in scene.objects if marks.FLOOR_DEPTH in item)
    assert not floor.hide_viewport
    assert floor.location.z == pytest.approx(-FLOOR - 0.01, abs=1e-4)
    ground.location.z = -FLOOR - 1.0
    bpy.context.view_layer.update()
    live_scenes.rebuild(scene)
    (floor,) = (item for item in scene.objects if marks.FLOOR_DEPTH in item)
    assert floor.location.z == pytest.approx(-FLOOR - 1.01, abs=1e-4)
    water.scene_floor = False
    live.update(scene)
    assert not problems.problem(scene)
    assert all(item.hide_viewport for item in scene.objects if marks.FLOOR_DEPTH in item)
