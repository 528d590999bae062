from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.surface.refraction import (
    fresnel_reflectance,
    in_water_cosine,
    refractive_index_QuanFry1995,
    sun_travel_direction,
)
from underwater_spectral.validation.closed_form.internal_reflectance import (
    diffuse_internal_reflectance,
)


def test_snell():
    zenith = np.array([0.0, 30.0, 60.0, 89.9, 90.0])
    sine = np.sqrt(1 - in_water_cosine(zenith) ** 2)
    np.testing.assert_allclose(1.34 * sine, np.sin(np.radians(zenith)), atol=1e-12)


def test_no_refraction_is_exact_at_the_horizon():
    assert in_water_cosine(89.9999999, 1.0) == pytest.approx(np.radians(1e-7), rel=1e-6)


def test_fresnel_limits():
    assert fresnel_reflectance(1.0) == pytest.approx((0.34 / 2.34) ** 2)
    assert fresnel_reflectance(0.0) == pytest.approx(1, abs=1e-5)
    # Total reflection outside Snell's cone, 97.5° wide at n = 1.33.
    edge = np.cos(np.radians(97.5 / 2))
    assert fresnel_reflectance(edge - 0.002, 1 / 1.33) == pytest.approx(1)
    assert fresnel_reflectance(edge + 0.002, 1 / 1.33) < 0.8
    np.testing.assert_array_equal(fresnel_reflectance(np.array([0.0, 0.5, 1.0]), 1.0), 0)


def test_fresnel_is_the_same_from_both_sides():
    zenith = np.linspace(0, 89, 30)
    inside = in_water_cosine(zenith)
    np.testing.assert_allclose(
        fresnel_reflectance(np.cos(np.radians(zenith))),
        fresnel_reflectance(inside, 1 / 1.34),
        rtol=1e-9,
    )


def test_brewster_angle_reflects_one_polarisation():
    cosine = np.cos(np.arctan(1.34))
    perpendicular = ((1 - 1.34**2) / (1 + 1.34**2)) ** 2
    assert fresnel_reflectance(cosine) == pytest.approx(perpendicular / 2)


def test_diffuse_reflectance():
    assert diffuse_internal_reflectance(1.34) == pytest.approx(0.48, abs=0.005)
    assert diffuse_internal_reflectance(1.0) == 0
    # Reciprocity against the integral from the air side.
    nodes, weights = np.polynomial.legendre.leggauss(200)
    mu = ((nodes + 1) / 2) ** 2
    outside = np.sum(2 * mu * fresnel_reflectance(mu) * (nodes + 1) / 2 * weights)
    inside = 1.34**2 * (1 - diffuse_internal_reflectance(1.34))
    assert inside == pytest.approx(1 - outside, abs=1e-6)


def test_travel_direction():
    direction = sun_travel_direction(60, 90)
    assert np.linalg.norm(direction) == pytest.approx(1)
    np.testing.assert_allclose(direction[:2], [0, np.sin(np.radians(60)) / 1.34], atol=1e-12)
    assert direction[2] == pytest.approx(-in_water_cosine(60))


@pytest.mark.parametrize(("zenith", "index"), [(-1, 1.34), (91, 1.34), (np.nan, 1.34), (30, 0.9)])
def test_bad_input(zenith, index):
    with pytest.raises(InputError):
        in_water_cosine(zenith, index)


@pytest.mark.parametrize(
    ("wavelength", "salinity", "temperature", "index"),
    [
        # Pure water against air, L. W. Tilton & J. K. Taylor (1938).
        (404.66, 0.0, 20.0, 1.342742),
        (589.26, 0.0, 20.0, 1.332988),
        (706.52, 0.0, 20.0, 1.330019),
    ],
)
def test_index_of_seawater(wavelength, salinity, temperature, index):
    found = refractive_index_QuanFry1995(wavelength, salinity, temperature)
    assert found == pytest.approx(index, abs=1.5e-4)
    # The salt of the sea adds 0.006.
    assert refractive_index_QuanFry1995(589.3) == pytest.approx(1.339, abs=5e-4)


def test_index_of_seawater_outside_its_measurements():
    for wrong, name in (
        ((150.0, 35.0, 20.0), "wavelength"),
        ((550.0, 50.0, 20.0), "salinity"),
        ((550.0, 35.0, -5.0), "temperature"),
        ((np.nan, 35.0, 20.0), "wavelength"),
    ):
        with pytest.raises(InputError, match=f"the {name} must be"):
            refractive_index_QuanFry1995(*wrong)
