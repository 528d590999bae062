"""Every test of the scene code starts from a clean Blender."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.scene import stored_settings
from underwater_spectral.tests.scene import scenes


@pytest.fixture(autouse=True)
def _clean(empty_blender):
    return empty_blender


@pytest.fixture
def properties():
    """What scenes and materials store."""
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
        yield
        stored_settings.unregister()
    else:
        yield


@pytest.fixture
def blend(properties, tmp_path):
    """A saved file with a wall before a camera."""
    scenes.add_camera()
    scenes.wall("wall", (-1.5, 3.0, -5.0), 2.0)
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path
