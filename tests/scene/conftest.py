"""Every test of the scene code starts from a clean Blender."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.scene import stored_settings


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
