"""Light through waves on average, against rays traced through waves, others' results, and laws."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.description import (
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from underwater_spectral.uw_spectral.imaging.optics import resolve
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import (
    fresnel_reflectance,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.surface.waves import slope_variance_CoxMunk1954
from underwater_spectral.uw_spectral.transfer import rough_surface
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    OpticalLayer,
    _quadrature,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.radiance_table import tabulate
from underwater_spectral.uw_spectral.transfer.rough_surface import (
    WaterSurface,
    exchange,
    facet_slopes,
)
from underwater_spectral.uw_spectral.transfer.sky import RINGS, Sky
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.closed_form.internal_reflectance import internal_reflectance
from underwater_spectral.validation.closed_form.light_field import light_field_of
from underwater_spectral.validation.traced_sea import TracedSea, photons

N = 1.34
DOWN = (0.0, 0.0, -1.0)
VARIANCES = {wind: float(slope_variance_CoxMunk1954(wind).sum()) for wind in (2, 5, 10)}
EVERY = pytest.mark.parametrize("variance", VARIANCES.values(), ids=VARIANCES)


def _layer(a, b, phase="hg:0.8", bottom=math.inf):
    a, b = np.atleast_1d(np.asarray(a, float)), np.atleast_1d(np.asarray(b, float))
    return OpticalLayer(bottom, a, b, parse_phase(phase).for_bands(b))


def _streams(count):
    mu, weights = _quadrature(count, math.sqrt(1.0 - N**-2))
    return mu, weights, (tuple(mu.tolist()), tuple(weights.tolist()), RINGS, 2 * count)


def _directions(count):
    w = np.random.default_rng(0).normal(size=(3, count))
    return tuple(w / np.linalg.norm(w, axis=0))


@pytest.mark.parametrize("count", [4, 8, 12, 16])
@EVERY
def test_the_exchange_neither_makes_nor_loses_light(variance, count):
    mu, weights, rays = _streams(count)
    found, flux = exchange(WaterSurface(N, variance), *rays), mu * weights
    goes, comes = found.reflected[0], found.entering[0].sum(axis=1) / N**2
    assert min(goes.min(), comes.min()) >= 0
    np.testing.assert_allclose(goes.sum(axis=1) + comes, 1.0, atol=1e-6)
    # The same the other way: what rises along a stream comes down, or leaves to the sky.
    np.testing.assert_allclose(flux @ goes / flux + comes, 1.0, atol=1e-6)
    for mode in found.reflected:
        both = flux[:, None] * mode
        np.testing.assert_allclose(both, both.T, atol=1e-12)
    assert np.abs(found.reflected[1:]).sum(axis=2).max() <= 1.0 + 1e-6


def test_no_waves_are_the_flat_surface():
    mu, _, rays = _streams(16)
    found = exchange(WaterSurface(N, 1e-12), *rays)
    for mode in found.reflected:
        flat = np.diag(fresnel_reflectance(mu, 1.0 / N))
        np.testing.assert_allclose(mode, flat, atol=3e-3)
    zenith = np.cos(np.radians(np.arange(0.0, 90.0, 5.0)))
    calm, flat = (WaterSurface(N, slopes).reflectance(zenith) for slopes in (1e-12, 0.0))
    np.testing.assert_allclose(calm, flat, rtol=1e-4)
    assert internal_reflectance(WaterSurface(N, 1e-12)) == pytest.approx(
        internal_reflectance(WaterSurface(N)), abs=1e-4
    )


@pytest.mark.parametrize("sky", ["uniform", "overcast"])
def test_light_under_ever_smaller_waves_is_that_under_a_flat_surface(sky):
    sun = sun_travel_direction(50, 20, N)
    light = {"sky": Sky.standard(sky, [0.5], sun_travel_direction(50, 20, 1.0)),
             "floor_reflectance": 0.3}  # fmt: skip
    flat, calm = (
        solve_discrete_ordinates([_layer(0.1, 0.3, bottom=6.0)], [1.0], sun,
                                 surface=WaterSurface(N, s), **light)
        for s in (0.0, 1e-9)
    )  # fmt: skip
    y = [0.0, 2.0, 6.0]
    for quantity in ("Ed", "Eu", "scalar_irradiance"):
        found, wanted = (getattr(field, quantity)(y) for field in (calm, flat))
        np.testing.assert_allclose(found, wanted, rtol=2e-3)
    w = _directions(60)
    away = np.abs(w[2] - math.sqrt(1.0 - N**-2)) > 0.02  # the edge of Snell's window
    w = tuple(part[away] for part in w)
    np.testing.assert_allclose(calm.radiance(2.0, w), flat.radiance(2.0, w), rtol=0.01)


@EVERY
@pytest.mark.parametrize(("streams", "error"), [(16, 1e-3), (32, 1e-5)])
def test_furnace(variance, streams, error):
    """White water over a white floor under a sky of 1: n² in every direction, waves or not."""
    field = solve_discrete_ordinates(
        [_layer([1e-9], [0.7], bottom=3.0)], [0.0], DOWN, sky=Sky.standard("uniform", [math.pi]),
        surface=WaterSurface(N, variance), floor_reflectance=1.0, streams=streams,
    )  # fmt: skip
    found = field.radiance([[0.0], [1.1], [3.0]], _directions(40))
    np.testing.assert_allclose(found, N**2, rtol=error)
    np.testing.assert_allclose(field.scalar_irradiance(1.1), 4 * math.pi * N**2, rtol=error)


@EVERY
@pytest.mark.parametrize("sky", ["uniform", "clear"])
def test_what_enters_leaves_or_is_absorbed(variance, sky):
    """White water over a black floor, and water that absorbs."""
    sun, floor = sun_travel_direction(60, 0, N), 4.0
    above = Sky.standard(sky, [0.7, 0.7], sun_travel_direction(60, 0, 1.0))
    field = solve_discrete_ordinates(
        [_layer([1e-9, 0.2], [0.8, 0.4], bottom=floor)], [1.0, 1.0], sun, sky=above,
        surface=WaterSurface(N, variance),
    )  # fmt: skip
    mu, weights, rays = _streams(len(field.mu))
    waves, flux = exchange(WaterSurface(N, variance), *rays), 2 * math.pi * weights * mu
    entered = 1.0 + flux @ (waves.entering[0] @ above.modes_in_air(1)[0].T)
    up = field.stream_modes([0.0], 1)[1][0, :, 0]
    left = up @ (flux - flux @ waves.reflected[0])
    nodes, steps = np.polynomial.legendre.leggauss(60)
    E0 = field.scalar_irradiance((nodes + 1.0) * floor / 2)
    absorbed = np.array([1e-9, 0.2]) * (steps @ E0) * floor / 2 + field.Ed(floor)
    np.testing.assert_allclose(left + absorbed, entered, rtol=1e-4)


def _reflectance_Jin2011(mu, variance):
    """Z. Jin et al., Opt. Express 19, 26429 (2011), a fit to a solver with waves; n = 1.34.

    Coefficients as public code that follows R. Séférian et al., Geosci. Model Dev. 11, 321
    (2018), has them.
    """
    s = math.sqrt(variance)
    f = 0.0152 - 1.7873 * mu + 6.8972 * mu**2 - 8.5778 * mu**3 + 4.071 * s - 7.6446 * mu * s
    f *= math.exp(0.1643 - 7.8409 * mu - 3.5639 * mu**2 - 2.3588 * s + 10.054 * mu * s)
    return float(fresnel_reflectance(mu, N)) - f


@EVERY
@pytest.mark.parametrize("zenith", [0, 30, 50, 60, 70, 75, 80])
def test_beam_reflectance_of_Jin2011(variance, zenith):
    """As close as their fit is to Fresnel where there are no waves: 10 % at 80°, 2 % to 60°."""
    mu = math.cos(math.radians(zenith))
    flat = abs(_reflectance_Jin2011(mu, 0.0) - float(fresnel_reflectance(mu, N)))
    found = float(WaterSurface(N, variance).reflectance(mu))
    assert found == pytest.approx(_reflectance_Jin2011(mu, variance), abs=0.002 + flat)


@EVERY
def test_internal_reflectance_of_Jin2011(variance):
    """Of the same source: r_w = 0.4817 - 0.0149 s - 0.2070 s²."""
    theirs = 0.4817 - 0.0149 * math.sqrt(variance) - 0.2070 * variance
    assert internal_reflectance(WaterSurface(N, variance)) == pytest.approx(theirs, abs=0.008)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("wind", [5, 10])
def test_reflectances_of_traced_waves(wind):
    sea = TracedSea(VARIANCES[wind], np.random.default_rng(wind), N)
    count, surface = 20_000, WaterSurface(N, VARIANCES[wind])
    any_way = np.sqrt((np.arange(count) + 0.5) / count)
    for cosines, above, ours in (
        (np.full(count, 0.5), True, surface.reflectance(0.5)),
        (np.full(count, 0.17), True, surface.reflectance(0.17)),
        (any_way, True, 1.0 - surface.sky_transmittance),
        (any_way, False, internal_reflectance(surface)),
    ):
        fraction, error = sea.reflectance(cosines, above=above)
        assert abs(float(ours) - fraction) < 4 * error + 0.05 * min(fraction, 1 - fraction)


@pytest.mark.parametrize("wind", [2, 10])
def test_where_traced_waves_reflect_to(wind):
    """How much of the light along a stream, how steeply down, and how far turned aside."""
    count, sea = 20_000, TracedSea(VARIANCES[wind], np.random.default_rng(1), N)
    mu, weights, rays = _streams(16)
    waves, flux = exchange(WaterSurface(N, VARIANCES[wind]), *rays), mu * weights
    for place in (4, 6):
        up = mu[place]
        w = np.repeat([[math.sqrt(1.0 - up * up)], [0.0], [up]], count, axis=1)
        x, y, z = sea.trace(w, above=False)
        down = z < 0
        reflected = waves.reflected[:, :, place] * flux / flux[place]
        assert reflected[0] @ mu == pytest.approx(-(z * down).mean(), abs=0.02)
        for m, fraction in enumerate(reflected[:6].sum(axis=1)):
            traced = np.cos(m * np.arctan2(y, x)) * down
            assert fraction == pytest.approx(traced.mean(), abs=0.03), (m, up)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("zenith", "sky"),
    [pytest.param(30.0, False, marks=pytest.mark.slow), (75.0, False), (0.0, True)],
)
def test_irradiances_of_photons_under_traced_waves(zenith, sky):
    """Ten winds' waves over a bright floor, which sends much to the surface from below."""
    a, b, g, floor, reflectance, y, count = 0.1, 0.4, 0.8, 3.0, 0.6, 1.0, 30_000
    random = np.random.default_rng(5)
    sea, sun = TracedSea(VARIANCES[10], random, N), sun_travel_direction(zenith, 0.0, N)
    w, entered = np.repeat(sun[:, None], count, axis=1), 1.0
    if sky:
        turn, up = random.uniform(0, 2 * math.pi, count), np.sqrt(random.random(count))
        w = np.array([np.sqrt(1 - up**2) * np.cos(turn), np.sqrt(1 - up**2) * np.sin(turn), -up])
        w = sea.trace(w, above=True)
        w = w[:, w[2] < 0]
        entered = w.shape[1] / count
    true = photons(sea, w, a=a, b=b, g=g, floor=floor, reflectance=reflectance, y=y)
    field = solve_discrete_ordinates(
        [_layer(a, b, f"hg:{g}", floor)], [0.0 if sky else 1.0], sun,
        sky=Sky.standard("uniform", [1.0 if sky else 0.0]),
        surface=WaterSurface(N, VARIANCES[10]), floor_reflectance=reflectance,
    )  # fmt: skip
    for quantity, wanted in ((field.Ed, true.Ed), (field.Eu, true.Eu),
                             (field.scalar_irradiance, true.E0)):  # fmt: skip
        assert float(quantity(y)[0]) == pytest.approx(entered * wanted, rel=0.012)


