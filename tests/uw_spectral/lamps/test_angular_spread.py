"""How scattering spreads the light of a lamp: what is kept, limits and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.angular_spread import WaterSpread
from underwater_spectral.uw_spectral.lamps.delta_scaled_phase import RESOLVED, wide_moments
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile, rov_lamp
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase, seawater_mixture

B = np.array([0.05, 0.7])
HG = parse_phase("hg:0.9").for_bands(B)
SEA = seawater_mixture(B, 0.02 * B)
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(800)


def _deflected(spread, half, length):
    """Light that goes nearly straight on by its deflection, over the length, 1/(sr m)."""
    return np.exp(spread.narrow.at(length=length, half=half[..., None]))


@pytest.mark.parametrize("phase", [HG, SEA])
@pytest.mark.parametrize("length", [0.1, 2.0, 10.0])
def test_light_that_harmonics_have_not_goes_somewhere(phase, length):
    """What is scattered twice and more, less that of what is left of scattering."""
    half = math.pi / 2 * ((_PLACES + 1) / 2) ** 3
    d_half = math.pi / 2 * 3 * ((_PLACES + 1) / 2) ** 2 * _WEIGHTS / 2
    sphere = (4 * math.pi * np.sin(2 * half) * d_half)[:, None]
    found = (_deflected(WaterSpread(B, phase), half, length) * sphere).sum(axis=0) * length
    whole, left = (
        1 - np.exp(-b * length) * (1 + b * length)
        for b in (B, B * wide_moments(phase, 0, RESOLVED)[0])
    )
    assert found == pytest.approx(whole - left, rel=0.03)


def test_isotropic_scattering_is_all_in_the_harmonics():
    spread = WaterSpread(B, parse_phase("isotropic").for_bands(B))
    for length in (0.5, 20.0):
        assert np.all(_deflected(spread, np.array([0.1, 1.5]), length) < 1e-12)


def test_without_scattering_there_is_nothing():
    spread = WaterSpread(np.zeros(1), parse_phase("hg:0.9").for_bands([0.0]))
    assert _deflected(spread, np.array([0.1]), 3.0) < 1e-25
    assert not spread.on_patches.values.any()
    assert np.isfinite(spread.profile(rov_lamp()).values).all()


@pytest.mark.parametrize("profile", [rov_lamp(), SpotProfile(math.radians(60), 0.5)])
def test_a_blurred_profile_keeps_its_light_and_loses_its_shape(profile):
    grid = WaterSpread(B, SEA).profile(profile)
    cosine = _PLACES[:, None]
    widest = []
    for length in (0.1, 5.0, 900.0):
        values = grid.at(length=length, cosine=cosine)
        light = 2 * math.pi * (values * _WEIGHTS[:, None]).sum(axis=0)
        assert light == pytest.approx(profile.solid_angle, rel=0.02)
        widest.append(values[:, 1].max())
    assert widest[0] > widest[1] > widest[2]
    # What is turned by little only is not yet even.
    even = profile.solid_angle / (4 * math.pi)
    assert 1.1 * even < widest[2] < 2.0 * even
    even = WaterSpread(B, SEA).profile(IsotropicProfile()).values
    assert even == pytest.approx(np.ones_like(even), abs=1e-3)


def test_the_table_is_as_fine_as_the_sum_needs():
    spread, half = WaterSpread(B, SEA), np.geomspace(0.01, 1.5, 7)
    orders = np.arange(401.0)
    chi = np.concatenate([np.ones((1, 2)), SEA.moments(400)])
    polynomials = np.polynomial.legendre.legvander(np.cos(2 * half), 400)
    fading = np.exp(-((2 * orders / 400) ** 4)) * (2 * orders + 1)
    for length in (0.3, 4.0):
        x = B * length
        wide = wide_moments(SEA, 400, RESOLVED)
        whole, left = (
            np.exp(x * (part - part[0])) - np.exp(-x * part[0]) * (1 + x * part)
            for part in (chi, wide)
        )
        wanted = polynomials @ (fading[:, None] * (whole - left)) / (4 * math.pi * length)
        assert _deflected(spread, half, length) == pytest.approx(wanted, rel=0.02)
