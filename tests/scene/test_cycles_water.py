"""Water goes into a scene, and out of it without a trace."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import uplift
from underwater_spectral.scene import marks
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.readers.lamps import lamps_of
from underwater_spectral.scene.water import cycles_water, pass_values, scene_water, water_body
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.illuminant import RELATIVE
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

FLAT = {"surface": "flat", "refractive_index": 1.34, "floor_depth": 9.0}


def _deeper(*tops, phase="hg:0.8"):
    phase = parse_phase(phase).for_bands(np.ones(3))
    return tuple(DeeperWater(top, 0.2 * top, 0.5, phase) for top in tops)


LAYERS = {"below": _deeper(2.0, 6.0)}


def _add(scene, **changes):
    column = columns.grey_column(0.05, 0.1, **changes)
    extent = water_body.water_extent(scene, column, 5.0)
    return cycles_water.add_water(
        scene,
        column,
        columns.layers_of(column, columns.henyey_greenstein(0.8)),
        extent,
        lamps_of(scene, column.bands, RELATIVE),
    )


@pytest.mark.parametrize("changes", [{}, FLAT, FLAT | LAYERS])
def test_removal_restores_every_value(changes):
    scene = scenes.varied_scene()
    before = snapshot.snapshot()
    assert _add(scene, **changes) == []
    during = snapshot.snapshot()
    scene_water.remove(scene)
    assert len(snapshot.differences(before, during)) > 100
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.parametrize("changes", [{}, FLAT])
def test_sunlight_is_not_left_to_rays_that_an_interface_turns_away(empty_blender, changes):
    _add(empty_blender, **changes)
    (sun,) = (o for o in marks.objects(empty_blender) if o.get(marks.IS_SUN))
    assert sun.data.cycles.use_multiple_importance_sampling == (not changes)


def test_removal_after_save_and_load(tmp_path):
    scenes.varied_scene()
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    before = snapshot.snapshot()
    _add(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert marks.has_water(bpy.context.scene)
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
    shining = [o.name for o in lamps if not o.hide_render]
    # The scene's own, an area and a point, are followed; its sun is not.
    assert shining == ["UW Sun", "UW Lamp", "UW Lamp.001"]
    assert scene.world.name == "UW Sky"


def test_deep_clear_water_has_a_bound():
    scene = scenes.varied_scene()
    extent = water_body.water_extent(scene, columns.grey_column(0.0, 0.0), 5.0)
    assert 1000.0 <= extent.half_width <= 6000.0
    assert extent.bottom <= 6000.0


def _boxes(scene):
    boxes = [item for item in marks.objects(scene) if item.name.startswith("UW Water")]
    heights = [[corner[2] for corner in item.bound_box] for item in boxes]
    return sorted((-max(z), -min(z)) for z in heights)


@pytest.mark.parametrize(("changes", "top"), [({}, 0.0), (FLAT, 0.01 * 2 / 3)])
def test_layers_lie_upon_each_other_without_a_gap_or_a_common_face(changes, top):
    scene = scenes.varied_scene()
    _add(scene, **changes, below=_deeper(2.0, 6.0, 1e5))
    boxes = _boxes(scene)
    assert len(boxes) == 3  # the fourth lies below all that can be seen
    assert boxes[0][0] == pytest.approx(top)
    for y, (_, end), (start, _) in zip((2.0, 6.0), boxes[:-1], boxes[1:], strict=True):
        assert y < start < end < y + 2e-3


def test_each_layer_reads_its_own_coefficients():
    scene = scenes.varied_scene()
    below = _deeper(2.0) + _deeper(6.0, phase="tthg:0.9,-0.5,0.75")
    column = columns.grey_column(0.1, 0.3, below=below)
    values = pass_values.PassValues.of_column(
        column, columns.layers_of(column, columns.henyey_greenstein(0.8))
    ).values
    by_layer = [("uw_absorption_0", 0.1), ("uw_scattering_0_0", 0.3)]
    by_layer += [("uw_absorption_1", 0.4), ("uw_scattering_1_0", 0.5)]
    by_layer += [
        ("uw_absorption_2", 1.2),
        ("uw_scattering_2_0", 0.375),
        ("uw_scattering_2_1", 0.125),
    ]
    for name, value in by_layer:
        np.testing.assert_allclose(values[name], value)
    cycles_water.add_water(
        scene,
        column,
        columns.layers_of(column, columns.henyey_greenstein(0.8)),
        water_body.water_extent(scene, column, 5.0),
    )
    read = {
        node.attribute_name
        for item in marks.objects(scene)
        for slot in item.material_slots
        for node in slot.material.node_tree.nodes
        if node.type == "ATTRIBUTE"
    }
    assert read == {name for name, _ in by_layer}


def test_water_reaches_as_far_as_in_its_clearest_layer():
    scene = scenes.varied_scene()
    clear, turbid = (
        water_body.water_extent(scene, columns.grey_column(a, 0.5), 5.0).half_width
        for a in (0.1, 1.0)
    )
    layered = columns.grey_column(1.0, 0.5, below=_deeper(0.5))
    assert clear == water_body.water_extent(scene, layered, 5.0).half_width > turbid


@pytest.mark.parametrize("changes", [{}, FLAT])
@pytest.mark.parametrize("strength", [0.0, 1.0])
def test_the_light_tree_is_for_more_lights_than_the_sun(empty_blender, changes, strength):
    """Nothing but the sun is sampled, unless something emits."""
    material = scenes.principled("lamp")
    material.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = strength
    _add(empty_blender, **changes)
    camera = scenes.add_camera((0.0, 0.0, -3.0), (0.0, 0.0, 0.0))
    before = empty_blender.cycles.use_light_tree
    with cycles_settings.reference_settings(empty_blender, camera, samples=1, seed=1):
        assert empty_blender.cycles.use_light_tree == (strength > 0.0)
    assert empty_blender.cycles.use_light_tree == before


def _shine(surface, inputs, tmp_path, *, color=1.0, indices_in_water=False):
    """Mean radiance of a plate below a sun of 1 W/m², in clear water or in none."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 8
    camera = scenes.add_camera((0.0, 0.0, -2.0), (0.0, 0.0, 0.0))
    camera.data.angle = math.radians(2.0)
    bpy.ops.mesh.primitive_plane_add(size=0.5, location=(0.0, 0.0, -6.0))
    material = scenes.principled("plate", (color, color, color, 1.0))
    for name, value in inputs.items():
        material.node_tree.nodes["Principled BSDF"].inputs[name].default_value = value
    bpy.context.object.data.materials.append(material)
    if surface is None:
        sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
        sun.data.energy = 1.0
        scene.collection.objects.link(sun)
    else:
        index = 1.0 if surface == "none" else 1.33
        column = columns.grey_column(1e-6, 0.0, surface=surface, refractive_index=index)
        phases = columns.layers_of(column, columns.henyey_greenstein(0.8))
        extent = water_body.water_extent(scene, column, 2.0)
        options = cycles_water.Options(indices_in_water=indices_in_water)
        cycles_water.add_water(scene, column, phases, extent, options=options)
        pass_values.PassValues.of_column(column, phases).apply(scene.view_layers[0], (0, 1, 2))
    with cycles_settings.reference_settings(scene, camera, samples=64, seed=1):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    image = read_exr(tmp_path / "a.exr")[0][..., 0]
    assert image.max() < 1.5 * image.mean()  # no fireflies
    return float(image.mean())


