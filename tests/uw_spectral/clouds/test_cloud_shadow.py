"""Shadows of clouds in the light of the water, against fine sums."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.cloud_light import Clouds, Several
from underwater_spectral.uw_spectral.clouds.cloud_shadow import daylit_fractions

from .test_cloud_light import SUN, _numbers


@pytest.mark.parametrize("rate", [-0.3, 0.0, 0.2, 2.0])
def test_a_path_below_a_cloud_loses_what_a_fine_sum_does(rate):
    """In the mean over chances; each alone is within a fraction of the path."""
    cloud, matter = _numbers(20.0, sun=1.0, spread=0.5, ambient=0.5)
    clouds = Clouds(Several([cloud]), [matter.phase], tuple(SUN))
    origin, w, P = np.array((0.0, -1.0, -1.5)) + SUN, np.array([0.0, 1.0, 0.0]), 6.0
    chance = np.array([[x] for x in (np.arange(64) + 0.5) / 64])
    found = daylit_fractions(clouds, origin, w, P, rate, chance)
    s = (np.arange(4000)[:, None] + 0.5) / 4000 * P
    weight = np.exp(-rate * s)
    point = [a + b * s for a, b in zip(origin, w, strict=True)]
    transmittances = (
        clouds.sunlight_transmittance(point),
        clouds.skylight_transmittance(point, all_round=True),
    )
    for fraction, transmittance in zip(found, transmittances, strict=True):
        wanted = (transmittance * weight).sum(axis=0) / weight.sum()
        assert wanted[0] < 0.98
        assert fraction.mean(axis=0) == pytest.approx(wanted, rel=0.005)
        assert np.ptp(fraction, axis=0).max() < 0.2


def test_where_clouds_are_not_it_is_all_there():
    cloud, matter = _numbers(20.0, sun=1.0)
    clouds = Clouds(Several([cloud]), [matter.phase], tuple(SUN))
    found = daylit_fractions(clouds, (9.0, 0.0, 0.0), (0.0, 1.0, 0.0), 5.0, 0.3, 0.5)
    assert np.concatenate(found) == pytest.approx(1.0)
