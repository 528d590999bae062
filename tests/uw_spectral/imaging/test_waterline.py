"""The waterline in a picture and its meniscus."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.imaging.waterline import (
    meniscus_height,
    meniscus_turn,
    split_picture,
)

N = 1.34


def test_water_climbs_until_it_meets_the_glass_at_its_angle():
    wall = meniscus_height()
    turn, inside = meniscus_turn(wall, N)
    # There the surface stands 70° to the level; a level ray meets it at 20°.
    expected = math.asin(N * math.sin(math.radians(20.0))) - math.radians(20.0)
    assert not inside
    assert turn == pytest.approx(expected, rel=1e-6)


def test_the_low_part_reflects_totally_down_and_the_high_part_looks_out():
    height = np.linspace(1e-5, meniscus_height(), 200)
    turn, inside = meniscus_turn(height, N)
    assert inside[0]
    assert not inside[-1]
    assert (np.diff(inside.astype(int)) != 0).sum() == 1
    assert np.all(np.diff(turn[inside]) > 0)
    # Where total reflection ends, light grazes the surface on its other side.
    assert math.degrees(turn[~inside][0]) > 30.0


def _parts(rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    height = np.repeat(np.linspace(0.02, -0.02, rows)[:, None], 4, axis=1)
    ramp = np.linspace(1.0, 2.0, rows)[:, None, None] * np.ones((1, 4, 1))
    return height, ramp, 10.0 * ramp


def test_each_half_is_its_own_and_the_meniscus_shows_the_water_below():
    height, air, water = _parts(801)
    both = split_picture(air, water, height, (1.0, 0.0), 700.0, N)
    above, below = height > meniscus_height() + 1e-3, height < -1e-3
    np.testing.assert_allclose(both[above], air[above])
    np.testing.assert_allclose(both[below], water[below])
    low = (height > 2e-4) & (height < 1.5e-3)
    assert both[low].min() > air.max()
    assert np.all(both[low] > water[np.abs(height) < 1e-3].max())  # further down it is brighter
    high = (height > 2.2e-3) & (height < 2.9e-3)
    assert both[high].max() < 2.0


def test_one_picture_that_holds_both_worlds_is_used_for_both():
    height, air, water = _parts(401)
    native = np.where((height > 0)[..., None], air, water)
    both = split_picture(native, native, height, (1.0, 0.0), 350.0, N)
    outside = (height < -1e-3) | (height > meniscus_height() + 1e-3)
    np.testing.assert_allclose(both[outside], native[outside])
    assert np.isfinite(both).all()
