"""Blender's own hair and scatter assets, in all three modes."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import batch
from underwater_spectral.scene import contents
from underwater_spectral.tests.scene import essentials
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

MODES = {
    "reference": ["--engine", "cycles", "--samples", "48"],
    "bands": ["--engine", "eevee", "--samples", "4"],
    "realtime": ["--engine", "eevee", "--mode", "realtime", "--samples", "4"],
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_hair_and_scatter_assets_render_in_every_mode(tmp_path, registered):
    """Panels in the groups' inputs, whose identifiers are numbers, ended every job."""
    scene = essentials.essentials_scene()
    scene.render.resolution_percentage = 33
    bpy.context.view_layer.update()
    names = {item.name for item in contents.objects(scene)}
    assert {"pebble", "hair", "ball", "post", "rock", "ground"} <= names
    assert "fur" in {material.name for material in contents.materials_of(bpy.data.objects["hair"])}
    path = tmp_path / "essentials.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    found = {}
    for name, options in MODES.items():
        out = str(tmp_path / name)
        options = [*options, "--bands", "8", "--water", "jerlov:IB", "--exposure", "0"]
        assert batch.main([str(path), *options, "--out", out], inside_blender=False) == 0
        found[name] = read_exr(f"{out}/0001.exr")[0]
    height, width = found["bands"].shape[:2]
    assert (width, height) == (31, 17)
    assert np.isfinite(list(found.values())).all()
    means = {name: image.mean(axis=(0, 1)) for name, image in found.items()}
    # Red of so few bands is a small difference of the sensor's responses.
    assert means["realtime"] == pytest.approx(
        means["bands"], abs=0.02 * float(means["bands"].max())
    )
    assert means["realtime"][1:] == pytest.approx(means["bands"][1:], rel=0.02)
    # Noise, coarse occlusion and hair, which real time draws too bright: no proof, but dry objects
    # would be many times off.
    assert means["realtime"][1:] == pytest.approx(means["reference"][1:], rel=0.25)
    below_hair = height // 2, slice(width // 8, width // 4), 1
    for image in found.values():
        assert image[below_hair].mean() < 0.7 * image[-3:, width // 2 :, 1].mean()
