"""Objects without a material, and objects that come after the water, are in it as all others."""

from __future__ import annotations

import functools

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.materials import bare_surfaces
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot


def _surfaces(material):
    """The groups of water behind a material."""
    return {n.node_tree for n in material.node_tree.nodes if "uw_muted" in n}


def _filled(scene):
    """Put live water into a scene; return what the file held before."""
    scene.underwater.diffuse_shadows = False
    bpy.context.view_layer.update()
    before = snapshot.snapshot()
    live.add(scene)
    bpy.context.view_layer.update()
    return before


def _wall(*materials):
    item = scenes._cube("wall", (0.0, 6.0, -5.0))
    item.scale = (6.0, 1.0, 6.0)
    for material in materials:
        item.data.materials.append(material)
    return item


@pytest.mark.slow
@pytest.mark.parametrize("slots", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_without_a_material_objects_are_blenders_grey_in_water(empty_blender, slots):
    scene = empty_blender
    camera = scene.camera = scenes.add_camera((0.0, 0.0, -5.0))
    scene.render.resolution_x, scene.render.resolution_y = 16, 9
    scene.render.resolution_percentage = 100
    wall = _wall(*[None] * slots)
    plan = render_plan.make_plan(
        SceneSettings(water="jerlov:IB", bands=3, samples=4, surface="none", diffuse_shadows=False)
    )

    def picture(opened):
        with opened as engine:
            return grey_scene.band_image(engine, plan, 5.0)[2:7, 5:11].mean(axis=(0, 1))

    bpy.context.view_layer.update()
    extent = water_body.water_extent(scene, plan.column, 5.0)
    eevee = functools.partial(engines.eevee_bands, scene, camera, plan, extent, 5.0)
    cycles = functools.partial(engines.cycles_bands, scene, camera, plan, extent, seed=1)
    before = snapshot.snapshot()
    bare, traced = picture(eevee()), picture(cycles())
    assert snapshot.differences(before, snapshot.snapshot()) == []
    wall.data.materials.clear()
    wall.data.materials.append(scenes.principled("grey", (0.8, 0.8, 0.8, 1.0)))
    grey = picture(eevee())
    np.testing.assert_allclose(bare, grey, rtol=1e-4)
    # Cycles knows what stands in, and so what it has to be.
    np.testing.assert_allclose(traced, picture(cycles()), rtol=1e-4)


def test_what_comes_into_live_water_gets_wet(registered):
    scene = registered
    scenes.add_camera((0.0, 0.0, -5.0))
    _wall(scenes.principled("paint"))
    before = _filled(scene)
    (surface,) = _surfaces(bpy.data.materials["paint"])
    bpy.ops.mesh.primitive_monkey_add(location=(1.0, 5.0, -5.0))
    monkey = bpy.context.object
    bpy.context.view_layer.update()
    (stand_in,) = monkey.data.materials
    assert bare_surfaces.STANDS_IN in stand_in
    assert _surfaces(stand_in) == {surface}
    # A material of its own takes its place, and gets wet too.
    fur = scenes.principled("fur")
    monkey.material_slots[0].material = fur
    monkey.update_tag()
    bpy.context.view_layer.update()
    assert _surfaces(fur) == {surface}
    live.remove(scene)
    assert not _surfaces(fur)
    assert list(monkey.data.materials) == [fur]
    mesh = monkey.data
    bpy.data.objects.remove(monkey)
    bpy.data.meshes.remove(mesh)
    bpy.data.materials.remove(fur)
    bpy.context.view_layer.update()
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_shared_meshes_and_slots_of_objects_get_theirs_back(registered):
    scene = registered
    scenes.add_camera((0.0, 0.0, -5.0))
    one = _wall()
    other = one.copy()
    third = _wall(scenes.principled("paint"))
    third.material_slots[0].link = "OBJECT"
    scene.collection.objects.link(other)
    before = _filled(scene)
    assert one.material_slots[0].material == third.material_slots[0].material
    assert other.active_material == one.active_material
    live.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    assert not [m for m in bpy.data.materials if m.name.startswith(bare_surfaces.NAME)]


def _made_by_nodes(item, *, instances):
    """Let geometry nodes make a cube in place of a mesh, or an instance of one."""
    tree = bpy.data.node_groups.new("made", "GeometryNodeTree")
    tree.is_modifier = True
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    made, end = tree.nodes.new("GeometryNodeMeshCube"), tree.nodes.new("NodeGroupOutput")
    last = made.outputs[0]
    if instances:
        points = tree.nodes.new("GeometryNodePoints")
        node = tree.nodes.new("GeometryNodeInstanceOnPoints")
        tree.links.new(points.outputs[0], node.inputs["Points"])
        tree.links.new(last, node.inputs["Instance"])
        last = node.outputs[0]
    tree.links.new(last, end.inputs[0])
    item.modifiers.new("made", "NODES").node_group = tree


@pytest.mark.slow
@pytest.mark.parametrize("instances", [False, True])
def test_what_nodes_make_of_nothing_gets_a_material(registered, instances):
    scene = registered
    scenes.add_camera((0.0, 0.0, -5.0))
    wall = _wall(scenes.principled("paint"))
    _made_by_nodes(wall, instances=instances)
    before = _filled(scene)
    shown = wall.evaluated_get(bpy.context.evaluated_depsgraph_get()).evaluated_geometry()
    if instances:
        assert len(wall.modifiers) == 1
    else:
        (stand_in,) = filter(None, shown.mesh.materials)
        assert bare_surfaces.STANDS_IN in stand_in
        assert _surfaces(stand_in.original)
    live.remove(scene)
    bpy.context.view_layer.update()
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_objects_that_cannot_be_changed_are_named(empty_blender, tmp_path):
    wall = _wall()
    bpy.data.libraries.write(str(tmp_path / "wall.blend"), {wall})
    bpy.data.objects.remove(wall)
    with bpy.data.libraries.load(str(tmp_path / "wall.blend"), link=True) as (_, here):
        here.objects = ["wall"]
    (linked,) = here.objects
    empty_blender.collection.objects.link(linked)
    _, notes = bare_surfaces.dress(empty_blender)
    (note,) = notes
    assert "'wall' has no material, is linked" in note
