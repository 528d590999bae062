"""Cycles with a bounded forward peak against the solution with the exact one."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.water.cycles_phase import cycles_phase
from underwater_spectral.tests.scene import columns
from underwater_spectral.tests.validation import cycles_probe
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase, seawater_mixture

DEPTH = 3.0


@pytest.mark.slow_but_first
@pytest.mark.parametrize("particles", ["fournier-forand:1.1,0.0183", "petzold"])
@pytest.mark.parametrize(("molecules", "tilt"), [(0.02, 90.0), (0.02, 0.0), (0.1, 90.0)])
def test_radiance_is_that_of_the_exact_peak(particles, molecules, tilt, tmp_path):
    """Vertical sun, black sky, a bright floor; the solver has nothing of Cycles."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    column = columns.grey_column(0.1, 0.4, floor_depth=10.0, floor_reflectance=0.3)
    phase = seawater_mixture(column.scattering, molecules, parse_phase(particles))
    lobes = [cycles_phase(phase, bounded=True)]
    assert len(lobes[0].lobes) == 2
    seen = cycles_probe.radiance_of_phases(
        scene, column, lobes, DEPTH, (math.radians(tilt), 0.0, 0.0),
        samples=512, path=tmp_path / "a.exr", size=24,
    )  # fmt: skip
    w = np.array([0.0, math.sin(math.radians(tilt)), -math.cos(math.radians(tilt))])
    field = column.solved_field(phase, 48)
    wanted = field.radiance(np.array([DEPTH]), tuple(w[:, None]))[0, 0]
    assert seen.error < 0.02 * wanted
    assert abs(seen.mean - wanted) < 3 * seen.error + 0.02 * wanted
