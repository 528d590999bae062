from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from underwater_spectral.uw_spectral.errors import DataWarning, InputError
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import (
    EinsteinSmoluchowski,
    FournierForand,
    HenyeyGreenstein,
    PetzoldAverage,
    Rayleigh,
    parse_phase,
    seawater_mixture,
)

TEXTS = (
    "hg:0.8",
    "hg:0.99",
    "hg:-0.7",
    "tthg:0.9,-0.3,0.97",
    "fournier-forand:1.10,0.0183",
    "fournier-forand:1.02,0.001",
    "petzold",
    "rayleigh",
    "einstein-smoluchowski",
    "isotropic",
)


@pytest.mark.parametrize("text", TEXTS)
def test_integrates_to_one(text):
    assert parse_phase(text).normalisation() == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("g", [-0.7, 0.3, 0.8, 0.95, 0.99])
def test_henyey_greenstein_moments_are_powers_of_g(g):
    moments = HenyeyGreenstein(g).moments(200)
    np.testing.assert_allclose(moments, g ** np.arange(1, 201), atol=1e-11)


@pytest.mark.parametrize("text", TEXTS)
def test_moments_against_an_independent_integral(text):
    phase = parse_phase(text)
    # Gauss-Legendre in t, cos = 1 - 2 t^8 : a substitution the module does not use.
    nodes, weights = np.polynomial.legendre.leggauss(500)
    t = (nodes + 1) / 2
    s2, solid = t**8, 4 * np.pi * 8 * t**7 * weights / 2
    density = phase.per_steradian(s2) * solid
    cosine = 1 - 2 * s2
    np.testing.assert_allclose(phase.moments(2)[0], density @ cosine, atol=2e-4)
    np.testing.assert_allclose(phase.moments(2)[1], density @ (1.5 * cosine**2 - 0.5), atol=2e-4)


def test_published_values():
    assert HenyeyGreenstein(0.8).backscatter_ratio == pytest.approx(0.0507, abs=5e-5)
    petzold = PetzoldAverage()
    assert petzold.g == pytest.approx(0.924, abs=5e-4)
    assert petzold.backscatter_ratio == pytest.approx(0.0183, abs=1e-4)
    # Morel's prefactor for seawater, and 3/(16π) for Rayleigh.
    assert EinsteinSmoluchowski(0.835)(0.0) == pytest.approx(0.06225, abs=5e-6)
    # β(90°)/b of Zhang et al. 2009: b = 8π/3 β(90°) (2 + δ)/(1 + δ), δ = 0.039.
    assert EinsteinSmoluchowski()(0.0) == pytest.approx(3 * 1.039 / (8 * np.pi * 2.039), rel=1e-9)
    assert Rayleigh()(0.0) == pytest.approx(3 / (16 * np.pi))


def test_petzold_reproduces_its_table():
    angles = np.radians([0.1, 1, 10, 45, 90, 180])
    published = np.array([1767.0, 71.61, 1.153, 0.03067, 0.004292, 0.003154])
    s2 = np.sin(angles / 2) ** 2
    # Normalised: the published values integrate to 0.993.
    np.testing.assert_allclose(PetzoldAverage().per_steradian(s2) / published, 1 / 0.993, rtol=2e-3)


def test_fournier_forand_backscatter_is_what_was_asked_for():
    for ratio in (0.005, 0.0183, 0.05):
        assert FournierForand(1.10, ratio).backscatter_ratio == pytest.approx(ratio, rel=1e-6)


