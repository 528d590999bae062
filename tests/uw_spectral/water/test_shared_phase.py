"""Bands that share a phase function, against the solver with their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import in_water_cosine, sun_travel_direction
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase, seawater_mixture
from underwater_spectral.uw_spectral.water.pure_water import molecular_scattering
from underwater_spectral.uw_spectral.water.shared_phase import LARGEST_SPREAD, alike, with_mean_of

DEPTHS = {
    "I": 20.0, "IA": 15.0, "IB": 8.0, "II": 5.0, "III": 3.0,
    "1C": 4.0, "3C": 2.0, "5C": 1.5, "7C": 1.0, "9C": 0.5,
}  # fmt: skip


def _water(name, bands):
    water = Water.jerlov(name)
    b_w = molecular_scattering(bands.centres)
    b = np.maximum(water.b(bands.centres), b_w)
    return water.a(bands.centres), b, seawater_mixture(b, b_w)


@pytest.mark.slow_but_first
@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
@pytest.mark.parametrize("name", ["IA", "IB", "3C", "9C"])
@pytest.mark.parametrize("count", [8, 15, 30])
def test_the_mean_of_a_band_stays_within_half_a_percent(name, count):
    """Radiance all around beyond 10° from the sun, and Eu, under a high and a low sun."""
    bands, y = Bands.uniform(count), DEPTHS[name]
    a, b, phase = _water(name, bands)
    shared = with_mean_of(phase, alike([phase]))
    rng = np.random.default_rng(3)
    mu, turn = rng.uniform(-1, 1, 60), rng.uniform(0, 2 * math.pi, 60)
    across = np.sqrt(1 - mu**2)
    w = np.stack([across * np.cos(turn), across * np.sin(turn), mu])
    for zenith in (30.0, 70.0):
        sun = np.asarray(sun_travel_direction(zenith, 60.0))
        column = WaterColumn(
            bands, a, b, np.ones(count), float(in_water_cosine(zenith)), sun, np.full(count, 0.05),
            y + 3.0, np.full(count, 0.3), "flat", 1.34, sky="clear",
        )  # fmt: skip
        far = w[:, -(sun @ w) < math.cos(math.radians(10))]
        own, mean = (column.solved_field(p, 16) for p in (phase, shared))
        y_each = np.full(far.shape[1], y)
        L, found = (f.radiance(y_each, tuple(far)).mean(axis=0) for f in (own, mean))
        assert np.abs(found / L - 1).max() < 0.005
        assert np.abs(mean.Eu(y) / own.Eu(y) - 1).max() < 0.01


def test_turbid_waters_share_and_clear_ones_do_not():
    bands = Bands.uniform(8)
    threes = [(0, 1, 2), (3, 4, 5), (6, 7)]
    for name in ("II", "III", "1C", "3C", "5C", "7C", "9C"):
        assert alike([_water(name, bands)[2]]) == threes, name
    assert len(alike([_water("IA", bands)[2]])) > 3
    # What differs in one layer is not shared in any.
    turbid, clear = (_water(name, bands)[2] for name in ("9C", "IA"))
    assert alike([turbid, clear]) == alike([clear])


def test_equal_ones_share_without_a_spread():
    phase = parse_phase("hg:0.8").for_bands(np.ones(4))
    assert alike([phase], spread=0.0) == [(0, 1, 2), (3,)]
    assert with_mean_of(phase, [(0, 1, 2), (3,)]) == phase
    _, _, turbid = _water("9C", Bands.uniform(4))
    assert alike([turbid], spread=0.0) == [(0,), (1,), (2,), (3,)]


def test_the_spread_is_bounded():
    fraction = 0.02 * (1.0 + np.array([0.0, 0.5, 0.6]))
    phase = seawater_mixture(np.ones(3), fraction)
    backscatter = phase.backscatter_ratio
    assert np.ptp(backscatter) > LARGEST_SPREAD * backscatter.mean()
    assert alike([phase]) == [(0,), (1, 2)]
