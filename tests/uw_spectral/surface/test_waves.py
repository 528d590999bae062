from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.surface.wave_components import WaveComponents
from underwater_spectral.uw_spectral.surface.waves import (
    WaveSpectrum,
    angular_frequency,
    slope_variance_CoxMunk1954,
)


def _grid(tile, resolution):
    step = np.arange(resolution) * tile / resolution
    return np.meshgrid(step, step)


@pytest.mark.parametrize("wind", [2.0, 5.0, 10.0])
def test_slope_variance_of_the_sea_is_that_of_cox_and_munk(wind):
    """On the surface itself: what the grid shows plus what it reports as left out."""
    waves = WaveSpectrum(wind, 30.0).realise(16.0, 1024, seed=3)
    _, sx, sy = waves.on_grid(1024, 12.0)
    turn = np.radians(30.0)
    along, across = sx * np.cos(turn) + sy * np.sin(turn), sy * np.cos(turn) - sx * np.sin(turn)
    shown = np.array([along.var(), across.var()])
    measured = slope_variance_CoxMunk1954(wind)
    whole = shown + waves.longer + waves.shorter
    assert whole.sum() == pytest.approx(measured.sum(), rel=0.01)
    if wind > 2:  # at 2 m/s their fit has more slope across the wind than along it
        assert np.all(np.abs(whole - measured) <= [0.004, 0.002])  # their scatter


def test_published_spectrum_before_the_constraint():
    """Elfouhaily's own slope variance lies within the scatter of Cox & Munk from 3 m/s."""
    k = np.geomspace(1e-3, 6000, 20000)
    for wind in (5.0, 7.0):
        B = WaveSpectrum(wind).curvature_Elfouhaily1997(k)
        slope = np.trapezoid(B, np.log(k))
        assert slope == pytest.approx(slope_variance_CoxMunk1954(wind).sum(), abs=0.004)


@pytest.mark.parametrize(("wind", "height"), [(5.0, 0.61), (10.0, 2.45)])
def test_height_of_a_developed_sea(wind, height):
    """Pierson & Moskowitz 1964: 0.0246 U² for the wind at 10 m."""
    assert WaveSpectrum(wind).significant_height == pytest.approx(height, rel=0.15)


def test_short_fetch_makes_low_and_short_waves():
    sea, bay = WaveSpectrum(8.0), WaveSpectrum(8.0, fetch=5e3)
    assert bay.significant_height < 0.4 * sea.significant_height
    assert bay.peak > 3 * sea.peak


def test_fft_and_direct_sum_agree():
    waves = WaveSpectrum(7.0, 70.0).realise(5.0, 32, seed=1)
    x, y = _grid(5.0, 32)
    grid = waves.on_grid(32, 7.5)
    for fast, slow in zip(
        grid, (waves.elevation(x, y, 7.5), *waves.slopes(x, y, 7.5)), strict=True
    ):
        np.testing.assert_allclose(fast, slow, atol=1e-13)


def test_slopes_are_derivatives():
    waves = WaveSpectrum(7.0, 20.0).realise(5.0, 24, seed=1)
    x, y, h = np.array([0.3, 2.0]), np.array([1.0, 4.0]), 1e-5
    sx, sy = waves.slopes(x, y, 3.0)
    np.testing.assert_allclose(
        sx, (waves.elevation(x + h, y, 3.0) - waves.elevation(x - h, y, 3.0)) / (2 * h), atol=1e-7
    )
    np.testing.assert_allclose(
        sy, (waves.elevation(x, y + h, 3.0) - waves.elevation(x, y - h, 3.0)) / (2 * h), atol=1e-7
    )


def test_energy_is_that_of_the_components():
    waves = WaveSpectrum(6.0).realise(8.0, 128, seed=2)
    eta, sx, sy = waves.on_grid(128, 1.0)
    assert eta.var() == pytest.approx(waves.elevation_variance, rel=1e-9)
    assert sx.var() + sy.var() == pytest.approx(waves.slope_variance.sum(), rel=1e-9)
    low = waves.below(5.0)
    np.testing.assert_allclose(
        low.slope_variance + low.shorter, waves.slope_variance + waves.shorter, rtol=1e-12
    )


def test_waves_run_with_the_wind():
    waves = WaveSpectrum(6.0, 0.0).realise(8.0, 64, seed=2)
    x = np.linspace(0, 8, 400)
    now, later = waves.elevation(x, 0.0, 0.0), waves.elevation(x, 0.0, 0.05)
    shifts = np.linspace(-0.5, 0.5, 101)
    match = [np.mean(later * waves.elevation(x - s, 0.0, 0.0)) for s in shifts]
    assert shifts[np.argmax(match)] > 0
    assert np.mean(now * later) < np.max(match)


def test_repeats_over_the_tile_and_over_the_loop():
    waves = WaveSpectrum(6.0).realise(3.0, 64, seed=2, loop_seconds=2.0)
    x, y = _grid(3.0, 64)
    np.testing.assert_allclose(
        waves.elevation(x + 3, y - 6, 0.4), waves.elevation(x, y, 0.4), atol=1e-12
    )
    for first, again in zip(waves.on_grid(64, 0.4), waves.on_grid(64, 2.4), strict=True):
        np.testing.assert_allclose(first, again, atol=1e-11)


def test_loop_moves_the_frequencies_little():
    free = WaveSpectrum(6.0).realise(16.0, 64, seed=2)
    loop = WaveSpectrum(6.0).realise(16.0, 64, seed=2, loop_seconds=10.0)
    assert np.abs(loop.frequency - free.frequency).max() <= np.pi / 10 + 1e-9


