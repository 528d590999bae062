"""Irradiance of lamps on patches."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import Lamp
from underwater_spectral.uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile, rov_lamp
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

PHASE = parse_phase("hg:0.9").for_bands([1.0])
WATER = lamp_water([0.05, 0.2], [0.05, 0.4], parse_phase("hg:0.9").for_bands([1.0, 1.0]))
A, C = WATER.a, WATER.c
NOTHING = lamp_water([0.0], [0.0], PHASE)


def _irradiance(lamp, point, normal, water=WATER):
    """Unscattered, and scattered forward."""
    return surface_irradiance(lamp, patch_past_lamp(lamp, point, normal), water)[:2]


def test_it_falls_with_the_square_and_with_the_extinction():
    lamp = Lamp((1.0, 2.0, 3.0), (0, 0, -1), np.array([4.0, 8.0]), radius=0.0)
    direct, forward = _irradiance(lamp, (1.0, 2.0, 0.0), (0, 0, 1))
    assert direct == pytest.approx(np.array([4, 8]) / 9 * np.exp(-3 * C))
    # All that is scattered stays within 30° of its way but for a little.
    scattered = forward / (np.array([4, 8]) / 9 * np.exp(-3 * A) * (1 - np.exp(-3 * (C - A))))
    assert np.all((scattered > 0.8) & (scattered < 0.99))


def test_the_cosine_and_the_profile_count():
    lamp = Lamp((0, 0, 2), (0, 0, -1), np.ones(2), rov_lamp(), radius=0.0)
    # 45° from the axis and from the normal: between 0.5 and 0.2 of the profile.
    direct, _ = _irradiance(lamp, (2, 0, 0), (0, 0, 1))
    k40, k45, k50 = np.cos(np.radians([40, 45, 50]))
    profile = 0.2 + 0.3 * (k45 - k50) / (k40 - k50)
    assert direct == pytest.approx(profile / 8 * math.sqrt(0.5) * np.exp(-math.sqrt(8) * C))
    assert not np.any(_irradiance(lamp, (2, 0, 0), (0, 0, -1)))
    # Behind the lamp there is only what is thrown back by the water.
    direct, back = _irradiance(lamp, (0, 0, 4), (0, 0, -1))
    assert not direct.any()
    assert np.all(back < 0.005 * _irradiance(lamp, (0, 0, 0), (0, 0, 1))[1])


def test_all_light_of_a_lamp_arrives_on_a_sphere_round_it():
    spot = SpotProfile(math.radians(70), 0.5)
    lamp = Lamp((0, 0, 0), (0, 0, 1), 1.0, spot, radius=0.0)
    edges = np.linspace(-1, 1, 200001)
    cosine = (edges[1:] + edges[:-1]) / 2
    sine = np.sqrt(1 - cosine**2)
    point = (3 * sine, 0 * sine, 3 * cosine)
    normal = (-sine, 0 * sine, -cosine)
    direct, forward = _irradiance(lamp, point, normal, NOTHING)
    flux = 2 * math.pi * 9 * (direct * np.diff(edges)).sum()
    assert flux == pytest.approx(spot.solid_angle, rel=1e-4)
    assert not np.any(forward)


def test_a_disc_is_integrated_exactly_on_its_axis():
    # Radiance 1 on a disc of radius R: normal irradiance π R²/(r² + R²), intensity π R².
    R = 0.3
    lamp = Lamp((0, 0, 0.4), (0, 0, -1), math.pi * R * R, radius=R)
    rho = (np.arange(2000) + 0.5) / 2000 * R
    wanted = (2 * math.pi * rho * 0.4**2 / (rho**2 + 0.4**2) ** 2).sum() * R / 2000
    direct, _ = _irradiance(lamp, (0, 0, 0), (0, 0, 1), NOTHING)
    assert direct == pytest.approx(wanted, rel=1e-5)


def test_an_error_of_10_percent_in_c_or_the_intensity_shows():
    lamp = Lamp((0, 0, 2), (0, 0, -1), 1.0, radius=0.0)
    right, wrong = (lamp_water([0.2], [b], PHASE) for b in (0.3, 0.35))
    wanted = math.exp(-1.0) / 4
    assert _irradiance(lamp, (0, 0, 0), (0, 0, 1), right)[0] == pytest.approx(wanted, rel=1e-9)
    assert _irradiance(lamp, (0, 0, 0), (0, 0, 1), wrong)[0] < 0.95 * wanted


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_extremes_are_finite(dtype):
    profiles = (IsotropicProfile(), rov_lamp(), SpotProfile(0.02, 0.0))
    for r, c, radius, profile, z in itertools.product(
        (0.0, 1e-3, 1.0, 1e3), (0.0, 1e-6, 500.0), (0.0, 0.01), profiles, (-1, 1)
    ):
        zero, one = dtype(0), dtype(1)
        lamp = Lamp((zero, zero, dtype(r)), (zero, zero, dtype(z)), one, profile, dtype(radius))
        water = lamp_water([c / 2], [c / 2], PHASE).astype(dtype)
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            patch = patch_past_lamp(lamp, (zero,) * 3, (zero, zero, one))
            found = surface_irradiance(lamp, patch, water)
        assert np.all(np.isfinite(found))
        assert np.all(np.asarray(found) >= 0)


def test_diffuse_light_reaches_round_the_corner():
    spot = SpotProfile(math.radians(120))
    lamp = Lamp((0, 0, 2), (1, 0, 0), np.ones(2), spot)
    patch = patch_past_lamp(lamp, (0, 0, 0), (0, 0, 1))
    direct, forward, diffuse = surface_irradiance(lamp, patch, WATER)
    assert not direct.any()
    assert np.all(forward > 0)
    assert np.all(diffuse > 0)
    behind = surface_irradiance(lamp, patch_past_lamp(lamp, (0, 0, 0), (0, 0, -1)), WATER)[2]
    assert np.all((behind >= 0) & (behind < diffuse))
