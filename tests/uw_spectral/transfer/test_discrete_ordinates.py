"""The solved light field against other solvers, published problems and laws it must obey."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from underwater_spectral.benchmarks import monte_carlo_table, solved_field
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.monte_carlo import numba_available, simulate
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    STREAMS,
    Layer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.sky import SKIES, Sky
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.optical_properties import Water, molecular_scattering
from underwater_spectral.uw_spectral.water.phase import parse_phase

DOWN, UP, LEVEL = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


def _layer(a, b, phase="hg:0.8", bottom=math.inf):
    a, b = np.atleast_1d(np.asarray(a, float)), np.atleast_1d(np.asarray(b, float))
    return Layer(bottom, a, b, parse_phase(phase).for_bands(b, 0.1 * b))


def _directions(count, seed=0):
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return tuple((w / np.linalg.norm(w, axis=1)[:, None]).T)


def _errors(count):
    """Relative errors of L, Ed and Eu in random cases."""
    found = [solved_field.errors(case, STREAMS) for case in solved_field.cases(count)]
    return [np.concatenate([each[name][:, 0] for each in found]) for name in ("L", "Ed", "Eu")]


def test_against_discrete_ordinates_quickly():
    L, Ed, Eu = _errors(12)
    assert np.median(L) < 0.005
    assert np.quantile(L, 0.95) < 0.03
    assert max(Ed.max(), Eu.max()) < 0.005


@pytest.mark.slow
def test_against_discrete_ordinates():
    L, Ed, Eu = _errors(150)
    assert np.median(L) < 0.005
    assert np.quantile(L, 0.95) < 0.03
    assert max(np.median(Ed), np.median(Eu)) < 1e-3


# Radiance upwelling to the zenith, of converged solutions, to two or three digits; the models'
# means scatter by 3 to 30 %.
_CONVERGED_LU = {(1, 1, 0.8): 1.68e-3, (1, 1, 4.0): 1.27e-5, (2, 1, 4.0): 7.9e-7,
                 (2, 2, 0.5): 3.13e-3}  # fmt: skip


@pytest.mark.parametrize(("problem", "case"), [(1, 1), (1, 2), (2, 1), (2, 2), (6, 1)])
def test_canonical_problems(problem, case):
    """C. D. Mobley et al., Appl. Opt. 32, 7484 (1993): a = 1 - w0 per optical depth, τ = c y."""
    field = solved_field.canonical_field(problem, case)
    checked = 0
    for y, quantity, mean, scatter in monte_carlo_table.canonical_values(problem, case):
        converged = _CONVERGED_LU.get((problem, case, y))
        if quantity == "Ed":
            assert float(field.Ed(y)[0]) == pytest.approx(mean, rel=max(3 * scatter, 0.01))
        elif quantity == "Lu" and converged:
            assert float(field.radiance(y, DOWN)[0]) == pytest.approx(converged, rel=0.02)
        elif quantity == "Lu" and scatter < 0.1:
            bound = pytest.approx(mean, rel=max(3 * scatter, 0.05))
            assert float(field.radiance(y, DOWN)[0]) == bound
        else:
            continue
        checked += 1
    assert checked >= 4


@pytest.mark.skipif(not numba_available(), reason="without numba it takes minutes")
@pytest.mark.parametrize(("phase", "sky"), [("hg:0.8", 0.0), ("hg:0.9", 0.1)])
def test_surface_and_sky_against_monte_carlo(phase, sky):
    a, b = np.array([0.08, 0.3]), np.array([0.25, 0.6])
    zenith, n, floor, y = 50.0, 1.34, 6.0, 2.0
    sun = sun_travel_direction(zenith, 0.0, n)
    column = WaterColumn(
        Bands.uniform(2), a, b, 1.0, float(in_water_cosine(zenith, n)), sun, sky, floor, 0.3,
        "flat", n,
    )  # fmt: skip
    views = [(y, (math.sqrt(1 - z * z) * math.cos(t), math.sqrt(1 - z * z) * math.sin(t), z))
             for z, t in ((-0.95, 0.5), (-0.4, 2.0), (0.25, 2.5), (0.5, 1.6))]  # fmt: skip
    band_phase = parse_phase(phase).for_bands(b, 0.1 * b)
    truth = simulate(column, band_phase, [0.5, y], views=views, photons=1_000_000, threads=2)
    field = solve_discrete_ordinates(
        [Layer(floor, a, b, band_phase)], np.ones(2), sun, refractive_index=n,
        sky=Sky.standard("uniform", np.full(2, math.pi * sky)), floor_reflectance=0.3,
    )  # fmt: skip
    for found, wanted in (
        (field.Ed([0.5, y]), truth.total.Ed),
        (field.Eu([0.5, y]), truth.total.Eu),
        (field.scalar_irradiance([0.5, y]), truth.total.E0),
    ):
        assert np.all(np.abs(found - wanted.mean) < 4 * wanted.error + 3e-3 * wanted.mean)
    found = field.radiance(y, tuple(np.transpose([w for _, w in views])))
    wanted = truth.total.L
    assert np.all(np.abs(found - wanted.mean) < 4 * wanted.error + 0.015 * wanted.mean)


@pytest.mark.parametrize("index", [None, 1.34])
def test_furnace(index):
    """White water over a white floor under a sky of 1: n² in every direction."""
    layers = [_layer([1e-9], [0.7], bottom=3.0)]
    field = solve_discrete_ordinates(
        layers, [0.0], DOWN, sky=Sky.standard("uniform", [math.pi]), refractive_index=index,
        floor_reflectance=1.0,
    )  # fmt: skip
    n2 = (index or 1.0) ** 2
    found = field.radiance([[0.0], [1.1], [3.0]], _directions(40))
    np.testing.assert_allclose(found, n2, rtol=1e-3)
    np.testing.assert_allclose(field.scalar_irradiance(1.1), 4 * math.pi * n2, rtol=1e-3)


@pytest.mark.parametrize("index", [None, 1.34])
def test_net_flux_falls_by_what_is_absorbed(index):
    """Gershun's law, and the balance of the whole column."""
    sun = sun_travel_direction(55, 20, 1.34)
    a, b = np.array([0.02, 0.3, 0.9]), np.array([0.6, 0.2, 0.05])
    field = solve_discrete_ordinates(
        [_layer(a, b, "petzold", 7.0)], np.ones(3), sun, sky=Sky.standard("clear", np.ones(3), 55),
        refractive_index=index, floor_reflectance=0.4,
    )  # fmt: skip
    y = np.linspace(0.0, 7.0, 4001)
    net = field.Ed(y) - field.Eu(y)
    absorbed = a * np.trapezoid(field.scalar_irradiance(y), y, axis=0)
    np.testing.assert_allclose(net[0] - net[-1], absorbed, rtol=1e-3)
    np.testing.assert_allclose(field.Eu(7.0), 0.4 * field.Ed(7.0), rtol=1e-9)


