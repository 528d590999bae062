"""Water survives its user: what is renamed, replaced or deleted takes nothing else along."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.node_groups import realtime_surface, uplift
from underwater_spectral.node_groups.node_mathematics import MARK, new_group
from underwater_spectral.scene import contents, marks
from underwater_spectral.scene.materials import bare_surfaces, wet_trees
from underwater_spectral.scene.materials.closure_walk import Surfaces
from underwater_spectral.scene.materials.realtime_materials import insert
from underwater_spectral.scene.water import giving_back, scene_water, water_body
from underwater_spectral.tests.scene import columns, scenes, snapshot

EXTENT = water_body.WaterExtent(50.0, 10.0)


@pytest.fixture
def scene(empty_blender):
    return furnish()


def furnish():
    """Cubes with a matt material, one with a group, one that is clear, lamps, world, camera."""
    scene = bpy.context.scene
    glass = scenes.principled("glass")
    glass.node_tree.nodes["Principled BSDF"].inputs["Transmission Weight"].default_value = 1.0
    made = scenes.principled("paint"), scenes.grouped(), glass, scenes.animated(), scenes.textured()
    for x, material in enumerate(made):
        scenes._cube(material.name, (3.0 * x, 6.0, -5.0)).data.materials.append(material)
    scenes._cube("bare", (0.0, 9.0, -5.0))
    for kind in ("SUN", "POINT"):
        lamp = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
        lamp.location = (1.0, 1.0, -4.0)
        scene.collection.objects.link(lamp)
    scene.world = bpy.data.worlds.new("own world")
    scenes.add_camera()
    bpy.context.view_layer.update()
    return scene


def _group(name, *, keeps):
    """A group with the sockets that materials need, and nothing in it."""
    tree = new_group(name)
    known = realtime_surface
    colours = (
        known.COLOR,
        known.EMITTED,
        known.BEHIND,
        known.COVERED,
        *(() if keeps else (known.LIT,)),
    )
    for names, socket in (
        (colours, "NodeSocketColor"),
        ((known.NORMAL,), "NodeSocketVector"),
        ((known.COVERAGE, known.CLOSED, known.COLUMN), "NodeSocketFloat"),
    ):
        for one in names:
            tree.interface.new_socket(one, in_out="INPUT", socket_type=socket)
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    for one in (*uplift.COLUMNS, uplift.MEASURED_INPUT) if keeps else ():
        tree.interface.new_socket(one, in_out="OUTPUT", socket_type="NodeSocketVector")
    if keeps:
        tree.interface.new_socket(uplift.FRACTION, in_out="OUTPUT", socket_type="NodeSocketFloat")
    return tree


def add(scene):
    """Put the frame of a water into a scene: all that touches the user's objects, and no light."""
    scene_water.prepare(scene)
    plain, _ = bare_surfaces.dress(scene)
    lit, native = _group("UW Surface", keeps=False), _group("UW Keeping", keeps=True)
    materials, _ = scene_water.own_materials(scene, routed=False)
    insert(materials, Surfaces(lit, native=native))
    world, floor = bpy.data.worlds.new("UW World"), bpy.data.materials.new("UW Floor")
    parts = {marks.SURFACE: lit, marks.NATIVE: native}
    if plain is not None:
        parts["uw_plain"] = plain
    sun = bpy.data.lights.new("UW Sun", "SUN")
    filling = scene_water.Filling(world, [sun], floor, [], parts=parts)
    column = columns.grey_column(0.05, 0.1, floor_depth=9.0, floor_reflectance=0.3)
    scene_water.add(scene, filling, column, EXTENT)


def left_overs():
    """Everything in the file that the water has made or marked."""
    data = bpy.data
    kinds = (
        data.objects, data.collections, data.meshes, data.lights, data.materials, data.worlds,
        data.node_groups, data.images, data.scenes, data.volumes,
    )  # fmt: skip
    blocks = [block for kind in kinds for block in kind]
    trees = [b.node_tree for b in blocks if getattr(b, "node_tree", None)] + [*data.node_groups]
    nodes = [(tree.name, node) for tree in trees for node in tree.nodes]
    found = [f"{b.name}: {key}" for b in blocks for key in dict(b.items()) if key.startswith("uw_")]
    found += [
        f"{t}.{n.name}: {key}" for t, n in nodes for key in dict(n.items()) if key.startswith("uw_")
    ]
    found += [
        f"{b.name}: {m.name}" for b in data.objects for m in b.modifiers if m.name[:2] == "UW"
    ]
    return found + [node.name for _, node in nodes if node.name.startswith("UW ")]


