"""Tests of the panel: the whole extension registered in a clean Blender."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral import registration
from underwater_spectral.scene import property_group


@pytest.fixture(autouse=True)
def registered(empty_blender):
    # A batch of an earlier test may have registered the properties alone in this process.
    if hasattr(bpy.types.Scene, property_group.PROPERTY):
        property_group.unregister()
    registration.register()
    yield bpy.context.scene
    registration.unregister()
    # Tests of the batch expect the properties to be there, or register them.
