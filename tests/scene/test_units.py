"""Scenes in other units than the metre are told so."""

import bpy
from underwater_spectral.scene.unsupported import unsupported


def test_only_another_unit_than_the_metre_is_named(empty_blender):
    scene = bpy.context.scene
    assert unsupported(scene) == ()
    scene.unit_settings.scale_length = 0.01
    (note,) = unsupported(scene)
    assert "0.01" in note
    scene.unit_settings.system = "NONE"
    assert unsupported(scene) == ()