@EVERY
def test_radiance_below_the_surface_adds_up_to_the_irradiance(variance):
    sun = sun_travel_direction(40, 0, N)
    field = solve_discrete_ordinates(
        [_layer(0.1, 0.3, bottom=6.0)], [1.0], sun, surface=WaterSurface(N, variance),
        sky=Sky.standard("uniform", [1.0]), floor_reflectance=0.5,
    )  # fmt: skip
    critical = math.sqrt(1.0 - N**-2)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    up = np.concatenate([critical * (nodes + 1) / 2, critical + (1 - critical) * (nodes + 1) / 2])
    weights = np.concatenate([critical * weights / 2, (1 - critical) * weights / 2])
    turn = 2 * math.pi * (np.arange(24) + 0.5) / 24
    across = np.sqrt(1.0 - up[:, None] ** 2)
    w = (across * np.cos(turn), across * np.sin(turn), np.repeat(up[:, None], 24, axis=1))
    E = 2 * math.pi / 24 * np.einsum("u,utn->n", weights * up, field.surface_radiance(w))
    assert pytest.approx(field.Ed(0.0), rel=0.005) == E + 1.0


def test_facets_have_the_slope_variance():
    x, y, fraction = facet_slopes(0.05, 6, 12)
    assert fraction @ x**2 == pytest.approx(0.025)
    assert fraction @ y**2 == pytest.approx(0.025)
    assert fraction @ x**4 == pytest.approx(3 * 0.025**2, rel=0.01)


