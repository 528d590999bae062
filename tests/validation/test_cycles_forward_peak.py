"""Cycles with a bounded forward peak against the solution with the exact one."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import (
    cycles_settings,
    cycles_water,
    exr_output,
    pass_values,
    water_body,
)
from underwater_spectral.scene.cycles_phase import cycles_phase
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase import parse_phase, seawater_mixture

DEPTH = 3.0


@pytest.mark.parametrize("particles", ["fournier-forand:1.1,0.0183", "petzold"])
@pytest.mark.parametrize(("molecules", "tilt"), [(0.02, 90.0), (0.02, 0.0), (0.1, 90.0)])
def test_radiance_is_that_of_the_exact_peak(particles, molecules, tilt, tmp_path):
    """Vertical sun, black sky, a bright floor; the solver has nothing of Cycles."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    column = columns.grey_column(0.1, 0.4, floor_depth=10.0, floor_reflectance=0.3)
    phase = seawater_mixture(column.scattering, molecules, parse_phase(particles))
    lobes = [cycles_phase(phase, bounded=True)]
    assert len(lobes[0].lobes) == 2
    scene.render.resolution_x = scene.render.resolution_y = 24
    camera = scenes.add_camera((0.0, 0.0, -DEPTH), (math.radians(tilt), 0.0, 0.0))
    camera.data.angle = math.radians(1.0)
    cycles_water.add_water(scene, column, lobes, water_body.water_extent(scene, column, DEPTH))
    values = pass_values.PassValues.of_column(column, lobes)
    values.apply(scene.view_layers[0], (0, 1, 2))
    scene.cycles.pixel_filter_type = "BOX"
    with cycles_settings.reference_settings(scene, camera, samples=512, seed=1, denoise=False):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    seen = read_exr(tmp_path / "a.exr")[0][..., 0].astype(np.float64)
    w = np.array([0.0, math.sin(math.radians(tilt)), -math.cos(math.radians(tilt))])
    field = column.solved_field(phase, 48)
    wanted = field.radiance(np.array([DEPTH]), tuple(w[:, None]))[0, 0]
    noise = seen.std() / math.sqrt(seen.size)
    assert noise < 0.02 * wanted
    assert abs(seen.mean() - wanted) < 3 * noise + 0.02 * wanted
