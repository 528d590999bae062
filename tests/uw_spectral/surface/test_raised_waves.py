"""The sea with heights: two tiles, and where rays meet it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.surface.raised_waves import (
    FARTHEST,
    HeightTile,
    RaisedWaves,
    Swell,
    far_waves,
    surface_ahead,
)
from underwater_spectral.uw_spectral.surface.refraction import sun_travel_direction
from underwater_spectral.uw_spectral.surface.wave_patterns import Sea
from underwater_spectral.uw_spectral.surface.waves import WaveSpectrum, slope_variance_CoxMunk1954

SEA = Sea(7.0, seed=3, tile=10.0, resolution=128, raised=True)


def test_the_two_tiles_hold_the_height_and_the_slopes_of_the_sea():
    """Pierson & Moskowitz (1964): 0.0246 U²; Cox & Munk (1954) within their scatter."""
    variance, slopes, times = 0.0, 0.0, (0.0, 40.0, 90.0)
    for t in times:
        found = SEA.raised_at(t)
        for part in (found.near, found.far):
            variance += part.elevation.var() / len(times)
            slopes += (part.slope_x.var() + part.slope_y.var()) / len(times)
    assert 4 * math.sqrt(variance) == pytest.approx(0.0246 * 7.0**2, rel=0.15)
    slopes += SEA.components().shorter.sum()
    assert slopes == pytest.approx(slope_variance_CoxMunk1954(7.0).sum(), abs=0.004)
    assert found.highest < SEA.highest_crest()


def test_a_swell_has_its_height_length_and_direction():
    calm = Sea(0.0, tile=10.0, resolution=32, raised=True, swell=Swell(1.0, 24.0, 90.0))
    found = calm.raised_at(0.0)
    assert np.ptp(found.far.elevation) == pytest.approx(1.0, rel=0.01)
    y = np.linspace(0.0, 24.0, 25)
    profile = found.elevation(3.0, y)
    assert profile[0] == pytest.approx(0.5, rel=0.01)
    assert profile[[0, 12, 24]] == pytest.approx([0.5, -0.5, 0.5], abs=0.01)
    assert found.elevation(55.0, y) == pytest.approx(profile, abs=1e-3)
    # A quarter of a period later it has run a quarter of its length: ω² = g k.
    later = calm.raised_at(math.pi / 2 / math.sqrt(9.81 * 2 * math.pi / 24.0))
    before, crest, after = later.elevation(0.0, [5.0, 6.0, 7.0])
    assert crest == pytest.approx(0.5, rel=0.02)
    assert before == pytest.approx(after, abs=0.02)


def test_swells_that_cannot_be_are_refused():
    with pytest.raises(InputError, match="would break"):
        Swell(3.0, 20.0)
    with pytest.raises(InputError, match="length positive"):
        Swell(0.1, 0.0)
    with pytest.raises(InputError, match="wider"):
        far_waves(WaveSpectrum(5.0), 1.0, 0, Swell(0.5, 200.0), None)


def test_a_raised_sea_repeats_in_space_and_time():
    sea = Sea(6.0, tile=4.0, resolution=64, raised=True, loop_seconds=3.0, swell=Swell(0.4, 12.0))
    start, end = sea.raised_at(0.0), sea.raised_at(3.0)
    x = np.linspace(0.0, 90.0, 50)
    np.testing.assert_allclose(end.elevation(x, 2.0), start.elevation(x, 2.0), atol=1e-9)
    np.testing.assert_allclose(start.elevation(x + 96.0, 2.0), start.elevation(x, 2.0), atol=1e-9)


def test_a_plane_has_no_heights():
    flat = Sea(6.0, tile=4.0, resolution=64)
    assert flat.raised_at(1.0) is None
    assert flat.highest_crest() == 0.0
    assert not flat.at(0.0, sun_travel_direction(30.0, 0.0), 1.34).slopes_image()[..., 2].any()


def _swell_only(height, length):
    n = 256
    tile = 4 * length
    x = np.arange(n) * tile / n
    level = np.broadcast_to(height / 2 * np.cos(2 * np.pi * x / length), (n, n))
    nothing = np.zeros((n, n))
    return RaisedWaves(
        HeightTile(tile, nothing, nothing, nothing),
        HeightTile(tile, level, nothing, nothing),
    )


@pytest.mark.parametrize(("side", "z"), [(1.0, 0.8), (-1.0, -0.9)])
def test_rays_meet_the_first_crest(side, z):
    """Against a march in millimetres."""
    waves = _swell_only(1.0, 10.0)
    angle = np.radians([5.0, 10.0, 20.0, 45.0, 80.0])
    w = np.cos(angle), 0.0 * angle, -side * np.sin(angle)
    found, t = surface_ahead((1.0, 0.0, z), w, waves.elevation, waves.highest, side)
    fine = np.arange(0.0, FARTHEST, 1e-3)[:, None]
    over = side * (z + fine * w[2] - waves.elevation(1.0 + fine * w[0], 0.0))
    first = fine[np.argmax(over < 0, axis=0), 0]
    assert found.tolist() == [1.0] * 5
    np.testing.assert_allclose(t, first, atol=0.03)


def test_rays_that_leave_find_nothing():
    waves = _swell_only(1.0, 10.0)
    found, t = surface_ahead((0.0, 0.0, 2.0), (0.0, 0.6, 0.8), waves.elevation, 0.5, 1.0)
    assert found == 0.0
    assert t == 0.0