def _column(**changes):
    values = {"surface": "waves", "sky": "uniform", "slope_variance": VARIANCES[10]} | changes
    return WaterColumn(
        Bands.uniform(2), 0.1, 0.3, 1.0, 0.8, (0.6, 0.0, -0.8), 0.2, 6.0, 0.3,
        refractive_index=N, **values,
    )  # fmt: skip


def test_only_waves_take_note_of_slopes():
    phase = parse_phase("hg:0.8").for_bands([0.3, 0.3])
    flat = _column(surface="flat", slope_variance=0.0)
    for same in (_column(surface="flat"), _column(slope_variance=0.0)):
        assert np.array_equal(
            same.solved_field(phase, 16).Ed(2.0), flat.solved_field(phase, 16).Ed(2.0)
        )
        assert np.array_equal(
            light_field_of(same, phase).Ed(2.0), light_field_of(flat, phase).Ed(2.0)
        )
        assert same.glitter == 1.0
    waves = _column()
    assert np.all(light_field_of(waves, phase).Ed(2.0) > light_field_of(flat, phase).Ed(2.0))
    assert np.all(waves.sky_irradiance > flat.sky_irradiance)
    with pytest.raises(InputError, match="slope variance"):
        _column(slope_variance=math.nan)
    with pytest.raises(InputError, match="slope variance"):
        solve_discrete_ordinates([_layer(1, 1)], [1.0], DOWN, surface=WaterSurface(N, -1.0))


