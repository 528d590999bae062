"""Scattered light of lamps on patches beside their beams, against photons."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_water
from underwater_spectral.uw_spectral.lamps.profile import SpotProfile
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import HenyeyGreenstein, Isotropic
from underwater_spectral.validation import lamp_cases
from underwater_spectral.validation.lamp_photons import summed

SPOT = SpotProfile(math.radians(60.0), 0.3)
UP = (0.0, 0.0, 1.0)


def _water(phase, albedo):
    return lamp_water([1.0 - albedo], [albedo], BandPhase((phase,), np.ones((1, 1))))


def _scattered(lamp, normal, water):
    patch = patch_past_lamp(lamp, (0.0, 0.0, 0.0), normal)
    return [float(E[0]) for E in surface_irradiance(lamp, patch, water)[1:]]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("phase", [Isotropic(), HenyeyGreenstein(0.8)])
@pytest.mark.parametrize(
    ("position", "axis"),
    [
        ((0.3, 0.0, 0.6), (0.0, 1.0, 0.0)),  # the beam passes beside the patch
        ((0.0, 0.0, 0.6), (0.0, 0.0, -1.0)),  # shines on it
        ((0.2, 0.5, 0.7), (-0.8, 0.6, 0.0)),
    ],
)
def test_patches_beside_a_beam_get_what_photons_find(phase, position, axis):
    function = BandPhase((phase,), np.ones((1, 1)))
    case = lamp_cases.Case("patch", function, SPOT, np.array(position), np.array(axis), math.inf)
    traced = lamp_cases.traced(case, 60000, 4)
    for albedo in (0.2, 0.5):
        wanted, error = summed(traced, albedo)
        found = sum(_scattered(case.lamp(), UP, _water(phase, albedo)))
        assert error < 0.05 * wanted
        assert found == pytest.approx(wanted, rel=0.05, abs=1.5 * error)


def test_it_comes_from_the_side_of_the_beam():
    lamp = lamp_cases.Case(
        "patch", _water(Isotropic(), 0.5).phase, SPOT, np.array((0.0, 0.0, 0.5)),
        np.array((1.0, 0.0, 0.0)), math.inf,
    ).lamp()  # fmt: skip
    water = _water(Isotropic(), 0.5)
    towards, away = (_scattered(lamp, (x, 0.0, 0.0), water)[1] for x in (1.0, -1.0))
    assert towards > 2.0 * away > 0.0
    # On both sides of the plane of the beam it is alike.
    left, right = (_scattered(lamp, (0.0, y, 0.0), water)[1] for y in (1.0, -1.0))
    assert left == pytest.approx(right, rel=1e-9)


def test_of_a_lamp_without_a_beam_it_is_alike_round_the_lamp():
    water = _water(HenyeyGreenstein(0.5), 0.8)
    lamp = lamp_cases.Case(
        "patch", water.phase, lamp_cases.PROFILES["isotropic"], np.array((0.0, 0.0, 0.7)),
        np.array((1.0, 0.0, 0.0)), math.inf,
    ).lamp()  # fmt: skip
    sides = ((0.6, 0.0, 0.8), (-0.6, 0.0, 0.8), (0.0, 0.6, 0.8))
    found = [_scattered(lamp, normal, water)[1] for normal in sides]
    assert found == pytest.approx([found[0]] * 3, rel=0.002)


def test_nothing_is_negative_or_lost_at_extremes():
    water = _water(HenyeyGreenstein(0.9), 0.6)
    for r in (1e-4, 0.05, 30.0, 1e4):
        for normal in np.eye(3):
            for sign in (1.0, -1.0):
                lamp = lamp_cases.Case(
                    "patch", water.phase, SPOT, np.array((0.0, 0.0, r)),
                    np.array((0.0, 0.0, -1.0)), math.inf,
                ).lamp()  # fmt: skip
                found = _scattered(lamp, tuple(sign * normal), water)
                assert np.isfinite(found).all()
                assert min(found) >= 0.0
