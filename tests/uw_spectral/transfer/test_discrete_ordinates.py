"""The solved light field against other solvers, published problems and laws it must obey."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.caustics import SUN_RADIUS
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.transfer import discrete_ordinates
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    STREAMS,
    OpticalLayer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.rough_surface import WaterSurface
from underwater_spectral.uw_spectral.transfer.sky import Sky
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.uw_spectral.water.pure_water import molecular_scattering
from underwater_spectral.validation import other_solver
from underwater_spectral.validation.monte_carlo import numba_available, simulate

DOWN, UP, LEVEL = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


def _layer(a, b, phase="hg:0.8", bottom=math.inf):
    a, b = np.atleast_1d(np.asarray(a, float)), np.atleast_1d(np.asarray(b, float))
    return OpticalLayer(bottom, a, b, parse_phase(phase).for_bands(b, 0.1 * b))


def _directions(count, seed=0):
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return tuple((w / np.linalg.norm(w, axis=1)[:, None]).T)


def _errors(count):
    """Relative errors of L, Ed and Eu in random cases."""
    found = [other_solver.errors(case, STREAMS) for case in other_solver.cases(count)]
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


@pytest.mark.slow_but_first
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
        [OpticalLayer(floor, a, b, band_phase)], np.ones(2), sun, surface=WaterSurface(n),
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
        layers, [0.0], DOWN, sky=Sky.standard("uniform", [math.pi]),
        surface=index and WaterSurface(index), floor_reflectance=1.0,
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
        [_layer(a, b, "petzold", 7.0)], np.ones(3), sun, surface=index and WaterSurface(index),
        sky=Sky.standard("clear", np.ones(3), sun_travel_direction(55, 20, 1.0)),
        floor_reflectance=0.4,
    )  # fmt: skip
    nodes, weights = np.polynomial.legendre.leggauss(100)
    y, step = 3.5 * (nodes + 1.0), 3.5 * weights
    net = field.Ed([0.0, 7.0]) - field.Eu([0.0, 7.0])
    absorbed = a * (step @ field.scalar_irradiance(y))
    np.testing.assert_allclose(net[0] - net[-1], absorbed, rtol=1e-9)
    np.testing.assert_allclose(field.Eu(7.0), 0.4 * field.Ed(7.0), rtol=1e-9)


def test_layers_of_one_water_are_one_layer():
    sun, w = sun_travel_direction(40, 30, 1.34), _directions(60)
    how = {"sky": Sky.standard("overcast", [0.5, 0.5]), "surface": WaterSurface(1.34),
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
        sky=Sky.standard("clear", [0.3], sun_travel_direction(40, 30, 1.0)),
        surface=WaterSurface(1.34), floor_reflectance=0.2,
    )  # fmt: skip
    down = (0.6, 0.0, -0.8)
    parts = field.scattered(2.0, down) + field.single_scattering(2.0, down)
    np.testing.assert_allclose(parts, field.radiance(2.0, down), rtol=1e-12)
    np.testing.assert_allclose(field.radiance(0.0, UP), field.surface_radiance(UP), rtol=1e-6)
    # Beyond Snell's window the surface mirrors the water.
    level = (math.sqrt(1 - 0.3**2), 0.0, 0.3)
    mirrored = field.radiance(0.0, (level[0], 0.0, -0.3))
    np.testing.assert_allclose(field.surface_radiance(level), mirrored, rtol=1e-6)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("a", "b"), list(itertools.product((0.0, 1e-6, 0.05, 50.0), (0.0, 1e-6, 0.5, 50.0)))
)
def test_extremes_are_finite_and_not_negative(a, b):
    for floor, zenith, index, r in itertools.product(
        (0.01, 1000.0, math.inf), (0.0, 89.9), (None, 1.34), (0.0, 1.0)
    ):
        sun = sun_travel_direction(zenith, 0.0, index or 1.0)
        field = solve_discrete_ordinates(
            [_layer(a, b, "petzold", floor)], [1.0], sun, surface=index and WaterSurface(index),
            sky=Sky.standard("clear", [0.5], sun_travel_direction(zenith, 0.0, 1.0)),
            floor_reflectance=r, streams=16,
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
        ({"surface": WaterSurface(0.9)}, "refractive index"),
        ({"streams": 7}, "streams must be even"),
        ({"sky": Sky.standard("clear", [1.0], (0.0, 0.6, -0.8))}, "the same azimuth"),
    ],
)
def test_input_that_cannot_be_used(change, words):
    given = {"layers": [_layer(0.1, 0.1)], "E": [1.0], "sun": DOWN} | change
    with pytest.raises(InputError, match=words):
        solve_discrete_ordinates(**given)


def test_molecules_and_particles_differ_by_band():
    nm = np.array([450.0, 650.0])
    water, b = Water.jerlov("I"), Water.jerlov("I").b(nm)
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(nm))
    layer = OpticalLayer(math.inf, water.a(nm), b, phase)
    both = solve_discrete_ordinates([layer], [1.0, 1.0], (0.4, 0.0, -math.sqrt(1 - 0.16)))
    for band in range(2):
        one = parse_phase("mixture").for_bands(b[[band]], molecular_scattering(nm[[band]]))
        alone = solve_discrete_ordinates(
            [OpticalLayer(math.inf, layer.absorption[[band]], b[[band]], one)], [1.0],
            (0.4, 0.0, -math.sqrt(1 - 0.16)),
        )  # fmt: skip
        np.testing.assert_allclose(
            both.radiance(5.0, LEVEL)[band], alone.radiance(5.0, LEVEL)[0], rtol=1e-10
        )


def _smooth_light(field, layers, y, mu, turns):
    """M* at one depth and cosine by quadrature: the source function, by the sum over the sphere."""
    count = 2 * len(field.mu)
    azimuths = 2 * math.pi * np.arange(2 * count) / (2 * count)
    cosines = np.concatenate([field.mu, -field.mu])
    solid = np.repeat(np.tile(field.weights, 2), len(azimuths)) * azimuths[1]
    across = np.sqrt(np.outer(1 - mu**2, 1 - cosines**2))[0, :, None]
    turned = np.cos(turns[:, None, None] - azimuths)
    between = (mu * cosines)[:, None] + across * turned  # (h, 2 N, azimuths)
    polynomials = np.polynomial.legendre.legvander(between.reshape(len(turns), -1), count - 1)

    def source(layer, depths):
        """Radiance per metre, (h, n, d)."""
        chi = np.vstack([np.ones(len(layer.phase)), layer.phase.moments(count)])
        terms = (2 * np.arange(count) + 1)[:, None] * (chi[:-1] - chi[-1]) / (4 * math.pi)
        L = np.concatenate(field.stream_modes(depths, count), axis=-1)
        L = np.einsum("mndj,mt->ndjt", L, np.cos(np.outer(np.arange(count), azimuths)))
        L = L.reshape(*L.shape[:2], -1) * solid
        return layer.scattering[:, None] * np.einsum("hkl,ln,ndk->hnd", polynomials, terms, L)

    nodes, weights = np.polynomial.legendre.leggauss(24)
    ends = np.array([0.0, *(layer.bottom for layer in layers)])
    passed = np.ones(len(layers[0].scattering))
    total = np.zeros((len(turns), len(passed)))
    order = list(zip(ends[:-1], ends[1:], layers, strict=True))
    for top, bottom, layer in order[::-1] if mu > 0 else order:
        scaled = layer.absorption + layer.scattering * (1 - layer.phase.moments(count)[-1])
        near, far = (min(y, bottom), top) if mu > 0 else (max(y, top), bottom)
        far = min(far, near + 45 * abs(mu) / scaled.min())
        if mu * (near - far) <= 0:
            continue
        edges = near + (far - near) * np.linspace(0, 1, 30) ** 2
        for a, b in itertools.pairwise(edges):
            depths = a + (b - a) * (nodes + 1) / 2
            length, step = np.abs(depths - near) / abs(mu), abs(b - a) / 2 * weights / abs(mu)
            seen = passed[:, None] * np.exp(-scaled[:, None] * length) * step
            total = total + (source(layer, depths) * seen).sum(axis=-1)
        passed = passed * np.exp(-scaled * abs(far - near) / abs(mu))
    return total.T


_GRIDS = {
    "floor": (8.0,),
    "deep": (math.inf,),
    "layers": (0.5, 3.0, 8.0),
    "layers, deep": (1.0, math.inf),
}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("ends", _GRIDS.values(), ids=_GRIDS)
@pytest.mark.parametrize("index", [None, 1.34])
def test_grid_is_the_integral_of_the_source_function(ends, index):
    """Also where a ray is one of the streams, or goes with the sun, and rates agree with it."""
    waters = ([0.1, 1.0], [0.4, 1e-7]), ([0.5, 0.2], [0.3, 1.0]), ([0.05, 0.1], [0.9, 0.1])
    layers = [_layer(a, b, "petzold", end) for end, (a, b) in zip(ends, itertools.cycle(waters))]
    sun = sun_travel_direction(50, 30, 1.34)
    field = solve_discrete_ordinates(
        layers, [1.0, 2.0], sun, surface=index and WaterSurface(index),
        floor_reflectance=0.3, streams=8,
        sky=Sky.standard("clear", [0.3, 0.1], sun_travel_direction(50, 30, 1.0)),
    )  # fmt: skip
    depths, turns = np.array([0.0, 0.5, 2.2, 7.9]), np.array([0.0, 1.0, 3.0])
    mu = np.array([-1.0, -field.mu[1], -0.02, 0.05, field.mu[2], -float(sun[2]), 0.9])
    found = field.scattered_on_grid(depths, mu, turns)
    wanted = [[_smooth_light(field, layers, y, x, turns) for x in mu] for y in depths]
    wanted = np.moveaxis(np.array(wanted), 2, 0)
    assert found.shape == (2, 4, 7, 3)
    largest = wanted.max(axis=(1, 2, 3), keepdims=True)
    np.testing.assert_allclose(found / largest, wanted / largest, atol=1e-9, rtol=0)


def test_grid_is_what_rays_see():
    layers = [_layer([0.1], [0.4], "isotropic", z) for z in (1.0, 5.0)]
    mu_s, floor = 0.8, 0.3
    field = solve_discrete_ordinates(
        layers, [1.0], (0.6, 0.0, -mu_s), floor_reflectance=floor, streams=8
    )
    depths, mu, turns = np.array([0.1, 3.0]), np.array([-0.9, -0.1, 0.3, 1.0]), np.array([0.2, 2.0])
    y, z, t = np.meshgrid(depths, mu, turns, indexing="ij")
    across = np.sqrt(1 - z**2)
    w = (-across * np.cos(t), -across * np.sin(t), z)
    seen = field.radiance(y, w) - field.single_scattering(y, w)
    grid, c = field.scattered_on_grid(depths, mu, turns), field.extinction
    np.testing.assert_allclose(c, 0.5)
    floor_image = (z < 0) * np.exp(-c * (5.0 - y) / np.abs(z)) * field.floor_radiance
    np.testing.assert_allclose(grid[0] + floor_image, seen[..., 0], rtol=1e-9)
    np.testing.assert_allclose(field.beam(depths)[0], np.exp(-c * depths / mu_s))
    down, up = field.stream_modes(depths, 12)
    assert down.shape == up.shape == (12, 1, 2, 4)
    direct = np.exp(-c * depths / mu_s)
    flux = 2 * math.pi * down[0, 0] @ (field.mu * field.weights) + direct
    np.testing.assert_allclose(field.Ed(depths)[:, 0], flux)


def test_sun_along_a_stream_is_as_beside_it():
    """Where next to nothing scatters the rates are those of the streams, and of the sun's beam."""

    def solved(mu_s):
        sun = math.sqrt(1 - mu_s**2), 0.0, -mu_s
        return solve_discrete_ordinates([_layer(0.5, 1e-14)], [1.0], sun, streams=8)

    mu_s = float(solved(0.7).mu[2])
    beside = [solved(mu_s + step) for step in (-1e-3, 1e-3)]
    for name in ("Eu", "scalar_irradiance"):
        found = getattr(solved(mu_s), name)(2.0)
        around = np.mean([getattr(field, name)(2.0) for field in beside], axis=0)
        np.testing.assert_allclose(found, around, rtol=1e-4)
    y, along = [0.5, 2.0], [0.9, mu_s, 0.2]
    found = solved(mu_s).scattered_on_grid(y, along, [0.0])
    around = np.mean([field.scattered_on_grid(y, along, [0.0]) for field in beside], axis=0)
    np.testing.assert_allclose(found, around, rtol=1e-3)
    down = solved(mu_s).stream_modes(y, 1)[0]
    around = np.mean([field.stream_modes(y, 1)[0] for field in beside], axis=0)
    np.testing.assert_allclose(down, around, rtol=1e-3)