def test_layers_of_one_water_are_one_layer():
    sun, w = sun_travel_direction(40, 30, 1.34), _directions(60)
    how = {"sky": Sky.standard("overcast", [0.5, 0.5]), "refractive_index": 1.34,
               "floor_reflectance": 0.2}  # fmt: skip
    whole, parts = (
        solve_discrete_ordinates(
            [_layer([0.1, 0.3], [0.4, 0.1], "petzold", z) for z in ends], [1.0, 1.0], sun, **how
        )
        for ends in ((8.0,), (0.5, 1.0, 4.0, 8.0))
    )
    y = np.array([0.0, 0.3, 2.0, 7.9])
    for name in ("Ed", "Eu", "scalar_irradiance"):
        np.testing.assert_allclose(getattr(parts, name)(y), getattr(whole, name)(y), rtol=1e-9)
    for name in ("radiance", "scattered", "single_scattering"):
        found, wanted = (getattr(f, name)(y[:, None], w) for f in (parts, whole))
        np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-12)


def test_murky_layer_darkens_what_lies_below():
    clear, murky = _layer(0.05, 0.1, bottom=2.0), _layer(0.5, 2.0, bottom=3.0)
    rest = _layer(0.05, 0.1)
    sun = (0.0, 0.0, -1.0)
    plain = solve_discrete_ordinates([rest], [1.0], sun)
    mixed = solve_discrete_ordinates([clear, murky, rest], [1.0], sun)
    assert mixed.Ed(1.0) == pytest.approx(plain.Ed(1.0), rel=0.2)
    assert mixed.Ed(4.0) < 0.7 * plain.Ed(4.0)
    assert mixed.Eu(1.0) > 1.5 * plain.Eu(1.0)


def test_parts_of_the_radiance_add_up():
    sun = sun_travel_direction(40, 30, 1.34)
    field = solve_discrete_ordinates(
        [_layer([0.1], [0.4], "petzold", 8.0)], [1.0], sun,
        sky=Sky.standard("clear", [0.3], 40.0), refractive_index=1.34, floor_reflectance=0.2,
    )  # fmt: skip
    down = (0.6, 0.0, -0.8)
    parts = field.scattered(2.0, down) + field.single_scattering(2.0, down)
    np.testing.assert_allclose(parts, field.radiance(2.0, down), rtol=1e-12)
    np.testing.assert_allclose(field.radiance(0.0, UP), field.surface_radiance(UP), rtol=1e-6)
    # Beyond Snell's window the surface mirrors the water.
    level = (math.sqrt(1 - 0.3**2), 0.0, 0.3)
    mirrored = field.radiance(0.0, (level[0], 0.0, -0.3))
    np.testing.assert_allclose(field.surface_radiance(level), mirrored, rtol=1e-6)


