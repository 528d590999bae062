"""Cameras so deep that Cycles finds too little daylight are named."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.scene.terms.limits import of_depths
from underwater_spectral.tests.scene import columns
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase


@pytest.mark.parametrize(
    ("scattering", "depths", "said"),
    [(1.0, [12.0], False), (1.0, [3.0, 24.0], True), (0.0, [90.0], False), (1.0, [], False)],
)
def test_deep_cameras_are_named(scattering, depths, said):
    column = columns.grey_column(0.2, scattering)
    assert bool(of_depths(column, depths)) == said
    night = dataclasses.replace(column, sun_irradiance=np.zeros(3), sky_radiance=np.zeros(3))
    assert not of_depths(night, depths)


@pytest.mark.parametrize(("scattering", "said"), [(0.0, False), (2.0, True)])
def test_layers_count_by_their_own_scattering(scattering, said):
    phase = parse_phase("hg:0.9").for_bands(np.ones(3))
    below = DeeperWater(10.0, np.full(3, 0.1), np.full(3, scattering), phase)
    column = dataclasses.replace(columns.grey_column(0.2, 0.5), below=(below,))
    assert bool(of_depths(column, [20.0])) == said
    assert not of_depths(column, [9.0])
