"""Tone curves: grey stays, order stays, the tables' own nodes are met; the meter's rules."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.colour_rendering import metered_stops
from underwater_spectral.uw_spectral.spectra.spectrum import shipped_table
from underwater_spectral.uw_spectral.spectra.tone import CAMERA_CURVES, MIDDLE_GREY, camera_curve


@pytest.mark.parametrize("name", CAMERA_CURVES)
def test_a_camera_curve_meets_its_nodes_and_keeps_grey_and_order(name):
    curve = camera_curve(name)
    table = shipped_table("camera_tone_curves.csv").columns
    gain = curve.white / table[f"{name}:raw"][-1]
    np.testing.assert_allclose(curve(table[f"{name}:raw"] * gain), table[f"{name}:picture"])
    assert float(curve(MIDDLE_GREY)) == pytest.approx(MIDDLE_GREY, rel=1e-4)
    outputs = curve(np.linspace(0.0, 1.2 * curve.white, 20_000))
    assert (np.diff(outputs) >= 0).all()
    # No kinks at the nodes: the slope does not jump.
    slopes = np.diff(outputs[: int(20_000 / 1.2)])
    assert np.abs(np.diff(slopes)).max() < 0.02 * slopes.max()


@pytest.mark.parametrize("name", CAMERA_CURVES)
def test_a_camera_curve_is_steeper_than_linear_at_grey_and_rolls_off(name):
    curve = camera_curve(name)
    slope = np.log2(float(curve(0.2) / curve(0.16))) / np.log2(0.2 / 0.16)
    assert 1.1 < slope < 1.7
    assert 0.7 < float(curve(1.0)) < 0.95
    assert curve.white > 2.0


def test_an_unknown_curve_is_named():
    with pytest.raises(InputError, match="Near names: nikon-d7000"):
        camera_curve("nikon-d700")


def test_the_meter_follows_the_mean_and_spares_the_highlights():
    even = np.full(50, 0.045)
    fraction = np.full(50, 0.02)
    assert metered_stops(even, fraction) == pytest.approx(2.0)
    # One ray of fifty may burn out, two may not.
    assert metered_stops([*even[:-1], 0.5], fraction) == pytest.approx(
        np.log2(0.18 / (0.98 * 0.045 + 0.02 * 0.5))
    )
    assert metered_stops([*even[:-2], 0.5, 0.5], fraction) == pytest.approx(1.0)
    # Shares need not add up to one, nor be equal.
    assert metered_stops([0.09, 0.36], [2.0, 1.0]) == pytest.approx(0.0)
    with pytest.raises(InputError, match="nothing in it is lit"):
        metered_stops(np.zeros(5), np.ones(5))
