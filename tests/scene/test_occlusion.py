"""Occlusion between objects: steady while a camera moves, the same from the cache, gone with it."""

from __future__ import annotations

import itertools

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks._occlusion_scenes import pool
from underwater_spectral.scene import marks
from underwater_spectral.scene.readers import surroundings
from underwater_spectral.scene.readers.cameras import eye_of
from underwater_spectral.scene.readers.surroundings import look_around
from underwater_spectral.scene.session import is_live
from underwater_spectral.scene.terms import eevee_water
from underwater_spectral.scene.viewport import changes, live, problems
from underwater_spectral.scene.water import occlusion
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.occlusion import filled_voxels
from underwater_spectral.uw_spectral.occlusion.occlusion_table import IRRADIANCE, SCATTERED

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)

BELOW = np.array([(x, y, z) for x in (-1.6, 0.3, 1.4) for y in (-1.2, 1.1) for z in (-7.3, -6.1)])


@pytest.fixture(autouse=True)
def _registered(registered, monkeypatch):
    monkeypatch.setattr(surroundings, "PROBES", 1500)
    monkeypatch.setattr(surroundings, "_COARSE", 60_000)
    return registered


def _block(name, at, size):
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=at)
    item = bpy.context.object
    item.name, item.scale = name, size
    item.data.materials.append(scenes.principled(name))
    return item


def _under_a_slab(size=7.0):
    """A camera before a slab over sand, and an object below it."""
    scene = bpy.context.scene
    _block("slab", (0.0, 0.0, -4.6), (size, size, 0.4))
    _block("sand", (0.0, 0.0, -8.3), (60.0, 60.0, 0.4))
    _block("fish", (0.4, -0.6, -6.6), (1.2, 0.5, 0.5))
    camera = scenes.add_camera()
    camera.location, camera.rotation_euler = (0.5, -6.0, -6.4), (np.pi / 2, 0.0, 0.0)
    bpy.context.view_layer.update()
    return scene


def _plan(**settings):
    return make_plan(SceneSettings(bands=3, phase="hg:0.9", **settings))


def _table(scene, plan, path=(), cache=None):
    around = (cache or occlusion.Cache()).look(scene, scene.camera, plan.column, path)
    weights = plan.reduction(6.0).weights
    return occlusion.table_of(around, plan.bands, plan.solved_field(), weights, 6.0, cache)


def _read(table):
    ways = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)]
    return np.concatenate(
        [
            table.mixed(first, BELOW, np.tile(w, (len(BELOW), 1)))[:, 0]
            for first in (IRRADIANCE, SCATTERED)
            for w in ways
        ]
    )


def _moved(scene, step):
    scene.camera.location = np.array((0.5, -6.0, -6.4)) + step * np.array((0.11, 0.23, 0.07))
    scene.camera.rotation_euler.z = 0.05 * step
    bpy.context.view_layer.update()


@pytest.mark.slow_but_first
@pytest.mark.parametrize("size", [7.0, 20.0])
def test_occlusion_is_steady_while_the_camera_moves(size):
    """With cells that follow the camera it changes by a tenth and more."""
    scene, plan, path, read = _under_a_slab(size), _plan(), [], []
    for step in range(6):
        _moved(scene, step)
        path.append(eye_of(scene.camera))
    cache = occlusion.Cache()
    for step in range(6):
        _moved(scene, step)
        read.append(_read(_table(scene, plan, path, cache)))
    assert read[0].min() < 0.5, "there is shade"
    for one, other in itertools.pairwise(read):
        np.testing.assert_allclose(one, other, rtol=1e-3)


@pytest.mark.slow
def test_a_view_keeps_the_cells_of_a_lattice():
    scene, plan = _under_a_slab(20.0), _plan()
    grids = []
    for step in range(8):
        _moved(scene, step)
        grids.append(_table(scene, plan).grid)
    assert len({(grid.cell, grid.anchor) for grid in grids}) == 1
    for grid in grids:
        places = np.subtract(grid.lower, grid.anchor) / grid.cell
        assert np.allclose(places, grid.first, atol=1e-9)


def test_a_long_path_has_larger_cells_rather_than_a_grid_per_frame():
    """It was so in the example's cave: occlusion changed by half from frame to frame."""
    y = np.linspace(-19.0, 19.0, 48)
    path = np.stack([2.5 * np.sin(y / 6.0), y, np.full(48, -12.0)], axis=1)
    ahead = np.tile([0.0, 0.3, 0.0], (48, 1))
    low, high = np.array([-18.6, -22.6, -15.6]), np.array([20.6, 22.6, -6.3])
    grids = {
        surroundings._near(low, high, np.roll(path, k, axis=0), ahead) for k in range(0, 48, 6)
    }
    assert len(grids) == 1
    assert surroundings.PROBES < grids.pop().count <= surroundings.PATH_PROBES


