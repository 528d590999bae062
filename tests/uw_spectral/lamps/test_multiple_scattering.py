"""Lamp light scattered more than once: against photons, and its limits."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.benchmarks.lamp_light import even_in_angle, exact, solved
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_path import gauss_sum, single_scattering
from underwater_spectral.uw_spectral.lamps.multiple_scattering import (
    BandLight,
    LampField,
    lamp_light,
    lamp_water,
    light_along,
)
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile, rov_lamp
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import (
    HenyeyGreenstein,
    parse_phase,
    seawater_mixture,
)
from underwater_spectral.validation import lamp_cases, lamp_photons

HG = BandPhase((HenyeyGreenstein(0.9),), np.ones((1, 1)))
MIXTURE = seawater_mixture([1.0], [0.02])


def test_photons_of_the_first_order_are_the_integral():
    rng = np.random.default_rng(2)
    for function in (HG, MIXTURE):
        phase = lamp_photons.tables_of(function)
        for position in ((0.3, 0.0, 0.0), (0.5, 0.0, 3.0)):
            x, w = np.zeros((20000, 3)), np.tile([0.0, 0.0, 1.0], (20000, 1))
            lamp = Lamp(position, (0, 0, 1), np.ones(1), rov_lamp(), 1e-4)
            found = lamp_photons.orders(
                x, w, math.inf, np.array(position), lamp.profile.value, np.array([0, 0, 1.0]),
                phase, rng, count=1,
            )  # fmt: skip
            ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 1e6)
            wanted = single_scattering(lamp, ray, np.ones(1), np.ones(1), function)[0]
            assert found.mean() == pytest.approx(wanted, rel=0.02)


def test_photons_absorb_all_that_the_lamp_emits():
    # Rays from random places in random directions are the scalar irradiance: a E0 over all
    # water is the power. Unscattered light is absorbed by a/c; the rest by what is scattered.
    rng = np.random.default_rng(5)
    count, R = 100_000, 14.0
    r = R * rng.random(count)
    x = np.zeros((count, 3))
    x[:, 0] = r
    w = rng.normal(size=(count, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    # 4π r² (volume) × 4π (radiance to scalar irradiance) × R (mean over r) / 4π (power).
    phase = lamp_photons.tables_of(BandPhase((HenyeyGreenstein(0.6),), np.ones((1, 1))))
    orders = lamp_photons.orders(
        x, w, math.inf, np.zeros(3), IsotropicProfile().value, np.array([0, 0, 1.0]), phase, rng,
        count=12, weight=4 * math.pi * R * r**2,
    )  # fmt: skip
    albedo = 0.4
    scattered, error = lamp_photons.summed(orders, albedo)
    assert (1 - albedo) * error < 0.03 * albedo
    assert (1 - albedo) * scattered == pytest.approx(albedo, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("index", "tolerance"), [(0, 0.15), (1, 0.15), (2, 0.08), (3, 0.08), (4, 0.2), (5, 0.35)]
)
def test_it_is_as_photons_have_it(index, tolerance):
    away = np.array([math.sin(0.2), 0.0, math.cos(0.2)])
    z, x = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    case = [
        lamp_cases.Case("in view", HG, IsotropicProfile(), 2.0 * away, -away, math.inf),
        lamp_cases.Case("in view", MIXTURE, rov_lamp(), 2.0 * away, -away, math.inf),
        lamp_cases.Case("beside", HG, rov_lamp(), 0.2 * x, z, 3.0),
        lamp_cases.Case("patch", HG, IsotropicProfile(), 1.5 * z, -z, math.inf),
        lamp_cases.Case("in view", HG, IsotropicProfile(), 5.0 * away, -away, math.inf),
        lamp_cases.Case("across", MIXTURE, SpotProfile(1.0, 0.5), 1.0 * away, -x, math.inf),
    ][index]
    # Beside a lamp rare photons bring much: few are too low.
    found = lamp_cases.traced(case, 150_000 if case.kind == "beside" else 30_000, 7)
    for albedo in (0.4, 0.8, 0.95):
        value, error = lamp_photons.summed(found, albedo)
        single, whole = solved(case, albedo)
        value += single if case.kind == "patch" else 0.0
        assert error < 0.5 * tolerance * value
        assert whole == pytest.approx(value, rel=tolerance)
        assert abs(whole / value - 1) < abs(single / value - 1)


def test_light_beside_a_beam_was_bent_out_of_it():
    """By the blur of the beam alone it would be three times too bright there."""
    at, axis = np.array([0.25, 0.0, 2.68]), np.array([0.7, -0.58, 0.42])
    case = lamp_cases.Case("across", HG, rov_lamp(), at, axis / np.linalg.norm(axis), math.inf)
    value, error = lamp_photons.summed(lamp_cases.traced(case, 10000, 3), 0.8)
    assert error < 0.1 * value
    assert 0.7 < solved(case, 0.8)[1] / value < 1.3


def test_the_first_part_is_light_scattered_once():
    lamp = Lamp((0.5, 0, 3), (0, 0, -1), np.array([2.0]), rov_lamp())
    ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 20.0)
    water = lamp_water([0.1], [0.3], HG)
    single, more = lamp_light(lamp, ray, water)
    assert single == pytest.approx(single_scattering(lamp, ray, water.b, water.c, HG))
    assert more > 0


def test_thin_water_scatters_once():
    lamp = Lamp((0.5, 0, 3), (0, 0, -1), np.array([2.0]))
    ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 20.0)
    single, more = lamp_light(lamp, ray, lamp_water([1e-4], [1e-4], HG))
    assert more < 0.01 * single


def test_more_nodes_change_little():
    def more(nodes, lamp, ray):
        def integrate(count, term):
            return gauss_sum(nodes or count, term)

        return light_along(lamp, ray, BandLight(np.ones(1), water), integrate=integrate)[1]

    water = lamp_water([0.05], [0.6], MIXTURE)
    for at, axis in (((0.4, 0, 0.1), (0, 0, 1)), ((1.0, 0, 4.0), (0, 0, -1))):
        for profile in (IsotropicProfile(), rov_lamp(), SpotProfile(1.2, 0.4)):
            lamp = Lamp(at, axis, np.ones(1), profile)
            ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 6.0)
            assert more(None, lamp, ray) == pytest.approx(more(100, lamp, ray), rel=0.03)


@pytest.mark.slow
def test_some_of_the_bands_are_those_bands():
    phase = seawater_mixture([0.3, 0.6, 1.2], [0.02, 0.03, 0.04])
    water = lamp_water([0.1, 0.2, 0.3], [0.3, 0.6, 1.2], phase)
    lamp = Lamp((0.5, 0, 3), (0, 0, -1), np.ones(1), rov_lamp())
    ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 1e6)
    found = light_along(lamp, ray, BandLight(1.0, water.of_bands([2, 0])))[1]
    assert found == pytest.approx(
        light_along(lamp, ray, BandLight(1.0, water))[1][[2, 0]], rel=1e-2
    )


def _of_degrees(degrees, water):
    return replace(water, field=LampField(replace(water.field.harmonics, degrees=degrees)))


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_extremes_are_finite(dtype):
    z = dtype(0), dtype(0), dtype(1)
    origin = (dtype(0),) * 3
    waters = [
        _of_degrees(12, lamp_water([a], [b], function)).astype(dtype)
        for a, b in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1e-6, 1e-6), (100.0, 400.0)]
        for function in (MIXTURE, parse_phase("isotropic").for_bands([1.0]))
    ]
    # What is solved is kept for few waters.
    for water, profile, position, P in itertools.product(
        waters,
        [IsotropicProfile(), SpotProfile(0.02, 0.0)],
        [(0, 0, 0), (0, 0, 5), (0, 0, -5), (1e-3, 0, 0), (0, 0, 1e3), (1e3, 0, 0), (0, 0, -1e3)],
        (1e-4, 1.0, 1e6),
    ):
        lamp = Lamp(tuple(map(dtype, position)), z, np.ones(1, dtype), profile, dtype(0.01))
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            ray = ray_past_lamp(lamp, origin, z, dtype(P))
            L = lamp_light(lamp, ray, water)
        assert np.all(np.isfinite(L))
        assert np.all(np.asarray(L) >= 0)


def test_coefficients_that_cannot_be_are_refused():
    for a, b in ((-0.1, 0.1), (0.1, math.nan), (math.inf, 0.1)):
        with pytest.raises(InputError, match="must be finite and not negative"):
            lamp_water([a], [b], HG)


def test_the_cube_root_is_what_sea_particles_need():
    lamp = Lamp((0.05, 0.0, 4.0), (0, 0, 1), np.ones(1), radius=1e-4)
    wanted = exact(lamp, 30.0, 0.3, MIXTURE)
    assert abs(even_in_angle(lamp, 30.0, 0.3, MIXTURE, 12) / wanted - 1) > 0.1
    ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 30.0)
    found = single_scattering(lamp, ray, np.ones(1), np.full(1, 0.3), MIXTURE)[0]
    assert found == pytest.approx(wanted, rel=1e-3)
