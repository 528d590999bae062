"""The water of a picture that EEVEE renders, found from it and its distances."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks._scenery import block, camera_at, new_file
from underwater_spectral.datasets.applied_pictures import FLAT, picture_rays
from underwater_spectral.datasets.layer_file import camera_of, read_layers
from underwater_spectral.jobs import batch
from underwater_spectral.uw_spectral.imaging.description import (
    CameraDescription,
    Description,
)
from underwater_spectral.uw_spectral.imaging.picture_cells import SeenPicture
from underwater_spectral.uw_spectral.imaging.picture_fit import fit_picture
from underwater_spectral.uw_spectral.imaging.water_fit import FITTED
from underwater_spectral.uw_spectral.water.bio_optics import Constituents

TRUTH = Constituents(chlorophyll=1.0, cdom=0.06, minerals=0.3)
DEPTH = 5.0


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_boards_in_open_water_tell_it(tmp_path):
    """Small and apart, so that they do not shade the water."""
    new_file()
    rng = np.random.default_rng(4)
    for number, away in enumerate(rng.permutation(np.geomspace(1.0, 9.0, 90))):
        side = 0.07 * away
        colour = rng.uniform(0.01, 0.03, 3) if number % 2 == 0 else rng.uniform(0.03, 0.7, 3)
        place = away * (number % 10 - 4.5) * 0.11, away, away * (number // 10 - 4.0) * 0.09 - DEPTH
        block(f"board {number}", place, (side, 0.005, side), tuple(colour.tolist()))
    camera_at((0.0, 0.0, -DEPTH), (math.pi / 2.0, 0.0, 0.0), math.radians(60.0))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "boxes.blend"))
    options = ["--water", f"bio:{TRUTH.described()}", "--engine", "eevee", "--mode", "realtime"]
    options += ["--samples", "8", "--resolution", "256", "192", "--sensor", "ARRI D21"]
    options += ["--bands", "16"]
    options += ["--surface", "flat", "--layers", "I,range", "--out", str(tmp_path / "out")]
    assert batch.main([str(tmp_path / "boxes.blend"), *options], inside_blender=False) == 0
    frame = read_layers(next((tmp_path / "out").glob("*_layers.exr")))
    camera, pose = camera_of(frame.header)
    seen = SeenPicture(
        frame["I"].astype(np.float64),
        frame["range"].astype(np.float64).reshape(camera.height, camera.width),
        picture_rays(camera, pose),
    )
    sea = Description(
        camera=CameraDescription("ARRI D21"),
        surface=FLAT,
    )
    fitted = fit_picture(seen, sea, DEPTH)
    nm = [450.0, 550.0, 600.0]
    found, wanted = (
        [x.water().a(nm), x.water().a(nm) + x.water().b(nm)] for x in (fitted.constituents, TRUTH)
    )
    assert found[0] == pytest.approx(wanted[0], rel=0.1)
    # Without the light of surroundings that is scattered forward it is 45 % too much.
    assert found[1] == pytest.approx(wanted[1], rel=0.25)
    for name in FITTED:
        low, true, high = (getattr(x, name) for x in (fitted.low, TRUTH, fitted.high))
        assert low < true < high, name
