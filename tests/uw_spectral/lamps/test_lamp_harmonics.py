"""Light of lamps by spherical harmonics against an integral of closed form and against photons."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_harmonics import Harmonics
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import HenyeyGreenstein, Isotropic
from underwater_spectral.validation import lamp_cases

ALBEDO = 0.8


def test_round_an_even_lamp_in_even_water_it_is_the_known_integral():
    """Fluence of what is scattered, from Case, de Hoffmann and Placzek's Fourier integral."""
    phase = BandPhase((Isotropic(),), np.ones((1, 1)))
    solved = Harmonics(np.array([1.0 - ALBEDO]), np.array([ALBEDO]), phase, 10)
    k = np.linspace(1e-6, 3000.0, 3_000_000)
    straight = np.arctan(k) / k
    scattered = ALBEDO * straight**2 / (1.0 - ALBEDO * straight) * np.exp(-((k / 1200.0) ** 2))
    found = solved.radial[:, 0, 0, 0, 0]
    for row in range(4, 22, 4):
        wave = k * k * np.sinc(k * solved.distances[row] / math.pi) * scattered
        wanted = np.trapezoid(wave, k) / (2.0 * math.pi**2)
        assert found[row] == pytest.approx(wanted, rel=0.015)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("position", "axis", "profile"),
    [
        ((0.6, 0.0, 0.0), (0.0, 0.0, 1.0), SpotProfile(math.radians(60.0), 0.3)),
        ((0.5, 0.0, 0.9), (-1.0, 0.0, 0.0), SpotProfile(math.radians(90.0), 0.5)),
        ((0.4, 0.0, 0.8), (0.0, 0.0, -1.0), IsotropicProfile()),
    ],
)
def test_light_scattered_twice_is_what_photons_find(position, axis, profile):
    # Of more scatterings rare photons bring much.
    phase, albedo = BandPhase((HenyeyGreenstein(0.7),), np.ones((1, 1))), 1e-3
    case = lamp_cases.Case("in view", phase, profile, np.array(position), np.array(axis), 3.0)
    traced = lamp_cases.traced(case, 40000, 1)[:, 1]
    error = float(traced.std(ddof=1)) / math.sqrt(len(traced))
    lamp = case.lamp()
    ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), case.P)
    water = lamp_water([1.0 - albedo], [albedo], phase)
    twice = float(lamp_light(lamp, ray, water)[1][0]) / albedo**2
    assert twice == pytest.approx(float(traced.mean()), abs=3.0 * error)
    assert error < 0.025 * traced.mean()
