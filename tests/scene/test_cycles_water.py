"""Water goes into a scene, and out of it without a trace."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.node_groups import uplift
from underwater_spectral.scene import cycles_water, scene_water, water_body
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError

FLAT = {"surface": "flat", "refractive_index": 1.34, "floor_depth": 9.0}


def _add(scene, **changes):
    column = columns.grey_column(0.05, 0.1, **changes)
    extent = water_body.water_extent(scene, column, 5.0)
    return cycles_water.add_water(scene, column, columns.henyey_greenstein(0.8), extent)


@pytest.mark.parametrize("changes", [{}, FLAT])
def test_removal_restores_every_value(changes):
    scene = scenes.varied_scene()
    before = snapshot.snapshot()
    assert _add(scene, **changes) == [
        "lamps other than the sun do not light the water; they are hidden"
    ]
    during = snapshot.snapshot()
    scene_water.remove(scene)
    assert len(snapshot.differences(before, during)) > 100
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_removal_after_save_and_load(tmp_path):
    scenes.varied_scene()
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    before = snapshot.snapshot()
    _add(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert scene_water.has_water(bpy.context.scene)
    scene_water.remove(bpy.context.scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_snapshot_sees_a_change():
    scenes.varied_scene()
    before = snapshot.snapshot()
    bpy.data.materials["metal"].node_tree.nodes["Principled BSDF"].inputs[
        "Roughness"
    ].default_value = 0.123
    assert len(snapshot.differences(before, snapshot.snapshot())) == 1


def test_water_twice_is_refused():
    scene = scenes.varied_scene()
    _add(scene)
    with pytest.raises(InputError, match="has water already; remove it first"):
        _add(scene)


def test_removing_no_water_does_nothing():
    scene = scenes.varied_scene()
    before = snapshot.snapshot()
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_animation_moves_with_the_colour():
    _add(scenes.varied_scene())
    tree = bpy.data.materials["animated"].node_tree
    paths = {
        c.data_path for c in tree.animation_data.action.layers[0].strips[0].channelbags[0].fcurves
    }
    assert paths == {'nodes["Group"].inputs[0].default_value'}
    assert uplift.is_uplift(tree.nodes["Group"].node_tree)


def test_only_the_water_lights_the_scene():
    scene = scenes.varied_scene()
    _add(scene)
    lamps = [o for o in scene.objects if o.type == "LIGHT"]
    assert [o.name for o in lamps if not o.hide_render] == ["UW Sun"]
    assert scene.world.name == "UW Sky"


def test_deep_clear_water_has_a_bound():
    scene = scenes.varied_scene()
    extent = water_body.water_extent(scene, columns.grey_column(0.0, 0.0), 5.0)
    assert 1000.0 <= extent.half_width <= 6000.0
    assert extent.bottom <= 6000.0
