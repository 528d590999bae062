"""Every test of the scene code starts from a clean Blender."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _clean(empty_blender):
    return empty_blender
