"""Water of several scenes, of copies, through undo and saving: each its own, and no trace left."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.scene import marks
from underwater_spectral.scene.water import (
    cycles_water,
    frame_water,
    realtime,
    scene_water,
    water_body,
)
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

PHASE = parse_phase("hg:0.8").for_bands(np.ones(3))
EXTENT = water_body.WaterExtent(50.0, 10.0)


def _water(a=0.05, b=0.1, **changes):
    floor = {"floor_depth": 9.0, "floor_reflectance": 0.3, "refractive_index": 1.34}
    column = columns.grey_column(a, b, **floor | changes)
    return frame_water.realtime_water(column, PHASE, 5.0, np.eye(3), shafts=True)


def _eevee(scene, a=0.05):
    return realtime.add_realtime(scene, _water(a), EXTENT)


def _cycles(scene, a=0.05):
    column = columns.grey_column(a, 0.1, surface="flat", refractive_index=1.34, floor_depth=9.0)
    return cycles_water.add_water(
        scene, column, columns.layers_of(column, columns.henyey_greenstein(0.8)), EXTENT
    )


MIRRORS = {
    _eevee: [
        f"material '{name}' mirrors; in real time it throws back the water's light as a matte "
        "object does"
        for name in ("metal", "mixed")
    ]
}
FILLINGS = pytest.mark.parametrize("fill", [_eevee, _cycles])


def _values(scene):
    return marks.part(scene, "uw_values")


def _numbers(scene):
    sockets = [s for n in _values(scene).nodes for s in (*n.inputs, *n.outputs)]
    return np.concatenate(
        [np.ravel(s.default_value) for s in sockets if hasattr(s, "default_value")]
    )


def _second_scene():
    """A scene of its own with a cube, a lamp and a world."""
    scene = bpy.data.scenes.new("second")
    cube = scenes._cube("second cube", (0.0, 5.0, -4.0))
    bpy.context.scene.collection.objects.unlink(cube)
    scene.collection.objects.link(cube)
    cube.data.materials.append(scenes.principled("second paint"))
    lamp = bpy.data.objects.new("second lamp", bpy.data.lights.new("second lamp", "SUN"))
    scene.collection.objects.link(lamp)
    scene.world = bpy.data.worlds.new("second world")
    return scene


@pytest.mark.parametrize(
    "fills",
    [
        (_cycles, _cycles),
        pytest.param((_eevee, _eevee), marks=pytest.mark.slow),
        pytest.param((_eevee, _cycles), marks=pytest.mark.slow),
    ],
)
def test_two_scenes_hold_different_water(fills):
    first = scenes.varied_scene()
    second = _second_scene()
    before = snapshot.snapshot()
    assert fills[0](first) == MIRRORS.get(fills[0], [])
    one = snapshot.snapshot()
    assert fills[1](second, a=0.5) == []
    scene_water.remove(second)
    assert snapshot.differences(one, snapshot.snapshot()) == []
    fills[1](second, a=0.5)
    scene_water.remove(first)
    assert marks.has_water(second)
    assert second.world.name != "second world"
    assert not bpy.data.objects["SUN lamp"].hide_render
    assert bpy.data.objects["second lamp"].hide_render
    scene_water.remove(second)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_values_of_two_scenes_are_apart():
    first = scenes.varied_scene()
    second = _second_scene()
    _eevee(first)
    _eevee(second, a=0.5)
    numbers = _numbers(second)
    assert not np.allclose(_numbers(first), numbers)
    realtime.set_values(first, _water(0.2, floor_depth=8.0))
    assert np.array_equal(_numbers(second), numbers)
    floors = [o.location.z for o in second.objects if "uw_floor_depth" in o]
    assert floors == pytest.approx([-9.0])


@FILLINGS
def test_what_a_second_scene_shares(fill):
    """One material cannot show two waters, but its colours follow the bands of either pass."""
    first = scenes.varied_scene()
    second = _second_scene()
    second.collection.objects.link(bpy.data.objects["measured"])
    second.collection.objects.link(bpy.data.objects["POINT lamp"])
    before = snapshot.snapshot()
    dry = len(bpy.data.materials["measured"].node_tree.nodes)
    fill(first)
    notes = fill(second)
    if fill is _eevee:
        (note,) = notes
        assert "'measured' are also in scene 'Scene'" in note
    else:
        assert notes == []
    scene_water.remove(first)
    assert bpy.data.objects["POINT lamp"].hide_render
    assert not bpy.data.objects["AREA lamp"].hide_render
    wet = len(bpy.data.materials["measured"].node_tree.nodes) > dry
    assert wet == (fill is _cycles)
    scene_water.remove(second)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@FILLINGS
def test_copies_of_objects_and_materials_leave_no_trace(fill):
    scene = scenes.varied_scene()
    fill(scene)
    copies = []
    for item in list(scene.objects):
        copy = item.copy()
        if item.data is not None:
            copy.data = item.data.copy()
        for slot in copy.material_slots:
            if slot.material is not None:
                slot.material = slot.material.copy()
        for collection in item.users_collection:
            collection.objects.link(copy)
        copies.append((item.name, copy.name, MARK in item))
    moved = bpy.data.objects[next(copy for _, copy, ours in copies if ours)]
    scene.collection.objects.link(moved)
    marks.collection_of(scene).objects.unlink(moved)
    scene_water.remove(scene)
    for original, copy, ours in copies:
        assert (copy in bpy.data.objects) == (original in bpy.data.objects) == (not ours)
        if not ours:
            assert bpy.data.objects[copy].hide_render == bpy.data.objects[original].hide_render
    blocks = [block for name in dir(bpy.data) for block in _blocks(name)]
    keys = {key for block in blocks for key in block.keys()}  # noqa: SIM118
    assert {key for key in keys if key.startswith("uw_")} == _USERS
    originals = [m for m in bpy.data.materials if not m.name.endswith(".001")]
    for material in originals:
        copy = bpy.data.materials[f"{material.name}.001"]
        assert len(copy.node_tree.nodes) == len(material.node_tree.nodes) <= 4


_USERS = {"uw_reflectance", "uw_reflectance_wavelengths_nm"}


def _blocks(name):
    found = getattr(bpy.data, name)
    listed = isinstance(found, bpy.types.bpy_prop_collection) and name != "all_ids"
    return [b for b in found if isinstance(b, bpy.types.ID)] if listed else []


@pytest.mark.slow_but_first
@FILLINGS
@pytest.mark.parametrize("kind", ["LINK_COPY", "FULL_COPY"])
@pytest.mark.parametrize("copy_first", [False, True])
def test_copies_of_a_scene(fill, kind, copy_first):
    """Each copy keeps its water until its own is removed; then nothing is left."""
    scene = scenes.varied_scene()
    scene.frame_set(1)
    dry = snapshot.snapshot()
    fill(scene)
    bpy.ops.scene.new(type=kind)
    copy = bpy.context.scene
    assert copy != scene
    assert marks.has_water(copy)
    pair = (copy, scene) if copy_first else (scene, copy)
    scene_water.remove(pair[0])
    assert not marks.has_water(pair[0])
    assert marks.has_water(pair[1])
    assert pair[0].world.name == "own world"
    assert "UW" in pair[1].world.name
    assert any(MARK in item for item in pair[1].objects)
    materials = bpy.data.materials["textured"].node_tree
    assert len(materials.nodes) > 3
    scene_water.remove(pair[1])
    assert not [w for w in bpy.data.worlds if w.name.startswith("UW")]
    bpy.data.scenes.remove(copy)
    if kind == "FULL_COPY":
        for item in [o for o in bpy.data.objects if not o.users_collection]:
            bpy.data.batch_remove([b for b in (item, item.data) if b is not None])
        bpy.data.orphans_purge(do_recursive=True)
    after = [
        line for line in snapshot.differences(dry, snapshot.snapshot()) if ".users:" not in line
    ]
    assert after == []


def test_a_full_copy_gets_water_of_its_own():
    scene = scenes.varied_scene()
    water = _water()
    realtime.add_realtime(scene, water, EXTENT)
    bpy.ops.scene.new(type="FULL_COPY")
    copy = bpy.context.scene
    assert realtime.fits(scene, water)
    assert not realtime.fits(copy, water)
    scene_water.remove(copy)
    (note,) = realtime.add_realtime(copy, water, EXTENT)[:1]
    assert "are also in scene 'Scene'" in note
    assert _values(copy) != _values(scene)


@FILLINGS
def test_undo_and_redo_across_adding_and_removing(fill):
    bpy.context.preferences.edit.use_global_undo = True
    scenes.varied_scene()
    bpy.context.view_layer.update()
    for message in ("dry", "the same"):
        bpy.ops.ed.undo_push(message=message)
    bpy.ops.ed.undo()  # a step that was read back counts users otherwise
    dry = snapshot.snapshot()
    fill(bpy.context.scene)
    bpy.ops.ed.undo_push(message="wet")
    bpy.ops.ed.undo()
    assert snapshot.differences(dry, snapshot.snapshot()) == []
    bpy.ops.ed.redo()
    assert marks.has_water(bpy.context.scene)
    scene_water.remove(bpy.context.scene)
    assert snapshot.differences(dry, snapshot.snapshot()) == []
    bpy.ops.ed.undo_push(message="dry again")
    bpy.ops.ed.undo()
    assert marks.has_water(bpy.context.scene)
    scene_water.remove(bpy.context.scene)
    assert snapshot.differences(dry, snapshot.snapshot()) == []


@FILLINGS
def test_names_that_are_taken(fill, tmp_path):
    """The user's own data-blocks may bear the names of ours, before and after reloading."""
    scene = scenes.varied_scene()
    names = ("UW Values", "UW Surface of Bands", "UW Reflectance of Bands", "UW Emission of Bands")
    for name in names:
        bpy.data.node_groups.new(name, "ShaderNodeTree").use_fake_user = True
    for name in ("UW Caustics", "UW Slopes"):
        bpy.data.images.new(name, 4, 4).use_fake_user = True
    scene.collection.children.link(bpy.data.collections.new("Underwater"))
    lamp = bpy.data.objects.new("UW Sun", bpy.data.lights.new("UW Sun", "SUN"))
    bpy.data.collections["Underwater"].objects.link(lamp)
    bpy.data.objects["metal" if "metal" in bpy.data.objects else "two slots"].name = "UW Floor"
    bpy.data.materials["metal"].name = "UW Floor"
    scene.world.name = "UW Sky"
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    before = snapshot.snapshot()
    fill(bpy.context.scene)
    assert bpy.data.objects["UW Sun"].hide_render
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert marks.has_water(bpy.context.scene)
    scene_water.remove(bpy.context.scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@FILLINGS
def test_what_the_user_puts_among_the_water_stays(fill):
    scene = scenes.varied_scene()
    fill(scene)
    water = marks.collection_of(scene)
    cube, other = (scenes._cube(name, (0.0, 0.0, -3.0)) for name in ("left here", "in both"))
    for item in (cube, other):
        water.objects.link(item)
    scene.collection.objects.unlink(cube)
    child = bpy.data.collections.new("child")
    water.children.link(child)
    world = scene.world = bpy.data.worlds.new("new world")
    scene_water.remove(scene)
    assert {cube.name, other.name} <= set(scene.collection.objects.keys())
    assert child.name in scene.collection.children
    assert scene.world == world


@FILLINGS
def test_a_wet_scene_that_is_deleted_is_cleared_up(fill):
    scene, second = scenes.varied_scene(), None
    second = _second_scene()
    fill(second)
    bpy.data.scenes.remove(second)
    fill(scene)
    scene_water.remove(scene)
    assert not [c for c in bpy.data.collections if MARK in c]
    assert not [o for o in bpy.data.objects if MARK in o]
    assert len(bpy.data.materials["second paint"].node_tree.nodes) == 2


def test_a_linked_scene_is_refused(tmp_path):
    _second_scene()
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.scenes = ["second"]
    before = snapshot.snapshot()
    for fill in (_eevee, _cycles):
        with pytest.raises(InputError, match="linked from another file"):
            fill(bpy.data.scenes["second"])
    assert snapshot.differences(before, snapshot.snapshot()) == []
