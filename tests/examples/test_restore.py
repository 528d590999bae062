"""The restoration of examples/ on a picture whose every part is known."""

from __future__ import annotations

import math
import runpy
import subprocess
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from underwater_spectral.datasets.axes import looking_at
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.datasets.depth_maps import write_depth_exr
from underwater_spectral.datasets.truth import image_truth, write_truth
from underwater_spectral.datasets.view import DataSetView
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import (
    BandsDescription,
    CameraDescription,
    Description,
    FormationFit,
    WaterDescription,
    remove_water,
    resolve,
)
from underwater_spectral.uw_spectral.imaging.range_attenuation import RangeAttenuation
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from underwater_spectral.uw_spectral.spectra.reflectance import (
    colorchecker_patches,
    colorchecker_reflectance,
)
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from underwater_spectral.validation.sun_beam import sun_beam
from underwater_spectral.validation.tabulated_water import tabulated_water

ROOT = Path(__file__).resolve().parents[2]
DEPTH = 5.0
CAMERA = PinholeCamera.from_field_of_view(240, 160, 60.0)
FAR = {"jerlov:IB": 12.0, "jerlov:II": 5.0, "jerlov:3C": 2.0}


def reef(water: str, folder: Path) -> np.ndarray:
    """Write a picture by the pixel model, with range and truth; return what it is without water.

    Patches of a colour chart at random, at ten ranges; some are black; open water above.
    """
    optics = resolve(
        Description(
            WaterDescription(water),
            camera=CameraDescription("Nikon D7000", "depth"),
            bands=BandsDescription(12),
        )
    )
    field, bands = optics.solved_field(), optics.bands
    height, width = CAMERA.height, CAMERA.width
    y, x = np.mgrid[:height, :width]
    z = np.geomspace(0.5, FAR[water], 10)[x * 10 // width]
    names = [name for name in colorchecker_patches() if not name.startswith("black")]
    reflectances = np.stack([colorchecker_reflectance(n).at(bands.centres) for n in names])
    random = np.random.default_rng(6)
    patch = random.integers(0, len(names), (height // 4, width // 4))[y // 4, x // 4]
    rho = np.where(((x // 4 + y // 4) % 20 == 0)[..., None], 0.0, reflectances[patch])
    J = rho * field.Ed(DEPTH) / math.pi
    beam = sun_beam(optics.column, optics.phase)
    water_light = tabulated_water(field, beam, optics.column.skylight, None)
    along = [np.full((height, width, 1), part) for part in (0.0, 1.0, 0.0)]
    depths = np.full((height, width, 1), DEPTH)
    seen = water_light.surface(depths, depths, along, z[..., None], J).total
    z = np.where(y < 24, np.inf, z)
    seen = np.where((y < 24)[..., None], field.radiance(DEPTH, (0.0, 1.0, 0.0)), seen)
    develop = optics.viewpoint(DEPTH).reduction.apply
    write_rgb_exr(folder / "picture.exr", develop(seen))
    write_depth_exr(folder / "depth.exr", z, CAMERA)
    pose = looking_at((0, 0, -DEPTH), (0, 1, -DEPTH))
    write_truth(
        folder / "truth.json", image_truth(optics, DataSetView("a", folder / "a", CAMERA, pose))
    )
    return np.where((y < 24)[..., None], 0.0, develop(J))


def restored(folder: Path, *options: str) -> np.ndarray:
    """Run the script; for the picture alone in this process, which has loaded all it needs."""
    names = ("picture.exr", "depth.exr", "truth.json", "restored.png")
    script = str(ROOT / "examples" / "restore.py")
    command = [script, *(str(folder / name) for name in names), *options]
    if options:
        with mock.patch.object(sys, "argv", command):
            runpy.run_path(script, run_name="__main__")
    else:
        subprocess.run([sys.executable, *command], check=True)
    return read_exr(folder / "restored.exr")[0].astype(np.float64)


@pytest.mark.slow
@pytest.mark.parametrize("water", FAR)
def test_the_truth_restores_better_than_the_picture_alone(water, tmp_path, record_property):
    J = reef(water, tmp_path)
    objects = np.arange(CAMERA.height) >= 24

    def error(picture):
        return float(delta_e_CIE2000_images(picture[objects], J[objects]).mean())

    none = error(read_exr(tmp_path / "picture.exr")[0].astype(np.float64))
    blind = error(restored(tmp_path, "--blind"))
    truth = error(restored(tmp_path))
    for name, value in (("none", none), ("blind", blind), ("truth", truth)):
        record_property(name, value)
    assert truth < 0.8 * blind < 0.8 * none
    assert truth < 2.0


def test_what_does_not_match_is_refused():
    clear = (RangeAttenuation(0.1, 0.0, 0.1, 0.0),)
    fit = FormationFit(clear, clear, (0.5,))
    with pytest.raises(InputError, match="for ranges of"):
        remove_water(np.ones((3, 1)), np.ones(2), fit)
    with pytest.raises(InputError, match="must be positive"):
        remove_water(np.ones((2, 1)), np.zeros(2), fit)
    assert remove_water([[0.7]], [np.inf], fit).tolist() == [[0.0]]