def _off(one, other):
    """Largest difference of two tables' means, of what is less than 2 % of it that."""
    tiles = [table.atlas[..., 0] / table.atlas[:, :, :1, :1, :1, 0] for table in (one, other)]
    return float((np.abs(tiles[0] - tiles[1]) / np.maximum(tiles[1], 0.02)).max())


@pytest.mark.slow
def test_what_is_kept_changes_next_to_nothing_however_long_it_swims():
    """Some 100 frames do not drift from what each is by itself."""
    scene, plan, cache = _under_a_slab(), _plan(), occlusion.Cache()
    fish, most, moved = bpy.data.objects["fish"], 0.0, []
    for frame in range(100):
        turn = 0.13 * frame
        fish.location = (1.5 * np.cos(turn), -0.6 + np.sin(turn), -6.4 + 0.4 * np.sin(2.1 * turn))
        bpy.context.view_layer.update()
        table = _table(scene, plan, cache=cache)
        if frame % 14 == 13:
            fresh = _table(scene, plan)
            most = max(most, _off(table, fresh))
            moved.append(fresh)
    assert _off(moved[1], moved[-1]) > 0.1, "it does change the light"
    assert most < 0.005


def test_frames_of_a_job_are_the_same_whatever_was_rendered_before():
    """A process that takes over begins with the first frame, too."""
    scene, plan = _under_a_slab(), _plan()
    fish, tables = bpy.data.objects["fish"], []
    for order in ((0.4, 1.3, 0.9), (0.4, 0.9)):
        cache = occlusion.Cache(of_job=True)
        for x in order:
            fish.location.x = x
            bpy.context.view_layer.update()
            table = _table(scene, plan, cache=cache)
        tables.append(table)
    np.testing.assert_array_equal(tables[0].atlas, tables[1].atlas)
    np.testing.assert_array_equal(tables[0].spectra, tables[1].spectra)


def test_nothing_is_computed_again_where_nothing_has_moved(monkeypatch):
    scene, plan, cache = _under_a_slab(), _plan(), occlusion.Cache()
    _table(scene, plan, cache=cache)
    monkeypatch.setattr(occlusion, "probe_irradiance", None)
    _table(scene, plan, cache=cache)
    bpy.data.objects["fish"].location.x = 1.3
    bpy.context.view_layer.update()
    with pytest.raises(TypeError):
        _table(scene, plan, cache=cache)


def test_a_small_object_fills_no_voxel_but_a_wall_of_them_does():
    scene, plan = _under_a_slab(), _plan()
    fry = _block("fry", (0.0, -2.0, -6.0), (0.06, 0.03, 0.03))
    clearest = float(plan.column.attenuation.min())

    def full():
        bpy.context.view_layer.update()
        voxels, _ = look_around(scene, scene.camera, clearest).under_objects()
        off = np.abs(voxels.grid.centres() - [0.0, -2.0, -6.0]).max(axis=1)
        return (voxels.number.ravel()[off < 0.6] >= 0).any()

    assert not full()
    fry.scale *= 15.0
    assert full()
    fry.scale /= 15.0
    for x, z in np.ndindex(8, 8):
        _block("brick", (0.08 * (x - 4), -2.0, -6.0 + 0.08 * (z - 4)), (0.09, 0.09, 0.09))
    assert full()


def test_a_small_overhang_close_to_the_camera_is_found():
    """Its room is half a metre high; farther away, where voxels are larger, it does not count."""
    scene, plan = bpy.context.scene, _plan()
    _block("sand", (0.0, 0.0, -8.3), (60.0, 60.0, 0.4))
    camera = scenes.add_camera()
    camera.rotation_euler = (np.pi / 2, 0.0, 0.0)
    _block("shelf", (0.0, 0.0, -7.45), (1.4, 1.4, 0.1))
    found = []
    for y in (-4.0, -25.0):
        camera.location = (0.0, y, -6.5)
        bpy.context.view_layer.update()
        around = look_around(scene, camera, float(plan.column.attenuation.min()))
        found.append(around.under_objects())
    assert found[1] is None
    assert found[0] is not None
    grid = found[0][1]
    assert grid.inside((0.0, 0.0, -7.8))
    # Nothing else overhangs, and below the sand, which ends, there is nothing.
    assert grid.upper[0] - grid.lower[0] < 8.0
    assert grid.lower[2] > -9.6


