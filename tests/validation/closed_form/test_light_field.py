from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.validation.closed_form.light_field import (
    TwoStreamWater,
    solve_light_field,
)

A, B = np.array([0.02, 0.05, 0.4]), np.array([0.004, 0.1, 1.0])


def _field(**changes):
    values = {"a": A, "b": B, "E": 1.0, "mu_s": 0.9, "r": 0.2, "y_f": 8.0} | changes
    water = TwoStreamWater(values.pop("a"), values.pop("b"), 0.8, 0.64)
    return solve_light_field(water, **values)


def test_boundary_conditions():
    field = _field(R=0.48, E_sky=0.3)
    down, up = field.Ed(0.0) - field.E, field.Eu(0.0)
    np.testing.assert_allclose(down, 0.3 + 0.48 * up, rtol=1e-12)
    np.testing.assert_allclose(field.Eu(8.0), 0.2 * field.Ed(8.0), rtol=1e-12)


@pytest.mark.parametrize("y_f", [8.0, math.inf])
def test_energy_balance(y_f):
    """Gershun's law: the net flux loses what is absorbed."""
    field = _field(y_f=y_f)
    y, step = np.linspace(0.5, 7.5, 8)[:, None], 1e-4
    net = [field.Ed(z) - field.Eu(z) for z in (y - step, y + step)]
    np.testing.assert_allclose(
        (net[0] - net[1]) / (2 * step), A * field.scalar_irradiance(y), rtol=1e-6
    )


def test_monte_carlo_irradiance():
    """Ed(y)/Ed(0) for a = .05, b = .1, HG .8, vertical sun (Monte Carlo)."""
    field = solve_light_field(TwoStreamWater(0.05, 0.1, 0.8, 0.64), 1.0, 1.0)
    y = np.array([0.5, 2, 5, 10, 20])[:, None]
    ratio = (field.Ed(y) / field.Ed(0.0))[:, 0]
    np.testing.assert_allclose(ratio, [0.9731, 0.8934, 0.7458, 0.5419, 0.2721], rtol=0.02)


def test_pure_absorption_is_beer_lambert():
    field = _field(b=0.0, r=0.0)
    np.testing.assert_allclose(field.Ed(5.0), np.exp(-A * 5 / 0.9), rtol=1e-9)
    np.testing.assert_allclose(field.Eu(5.0), 0, atol=1e-12)


def test_no_absorption_conserves_the_flux():
    field = _field(a=0.0, r=0.3)
    net = field.Ed(0.0) - field.Eu(0.0)
    np.testing.assert_allclose(field.Ed(8.0) - field.Eu(8.0), net, rtol=2e-3)


def test_white_furnace():
    """A white floor under water that does not absorb returns all light."""
    field = _field(a=0.0, r=1.0, E=0.0, E_sky=1.0)
    for y in (0.0, 4.0, 8.0):
        np.testing.assert_allclose(field.E0(y), 4, rtol=2e-3)


def test_deep_water_is_the_limit_of_a_far_floor():
    np.testing.assert_allclose(_field(y_f=math.inf).Ed(3.0), _field(y_f=2000.0).Ed(3.0), rtol=1e-9)


def test_surface_irradiance_adds_up_to_the_downwelling():
    field = _field(E_sky=0.2)
    direct, forward, diffuse = field.surface_irradiance(4.0, 0.9, 1.0)
    np.testing.assert_allclose(direct + forward + diffuse, field.Ed(4.0), rtol=1e-12)
    np.testing.assert_allclose(direct, np.exp(-(A + B) * 4 / 0.9), rtol=1e-12)
    away = field.surface_irradiance(4.0, -0.9, -1.0)
    np.testing.assert_allclose(away[0], 0)
    np.testing.assert_allclose(away[2], field.Eu(4.0), rtol=1e-12)


@settings(max_examples=200, deadline=None)
@given(
    c=st.sampled_from([0.0, 1e-9]) | st.floats(1e-4, 50),
    albedo=st.floats(0, 1),
    g=st.floats(-0.9, 0.99),
    mu_s=st.floats(0, 1),
    y_f=st.floats(1e-3, 1e4) | st.just(math.inf),
    r=st.floats(0, 1),
    R=st.sampled_from([0.0, 0.48, 1.0]),
    fraction=st.floats(0, 1),
)
def test_any_water_gives_finite_irradiance(c, albedo, g, mu_s, y_f, r, R, fraction):
    if R == 1 and r == 1:
        R = 0.48  # a closed mirror box holds any amount of light
    water = TwoStreamWater(c * (1 - albedo), c * albedo, g, g * g)
    field = solve_light_field(water, 1.0, mu_s, R=R, r=r, y_f=y_f, E_sky=0.3)
    y = fraction * min(y_f, 500.0)
    for value in (field.E0(y), field.F(y), field.Ed(y), field.Eu(y), field.floor_radiance()):
        assert np.isfinite(value).all()
    assert (field.Ed(0.0) > 0).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": [-0.1]}, "absorption"),
        ({"b": [np.nan]}, "scattering"),
        ({"r": 1.1}, "floor reflectance must be finite and 0 to 1"),
        ({"y_f": 0.0}, "floor must lie below"),
        ({"mu_s": 1.5}, "sun cosine"),
        ({"E": np.inf}, "sun irradiance"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(InputError, match=message):
        _field(**change)
