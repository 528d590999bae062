"""Lamps in water that differs with depth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.tests.scene.columns import grey_column
from underwater_spectral.uw_spectral.lamps.lamp import Lamp
from underwater_spectral.uw_spectral.lamps.lamp_projection import project_lamps
from underwater_spectral.uw_spectral.lamps.layers import water_between, waters_of_lamps
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture

ONE = grey_column(0.4, 0.6)
N = len(ONE.bands)
TURBID, CLEAR = (seawater_mixture([1.0] * N, [fraction] * N) for fraction in (0.01, 0.5))
COLUMN = dataclasses.replace(
    ONE, below=(DeeperWater(6.0, np.full(N, 0.1), np.full(N, 0.2), CLEAR),)
)


@pytest.mark.parametrize(
    ("one", "other", "turbid"),
    [(1.0, 5.0, 1.0), (4.0, 8.0, 0.5), (9.0, 5.0, 0.25), (7.0, 9.0, 0.0), (-3.0, 8.0, 0.75)],
)
def test_water_is_the_mean_over_depth(one, other, turbid):
    water = water_between(COLUMN, TURBID, one, other)
    a, b = 0.1 + 0.3 * turbid, 0.2 + 0.4 * turbid
    assert water.a == pytest.approx(a)
    assert water.b == pytest.approx(b)
    # Phase functions count by what they scatter.
    molecular = (0.6 * turbid * 0.01 + 0.2 * (1.0 - turbid) * 0.5) / b
    assert np.sort(water.phase.weights, axis=0)[0] == pytest.approx(molecular)


@pytest.mark.parametrize(("depth", "a"), [(5.0, 0.4), (6.0, 0.4), (7.0, 0.1), (-1.0, 0.4)])
def test_on_a_level_way_it_is_that_of_the_layer(depth, a):
    assert water_between(COLUMN, TURBID, depth, depth).a == pytest.approx(a)


def test_each_lamp_has_its_own_water_and_all_have_the_mean_by_their_light():
    lamps = [
        Lamp((0.0, 3.0, -z), (0.0, 1.0, 0.0), np.full(N, power))
        for z, power in ((5.0, 3.0), (7.0, 1.0))
    ]
    around, each = waters_of_lamps(COLUMN, TURBID, lamps, 5.0)
    assert [float(x.a[0]) for x in each] == pytest.approx([0.4, 0.25])
    assert around.a == pytest.approx((3.0 * 0.4 + 0.25) / 4.0)
    channels = channels_of_bands(COLUMN.bands, [0, 1, 2])
    projected = project_lamps(lamps, around, channels, own=each)
    for tables, water in zip(projected.projected, each, strict=True):
        ratio = tables.unscattered[1:64] / tables.unscattered[0]
        place = np.arange(1, 64) / 255.0
        length = projected.stretch * place / (1.0 - place)
        assert ratio[:, 0] == pytest.approx(np.exp(-float(water.c[0]) * length), rel=1e-6)
