"""Tests of the panel: the whole extension registered in a clean Blender."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _registered(registered):
    return registered