def test_fournier_forand_as_published():
    # The published form, evaluated away from its removable singularity.
    n, mu, angle = 1.10, 3.5835, np.radians([1.0, 30.0, 90.0, 150.0])
    u = np.sin(angle / 2) ** 2
    nu, delta = (3 - mu) / 2, 4 / (3 * (n - 1) ** 2) * u
    d180 = 4 / (3 * (n - 1) ** 2)
    bracket = nu * (1 - delta) - (1 - delta**nu)
    bracket += (delta * (1 - delta**nu) - nu * (1 - delta)) / u
    expected = bracket / (4 * np.pi * (1 - delta) ** 2 * delta**nu)
    expected += (1 - d180**nu) / (16 * np.pi * (d180 - 1) * d180**nu) * (3 * np.cos(angle) ** 2 - 1)
    phase = FournierForand.from_junge_slope(n, mu)
    np.testing.assert_allclose(phase.per_steradian(u), expected, rtol=1e-9)
    np.testing.assert_allclose(
        expected, [72.78378, 0.07305628, 0.004193319, 0.002673421], rtol=1e-6
    )


@pytest.mark.parametrize("text", TEXTS)
def test_single_precision(text):
    phase = parse_phase(text)
    s2 = np.geomspace(1e-10, 1, 2001, dtype=np.float32)
    single, double = phase.per_steradian(s2), phase.per_steradian(s2.astype(np.float64))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, double, rtol=2e-4)


@given(g=st.floats(-0.999, 0.999), cosine=st.floats(-1, 1))
def test_henyey_greenstein_is_positive_and_finite(g, cosine):
    value = HenyeyGreenstein(g)(cosine)
    assert np.isfinite(value)
    assert value > 0


def test_mixture_is_weighted_by_scattering():
    b, molecular = np.array([0.01, 0.1, 1.0]), np.array([0.004, 0.003, 0.001])
    mixture = seawater_mixture(b, molecular)
    fraction = molecular / b
    particles = FournierForand()
    np.testing.assert_allclose(mixture.chi1, (1 - fraction) * particles.g, rtol=1e-9, atol=1e-12)
    expected = 0.5 * fraction + (1 - fraction) * particles.backscatter_ratio
    np.testing.assert_allclose(mixture.backscatter_ratio, expected, rtol=1e-9)
    np.testing.assert_allclose(mixture.normalisation(), 1, atol=1e-9)
    assert mixture(np.linspace(-1, 0.9, 5)).shape == (5, 3)
    assert np.ptp(mixture.weights, axis=1).any()


def test_one_function_is_the_same_in_all_bands():
    bands = parse_phase("hg:0.8").for_bands(np.ones(4))
    assert not np.ptp(bands.weights, axis=1).any()
    assert len(bands) == 4
    np.testing.assert_allclose(bands.chi2, np.full(4, 0.64))


def test_molecular_scattering_counts_at_most_all():
    mixture = seawater_mixture([0.010, 0.0, 1.0], [0.011, 0.001, 0.0])
    np.testing.assert_array_equal(mixture.weights[0], [1, 1, 0])
    with pytest.warns(DataWarning, match="below that of pure seawater"):
        seawater_mixture([0.010], [0.020])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("henyey", "unknown phase function 'henyey'"),
        ("hg:1", "between -1 and 1"),
        ("hg:nan", "between -1 and 1"),
        ("hg", "0 values; write hg:g"),
        ("hg:0.8,0.9", "2 values"),
        ("hg:much", "not a number"),
        ("petzold:1", "1 values"),
        ("tthg:0.9,-0.3,1.2", "fraction"),
        ("fournier-forand:0.9,0.01", "index of the particles"),
        ("fournier-forand:1.10,0.6", "bb/b must be"),
        ("fournier-forand:2,0.01", "at most 1.5"),
    ],
)
def test_bad_input(text, message):
    with pytest.raises(InputError, match=message):
        parse_phase(text)


def test_mixture_needs_its_parts():
    with pytest.raises(InputError, match="molecular scattering per band"):
        parse_phase("mixture").for_bands([0.1])
    with pytest.raises(InputError, match="add up to 1"):
        BandPhase((Rayleigh(),), np.array([[0.5]]))
    assert parse_phase("mixture:0.01").particles.backscatter == 0.01
