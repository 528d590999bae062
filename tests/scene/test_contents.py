"""What geometry nodes and particle systems show belongs to a scene as all else does."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot


def _geometry(name):
    """A group of geometry nodes with an input and an output, and its nodes for both."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def _painting(material=None):
    """Set a material: a given one, or one that the modifier asks for."""
    tree, given, found = _geometry("paint")
    node = tree.nodes.new("GeometryNodeSetMaterial")
    tree.links.new(given.outputs[0], node.inputs["Geometry"])
    tree.links.new(node.outputs[0], found.inputs[0])
    if material is None:
        tree.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketMaterial")
        tree.links.new(given.outputs["Paint"], node.inputs["Material"])
    else:
        node.inputs["Material"].default_value = material
    return tree


def _nested(inner):
    tree, given, found = _geometry("outer")
    node = tree.nodes.new("GeometryNodeGroup")
    node.node_tree = inner
    tree.links.new(given.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], found.inputs[0])
    return tree


def _scattering(kind, block):
    """Put an object or a collection that no scene has in place of the geometry."""
    tree, _, found = _geometry("scatter")
    node = tree.nodes.new(f"GeometryNode{kind}Info")
    node.inputs[kind].default_value = block
    tree.links.new(node.outputs["Geometry" if kind == "Object" else "Instances"], found.inputs[0])
    return tree


def _unlinked(material):
    """A cube that only bpy.data knows."""
    item = scenes._cube("coral", (0.0, 0.0, 0.0))
    item.data.materials.append(material)
    for collection in item.users_collection:
        collection.objects.unlink(item)
    return item


def _show(item, way, material):
    """Let an object show a material in one of many ways."""
    if way in ("node", "nested node", "input"):
        tree = _painting(None if way == "input" else material)
        modifier = item.modifiers.new("paint", "NODES")
        modifier.node_group = _nested(tree) if way == "nested node" else tree
        if way == "input":
            inputs = modifier.properties.inputs
            identifier = tree.interface.items_tree["Paint"].identifier
            getattr(inputs, identifier).value = material
            item.update_tag()
        return
    shown = _unlinked(material)
    if way == "particles":
        system = item.modifiers.new("hair", "PARTICLE_SYSTEM").particle_system.settings
        system.render_type, system.instance_object = "OBJECT", shown
        return
    block, kind = shown, "Object"
    if way == "collection":
        block, kind = bpy.data.collections.new("corals"), "Collection"
        block.objects.link(shown)
    item.modifiers.new("scatter", "NODES").node_group = _scattering(kind, block)


@pytest.mark.parametrize(
    "way", ["node", "nested node", "input", "object", "collection", "particles"]
)
def test_materials_are_found_however_they_come(empty_blender, way):
    item = scenes._cube("rock", (0.0, 5.0, -5.0))
    plain = scenes.principled("plain", (0.5, 0.5, 0.5, 1.0))
    item.data.materials.append(plain)
    coral = scenes.principled("coral", (0.9, 0.2, 0.1, 1.0))
    assert contents.materials(empty_blender) == [plain]
    _show(item, way, coral)
    assert contents.materials(empty_blender) == [coral, plain]
    named = way in ("object", "collection", "particles")
    assert len(contents.objects(empty_blender)) == 1 + named


def test_groups_that_name_one_another_end():
    tree, *_ = _geometry("a")
    item = scenes._cube("rock", (0.0, 5.0, -5.0))
    for _ in range(2):
        item.modifiers.new("twice", "NODES").node_group = _nested(tree)
    assert item in contents.objects(bpy.context.scene)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("engine", "way"),
    [
        ("eevee", "node"),
        ("cycles", "collection"),
        pytest.param("eevee", "collection", marks=pytest.mark.slow),
        pytest.param("cycles", "node", marks=pytest.mark.slow),
    ],
)
def test_what_nodes_show_is_as_wet_as_other_objects(empty_blender, engine, way):
    scene = empty_blender
    camera = scenes.add_camera((0.0, 0.0, -5.0))
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 16, 9
    scene.render.resolution_percentage = 100
    plan = render_plan.make_plan(
        SceneSettings(water="jerlov:IB", bands=3, samples=1, surface="none", diffuse_shadows=False)
    )
    coral = scenes.principled("coral", (0.9, 0.2, 0.1, 1.0))

    def picture():
        bpy.context.view_layer.update()
        extent = water_body.water_extent(scene, plan.column, 5.0)
        opened = (
            engines.eevee_bands(scene, camera, plan, extent, 5.0)
            if engine == "eevee"
            else engines.cycles_bands(scene, camera, plan, extent, seed=1)
        )
        with opened as found:
            return grey_scene.band_image(found, plan, 5.0)[2:7, 5:11]

    item = scenes._cube("rock", (0.0, 6.0, -5.0))
    item.scale = (6.0, 1.0, 6.0)
    item.data.materials.append(coral)
    wanted = picture()
    item.data.materials.clear()
    _show(item, way, coral)
    before = snapshot.snapshot()
    found = picture()
    assert snapshot.differences(before, snapshot.snapshot()) == []
    np.testing.assert_allclose(found, wanted, rtol=1e-3)
