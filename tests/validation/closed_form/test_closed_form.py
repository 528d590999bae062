from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from underwater_spectral.tests import by_hand
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.transfer.aureole import moments_of_spread
from underwater_spectral.uw_spectral.transfer.path_integral import attenuated_path, phi
from underwater_spectral.uw_spectral.transfer.radiance_field import (
    distance_in_water,
    upwelling_irradiance,
)
from underwater_spectral.uw_spectral.transfer.sky import Sky
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.closed_form.aureole_lobes import solve_aureole
from underwater_spectral.validation.closed_form.closed_form import solve_closed_form
from underwater_spectral.validation.closed_form.light_field import (
    TwoStreamWater,
    solve_light_field,
)
from underwater_spectral.validation.closed_form.paths import under_surface
from underwater_spectral.validation.closed_form.pixel import Pixel, forward_scattered_fraction
from underwater_spectral.validation.closed_form.unoccluded_water import UnoccludedWater
from underwater_spectral.validation.sun_beam import closed_beam


def _water(a, b, text="hg:0.8", mu_s=0.9, y_o=5.0, y_f=8.0, **options):
    a, b = np.atleast_1d(a), np.atleast_1d(b)
    phase = parse_phase(text).for_bands(b)
    water = TwoStreamWater(a, b, phase.chi1, phase.chi2)
    field = solve_light_field(water, 1.0, mu_s, y_f=y_f, **options)
    return solve_closed_form(field, phase, y_o, (math.sqrt(1 - mu_s**2), 0.0, -mu_s))


def _view(w_y, azimuth=0.0):
    across = math.sqrt(1 - w_y**2)
    return (across * math.cos(azimuth), across * math.sin(azimuth), -w_y)


def test_phi_in_single_precision():
    x = np.concatenate([[0], np.geomspace(1e-12, 1e8, 4001)]).astype(np.float32)
    exact = np.ones(len(x))
    exact[1:] = -np.expm1(-x[1:].astype(np.float64)) / x[1:].astype(np.float64)
    single = phi(x)
    assert single.dtype == np.float32
    assert np.max(np.abs(single / exact - 1)) <= 4e-7
    np.testing.assert_allclose(phi(x.astype(np.float64)), exact, rtol=2e-9)


@pytest.mark.parametrize("q", [-0.4, -1e-7, 0.0, 1e-7, 0.3])
def test_attenuated_path_for_either_sign(q):
    near, P = -2.0, 4.0
    v = np.linspace(0, P, 20001)
    expected = np.trapezoid(np.exp(near - q * v), v)
    assert attenuated_path(near, near - q * P, q * P, P) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("y_o", "w_y", "expected"),
    [(5.0, -0.5, 10.0), (5.0, 0.5, 6.0), (5.0, 0.0, 1e7), (0.0, 0.5, 16.0), (0.0, -1.0, 0.0)],
)
def test_distance_ends_at_surface_and_floor(y_o, w_y, expected):
    assert distance_in_water(y_o, w_y, 8.0) == pytest.approx(expected)


@pytest.mark.parametrize("w_y", [-0.95, -0.3, 0.0, 0.3, 0.95])
def test_path_is_the_integral_of_its_source(w_y):
    """The closed form against a numerical integral of the source along the ray."""
    water = _water(0.05, 0.2, E_sky=0.1, r=0.2)
    field, w, P = water.field, _view(w_y, 1.0), 2.5
    v = np.linspace(0, P, 4001)
    y = (5 + w_y * v)[:, None]
    cosine = -np.dot(w, water.sun)
    s2 = (1 - cosine) / 2
    single = field.b * water.aureole.spread(water.phase.per_steradian(s2), s2)
    sun = np.exp(-field.ks * y)
    horizontal = field.Fx * sun * (cosine + w_y * field.mu_s)
    diffuse = field.E0(y) - 3 * field.gp * (w_y * field.F(y) - horizontal)
    source = single * field.E / field.mu_s * sun + field.bp / (4 * math.pi) * diffuse
    expected = np.trapezoid(source * np.exp(-field.cp * v[:, None]), v, axis=0)
    np.testing.assert_allclose(water.path(5.0, w, P), expected, rtol=1e-6)