@pytest.mark.slow
def test_between_tall_walls_there_is_occlusion_without_a_roof_and_it_is_steady():
    scene, plan, read = bpy.context.scene, _plan(), []
    _block("sand", (0.0, 0.0, -8.3), (60.0, 60.0, 0.4))
    walls = [_block("wall", (2.0 * side, 0.0, -5.9), (2.0, 9.0, 4.8)) for side in (-1.0, 1.0)]
    scene.camera = scenes.add_camera((0.2, -6.0, -6.4), (np.pi / 2, 0.0, 0.0))
    for step in range(3):
        scene.camera.location.y = -6.0 + 0.15 * step
        bpy.context.view_layer.update()
        read.append(_table(scene, plan))
    between, up = np.array([(0.0, 0.0, -7.4), (0.0, 0.0, -6.4)]), np.array([[0.0, 0.0, 1.0]] * 2)
    light = [table.mixed(IRRADIANCE, between, up)[:, 0] for table in read]
    assert (light[0] < 0.7).all()
    for one in light[1:]:
        np.testing.assert_allclose(one, light[0], rtol=1e-3)
    for wall in walls:
        wall.scale.z, wall.location.z = 1.0, -7.6
    bpy.context.view_layer.update()
    around = look_around(scene, scene.camera, 0.1)
    low, high = around.coarse.between_objects(around.eyes)
    assert not (high > low).all(), "low walls"


def _balls(away=0.0):
    """Nine dark balls of .7 m on sand at 6 m, a metre apart."""
    dark = scenes.principled("dark", (0.05, 0.05, 0.05, 1.0))
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 0.0, -6.0))
    for x, y in itertools.product((-1, 0, 1), repeat=2):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.35, location=(x, y + away, -5.65))
        bpy.context.object.data.materials.append(dark)
    bpy.context.scene.camera = scenes.add_camera((0.0, -2.6, -4.1), (1.05, 0.0, 0.0))
    bpy.context.view_layer.update()
    return bpy.context.scene


def test_objects_that_stand_on_the_ground_shade_it():
    """Brown balls on bright sand were 1.4 times as bright as in Cycles."""
    plan = make_plan(SceneSettings(bands=3, floor_depth=6.0, floor_reflectance="0.8"))
    table = _table(_balls(), plan)
    between = np.array([(0.5, 0.5, -6.0), (-0.5, 0.5, -6.0)])
    light = table.on_patches(between, np.tile((0.0, 0.0, 1.0), (2, 1)))[:, 0]
    assert (light < 0.93).all()
    far = table.on_patches(np.array([[9.0, 9.0, -6.0]]), np.array([[0.0, 0.0, 1.0]]))[0, 0]
    assert far > 0.98


def test_objects_far_off_do_not():
    scene = _balls(away=14.0)
    assert look_around(scene, scene.camera, 0.1).under_objects() is None


def test_occlusion_reaches_down_to_a_camera_below_an_object():
    """It ended 2 m below what hangs in open water, so that the sun shone through a cube."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(0.0, 0.0, -4.0))
    below = scenes.add_camera((0.0, 0.0, -11.0), (np.pi, 0.0, 0.0))
    beside = scenes.add_camera((9.0, 0.0, -11.0), (np.pi, 0.0, 0.0))
    bpy.context.view_layer.update()
    grids = [look_around(scene, camera, 0.1).under_objects()[1] for camera in (below, beside)]
    assert grids[0].lower[2] < -11.5
    assert -8.5 < grids[1].lower[2] < -7.0


@pytest.mark.slow_but_first
@pytest.mark.parametrize("height", [-3.0, -6.4])
def test_an_added_floor_lies_below_objects_as_sand_does(monkeypatch, height):
    """What came from it was as bright below a roof as beside it, twice and more what it was."""
    monkeypatch.setattr(surroundings, "PROBES", 6000)
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    scene, read = _under_a_slab(), []
    scene.camera.location.z = height
    sand = bpy.data.objects["sand"]
    sand.active_material.node_tree.nodes["Principled BSDF"].inputs[0].default_value = [0.7] * 4
    bpy.context.view_layer.update()
    plan = _plan(floor_depth=8.1, floor_reflectance="0.7")
    read.append(_read(_table(scene, plan)))
    bpy.data.objects.remove(sand)
    read.append(_read(_table(scene, plan)))
    assert read[0].min() < 0.5, "there is shade"
    np.testing.assert_allclose(*read, rtol=0.02, atol=0.005)


def _slab_alone(size, height, **settings):
    """What is around a camera and a slab at 4.6 m, without sand."""
    scene = _under_a_slab(size)
    bpy.data.objects.remove(bpy.data.objects["sand"])
    scene.camera.location.z = height
    bpy.context.view_layer.update()
    return occlusion.Cache().look(scene, scene.camera, _plan(**settings).column)


def test_a_pool_is_in_the_grid_with_its_walls_up_to_the_surface(monkeypatch):
    """Its walls were just outside, so that it was as dark as they without each other's light."""
    monkeypatch.setattr(surroundings, "PROBES", 6000)
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    camera = pool()
    plan = make_plan(SceneSettings(bands=3, water="jerlov:I"))
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    voxels, grid = occlusion.Cache().look(scene, camera, plan.column).under_objects()
    assert (np.abs([grid.lower[:2], grid.upper[:2]]) > [2.5, 5.0]).all()
    assert grid.upper[2] == pytest.approx(0.0)
    assert len(voxels) > 0
    table = _table(scene, plan)
    on_bottom = table.on_patches(np.array([[0.0, 0.0, -3.0]]), np.array([[0.0, 0.0, 1.0]]))
    assert on_bottom[0, 0] > 1.5, "white tiles light one another"