def _tree(name="paint"):
    return bpy.data.materials[name].node_tree


def _shader_wired():
    tree = _tree()
    made = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(made.outputs[0], tree.get_output_node("ALL").inputs["Surface"])


def _shader_mixed():
    tree = _tree()
    output = tree.get_output_node("ALL").inputs["Surface"]
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.name = "own mix"
    tree.links.new(output.links[0].from_socket, mix.inputs[1])
    tree.links.new(mix.outputs[0], output)


def _texture_linked():
    tree = _tree()
    made = tree.nodes.new("ShaderNodeTexChecker")
    made.name = "own checker"
    tree.links.new(made.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])


def _node_renamed():
    _tree().nodes["Principled BSDF"].name = "other"


def _node_deleted():
    _tree().nodes.remove(_tree().nodes["Principled BSDF"])


def _output_deleted():
    _tree().nodes.remove(_tree().get_output_node("ALL"))


def _material_deleted():
    bpy.data.materials.remove(bpy.data.materials["paint"])


def _material_copied():
    bpy.data.objects["bare"].data.materials[0] = bpy.data.materials["paint"].copy()


def _group_copied():
    node = _tree("grouped").nodes["Group"]
    node.node_tree = node.node_tree.copy()


def _object_deleted():
    bpy.data.objects.remove(bpy.data.objects["bare"])


def _lamp_deleted():
    bpy.data.objects.remove(bpy.data.objects["SUN"])


def _lamp_made_single():
    bpy.data.objects["POINT"].data = bpy.data.objects["POINT"].data.copy()


def _world_replaced():
    bpy.context.scene.world = bpy.data.worlds.new("another")


def _own_world_deleted():
    bpy.data.worlds.remove(bpy.data.worlds["own world"])


def _everything_renamed():
    for kind in ("objects", "collections", "materials", "worlds", "scenes", "meshes", "lights"):
        for number, block in enumerate(getattr(bpy.data, kind)):
            block.name = f"object {number}"
    for tree in [m.node_tree for m in bpy.data.materials] + [*bpy.data.node_groups]:
        for number, node in enumerate(tree.nodes):
            node.name = f"node {number}"


THEIRS = {
    edit.__name__[1:]: edit
    for edit in (
        _shader_wired, _shader_mixed, _texture_linked, _node_renamed, _node_deleted,
        _output_deleted, _material_deleted, _material_copied, _group_copied, _object_deleted,
        _lamp_deleted, _lamp_made_single, _world_replaced, _own_world_deleted, _everything_renamed,
    )
}  # fmt: skip
"""Edits of the user's own objects: the outcome is the same without water."""


@pytest.mark.slow_but_first
@pytest.mark.parametrize("edit", THEIRS)
def test_the_user_edits_as_if_there_were_no_water(scene, edit):
    add(scene)
    THEIRS[edit]()
    scene_water.remove(bpy.context.scene)
    assert left_overs() == []
    wet = snapshot.snapshot()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    furnish()
    if edit == "material_copied":
        bpy.data.objects["bare"].data.materials.append(None)
    THEIRS[edit]()
    differing = snapshot.differences(snapshot.snapshot(), wet)
    # Of this test's fixture, and what Blender finds out about copied trees only once it draws.
    of_blender = (".enabled", ".is_icon_visible", ".is_inactive", ".is_unavailable", "pool_size")
    assert [line for line in differing if not any(x in line for x in of_blender)] == []


def _collection_deleted():
    bpy.data.collections.remove(next(c for c in bpy.data.collections if MARK in c))


def _collection_unlinked():
    collection = marks.collection_of(bpy.context.scene)
    bpy.context.scene.collection.children.unlink(collection)


def _collection_copied():
    bpy.context.scene.collection.children.link(marks.collection_of(bpy.context.scene).copy())


def _world_deleted():
    bpy.data.worlds.remove(bpy.context.scene.world)


def _world_used_twice():
    bpy.data.scenes.new("other").world = bpy.context.scene.world


def _world_kept():
    bpy.context.scene.world.use_fake_user = True


def _sun_copied():
    sun = next(o for o in bpy.data.objects if marks.IS_SUN in o)
    bpy.context.scene.collection.objects.link(sun.copy())


def _sun_deleted():
    bpy.data.objects.remove(next(o for o in bpy.data.objects if marks.IS_SUN in o))


def _plain_renamed():
    bpy.data.materials["UW Plain"].name = "mine"


def _plain_deleted():
    bpy.data.materials.remove(bpy.data.materials["UW Plain"])