def test_paths_add_up():
    water = _water([0.05, 0.3], [0.2, 1.0], r=0.2)
    w = _view(0.4, 0.5)
    whole, first, rest = (water.path(y, w, P) for y, P in ((5.0, 3.0), (5.0, 1.0), (5.4, 2.0)))
    np.testing.assert_allclose(whole, first + np.exp(-water.field.cp) * rest, rtol=1e-9)


def test_upwelling_irradiance_of_the_floor_and_converged():
    water = _water([0.05, 0.3], [0.2, 1.0], r=0.2)
    field = water.field
    floor = upwelling_irradiance(water.radiance, field.y_f)
    np.testing.assert_allclose(floor, 0.2 * field.Ed(field.y_f), rtol=1e-9)
    mu, weights = np.polynomial.legendre.leggauss(40)
    mu, azimuth = (mu + 1) / 2, (np.arange(64) + 0.5) * 2 * math.pi / 64
    across = np.sqrt(1 - mu**2)[:, None, None]
    w = (across * np.cos(azimuth)[:, None], across * np.sin(azimuth)[:, None])
    L = water.radiance(5.0, (*w, -mu[:, None, None] + 0 * w[0])).mean(axis=1)
    exact = math.pi * (weights * mu) @ L
    np.testing.assert_allclose(upwelling_irradiance(water.radiance, 5.0), exact, rtol=5e-3)


def test_upwelling_irradiance_where_two_streams_are_negative():
    """Hardly any scattering: single scattering is all that comes back, at every depth alike."""
    water = _water(1.0, 0.05)
    y = np.array([[1.0], [3.0], [6.0]])
    assert np.all(water.field.Eu(y)[1:] < 0)
    fraction = upwelling_irradiance(water.radiance, y) / water.field.Ed(y)
    assert fraction.shape == (3, 1)
    assert np.all(fraction > 0)
    assert np.ptp(fraction) < 0.1 * fraction.mean()


def test_thin_water_is_single_scattering():
    water = _water(0.02, 1e-4)
    for w_y in (-0.6, 0.2, 0.8):
        w = _view(w_y, 2.0)
        path, single = water.path(5.0, w, 2.0), closed_beam(water).single_scattering(5.0, w, 2.0)
        np.testing.assert_allclose(path, single, rtol=5e-3)


def test_single_scattering_is_its_integral():
    water = _water(0.1, 0.4)
    w, c = _view(-0.5, 1.0), 0.5
    v = np.linspace(0, 3, 4001)
    p = parse_phase("hg:0.8")(-np.dot(w, water.sun))
    light = np.exp(-c * (5 - 0.5 * v) / 0.9 - c * v) / 0.9
    expected = 0.4 * p * np.trapezoid(light, v)
    np.testing.assert_allclose(
        closed_beam(water).single_scattering(5.0, w, 3.0), expected, rtol=1e-6
    )


def test_pixel_joins_object_and_background():
    water = _water(0.05, 0.2, r=0.2)
    w = _view(1.0)
    field = water.field
    # An object with the radiance of the floor, on the floor, is the floor.
    floor = field.floor_radiance()
    pixel = Pixel(water, 5.0, w, 3.0, floor, floor).total
    np.testing.assert_allclose(pixel, water.radiance(5.0, w), rtol=1e-12)
    assert (forward_scattered_fraction(water, np.array([0.0, 1.0, 1e3])) >= 0).all()
    np.testing.assert_allclose(Pixel(water, 5.0, w, 0.0, 2.0, 1.0).total, 2.0)


def test_components_add_up_and_are_what_their_names_say():
    water, w = _water(0.05, 0.2, r=0.2), _view(0.3)
    pixel = UnoccludedWater(water, Sky(0.1)).surface(5.0, 5.6, w, 2.0, 0.7, coverage=0.6)
    whole = pixel.direct + pixel.forward_scattered + pixel.path
    np.testing.assert_allclose(pixel.total, whole, rtol=1e-12)
    np.testing.assert_allclose(pixel.direct, 0.7 * np.exp(-0.25 * 2.0))
    beyond = 0.6 * water.radiance(5.6, w, 0.1)
    np.testing.assert_allclose(
        pixel.total, by_hand.pixel(water, 5.0, w, 2.0, 0.7, beyond)
        - 0.4 * water.path(5.0, w, 2.0), rtol=1e-12,
    )  # fmt: skip