def test_a_tank_is_in_a_grid_of_small_cells(monkeypatch):
    """Its walls were too thin and too low for one, and red was at half of what it is."""
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    for side in (-1.0, 1.0):
        _block("long", (0.55 * side, 0.0, -0.45), (0.1, 2.2, 1.1))
        _block("short", (0.0, 1.05 * side, -0.45), (1.0, 0.1, 1.1))
    camera = scenes.add_camera()
    camera.location, camera.rotation_euler = (-0.2, -0.8, -0.5), (np.pi / 2, 0.0, 0.0)
    bpy.context.view_layer.update()
    plan = _plan(floor_depth=1.0)
    _, grid = occlusion.Cache().look(bpy.context.scene, camera, plan.column).under_objects()
    assert grid.cell < 0.2
    assert (np.abs([grid.lower[:2], grid.upper[:2]]) > [0.55, 1.05]).all()
    assert grid.upper[2] == pytest.approx(0.0)


def test_nets_are_among_the_surfaces_with_what_they_cover():
    """They let all light through that is not the sun's, and leaves of a little more none."""
    scene = _under_a_slab(12.0)
    shader = bpy.data.materials["slab"].node_tree.nodes["Principled BSDF"]
    for alpha, coverage in ((0.7, [0.7]), (0.3, [0.3]), (0.02, [])):
        shader.inputs["Alpha"].default_value = alpha
        surfaces = look_around(scene, scene.camera, 0.1).surfaces
        found = [s.coverage[0] for s in surfaces if s.coverage[0] < 1.0]
        assert found == pytest.approx(coverage)


def test_a_wide_roof_far_from_the_eyes_has_a_grid_of_large_cells(monkeypatch):
    monkeypatch.setattr(surroundings, "PROBES", 6000)
    low, high = np.array([-14.0, -14.0, -7.1]), np.array([14.0, 14.0, 0.0])
    eyes, ahead = np.array([[0.0, 0.0, -5.0]]), np.array([[0.0, 1.0, 0.0]])
    cut, whole = (surroundings._near(low, high, eyes, ahead, clear=clear) for clear in (1.0, 5.0))
    assert cut.upper[0] < 12.0
    assert cut.cell < 0.75
    assert whole.upper[0] >= 14.0
    assert whole.cell < 5.0 / 3.0


def test_an_added_floor_is_not_filled_again_where_nothing_has_moved(monkeypatch):
    scene, cache, filled = _under_a_slab(), occlusion.Cache(), []
    bpy.data.objects.remove(bpy.data.objects["sand"])
    bpy.context.view_layer.update()
    fill = filled_voxels._fill
    monkeypatch.setattr(filled_voxels, "_fill", lambda *given: filled.append(1) or fill(*given))
    for more in (True, False):
        around = cache.look(scene, scene.camera, _plan(floor_depth=8.1).column)
        assert around.under_objects() is not None
        assert bool(filled) == more
        filled.clear()


def test_what_is_above_the_cameras_is_no_seabed():
    """Under a floe of 20 m in deep water there was a seabed .3 m below the camera."""
    assert _slab_alone(20.0, -6.4).ground is None
    assert _slab_alone(20.0, -3.0).ground is not None


