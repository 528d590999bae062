"""A file with live water renders where the extension is not installed."""

from __future__ import annotations

import subprocess
import sys

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import marks, stored_settings
from underwater_spectral.scene.engines import exr_output
from underwater_spectral.scene.readers import surroundings
from underwater_spectral.scene.viewport import live
from underwater_spectral.uw_spectral.errors import DataWarning
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

_RENDER = """
import sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Scene, "underwater")
image = bpy.context.scene.render.image_settings
image.media_type, image.file_format, image.color_depth = "IMAGE", "OPEN_EXR", "32"
bpy.context.scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
"""


def _render(blend, picture):
    subprocess.run([sys.executable, "-c", _RENDER, blend, picture], check=True)
    return read_exr(picture)[0]


@pytest.mark.slow
@pytest.mark.filterwarnings(f"ignore::{DataWarning.__module__}.DataWarning")
def test_groups_are_ordinary_nodes(tmp_path, empty_blender, monkeypatch):
    monkeypatch.setattr(surroundings, "_COARSE", 60_000)
    scene = bpy.context.scene
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0.0, 4.0, -3.0))
    # What is below is in the shade, of which there is a table too.
    bpy.ops.mesh.primitive_plane_add(size=6.0, location=(0.0, 4.0, -1.5))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -3.0), (np.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 48, 27
    scene.eevee.taa_render_samples = 1
    live.add(scene)
    assert marks.part(scene, "uw_shade").size[0] > 24
    wet = tmp_path / "wet.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(wet))
    exr_output.write_float_exr(scene, tmp_path / "with.exr")
    wanted = read_exr(tmp_path / "with.exr")[0]
    assert wanted[13, 0, 2] > 0.02  # open water is blue; without the groups it is black
    assert _render(wet, tmp_path / "wet.exr")[..., :3] == pytest.approx(wanted, abs=1e-3)
