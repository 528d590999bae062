"""Directions of the light from above against the irradiances of the field they are drawn from."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.light_from_above import light_from_above
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

PHASE = parse_phase("hg:0.9").for_bands(np.ones(2))
SUN = np.array([0.3, 0.4, -math.sqrt(0.75)])


def _field(sun=1.0, sky=0.1, streams=16, surface="flat"):
    column = WaterColumn(
        Bands.uniform(2), [0.05, 0.2], [0.1, 0.4], sun, -float(SUN[2]), SUN, sky,
        math.inf, 0.0, surface, 1.34,
    )  # fmt: skip
    return column.solved_field(PHASE, streams)


@pytest.mark.parametrize("depth", [0.5, 8.0])
@pytest.mark.parametrize(("sun", "sky"), [(1.0, 0.1), (0.0, 1.0)])
def test_directions_carry_the_flux_of_the_light_from_above(depth, sun, sky):
    field = _field(sun, sky)
    w = light_from_above(field, depth, 20_000)
    assert np.linalg.norm(w, axis=1) == pytest.approx(1.0)
    assert w[:, 2].min() > 0
    down, _ = field.stream_modes([depth], 2)
    fraction = field.weights * down[:, :, 0].sum(axis=1)
    assert w[:, 2].mean() == pytest.approx(fraction[0] @ field.mu / fraction[0].sum(), rel=0.02)
    # More of it comes from the sun's side, and none from one side of the sun more than the other.
    along, aside = -SUN[:2] / 0.5, np.array([SUN[1], -SUN[0]]) / 0.5
    across = 0.5 * fraction[1] @ np.sqrt(1 - field.mu**2) / fraction[0].sum()
    assert float((w[:, :2] @ along).mean()) == pytest.approx(across, abs=0.01)
    assert float((w[:, :2] @ aside).mean()) == pytest.approx(0.0, abs=0.01)


def test_few_directions_stand_for_many():
    field = _field()
    few, many = (light_from_above(field, 4.0, count) for count in (16, 4000))
    assert few.mean(axis=0) == pytest.approx(many.mean(axis=0), abs=0.1)


def test_without_light_it_is_straight_up():
    assert light_from_above(_field(0.0, 0.0), 3.0, 3).tolist() == [[0.0, 0.0, 1.0]] * 3
