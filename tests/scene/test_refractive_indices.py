"""Refractive indices of materials are taken against the water that they lie in."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.node_groups import uplift
from underwater_spectral.scene.materials import band_colors, refractive_indices
from underwater_spectral.scene.materials.inserted import own_input
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.snapshot import snapshot


def _glass() -> bpy.types.Material:
    material, tree, output = scenes._material("glass")
    node = tree.nodes.new("ShaderNodeBsdfGlass")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def test_indices_go_through_groups_and_come_back(empty_blender):
    glass, plastic = _glass(), scenes.principled("plastic")
    socket = glass.node_tree.nodes["Glass BSDF"].inputs["IOR"]
    socket.default_value = 1.6
    socket.keyframe_insert("default_value", frame=1)
    before = snapshot()
    refractive_indices.insert([glass, plastic])
    uplift.set_water_index(1.34)
    assert own_input(socket) != socket
    assert own_input(socket).default_value == pytest.approx(1.6)
    inserted = [n for n in plastic.node_tree.nodes if n.bl_idname == "ShaderNodeGroup"]
    assert [n.node_tree["uw_uplift"] for n in inserted] == [uplift.OPAQUE_INDEX]  # no coat, no film
    refractive_indices.insert([glass, plastic])
    assert len([n for n in plastic.node_tree.nodes if n.bl_idname == "ShaderNodeGroup"]) == 1
    band_colors.remove(set())
    for group in [g for g in bpy.data.node_groups if not g.users]:
        bpy.data.node_groups.remove(group)
    assert snapshot() == before


def test_what_is_filled_with_air_keeps_its_index(empty_blender, properties):
    glass, mask = _glass(), _glass()
    mask.underwater.filled_with_air = True
    refractive_indices.insert([glass, mask])
    kept = mask.node_tree.nodes["Glass BSDF"].inputs["IOR"]
    assert own_input(kept) == kept
    wet = glass.node_tree.nodes["Glass BSDF"].inputs["IOR"]
    assert own_input(wet) != wet


@pytest.mark.parametrize(
    ("transmission", "kind"), [(0.0, uplift.OPAQUE_INDEX), (0.5, uplift.INDEX)]
)
def test_water_makes_no_mirror_of_what_is_opaque(empty_blender, transmission, kind):
    """Files give what has no gloss an index of 1, which is below that of water."""
    material = scenes.principled("of a file")
    node = material.node_tree.nodes["Principled BSDF"]
    node.inputs["IOR"].default_value = 1.0
    node.inputs["Transmission Weight"].default_value = transmission
    node.inputs["Coat Weight"].default_value = 1.0
    refractive_indices.insert([material])
    uplift.set_water_index(1.34)
    groups = {name: node.inputs[name].links[0].from_node.node_tree for name in ("IOR", "Coat IOR")}
    assert groups["IOR"][uplift.KIND] == kind
    assert groups["Coat IOR"][uplift.KIND] == uplift.OPAQUE_INDEX
    for group in groups.values():
        assert group.nodes["Water"].outputs[0].default_value == pytest.approx(1.34)