def _pasted_into_the_own_world():
    tree = bpy.data.worlds["own world"].node_tree
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree, group[MARK] = bpy.data.node_groups["UW Surface"], True


OURS = {
    edit.__name__[1:]: edit
    for edit in (
        _collection_deleted, _collection_unlinked, _collection_copied, _world_deleted,
        _world_used_twice, _world_kept, _sun_copied, _sun_deleted, _plain_renamed, _plain_deleted,
        _pasted_into_the_own_world,
    )
}  # fmt: skip
"""Edits of the water's objects: the user's are as before."""


@pytest.mark.slow_but_first
@pytest.mark.parametrize("edit", OURS)
def test_what_happens_to_the_water_leaves_everything_else(scene, edit):
    before = snapshot.snapshot()
    add(scene)
    OURS[edit]()
    scene_water.remove(scene)
    assert left_overs() == []
    if edit == "world_used_twice":
        bpy.data.scenes.remove(bpy.data.scenes["other"])
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_any_node_of_the_water_may_be_deleted(scene):
    before = {m.name: _shown(m) for m in bpy.data.materials}
    number, there = 0, True
    while there:
        add(scene)
        there = False
        for material in [m for m in contents.materials(scene) if MARK not in m]:
            ours = [n for n in material.node_tree.nodes if MARK in n]
            if number < len(ours):
                there = True
                material.node_tree.nodes.remove(ours[number])
        scene_water.remove(scene)
        assert left_overs() == []
        assert {m.name: _shown(m) for m in bpy.data.materials} == before
        number += 1
    assert number > 10


def _shown(material):
    return material.node_tree.get_output_node("EEVEE").inputs["Surface"].links[0].from_node.name


def test_the_water_of_a_deleted_scene_is_taken_back(scene):
    before = snapshot.snapshot()
    other = bpy.data.scenes.new("other")
    for item in scene.objects:
        other.collection.objects.link(item)
    add(other)
    assert wet_trees.surface_node(_tree()) is not None
    bpy.data.scenes.remove(other)
    assert len(giving_back.strays()) == 1
    giving_back.let_go()
    assert left_overs() == []
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_a_group_that_is_deleted_is_named(scene):
    add(scene)
    for group in [g for g in bpy.data.node_groups if MARK in g]:
        bpy.data.node_groups.remove(group)
    notes = scene_water.remove(scene)
    assert any("'paint'" in note and "deleted" in note for note in notes)
    assert left_overs() == []
    assert _shown(bpy.data.materials["paint"]) == "Principled BSDF"


def test_worlds_that_are_gone_or_replaced_are_named(scene):
    add(scene)
    _own_world_deleted()
    (note,) = scene_water.remove(scene)
    assert "was deleted" in note
    scene.world = bpy.data.worlds.new("own world")
    add(scene)
    _world_replaced()
    (note,) = scene_water.remove(scene)
    assert "keeps world 'another'" in note
    assert scene.world.name == "another"


def test_switches_that_the_user_has_set_stay(scene):
    add(scene)
    lamp, sun = bpy.data.objects["POINT"], bpy.data.objects["SUN"]
    lamp.hide_viewport, lamp.data.diffuse_factor = True, 0.5
    sun.hide_render = False
    scene_water.remove(scene)
    assert lamp.hide_viewport
    assert lamp.data.diffuse_factor == 0.5
    assert (lamp.hide_render, sun.hide_render, sun.hide_viewport) == (False, False, False)


def test_a_new_shader_is_wet_again(scene):
    add(scene)
    paint = bpy.data.materials["paint"]
    assert not wet_trees.is_dry(paint)
    _shader_wired()
    assert wet_trees.is_dry(paint)
    giving_back.dry_but(set(bpy.data.materials) - {paint})
    assert len(_tree().nodes) == 3
    lit, native = (marks.part(scene, name) for name in (marks.SURFACE, marks.NATIVE))
    insert([paint], Surfaces(lit, native=native))
    assert not wet_trees.is_dry(paint)
    assert wet_trees.own_shader(_tree()).links[0].from_node.bl_idname == "ShaderNodeEmission"
    scene_water.remove(scene)
    assert left_overs() == []
    assert _shown(paint) == "Emission"


def test_constants_follow_renamed_nodes(scene):
    add(scene)
    node = _tree("glass").nodes["Principled BSDF"]
    node.name = "other"
    node.inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    _node_deleted()
    wet_trees.refresh()
    copies = [n for n in _tree("glass").nodes if wet_trees.SOURCE in n and len(n.inputs) == 3]
    assert [i.default_value for i in copies[0].inputs] == pytest.approx([0.1, 0.2, 0.3])
