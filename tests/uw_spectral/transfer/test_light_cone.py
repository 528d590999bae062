"""The cone that stands for the light from above."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.transfer.light_cone import NARROWEST, WIDEST, light_cone
from underwater_spectral.uw_spectral.transfer.light_field import solve_light_field

SUN = np.array([0.6, 0.0, -0.8])


def _cone(a, b, y=5.0, chi=(0.9, 0.81), **light):
    return light_cone(solve_light_field([a], [b], *chi, **{"E": 1.0, "mu_s": 0.8} | light), y, SUN)


def test_it_follows_the_sun_at_first_and_turns_upright_deep_down():
    # χ2 = 1 would scatter everything straight on.
    near = _cone(0.1, 0.5, 0.05, chi=(0.999, 0.998))
    assert near.direction == pytest.approx(SUN, abs=0.05)
    deep = _cone(0.1, 0.5, 200.0)
    assert deep.direction == pytest.approx([0, 0, -1], abs=1e-3)
    assert NARROWEST <= near.half_angle < deep.half_angle <= WIDEST


def test_without_light_it_is_wide_and_upright():
    for cone in (_cone(10.0, 1.0, 1e4), _cone(0.1, 0.2, E=0.0)):
        assert cone.direction == pytest.approx([0, 0, -1])
        assert cone.half_angle == WIDEST


def test_a_uniform_sky_fills_a_cone_of_its_mean_cosine():
    # Isotropic light from above has a mean cosine of 1/2: a hemisphere, held at the widest.
    assert _cone(1e-9, 1e-9, 1.0, E=0.0, E_sky=1.0).half_angle == WIDEST
    assert math.isclose(WIDEST, math.pi / 3)