@pytest.mark.parametrize("z", [0.9, 0.3, 0.0, -0.3, -0.9])
@pytest.mark.parametrize("index", [None, 1.34])
def test_open_water_is_the_unoccluded_radiance(z, index):
    water, w = UnoccludedWater(_water(0.05, 0.2, r=0.2), Sky(0.1), index), _view(z)
    pixel = water.open_water(5.0, w)
    np.testing.assert_allclose(pixel.total, water.radiance(5.0, w), rtol=1e-12)
    # What lies on the way changes nothing if it shines as the water behind it does.
    seen = water.surface(5.0, 5.0 - 1.5 * w[2], w, 1.5, water.radiance(5.0 - 1.5 * w[2], w))
    np.testing.assert_allclose(seen.total, water.radiance(5.0, w), rtol=1e-6)


def test_flat_surface_from_below():
    water = _water(0.05, 0.2, r=0.2)
    # Inside Snell's window the sky gains n²; outside only the mirrored water is seen.
    overhead = under_surface(water, (0.0, 0.0, 1.0), 1.0, 1.34) - under_surface(
        water, (0.0, 0.0, 1.0), 0.0, 1.34
    )
    np.testing.assert_allclose(overhead, 1.34**2 * (1 - (0.34 / 2.34) ** 2), rtol=1e-6)
    shallow = _view(-0.3)
    outside = under_surface(water, shallow, 1.0, 1.34)
    np.testing.assert_allclose(outside, water.radiance(0.0, _view(0.3)), rtol=1e-6)


@pytest.mark.parametrize("text", ["hg:0.8", "hg:0.95", "hg:0.99", "petzold", "rayleigh"])
def test_lobes_reproduce_the_spread(text):
    x = np.array([0.0, 1e-6, 0.3, 1, 3, 10, 100, 25000])
    phase = parse_phase(text).for_bands(x)
    aureole = solve_aureole(x, phase, 1.0, 1.0)
    angles = np.radians([0.5, 2, 5, 10, 30, 60, 120, 180])
    s2 = np.sin(angles / 2)[:, None] ** 2
    p = phase.per_steradian(s2)
    chi = np.vstack([np.ones(len(x)), phase.moments(512)])
    order = np.arange(513)
    rest = (moments_of_spread(chi, x) - np.exp(-chi[2] * x) * chi) * np.exp(
        -4 * (order[:, None] / 512) ** 2
    )
    terms = np.polynomial.legendre.legvander(np.cos(angles), 512) * (2 * order + 1) / (4 * np.pi)
    exact = np.exp(-chi[2] * x) * p + terms @ rest
    spread = aureole.spread(p, s2)
    assert np.isfinite(spread).all()
    np.testing.assert_allclose(spread[:, 0], p[:, 0], rtol=1e-6)
    # Relative to the light there, or to a tenth of single scattering where that is less.
    assert np.max(np.abs(spread - exact) / (np.abs(exact) + 0.1 * p)) < 0.16


# The grid of extremes. Absorption and scattering from c and the albedo b/c; the
# albedo 0.577 puts k on ks under a sun at the zenith.
C, ALBEDO = (
    grid.ravel()
    for grid in np.meshgrid(
        [0, 1e-4, 1e-3, 0.01, 0.1, 1, 5, 50], [0, 1e-6, 0.01, 0.3, 0.577, 0.9, 0.999, 1]
    )
)
DISTANCES = np.array([0, 1e-6, 1e-3, 1, 10, 1000, np.inf], dtype=np.float32)[None, :, None]
COSINES = (-1, -0.999, -0.9, -0.5, -0.1, -1e-3, -1e-6, 0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.999, 1)
RAYS = np.array([_view(w_y, azimuth) for w_y in COSINES for azimuth in (0, 1, math.pi)])
GRID = list(
    itertools.product(
        ("hg:0.8", "hg:0.99", "fournier-forand:1.10,0.0183", "isotropic", "hg:-0.6", "hg:0.0001"),
        (1.0, 0.75, 0.66, 0.0),
        (0.0, 1e-3, 5.0, 100.0, 500.0),
        ((1e-3, 0.0, 0.0), (3.0, 0.2, 0.48), (1e-3, 1.0, 0.48), (math.inf, 0.0, 0.0)),
    )
)


