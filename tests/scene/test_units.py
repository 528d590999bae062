"""Scenes in other units than the metre are told so."""

import bpy
from underwater_spectral.scene import units


def test_only_another_unit_than_the_metre_is_named(empty_blender):
    scene = bpy.context.scene
    assert units.note(scene) == ""
    scene.unit_settings.scale_length = 0.01
    assert "0.01" in units.note(scene)
    scene.unit_settings.system = "NONE"
    assert units.note(scene) == ""