def test_a_low_sun_enters_through_waves():
    given = Description(
        light=SunAndSky("d65", 80.0, above_surface=True),
        surface=SurfaceDescription("waves", N, VARIANCES[10]), floor=FloorDescription(6.0),
    )  # fmt: skip
    flat = dataclasses.replace(given, surface=SurfaceDescription("flat", N))
    columns = [resolve(each).column for each in (given, flat)]
    ratio = columns[0].sun_irradiance / columns[1].sun_irradiance
    cosine = math.cos(math.radians(80))
    surfaces = WaterSurface(N, VARIANCES[10]), WaterSurface(N)
    enters = [1 - surface.reflectance(cosine) for surface in surfaces]
    wanted = enters[0] / enters[1]
    assert ratio == pytest.approx(float(wanted))
    assert 1.15 < float(wanted) < 1.3
    assert columns[0].glitter == pytest.approx(1 / float(wanted))
    assert columns[1].glitter == 1.0


def test_tables_hold_the_surface_under_waves():
    column = _column(sky="clear")
    field = column.solved_field(parse_phase("hg:0.8").for_bands([0.3, 0.3]), 24)
    sun = column.sun_direction.tolist()
    w = _directions(200)
    w = tuple(part[w[2] > 0.15] for part in w)
    error = np.abs(tabulate(field).boundary_image(w, sun) / field.surface_radiance(w) - 1.0)
    assert np.quantile(error, 0.9) < 0.03
    assert error.max() < 0.15


def test_waters_below_the_same_waves_share_what_these_do():
    surface = SurfaceDescription("waves", N, 0.03)

    def light(absorption):
        water = WaterDescription("jerlov:IB", absorption_factor=absorption)
        return resolve(Description(water, surface=surface)).viewpoint(5.0).light

    first = light(1.0)
    before = [f.cache_info().misses for f in (rough_surface._reflectance, internal_reflectance)]
    assert not np.array_equal(light(2.0), first)
    after = [f.cache_info().misses for f in (rough_surface._reflectance, internal_reflectance)]
    assert after == before