@pytest.mark.parametrize("part", range(6))
def test_single_precision_over_the_extremes(part):
    """Single against double: no NaN, no infinity, nothing negative, error ≤ 1e-3.

    Inputs are rounded to single precision first. The error is relative to the
    radiance, or to a tenth of what isotropic single scattering would give at
    that depth (b/(4π) E G(c, P) e^{-k y}) where the radiance is below that;
    radiance below 1e-12 of E only has to be finite.
    """
    worst = 0.0
    for text, mu_s, depth, (below, r, R) in GRID[part::18]:
        y_o = np.float32(depth)
        y_f = float(np.float32(depth + below))
        water = _water(
            C * (1 - ALBEDO), C * ALBEDO, text, mu_s, float(y_o), y_f, r=r, R=R, E_sky=0.3
        )
        rays = [RAYS[:, axis, None, None].astype(np.float32) for axis in range(3)]
        exact = water.path(float(y_o), [ray.astype(np.float64) for ray in rays], DISTANCES * 1.0)
        single = water.astype(np.float32).path(y_o, rays, DISTANCES)
        assert single.dtype == np.float32
        for radiance in (exact, single):
            assert np.isfinite(radiance).all()
            assert (radiance >= 0).all()
        field, P = water.field, np.minimum(DISTANCES.astype(np.float64), 1e7)
        scale = field.b / (4 * np.pi) * P * phi(field.c * P) * np.exp(-field.k * depth)
        scale = np.maximum(exact, 0.1 * scale)
        error = np.abs(single - exact)[scale > 1e-12] / scale[scale > 1e-12]
        worst = max(worst, error.max())
    assert worst <= 1e-3


@settings(max_examples=300, deadline=None)
@given(
    c=st.sampled_from([0.0]) | st.floats(1e-4, 50),
    albedo=st.floats(0, 1),
    g=st.floats(-0.9, 0.99),
    mu_s=st.floats(0, 1),
    y_o=st.floats(0, 500),
    below=st.floats(1e-3, 100) | st.just(math.inf),
    w_y=st.floats(-1, 1),
    azimuth=st.floats(-math.pi, math.pi),
    P=st.floats(0, 1e6) | st.just(math.inf),
    single=st.booleans(),
)
def test_any_ray_is_finite_and_not_negative(
    c, albedo, g, mu_s, y_o, below, w_y, azimuth, P, single
):
    y_f = y_o + below
    water = _water(
        c * (1 - albedo), c * albedo, f"hg:{g}", mu_s, y_o, y_f, r=0.3, R=0.48, E_sky=0.1
    )
    kind = np.float32 if single else np.float64
    water = water.astype(kind)
    w = [kind(value) for value in _view(w_y, azimuth)]
    values = (
        water.path(kind(y_o), w, kind(P)),
        water.radiance(kind(y_o), w, kind(0.1)),
        closed_beam(water).single_scattering(kind(y_o), w, kind(P)),
    )
    for value in values:
        assert np.isfinite(value).all()
        assert (value >= 0).all()


@settings(max_examples=100, deadline=None)
@given(P=st.floats(0.01, 50), w_y=st.floats(-1, 1), more=st.floats(1.01, 3))
def test_longer_paths_are_brighter(P, w_y, more):
    water = _water([0.05, 0.3], [0.2, 1.0], r=0.2)
    w = _view(w_y, 0.7)
    assert (water.path(5.0, w, P * more) >= water.path(5.0, w, P) * (1 - 1e-9)).all()


def test_camera_outside_the_water():
    for y_o in (-1.0, 9.0):
        with pytest.raises(InputError, match="move the camera or the floor"):
            _water(0.1, 0.1, y_o=y_o)
