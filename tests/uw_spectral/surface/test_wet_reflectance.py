"""What porous objects reflect in water, against rays traced through grains and measured sands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.surface.refraction import fresnel_reflectance
from underwater_spectral.uw_spectral.surface.wet_reflectance import (
    GRAIN_INDEX,
    mean_cosine_of_grains,
    wet_reflectance_TwomeyEtAl1986,
)


def _traced(n: float, rays: int = 400_000) -> float:
    """Mean cosine of rays that are followed through a sphere from wall to wall."""
    rng = np.random.default_rng(1)
    sine = np.sqrt(rng.random(rays))
    i, r = np.arcsin(sine), np.arcsin(sine / n)
    R = fresnel_reflectance(np.cos(i), n)
    out = rng.random(rays) < R
    turn = np.where(out, math.pi - 2 * i, 2 * (i - r))
    inside = ~out
    while inside.any():
        # At each wall it leaves, or turns on by π - 2 r.
        inside &= rng.random(rays) < R
        turn = np.where(inside, turn + math.pi - 2 * r, turn)
    return float(np.cos(turn).mean())


@pytest.mark.parametrize("n", [1.05, 1.15, 1.54])
def test_the_mean_cosine_is_that_of_traced_rays(n):
    assert 1 - mean_cosine_of_grains(n) == pytest.approx(1 - _traced(n), rel=0.02)


def test_sand_darkens_as_it_does():
    """Quartz sands of 0.35 to 0.45 have half of that wet, or less."""
    wet = mean_cosine_of_grains(GRAIN_INDEX / 1.34)
    found = wet_reflectance_TwomeyEtAl1986(np.array([0.35, 0.45]), wet, -1.0)
    np.testing.assert_array_less(found, [0.35 * 0.55, 0.45 * 0.55])
    np.testing.assert_array_less([0.35 * 0.3, 0.45 * 0.3], found)


def test_in_the_air_and_in_a_medium_like_air_it_stays():
    R, g = np.linspace(0.0, 1.0, 11), mean_cosine_of_grains(GRAIN_INDEX)
    np.testing.assert_allclose(wet_reflectance_TwomeyEtAl1986(R, 0.95, 0.1), R)
    np.testing.assert_allclose(wet_reflectance_TwomeyEtAl1986(R, g, -0.1), R, atol=1e-12)
