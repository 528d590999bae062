"""A clean Blender for every test of the scene code."""

from __future__ import annotations

import warnings

import pytest


@pytest.fixture(autouse=True)
def empty_blender():
    """Read an empty home file; bpy's own deprecation warnings are not ours."""
    import bpy

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene
