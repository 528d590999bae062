"""Cameras and lamps that the script of the example scenes chooses."""

from __future__ import annotations

import runpy
from pathlib import Path

import bpy
import pytest
from underwater_spectral.tests.scene import scenes

SCRIPT = Path(__file__).resolve().parents[2] / "examples" / "build_scene.py"


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(SCRIPT))


def test_lamps_hang_on_the_chosen_camera(registered, script):
    first, second = scenes.add_camera(), scenes.add_camera()
    script["choose_camera"](second.name)
    script["hang_lamps"]("strobes")
    lamps = [item for item in registered.objects if item.type == "LIGHT"]
    assert [item.parent for item in lamps] == [second, second]
    assert first != second
    assert bpy.context.scene.camera == second


def test_an_unknown_camera_is_named(registered, script):
    scenes.add_camera()
    with pytest.raises(SystemExit, match="no camera 'Periscope'; there are"):
        script["choose_camera"]("Periscope")
