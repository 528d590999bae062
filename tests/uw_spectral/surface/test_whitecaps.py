"""Foam: how much of the sea it covers, and how bright it is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.uw_spectral.surface.raised_waves import (
    FAR_RESOLUTION,
    NO_SWELL,
    Swell,
    far_waves,
)
from underwater_spectral.uw_spectral.surface.wave_patterns import Sea
from underwater_spectral.uw_spectral.surface.whitecaps import (
    breaking,
    foam_of,
    foam_reflectance,
    whitecap_cover_Monahan1980,
)

SEA = Sea(10.0, seed=1, tile=10.0, resolution=64, raised=True, foam=True)
GRID, FINE, APART, SEEDS = 64, 512, 13.0, (1, 2, 3)
MOMENTS = {5.0: 600, 8.0: 250, 11.0: 150, 15.0: 100}


@pytest.mark.slow
@pytest.mark.parametrize("wind", MOMENTS)
def test_cover_is_that_of_monahan_and_reflectance_that_of_koepke(wind):
    """3.84e-6 U^3.41 and .22, over places and moments of several seas, by area."""
    cover, fresh, area, random = 0.0, 0.0, 0.0, np.random.default_rng(5)
    for seed in SEEDS:
        sea = dataclasses.replace(SEA, wind_speed=wind, seed=seed)
        far = far_waves(sea.spectrum, sea.tile, seed, NO_SWELL, None)
        parts = breaking(sea.components(), FINE), breaking(far, FAR_RESOLUTION)
        foam = foam_of(parts, whitecap_cover_Monahan1980(wind))
        for t in np.arange(MOMENTS[wind]) * APART + 5.0:
            # The same places at rest of either tile, which meet anywhere.
            shift = tuple(random.integers(0, GRID, 2))
            crowding, stretch = np.zeros((GRID, GRID)), np.ones((GRID, GRID))
            for part in parts:
                crowding = np.roll(crowding, shift, (0, 1)) + part.crowding(GRID, t)
                stretch = np.roll(stretch, shift, (0, 1)) * part.choppy(GRID, t).stretch
            cover += np.sum((crowding > foam.first) * stretch)
            fresh += np.sum(foam.fraction(crowding) * stretch)
            area += np.sum(stretch)
    assert cover / area == pytest.approx(3.84e-6 * wind**3.41, rel=0.07)
    assert foam_reflectance(500.0) * fresh / cover == pytest.approx(0.22, rel=0.07)


@pytest.mark.slow
@pytest.mark.parametrize(("resolution", "moments"), [(64, 60), (256, 30)])
def test_what_is_drawn_has_that_cover(resolution, moments):
    """Images as coarse as users may choose them, over a swell."""
    sea = dataclasses.replace(SEA, wind_speed=14.0, resolution=resolution, swell=Swell(0.5, 60.0))
    at = np.random.default_rng(2).uniform(0.0, 240.0, (2, 20_000))
    found = [np.mean(sea.raised_at(t).foam_fraction(*at)) for t in np.arange(moments) * 29.0]
    assert np.mean(found) == pytest.approx(0.22 / 0.55 * 3.84e-6 * 14.0**3.41, rel=0.1)


def test_foam_lies_on_crests():
    found = dataclasses.replace(SEA, wind_speed=14.0).raised_at(3.0)
    at = np.random.default_rng(2).uniform(0.0, 240.0, (2, 40_000))
    fraction, height = found.foam_fraction(*at), found.near.at(*at, found.near.elevation)[0]
    assert np.average(height, weights=fraction) > 0.5 * height.std()


def test_a_calm_sea_has_none_and_foam_is_off_by_itself():
    for wind in (0.0, 1.0):
        found = dataclasses.replace(SEA, wind_speed=wind).raised_at(1.0)
        assert found.foam_fraction(np.arange(9.0), 0.0).max() == 0.0
    plain = dataclasses.replace(SEA, foam=False).raised_at(1.0)
    assert plain.near.crowding is None
    assert plain.foam_fraction(np.arange(9.0), 0.0).max() == 0.0


def test_foam_darkens_in_the_red():
    """Frouin et al. (1996): 40 % less at 850 nm, within their scatter of 10 %."""
    blue, green, red, infrared = foam_reflectance([440.0, 550.0, 670.0, 850.0])
    assert blue == green > red > infrared
    assert infrared / blue == pytest.approx(0.6, abs=0.1)