def test_azimuth_modes_left_out_are_faint(monkeypatch):
    depths, mu, turns = np.linspace(0.1, 9, 5), np.linspace(-0.95, 0.95, 12), np.linspace(0, 3, 6)

    def solved():
        return solve_discrete_ordinates(
            [_layer([0.1], [0.4], "petzold", 9.0)], [1.0], sun_travel_direction(12, 30, 1.34),
            sky=Sky.standard("uniform", [0.3]), surface=WaterSurface(1.34), floor_reflectance=0.2,
        )  # fmt: skip

    some = solved().scattered_on_grid(depths, mu, turns)
    kept = np.count_nonzero(np.any(solved().stream_modes(depths, STREAMS)[0], axis=(1, 2, 3)))
    monkeypatch.setattr(discrete_ordinates, "_FAINT", 0.0)
    every = solved().scattered_on_grid(depths, mu, turns)
    assert kept < 0.6 * STREAMS
    np.testing.assert_allclose(some, every, atol=1e-6 * every.max())


def _ring(sun, degrees, count=8):
    """View directions at an angle to the in-water sun."""
    to_sun = -np.array(sun)
    across = np.cross(to_sun, (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    around = 2 * math.pi * (np.arange(count) + 0.5) / count
    turned = np.outer(across, np.cos(around)) + np.outer(np.cross(to_sun, across), np.sin(around))
    angle = math.radians(degrees)
    return tuple(math.cos(angle) * to_sun[:, None] + math.sin(angle) * turned)


@pytest.mark.parametrize(
    ("water", "nm", "y", "bound"), [("IB", 480.0, 15.0, 0.015), ("3C", 560.0, 5.0, 0.02)]
)
def test_light_close_to_the_sun(water, nm, y, bound):
    """Rings of 24 and 32 streams against 96, whose own delta-M resolves 2°; it is far off at 1°."""
    nm, sun = np.array([nm]), sun_travel_direction(30, 0, 1.34)
    water, b = Water.jerlov(water), Water.jerlov(water).b(nm)
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(nm))
    fields = [
        solve_discrete_ordinates(
            [OpticalLayer(math.inf, water.a(nm), b, phase)], [1.0], sun, streams=n
        )
        for n in (24, 32, 96)
    ]
    for degrees in (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 12.0, 15.0):
        w = _ring(sun, degrees)
        few, more, many = (field.radiance(y, w).mean() for field in fields)
        assert few == pytest.approx(many, rel=bound), degrees
        assert more == pytest.approx(many, rel=bound / 2), degrees
        # Of the many streams the factor is next to 1 where they resolve the peak themselves.
        if degrees >= 3.0:
            s2 = [math.sin(math.radians(degrees) / 2) ** 2]
            assert fields[2].aureole([y], s2) == pytest.approx(1.0, abs=0.03)


def test_the_aureole_grows_from_the_surface_and_ends_at_15_degrees():
    layers = [_layer(0.1, 0.3, "mixture", z) for z in (1.0, 4.0)]
    field = solve_discrete_ordinates(layers, [1.0], DOWN)
    s2 = np.sin(np.radians([0.5, 3.0, 16.0]) / 2) ** 2
    factor = field.aureole([0.0, 2.0, 4.0], s2)
    assert factor[:, 0] == pytest.approx(1.0)
    assert np.all(factor[..., 2] == 1.0)
    assert 0.5 < factor[0, 2, 0] < factor[0, 1, 0] < 0.95


def test_the_sun_is_no_brighter_than_its_disc():
    field = solve_discrete_ordinates([_layer(0.05, 0.2, "mixture")], [1.0], (0.6, 0.0, -0.8))
    at_sun, beside = (
        field.radiance(5.0, tuple(x[0] for x in _ring((0.6, 0.0, -0.8), angle)))
        for angle in (0.0, 0.05)
    )
    assert at_sun == pytest.approx(beside, rel=1e-3)
    # The sun itself, spread over its disc in the water.
    assert at_sun < 1.0 / 0.8 / (math.pi * (SUN_RADIUS / 1.34) ** 2)