@pytest.mark.parametrize("kind", SKIES)
def test_skies_bring_their_irradiance_and_look_like_themselves(kind):
    sky = Sky.standard(kind, [2.0], 50.0)
    cosine, turn = np.linspace(0.0005, 0.9995, 1000), np.linspace(0, 2 * math.pi, 181)[:-1]
    L = sky.radiance(*np.broadcast_arrays(cosine[:, None], turn))[..., 0]
    assert 2 * math.pi * np.mean(L.mean(axis=1) * cosine) == pytest.approx(2.0, rel=2e-3)
    zenith = sky.radiance(np.array([1.0]), np.array([0.0]))[0, 0]
    horizon = sky.radiance(np.array([0.05]), np.array([math.pi]))[0, 0]
    towards_sun = sky.radiance(np.array([math.cos(math.radians(50))]), np.array([0.0]))[0, 0]
    if kind == "overcast":
        assert zenith == pytest.approx(3 * horizon, rel=0.05)  # CIE: a third at the horizon
    if kind == "clear":
        assert towards_sun > 4 * zenith


@pytest.mark.parametrize(
    ("a", "b"), list(itertools.product((0.0, 1e-6, 0.05, 50.0), (0.0, 1e-6, 0.5, 50.0)))
)
def test_extremes_are_finite_and_not_negative(a, b):
    for floor, zenith, index, r in itertools.product(
        (0.01, 1000.0, math.inf), (0.0, 89.9), (None, 1.34), (0.0, 1.0)
    ):
        sun = sun_travel_direction(zenith, 0.0, index or 1.0)
        field = solve_discrete_ordinates(
            [_layer(a, b, "petzold", floor)], [1.0], sun, sky=Sky.standard("clear", [0.5], zenith),
            refractive_index=index, floor_reflectance=r, streams=16,
        )  # fmt: skip
        y = np.array([0.0, 0.005, min(floor, 1000.0)])
        for values in (field.Ed(y), field.Eu(y), field.scalar_irradiance(y)):
            assert np.isfinite(values).all()
            assert (values > -1e-6).all()
        seen = field.radiance(y[:, None], _directions(30))
        assert np.isfinite(seen).all()
        assert (seen > -2e-3 * max(1.0, float(seen.max()))).all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"layers": []}, "at least one layer"),
        ({"layers": [_layer(-0.1, 0.1)]}, "absorption of layer 0"),
        ({"layers": [_layer(math.nan, 0.1)]}, "absorption of layer 0"),
        ({"layers": [_layer(0.1, 0.1), _layer(0.1, 0.1)]}, "only the last may be infinite"),
        ({"layers": [_layer(0.1, 0.1, bottom=2.0), _layer(0.1, 0.1, bottom=1.0)]}, "increase"),
        ({"E": [-1.0]}, "sun irradiance"),
        ({"floor_reflectance": 1.2}, "floor reflectance must be finite and 0 to 1"),
        ({"refractive_index": 0.9}, "refractive index"),
        ({"streams": 7}, "streams must be even"),
    ],
)
def test_input_that_cannot_be_used(change, words):
    given = {"layers": [_layer(0.1, 0.1)], "E": [1.0], "sun": DOWN} | change
    with pytest.raises(InputError, match=words):
        solve_discrete_ordinates(**given)


def test_skies_that_cannot_be_used():
    with pytest.raises(InputError, match="stormy"):
        Sky.standard("stormy", [1.0])
    with pytest.raises(InputError, match="not negative"):
        Sky.standard("clear", [-1.0])


def test_molecules_and_particles_differ_by_band():
    nm = np.array([450.0, 650.0])
    water, b = Water.jerlov("I"), Water.jerlov("I").b(nm)
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(nm))
    layer = Layer(math.inf, water.a(nm), b, phase)
    both = solve_discrete_ordinates([layer], [1.0, 1.0], (0.4, 0.0, -math.sqrt(1 - 0.16)))
    for band in range(2):
        one = parse_phase("mixture").for_bands(b[[band]], molecular_scattering(nm[[band]]))
        alone = solve_discrete_ordinates(
            [Layer(math.inf, layer.absorption[[band]], b[[band]], one)], [1.0],
            (0.4, 0.0, -math.sqrt(1 - 0.16)),
        )  # fmt: skip
        np.testing.assert_allclose(
            both.radiance(5.0, LEVEL)[band], alone.radiance(5.0, LEVEL)[0], rtol=1e-10
        )