def test_a_million_seconds():
    waves = WaveSpectrum(6.0).realise(3.0, 64, seed=2)
    one, other = waves.on_grid(64, 1e6), waves.on_grid(64, 1e6 + 1e-9)
    assert np.isfinite(one).all()
    np.testing.assert_allclose(one[1], other[1], atol=1e-5)


def test_no_wind_no_waves():
    waves = WaveSpectrum(0.0).realise(4.0, 64)
    assert len(waves) == 0
    assert not waves.shorter.any()
    assert not np.any(waves.on_grid(64, 5.0))
    assert not np.any(waves.elevation([0.0, 1.0], 2.0, 5.0))


def test_storm_is_finite():
    waves = WaveSpectrum(25.0, -120.0, fetch=1e4, depth=3.0).realise(32.0, 256, seed=5)
    assert np.isfinite(waves.on_grid(256, 1e6)).all()


def test_seed_and_scrubbing():
    spectrum = WaveSpectrum(5.0)
    first = spectrum.realise(4.0, 64, seed=1)
    np.testing.assert_array_equal(first.phase, spectrum.realise(4.0, 64, seed=1).phase)
    assert not np.array_equal(first.phase, spectrum.realise(4.0, 64, seed=2).phase)
    np.testing.assert_array_equal(first.on_grid(64, 3.0)[0], first.on_grid(64, 3.0)[0])


def test_dispersion_limits():
    assert angular_frequency(0.01, 2.0) == pytest.approx(0.01 * np.sqrt(9.81 * 2), rel=1e-3)
    assert angular_frequency(370.0) / 370.0 == pytest.approx(0.23, abs=0.001)  # slowest wave


@pytest.mark.parametrize(
    "settings", [{"wind_speed": -1}, {"wind_speed": np.nan}, {"wind_speed": 5, "fetch": 0},
                 {"wind_speed": 5, "depth": 0}, {"wind_speed": 5, "wind_direction": np.inf}],
)  # fmt: skip
def test_bad_spectrum(settings):
    with pytest.raises(InputError):
        WaveSpectrum(**settings)


@pytest.mark.parametrize("settings", [(0.0, 64), (4.0, 2), (np.inf, 64)])
def test_bad_tile(settings):
    with pytest.raises(InputError):
        WaveSpectrum(5.0).realise(*settings)


def test_grid_too_coarse():
    with pytest.raises(InputError, match="finer"):
        WaveSpectrum(5.0).realise(4.0, 64).on_grid(32, 0.0)


def _single_wave(steepness=0.3, periods=3, tile=2.0):
    """One wave along x, whose crest is at the origin."""
    k = 2 * np.pi * periods / tile
    none = np.zeros(2)
    return k, WaveComponents(
        tile, np.array([[periods, 0]]), np.array([steepness / k]), np.array([2.0]),
        np.zeros(1), 0.0, none, none,
    )  # fmt: skip


def test_a_single_choppy_wave_is_gerstners():
    """x = q - a sin kq, z = a cos kq."""
    k, wave = _single_wave()
    q, a = np.arange(64) * 2.0 / 64, 0.3 / k
    found = wave.choppy(64, 0.0)
    np.testing.assert_allclose(found.shift_x[5], -a * np.sin(k * q), atol=1e-12)
    assert not found.shift_y.any()
    stretch = 1 - 0.3 * np.cos(k * q)
    np.testing.assert_allclose(found.stretch[7], stretch, atol=1e-12)
    np.testing.assert_allclose(found.slope_x[9], -0.3 * np.sin(k * q) / stretch, atol=1e-12)


def test_heights_and_slopes_over_places_of_a_choppy_wave():
    k, wave = _single_wave()
    surface = wave.choppy(256, 0.0)
    elevation, slope = surface.over_mean(128, surface.elevation, surface.slope_x)
    q, a = np.linspace(-1.0, 3.0, 40001), 0.3 / k
    x, at = np.arange(128) * 2.0 / 128, q - a * np.sin(k * q)
    np.testing.assert_allclose(elevation[3], np.interp(x, at, a * np.cos(k * q)), atol=3e-3 * a)
    rise = -0.3 * np.sin(k * q) / (1 - 0.3 * np.cos(k * q))
    np.testing.assert_allclose(slope[3], np.interp(x, at, rise), atol=3e-3)


def test_the_sea_has_sharp_crests_and_the_slopes_of_cox_and_munk():
    sea = WaveSpectrum(5.0)
    waves = sea.realise(16.0, 256, seed=1)

    def curvature_skewness(choppiness):
        surface = waves.choppy(512, 3.0, choppiness)
        (elevation,) = surface.over_mean(512, surface.elevation)
        step = 8  # cells; what is finer is noise of the interpolation
        curvature = sum(np.roll(elevation, n, axis) for n in (step, -step) for axis in (0, 1))
        curvature = curvature - 4 * elevation
        return float((curvature**3).mean() / curvature.std() ** 3)

    assert curvature_skewness(1.0) < -0.1  # crests turn down sharply, troughs up gently
    assert abs(curvature_skewness(0.0)) < 0.05
    assert curvature_skewness(-1.0) > 0.1
    surface = waves.choppy(512, 3.0)
    steep, gentle = surface.over_mean(256, surface.slope_x, surface.slope_y)
    shown = steep.var() + gentle.var() + waves.longer.sum() + waves.shorter.sum()
    assert shown == pytest.approx(slope_variance_CoxMunk1954(5.0).sum(), abs=0.004)
    (level,) = surface.over_mean(256, surface.elevation)
    assert level.std() == pytest.approx(np.sqrt(waves.elevation_variance), rel=0.05)
