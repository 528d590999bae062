from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.surface.caustics import (
    bake_layers,
    caustic_pattern,
    disc_transfer,
    ray_density,
    refracted_offset,
)
from underwater_spectral.uw_spectral.surface.refraction import (
    fresnel_reflectance,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.surface.wave_components import EVEN, WaveComponents
from underwater_spectral.uw_spectral.surface.waves import WaveSpectrum
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    OpticalLayer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.sky import Sky
from underwater_spectral.uw_spectral.transfer.sunlit_water import SunlitWater, scattering_transfer
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.caustics_at_sea import layer_depths, whole_contrast

SUN = sun_travel_direction(35, 50)
WAVES = WaveSpectrum(5.0, 20.0).realise(4.0, 128, seed=1)


def _water(a=(0.05, 0.4), b=(0.5, 0.3), phase="fournier-forand:1.10,0.0183", sky=0.1):
    functions = parse_phase(phase).for_bands(b)
    layer = OpticalLayer(math.inf, np.array(a), np.array(b), functions)
    above = Sky.standard("uniform", np.full(len(a), sky), SUN.tolist())
    field = solve_discrete_ordinates([layer], np.ones(len(a)), SUN.tolist(), sky=above)
    return SunlitWater(field)


def _patterns(water, pattern, tile, depth, collector=0.0):
    """Relative Ed per band, shape (N, N, n), of mean 1; arguments as of SunlitWater.variation."""
    transfer = water._transfer(pattern, tile, depth, collector)
    transfer[0, 0] = 1.0
    bands = np.fft.rfft2(pattern)[..., None] * transfer
    shown = np.maximum(np.fft.irfft2(bands, pattern.shape, axes=(0, 1)), 0.0)
    return shown / shown.mean(axis=(0, 1))


def test_snell_on_a_tilted_facet():
    """Tilting the water by 10° is the flat refraction 10° away from it."""
    tilt, zenith = math.radians(10), math.radians(35)
    direction = sun_travel_direction(35, 0)
    # Normal leans to +x for a slope of -tan; light travelling to +x meets it at 35 + 10.
    x, y, flux = refracted_offset(-math.tan(tilt), 0.0, direction)
    inside = math.asin(math.sin(zenith + tilt) / 1.34) - tilt
    assert x == pytest.approx(math.tan(inside))
    assert y == pytest.approx(0)
    flat = refracted_offset(0.0, 0.0, direction)
    np.testing.assert_allclose(flat[0], direction[0] / -direction[2])
    assert flux < flat[2]


def test_no_index_no_bending():
    x, y, _ = refracted_offset([0.3, -0.2], [0.1, 0.4], sun_travel_direction(20, 0, 1.0), 1.0)
    np.testing.assert_allclose(x, math.tan(math.radians(20)), rtol=1e-12)
    np.testing.assert_allclose(y, 0, atol=1e-12)


@pytest.mark.parametrize("depth", [0.0, 0.01, 1.0, 100.0])
def test_flat_water_is_exactly_one(depth):
    flat = WaveSpectrum(0.0).realise(4.0, 64)
    assert np.all(caustic_pattern(flat, SUN, depth, 3.0, 64) == 1)
    water = _water()
    np.testing.assert_allclose(_patterns(water, np.ones((64, 64)), 4.0, 1.0), 1, rtol=1e-12)
    assert not water.variation(np.ones((64, 64)), 4.0, 1.0).any()


@pytest.mark.parametrize("zenith", [0, 60, 90])
@pytest.mark.parametrize("wind", [2.0, 25.0])
@pytest.mark.parametrize("depth", [0.0, 0.01, 1.0, 10.0, 100.0])
def test_energy_and_extremes(zenith, wind, depth):
    waves = WaveSpectrum(wind).realise(8.0, 128, seed=4)
    pattern = caustic_pattern(waves, sun_travel_direction(zenith, 30), depth, 1e6, 128)
    assert np.isfinite(pattern).all()
    assert pattern.min() >= 0
    assert pattern.mean() == pytest.approx(1, abs=1e-9)
    assert pattern.max() < 60


def test_index_matched_water_has_no_caustics():
    sun = sun_travel_direction(0, 0, 1.0)
    pattern = caustic_pattern(WAVES, sun, 2.0, 0.0, 128, refractive_index=1.0)
    np.testing.assert_allclose(pattern, 1, atol=1e-9)


def test_weak_lens_follows_the_curvature():
    """Flat waves: irradiance is 1 - y (1 - 1/n) ∇²η; a crest gathers."""
    drawn = WaveSpectrum(3.0).realise(4.0, 16, seed=1)
    waves = dataclasses.replace(drawn, amplitude=1e-4 * drawn.amplitude)
    depth, n = 2.0, 256
    step = np.arange(n) * 4 / n
    x, y = np.meshgrid(step, step)
    curvature = -sum(
        a * (k @ k) * np.cos(k[0] * x + k[1] * y + p)
        for a, k, p in zip(waves.amplitude, waves.k, waves.phase, strict=True)
    )
    lens = ray_density(waves, sun_travel_direction(0, 0), depth, 0.0, n, rays=4 * n) - 1
    expected = -depth * (1 - 1 / 1.34) * curvature
    assert (lens - expected).std() < 0.05 * expected.std()


def test_ripples_that_lie_in_patches_blur_less():
    """Against patches drawn one by one: a gamma distribution of the ripples' variance."""
    depth, sun = 2.0, sun_travel_direction(20, 0)
    drawn = WaveSpectrum(5.0).realise(5.0, 128, seed=1)
    waves = dataclasses.replace(drawn.below(drawn.ripples.longest), ripples=drawn.ripples)
    even = dataclasses.replace(waves, ripples=EVEN)
    u = drawn.ripples.unevenness
    # c₂₂ of Cox & Munk, on the whole of the slopes.
    share = drawn.ripples.variance.sum() / WaveSpectrum(5.0).mean_square_slope
    assert u * share**2 == pytest.approx(0.12)
    random = np.random.default_rng(4)
    power = np.mean([
        caustic_pattern(
            dataclasses.replace(even, shorter=v * waves.shorter), sun, depth, 0.0, 128
        ).var()
        for v in random.gamma(1 / u, u, 1000)
    ])  # fmt: skip
    assert caustic_pattern(waves, sun, depth, 0.0, 128).var() == pytest.approx(power, rel=0.05)
    assert caustic_pattern(even, sun, depth, 0.0, 128).var() < 0.8 * power


def test_rays_enough():
    """Four times the rays change the pattern by little."""
    coarse = ray_density(WAVES.below(60), SUN, 2.0, 1.0, 128)
    fine = ray_density(WAVES.below(60), SUN, 2.0, 1.0, 128, rays=512)
    assert coarse.std() == pytest.approx(fine.std(), rel=0.1)


def test_scrubs_and_loops():
    waves = WaveSpectrum(5.0).realise(4.0, 64, seed=1, loop_seconds=3.0)
    first = caustic_pattern(waves, SUN, 1.0, 0.7, 64)
    caustic_pattern(waves, SUN, 1.0, 2.0, 64)
    np.testing.assert_array_equal(first, caustic_pattern(waves, SUN, 1.0, 0.7, 64))
    np.testing.assert_allclose(first, caustic_pattern(waves, SUN, 1.0, 3.7, 64), atol=1e-8)


def test_anchored_along_the_sun():
    """Two depths of one sea lie on top of each other although the sun is low."""
    waves = WaveSpectrum(4.0).realise(16.0, 512, seed=1)
    sun = sun_travel_direction(60, 0)
    one, two = (caustic_pattern(waves, sun, depth, 0.0, 512) - 1 for depth in (2.0, 2.4))
    spectrum = np.fft.fft2(one) * np.conj(np.fft.fft2(two))
    peak = np.unravel_index(np.argmax(np.fft.ifft2(spectrum).real), one.shape)
    shift = (np.array(peak) + 256) % 512 - 256
    assert np.abs(shift).max() * 16 / 512 < 0.1  # unanchored: 0.4 m × tan = 0.34 m


def test_disc_transfer_against_a_drawn_disc():
    x = np.linspace(-1, 1, 4001)
    chord = np.sqrt(1 - x**2)
    for k in (0.5, 3.0, 20.0, 150.0):
        drawn = np.sum(chord * np.cos(k * x)) / np.sum(chord)
        assert disc_transfer(k) == pytest.approx(drawn, abs=2e-4)
    assert disc_transfer(1e9) == 0


def test_scattering_transfer_limits():
    phase = parse_phase("hg:0.9").for_bands([0.4])
    exponent = scattering_transfer([0.4], phase, 0.8, 4.0, [0.0, 1e-3, 1.0, 1e5])[:, 0]
    assert exponent[0] == pytest.approx(0.4 * 4 / 0.8)
    assert exponent[1] == pytest.approx(exponent[0], rel=1e-2)
    assert np.all(np.diff(exponent) <= 0)
    assert exponent[-1] < 1e-3
    # HG: χ(l) = g^l, integrated in closed form.
    expected = 0.4 * (0.5 + (1 - 0.9**4.5) / -math.log(0.9))
    assert exponent[2] == pytest.approx(expected, rel=0.002)


def test_red_carries_more_than_blue_and_shallow_more_than_deep():
    water = _water()
    deep = WaveSpectrum(5.0).realise(8.0, 256, seed=1)
    fractions = [
        water.variation(caustic_pattern(deep, SUN, y, 0.0, 256), 8.0, y) for y in (1.0, 4.0, 8.0)
    ]
    assert np.all(np.diff(fractions, axis=0) < 0)
    assert np.all(np.array(fractions)[:, 1] > np.array(fractions)[:, 0])


def test_variation_is_that_of_the_patterns():
    pattern = caustic_pattern(WAVES, SUN, 2.0, 0.0, 128)
    water = _water()
    for collector in (0.0, 0.1):
        bands = _patterns(water, pattern, 4.0, 2.0, collector)
        np.testing.assert_allclose(bands.mean(axis=(0, 1)), 1, atol=1e-12)
        np.testing.assert_allclose(
            bands.std(axis=(0, 1)), water.variation(pattern, 4.0, 2.0, collector), rtol=0.01
        )


def test_water_without_scattering_or_sky_keeps_the_pattern():
    pattern = caustic_pattern(WAVES, SUN, 2.0, 0.0, 128)
    water = _water(b=(0.0, 0.0), sky=0.0)
    np.testing.assert_allclose(water.variation(pattern, 4.0, 2.0), pattern.std(), rtol=1e-6)
    np.testing.assert_allclose(whole_contrast(water, pattern, 4.0, 2.0), 1, rtol=1e-6)


def test_dark_water_is_finite():
    pattern = caustic_pattern(WAVES, SUN, 100.0, 0.0, 128)
    water = _water(a=(20.0, 0.01), b=(30.0, 5.0))
    for values in (
        whole_contrast(water, pattern, 4.0, 100.0),
        water.variation(pattern, 4.0, 100.0),
        _patterns(water, pattern, 4.0, 100.0),
    ):
        assert np.isfinite(values).all()


def test_layers():
    waves = WaveSpectrum(5.0).realise(8.0, 256, seed=1)
    layers = bake_layers(waves, SUN, layer_depths(1.0, 8.0), 0.0, 256)
    assert layers.images.dtype == np.float32
    np.testing.assert_allclose(layers.images.mean(axis=(1, 2)), 1, atol=1e-5)
    np.testing.assert_array_equal(layers.blend(0.1), layers.blend(1.0))
    np.testing.assert_array_equal(layers.blend(50.0), layers.blend(8.0))
    water = _water()
    for depth in (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0):
        truth = caustic_pattern(waves, SUN, depth, 0.0, 256)
        contrast = layers.contrast(water, depth)
        grey = layers.blend(depth)
        modelled = water.sun_fraction(depth) * contrast * grey.std()
        # Where most of the light has been scattered, the sun's share cannot carry the pattern.
        free = contrast < 1.5
        assert free.any() or depth > 4.0
        np.testing.assert_allclose(
            modelled[free], water.variation(truth, 8.0, depth)[free], rtol=0.1
        )
        assert (modelled <= 1.1 * water.variation(truth, 8.0, depth)).all()


@pytest.mark.parametrize("depth", [-1.0, np.nan, np.inf])
def test_bad_depth(depth):
    with pytest.raises(InputError, match="depth"):
        caustic_pattern(WAVES, SUN, depth, 0.0, 128)


@pytest.mark.parametrize("depths", [[], [0.0, 1.0], [2.0, 1.0]])
def test_bad_layers(depths):
    with pytest.raises(InputError, match="increase"):
        bake_layers(WAVES, SUN, depths, 0.0, 128)


def test_bad_layer_range():
    with pytest.raises(InputError, match="shallowest"):
        layer_depths(0.0, 3.0)


@pytest.mark.slow
def test_rays_of_a_choppy_wave_land_where_gerstners_send_them():
    """Sun overhead, one wave along x: rays counted by their own places, Snell by angles."""
    tile, k, steep, depth, bins = 2.0, 3 * math.pi, 0.2, 0.7, 64
    none = np.zeros(2)
    wave = WaveComponents(
        tile, np.array([[3, 0]]), np.array([steep / k]), np.ones(1), np.zeros(1), 0.0, none, none
    )
    straight_down = sun_travel_direction(0.0, 0.0)
    found = ray_density(wave, straight_down, depth, 0.0, 512, rays=2048, choppiness=1.0)
    q = (np.arange(400_000) + 0.5) * tile / 400_000
    height, x = steep / k * np.cos(k * q), q - steep / k * np.sin(k * q)
    fall = np.arctan(steep * np.sin(k * q) / (1 - steep * np.cos(k * q)))  # of the surface, to +x
    refracted = fall - np.arcsin(np.sin(fall) / 1.34)
    lands = np.mod(x - (depth + height) * np.tan(refracted), tile)
    weight = (1 - steep * np.cos(k * q)) * (1 - fresnel_reflectance(np.cos(fall), 1.34))
    counted = np.histogram(lands, bins, (0.0, tile), weights=weight)[0]
    shown = found.mean(axis=0)
    shown = (shown + np.roll(shown, -1)) / 2  # samples stand for places, bins begin at their edge
    shown = shown.reshape(bins, -1).mean(axis=1)
    np.testing.assert_allclose(shown, counted / counted.mean(), atol=0.05 * shown.max())
    assert shown.std() == pytest.approx((counted / counted.mean()).std(), rel=0.02)
