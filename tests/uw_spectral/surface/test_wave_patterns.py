"""Waves of a moment, and the formulas by which a renderer reads them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.surface.refraction import (
    fresnel_reflectance,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.surface.wave_patterns import (
    KNOTS,
    LAYERS,
    Sea,
    interp,
    layer_position,
    pattern_at,
    sunlight_factor,
    under_waves,
)
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    OpticalLayer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.radiance_field import (
    Ripples,
    sun_image,
    surface_normal,
)
from underwater_spectral.uw_spectral.transfer.sky import Sky
from underwater_spectral.uw_spectral.transfer.sunlit_water import SunlitWater
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.closed_form.closed_form import solve_closed_form
from underwater_spectral.validation.closed_form.light_field import (
    TwoStreamWater,
    solve_light_field,
)
from underwater_spectral.validation.closed_form.paths import under_surface

SUN = sun_travel_direction(30.0, 20.0)
SEA = Sea(5.0, seed=2, tile=4.0, resolution=128)
PHASE = parse_phase("hg:0.9").for_bands(np.ones(2))


def _water(sky=0.2, index=1.34):
    water = TwoStreamWater([0.05, 0.3], [0.1, 0.2], PHASE.chi1, PHASE.chi2)
    field = solve_light_field(water, [1.0, 1.0], -SUN[2], E_sky=sky)
    return solve_closed_form(field, PHASE, 3.0, SUN)


def test_formulas_are_those_of_the_layers():
    now = SEA.at(1.0, SUN, 1.34)
    first, last = now.layers.depths[[0, -1]]
    log_first, per_log = math.log(first), (LAYERS - 1) / math.log(last / first)
    for depth in (0.2, 0.7, first, 3.0, 17.0, last, 80.0):
        position = layer_position(depth, log_first, per_log)
        seen = pattern_at(depth, position, list(now.layers.images.astype(float)))
        assert seen == pytest.approx(now.layers.blend(depth), abs=1e-5)


def test_contrast_between_the_knots_is_close():
    now = SEA.at(1.0, SUN, 1.34)
    layer = OpticalLayer(math.inf, np.array([0.05, 0.3]), np.array([0.1, 0.2]), PHASE)
    sky = Sky.standard("uniform", np.full(2, 0.2), SUN.tolist())
    lit = SunlitWater(solve_discrete_ordinates([layer], np.ones(2), SUN.tolist(), sky=sky))
    knots = now.contrast(lit)
    assert knots.shape == (KNOTS, 2)
    first, last = now.layers.depths[[0, -1]]
    for depth in (2.2, 3.1, 5.0, 12.0, 20.0):
        position = 2 * layer_position(depth, math.log(first), (LAYERS - 1) / math.log(last / first))
        assert interp(position, list(knots)) == pytest.approx(
            now.layers.contrast(lit, depth), abs=0.06
        )


def test_light_is_kept_and_calm_is_even():
    now = SEA.at(3.0, SUN, 1.34)
    assert now.caustics_image().mean(axis=(0, 1)) == pytest.approx(1.0, abs=1e-4)
    calm = dataclasses.replace(SEA, wind_speed=0.0).at(3.0, SUN, 1.34)
    assert np.all(calm.caustics_image() == 1.0)
    assert not calm.slopes_image()[..., :3].any()
    assert sunlight_factor(pattern_at(2.0, 1.3, [1.0] * 4), 1.2) == 1.0


def test_a_moment_does_not_depend_on_others_and_a_loop_closes():
    looping = dataclasses.replace(SEA, loop_seconds=2.0)
    start = looping.at(0.0, SUN, 1.34).caustics_image()
    assert looping.at(2.0, SUN, 1.34).caustics_image() == pytest.approx(start, abs=1e-4)
    assert np.array_equal(looping.at(0.0, SUN, 1.34).caustics_image(), start)
    halfway = looping.at(1.0, SUN, 1.34).caustics_image()
    assert np.corrcoef(halfway.ravel(), start.ravel())[0, 1] < 0.8


def test_place_under_the_waves_lies_back_along_the_sun():
    x, y = under_waves(1.0, 2.0, 3.0, SUN)
    back = np.array([x, y, 0.0]) - (1.0, 2.0, -3.0)
    assert back / np.linalg.norm(back) == pytest.approx(-SUN)


@pytest.mark.parametrize("wind", [0.5, 25.0])
@pytest.mark.parametrize("zenith", [0.0, 89.9])
def test_extremes(wind, zenith):
    sea = dataclasses.replace(SEA, wind_speed=wind)
    now = sea.at(1e6, sun_travel_direction(zenith, 0.0), 1.34, 100.0)
    image = now.caustics_image()
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert image.max() < 60


def test_flat_surface_with_slopes_zero_is_the_flat_surface():
    water = _water()
    z = np.linspace(0.02, 1.0, 50)[:, None]
    w = (np.sqrt(1 - z * z), 0 * z, z)
    flat = under_surface(water, w, 0.3, 1.34)
    assert under_surface(water, w, 0.3, 1.34, slopes=(0.0, 0.0)) == pytest.approx(flat, rel=1e-6)


def test_no_energy_is_gained_under_a_tilted_surface():
    """A sky of 1 and water that is as bright as n² of it: nothing above n²."""
    n = 1.34
    random = np.random.default_rng(0)
    w = random.normal(size=(500, 3))
    w[:, 2] = np.abs(w[:, 2])
    w /= np.linalg.norm(w, axis=1)[:, None]
    slopes = random.normal(scale=0.3, size=(2, 500, 1))
    normal = surface_normal(*slopes)
    cosine = sum(w[:, i, None] * normal[i] for i in range(3))
    reflectance = fresnel_reflectance(np.maximum(cosine, 0), 1 / n)
    seen = under_surface(_water(sky=0.0), [w[:, i, None] for i in range(3)], 1.0, n, slopes=slopes)
    dark = solve_closed_form(
        solve_light_field(
            TwoStreamWater([50.0], [1e-9], PHASE.chi1[:1], PHASE.chi2[:1]), [0.0], -SUN[2]
        ),
        parse_phase("hg:0.9").for_bands([1.0]), 0.0, SUN,
    )  # fmt: skip
    only_sky = under_surface(dark, [w[:, i, None] for i in range(3)], 1.0, n, slopes=slopes)
    assert only_sky == pytest.approx((1 - reflectance) * n * n, abs=1e-6)
    assert np.all(np.isfinite(seen))


def test_glitter_carries_the_irradiance_of_the_sun():
    """Its radiance times the cosine, over the hemisphere, is E: nothing lost or gained."""
    water = _water()
    zenith = np.linspace(0, math.pi / 2, 1201)[:-1] + math.pi / 4800
    turn = np.linspace(0, 2 * math.pi, 1440, endpoint=False)
    theta, phi = np.meshgrid(zenith, turn, indexing="ij")
    w = [
        a[..., None]
        for a in (np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))
    ]
    L = sun_image(water.sun, w, 1.34, Ripples((0.0, 0.0), 0.03**2)) * water.field.E
    weight = np.sin(theta) * np.cos(theta) * (zenith[1] - zenith[0]) * (turn[1] - turn[0])
    assert (L * weight[..., None]).sum(axis=(0, 1)) == pytest.approx(water.field.E, rel=0.01)
