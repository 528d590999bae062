"""Water from plain numbers, against the fitted aureole, its exact moments and single precision."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.aureole import moments_of_spread
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import henyey_greenstein, parse_phase
from underwater_spectral.validation.closed_form.closed_form import solve_closed_form
from underwater_spectral.validation.closed_form.internal_reflectance import (
    diffuse_internal_reflectance,
)
from underwater_spectral.validation.closed_form.light_field import TwoStreamWater, light_field_of
from underwater_spectral.validation.closed_form.one_lobe import (
    LobeSeries,
    PlainLight,
    plain_water,
    surface_fractions,
)
from underwater_spectral.validation.closed_form.unoccluded_water import UnoccludedWater

SUN = np.array([0.37, 0.0, -math.sqrt(1 - 0.37**2)])


def _rays(count=300):
    w = np.random.default_rng(0).normal(size=(count, 3))
    w /= np.linalg.norm(w, axis=1)[:, None]
    return tuple(w.T[..., None])


def _column(a, b, floor, r):
    return WaterColumn(
        Bands.uniform(1), a, b, 1.0, float(-SUN[2]), SUN, 0.05, floor, r, "flat", 1.34
    )


def _plain(column, g, depth, dtype=np.float64):
    numbers = {
        "r": column.floor_reflectance, "y_o": depth, "y_f": min(column.floor_depth, 1e3),
        "index": 1.34,
    }  # fmt: skip
    numbers = {name: np.asarray(value, dtype) for name, value in numbers.items()}
    water, light = (
        [np.asarray(x, dtype) for x in given]
        for given in (
            (column.absorption, column.scattering, g, g * g),
            (column.sun_irradiance, column.sky_radiance),
        )
    )
    sun = [np.asarray(x, dtype) for x in SUN]
    return plain_water(TwoStreamWater(*water), PlainLight(*light, sun), **numbers)


@pytest.mark.parametrize("g", [0.8, 0.924])
@pytest.mark.parametrize(("a", "b"), [(0.03, 0.05), (0.1, 0.1), (0.2, 0.5), (0.3, 1.0)])
@pytest.mark.parametrize("depth", [2.0, 5.0])
@pytest.mark.parametrize(("floor", "r"), [(math.inf, 0.0), (8.0, 0.3)])
def test_it_is_the_closed_form_with_its_fitted_aureole(g, a, b, depth, floor, r):
    column, phase = _column(a, b, floor, r), parse_phase(f"hg:{g}").for_bands([1.0])
    fitted = solve_closed_form(light_field_of(column, phase), phase, depth, SUN)
    w = _rays()
    wanted = UnoccludedWater(fitted, column.skylight, 1.34).open_water(depth, w).total
    errors = np.abs(_plain(column, g, depth).open_water(depth, w).total / wanted - 1)
    assert np.median(errors) < 0.005
    assert np.quantile(errors, 0.95) < 0.02


@pytest.mark.parametrize("x", [1e-4, 0.1, 1.0, 4.0, 12.0])
def test_series_has_the_moments_of_the_spread(x):
    """All of them by the formula of the aureole: of l = 0 and 1 what the diffuse light lacks."""
    g = 0.85
    nodes, weights = np.polynomial.legendre.leggauss(600)
    s2 = (1.0 - nodes) / 2.0
    found = LobeSeries(g, g * g, x).spread(henyey_greenstein(g, s2), s2)
    moments = [
        2 * math.pi * weights @ (found * np.polynomial.legendre.Legendre.basis(degree)(nodes))
        for degree in range(6)
    ]
    chi = (g ** np.arange(30.0))[:, None]
    wanted = moments_of_spread(chi, np.array([x]))[:6, 0]
    np.testing.assert_allclose(moments[:2], wanted[:2], atol=2e-6)
    # Of many orders only the mean asymmetry is kept.
    if x <= 4.0:
        np.testing.assert_allclose(moments, wanted, atol=0.05 * wanted[2])


def test_single_precision():
    for a, b, depth in ((0.0, 0.0, 5.0), (0.05, 0.1, 5.0), (0.3, 1.5, 20.0), (3.0, 9.0, 40.0)):
        column = _column(a, b, 60.0, 0.4)
        w = _rays()
        single = _plain(column, 0.9, depth, np.float32)
        w32 = tuple(part.astype(np.float32) for part in w)
        seen = single.open_water(np.float32(depth), w32).total
        wanted = _plain(column, 0.9, depth).open_water(depth, w).total
        assert np.isfinite(seen).all()
        np.testing.assert_allclose(seen, wanted, rtol=2e-3, atol=1e-12)


@pytest.mark.parametrize("index", np.linspace(1.0, 1.8, 17))
def test_fractions_of_the_surface(index):
    let_in, sent_back = surface_fractions(index)
    assert sent_back == pytest.approx(diffuse_internal_reflectance(index), abs=3e-3)
    assert let_in == pytest.approx(index**2 * (1 - sent_back))