@pytest.mark.parametrize(
    "inputs",
    [
        {"Metallic": 1.0, "Roughness": 0.7},
        {"Metallic": 1.0, "Roughness": 0.3},
        {"Roughness": 0.3},
        {"Roughness": 0.8, "Coat Weight": 1.0, "Coat Roughness": 0.2},
    ],
    ids=["rough metal", "metal", "plastic", "varnish"],
)
def test_the_sun_shines_in_metal_and_varnish(inputs, tmp_path):
    """As in plain Blender. The sun was left out of all that shines: metal had nothing of it."""
    wanted = _shine(None, inputs, tmp_path)
    assert _shine("none", inputs, tmp_path) == pytest.approx(wanted, rel=0.01)
    assert _shine("flat", inputs, tmp_path) == pytest.approx(wanted, rel=0.01)


def test_plastic_mirrors_in_water_what_its_index_against_water_makes_it(tmp_path):
    """1.5 against 1.33 is 1.128: at normal incidence .36 % instead of 4 %."""
    inputs = {"Roughness": 0.3}
    dry = _shine("flat", inputs, tmp_path, color=0.0)
    wet = _shine("flat", inputs, tmp_path, color=0.0, indices_in_water=True)
    n = 1.5 / 1.33
    assert wet / dry == pytest.approx(((n - 1) / (n + 1)) ** 2 / 0.04, rel=0.02)


def test_what_has_no_gloss_has_none_in_water(tmp_path):
    """An index of 1 against 1.33 would mirror, and all that comes in at a flat angle."""
    inputs = {"Roughness": 0.3, "IOR": 1.0}
    dry = _shine("flat", inputs, tmp_path)
    wet = _shine("flat", inputs, tmp_path, indices_in_water=True)
    assert wet == pytest.approx(dry, rel=0.01)
