"""A colour that is linked straight into a surface emits, in both engines."""

from __future__ import annotations

from underwater_spectral.scene.materials import bare_colours, material_kinds
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.snapshot import snapshot


def _bare():
    material, tree, output = scenes._material("bare")
    tree.links.new(tree.nodes.new("ShaderNodeRGB").outputs[0], output.inputs["Surface"])
    return material


def test_a_colour_in_a_surface_emits_and_comes_back(empty_blender):
    material, plain = _bare(), scenes.principled("plain")
    assert material_kinds.kinds([material]).glows
    before = snapshot()
    bare_colours.insert([material, plain])
    link = material.node_tree.nodes["Material Output"].inputs["Surface"].links[0]
    assert link.from_node.bl_idname == "ShaderNodeEmission"
    assert link.from_node.inputs["Strength"].default_value == 1.0
    bare_colours.insert([material])
    bare_colours.remove(set())
    assert snapshot() == before