def test_a_roof_over_an_added_floor_is_no_ground():
    """Below it there was no water, where most of the floor about a camera lay under it."""
    for depth in (12.0, 90.0):
        around = _slab_alone(9.0, -3.0, floor_depth=depth)
        assert around.ground is None
        assert around.coarse.reachable([])[around.coarse.roofed].any()
    assert _slab_alone(40.0, -3.0, floor_depth=90.0).ground is not None


@pytest.mark.slow_but_first
@pytest.mark.parametrize("cuts", [1, 64])
def test_a_larger_seabed_changes_nothing(cuts):
    """From 3 km on, the ground below a roof had holes."""
    scene, found = _under_a_slab(), []
    bpy.data.objects.remove(bpy.data.objects["sand"])
    for size in (60.0, 1000.0, 4000.0, 20_000.0):
        bpy.ops.mesh.primitive_grid_add(
            x_subdivisions=cuts, y_subdivisions=cuts, size=size, location=(0.0, 0.0, -8.1)
        )
        around = look_around(scene, scene.camera, 0.1)
        found.append((around.ground, *around.under_objects()))
        bpy.data.objects.remove(bpy.context.object)
    ground, voxels, grid = found[0]
    for other, larger, cells in found[1:]:
        assert (other, cells) == (ground, grid)
        np.testing.assert_array_equal(larger.number, voxels.number)


@pytest.mark.slow
def test_removal_leaves_no_trace_of_occlusion():
    scene = _under_a_slab()
    before = snapshot.snapshot()
    live.add(scene)
    image = marks.part(scene, "uw_shade")
    assert image.size[0] > 24, "there is a table"
    live.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.slow
def test_undo_takes_the_occlusion_out():
    bpy.context.preferences.edit.use_global_undo = True
    _under_a_slab()
    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.underwater.add_water("EXEC_DEFAULT", True) == {"FINISHED"}
    assert marks.part(bpy.context.scene, "uw_shade").size[0] > 24
    bpy.ops.ed.undo()
    assert not is_live(bpy.context.scene)
    assert not [image for image in bpy.data.images if image.name.startswith("UW")]
    # And it can come back.
    assert bpy.ops.underwater.add_water("EXEC_DEFAULT", True) == {"FINISHED"}
    assert marks.part(bpy.context.scene, "uw_shade").size[0] > 24


@pytest.mark.slow
def test_a_hasty_update_does_not_look_around(monkeypatch):
    """A slider that is dragged keeps the occlusion, and the ground that belongs to it."""
    scene = _under_a_slab()
    live.add(scene)
    column = _floors(monkeypatch)
    monkeypatch.setattr(occlusion, "look_around", None)
    scene.underwater.scattering_factor = 1.3
    assert live.update(scene, hasty=True)
    assert not problems.problem(scene)
    assert changes.is_stale(scene)
    assert column
    assert np.isfinite(column).all()


@pytest.mark.parametrize(("of_job", "looks"), [(True, [1, 1, 2]), (False, [1, 2, 3])])
def test_a_job_looks_around_once_a_frame(of_job, looks, monkeypatch):
    """For its light, its floor and the note of a floor; what is live moves within a frame."""
    scene, plan, found = _under_a_slab(), _plan(), []

    def noted(*given):
        found.append(given)
        return look_around(*given)

    monkeypatch.setattr(occlusion, "look_around", noted)
    cache, counts = occlusion.Cache(of_job=of_job), []
    for frame in (1, 1, 2):
        scene.frame_set(frame)
        cache.look(scene, scene.camera, plan.column)
        counts.append(len(found))
    assert counts == looks
    assert cache.ground is not None


def _floors(monkeypatch):
    """Depths of the floors that are drawn from now on."""
    found, before = [], eevee_water.realtime_water

    def noted(column, *rest, **more):
        found.append(column.floor_depth)
        return before(column, *rest, **more)

    monkeypatch.setattr(eevee_water, "realtime_water", noted)
    return found


@pytest.mark.slow
def test_what_is_kept_does_not_grow():
    scene, plan, cache = _under_a_slab(), _plan(), occlusion.Cache()
    fish, sizes = bpy.data.objects["fish"], []
    for frame in range(9):
        fish.location.x = 0.4 + 0.15 * frame
        bpy.context.view_layer.update()
        _table(scene, plan, cache=cache)
        sizes.append(len(cache.samples))
    assert sizes[-1] == sizes[1]
    assert len(cache._waters._known) <= 2
    # What starts from the first frame holds nothing of those between.
    assert not cache._last[1].solution.parts or cache._last[1] is cache._first[2]
