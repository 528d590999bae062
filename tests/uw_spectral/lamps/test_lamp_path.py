"""Lamp light scattered once, against brute force, and its limits."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps import lamp_path
from underwater_spectral.uw_spectral.lamps.lamp import NEAREST, Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.profile import (
    IsotropicProfile,
    SpotProfile,
    TableProfile,
    rov_lamp,
)
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import (
    HenyeyGreenstein,
    parse_phase,
    seawater_mixture,
)

PHASES = {
    "hg": BandPhase((HenyeyGreenstein(0.924),), np.ones((1, 1))),
    "mixture": seawater_mixture([0.3], [0.003]),
}


def marched(lamp, origin, w, P, b, c, phase, panels=20000):
    """The same along t, by the definition: no ξ, panels even in the angle that the lamp sees."""
    origin, w = np.asarray(origin, float), np.asarray(w, float)
    to_lamp = np.asarray(lamp.position, float) - origin
    t0 = to_lamp @ w
    h = math.sqrt(max(to_lamp @ to_lamp - t0 * t0, 1e-20))
    # Panels even in asinh(s/h): as fine as the lamp is near, everywhere.
    u = np.linspace(math.asinh(-t0 / h), math.asinh((P - t0) / h), panels + 1)
    half, middle = np.diff(u)[:, None] / 2, (u[1:] + u[:-1])[:, None] / 2
    nodes, weights = np.polynomial.legendre.leggauss(4)
    s = h * np.sinh(middle + half * nodes)
    dt = half * weights * np.sqrt(s * s + h * h)
    x = origin + (t0 + s)[..., None] * w
    from_lamp = x - lamp.position
    r = np.linalg.norm(from_lamp, axis=-1)
    u_lamp = from_lamp / r[..., None]
    towards_camera = ((u_lamp + w) ** 2).sum(axis=-1) / 4  # sin² of half the scattering angle
    falling = lamp.profile.value(u_lamp @ np.asarray(lamp.axis)) * lamp.intensity[0] / r**2
    p = phase.per_steradian(np.maximum(towards_camera, 1e-14)[..., None])[..., 0]
    return float((b * p * falling * np.exp(-c * (r + t0 + s)) * dt).sum())


def single(lamp, origin, w, P, b, c, phase, nodes=lamp_path.NODES):
    ray = ray_past_lamp(lamp, origin, w, P)
    found = lamp_path.single_scattering(lamp, ray, np.array([b]), np.array([c]), phase, nodes=nodes)
    return float(found[0])


def _unit(v):
    return tuple(np.asarray(v, float) / np.linalg.norm(v))


BESIDE = [
    (position, P, c)
    for position, P, c in itertools.product(
        [(0.3, 0, 0), (0.1, 0.2, -0.2), (1, 0, 0.1), (0, -0.5, -1)], (0.5, 3, 1e4), (0.03, 0.4, 3.0)
    )
]
IN_VIEW = [
    (position, P, c)
    for position, P, c in itertools.product(
        [(0.02, 0, 2), (0.5, 0, 5), (3, 1, 3), (0.3, 0, 30)], (40.0, 1e4), (0.03, 0.4, 3.0)
    )
]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize(("cases", "tolerance"), [(BESIDE, 1e-3), (IN_VIEW, 2e-3)])
def test_it_is_the_integral_along_the_ray(phase, cases, tolerance):
    for position, P, c in cases:
        lamp = Lamp(position, (0, 0, 1), np.array([2.0]), IsotropicProfile(), 1e-3)
        arguments = (lamp, (0, 0, 0), (0, 0, 1), P, 0.7 * c, c, PHASES[phase])
        assert single(*arguments) == pytest.approx(marched(*arguments), rel=tolerance), (
            position,
            c,
        )


@pytest.mark.parametrize(
    ("profile", "tolerance"),
    [
        (rov_lamp(), 0.02),
        (SpotProfile(math.radians(60), 1.0), 5e-3),
        (SpotProfile(math.radians(60), 0.15), 0.02),
        (SpotProfile(math.radians(3), 0.15), 0.02),
        (SpotProfile(math.radians(3), 0.0), 0.02),
        (TableProfile.of_angles([0, 4], [1, 1]), 0.02),
    ],
    ids=str,
)
def test_narrow_lamps_are_resolved(profile, tolerance):
    # Aimed along, across, against and away from the view, from beside and in front.
    for position, axis in (
        ((0.3, 0, 0), (0, 0, 1)),
        ((0.3, 0, 0), (-0.1, 0, 1)),
        ((1, 0, 4), (-1, 0, 0)),
        ((1, 0, 4), (-1, 0.02, -0.7)),
        ((0.05, 0, 4), (0, 0, -1)),
        ((2, 0, -1), (-0.6, 0, 1)),
    ):
        lamp = Lamp(position, _unit(axis), np.array([2.0]), profile, 1e-4)
        arguments = (lamp, (0, 0, 0), (0, 0, 1), 60.0, 0.2, 0.3, PHASES["hg"])
        wanted = marched(*arguments)
        assert single(*arguments) == pytest.approx(wanted, rel=tolerance, abs=1e-9), (
            position,
            axis,
        )


def test_a_ray_that_misses_the_cone_gets_nothing():
    spot = SpotProfile(math.radians(20), 0.2)
    lamp = Lamp((1, 0, 0), (1, 0, 0), np.array([1.0]), spot)
    assert single(lamp, (0, 0, 0), (0, 0, 1), 100.0, 0.1, 0.2, PHASES["hg"]) == 0.0


# What only an isotropic phase function in empty water has: L = b I (atan) / (4π h).
def test_without_extinction_it_is_the_angle_that_the_lamp_sees():
    phase = parse_phase("isotropic").for_bands([1.0])
    lamp = Lamp((2, 0, 1), (0, 0, 1), np.array([5.0]))
    wanted = 0.3 * 5.0 / (4 * math.pi * 2) * (math.atan(9 / 2) + math.atan(1 / 2))
    found = single(lamp, (0, 0, 0), (0, 0, 1), 10.0, 0.3, 0.0, phase)
    assert found == pytest.approx(wanted, rel=1e-5)


def test_an_error_of_10_percent_in_b_c_or_the_intensity_shows():
    lamp = Lamp((0.5, 0, 3), (0, 0, 1), np.array([2.0]))
    case = {"b": 0.2, "c": 0.5, "phase": PHASES["hg"]}
    geometry = ((0, 0, 0), (0, 0, 1), 20.0)
    right = marched(lamp, *geometry, **case)
    assert single(lamp, *geometry, **case) == pytest.approx(right, rel=2e-3)
    brighter = dataclasses.replace(lamp, intensity=np.array([2.2]))
    for wrong in (
        single(lamp, *geometry, **case | {"b": 0.22}),
        single(lamp, *geometry, **case | {"c": 0.55}),
        single(brighter, *geometry, **case),
    ):
        assert abs(wrong / right - 1) > 0.05


EXTREMES = list(
    itertools.product(
        [(0, 0, 0), (0, 0, 1e-3), (0, 0, 5), (0, 0, -5), (1e-3, 0, 0), (0, 0, 1e3), (1e3, 0, 0),
         (0, 0, -1e3)],
        (1e-4, 1.0, 1e6),
        [(0.0, 0.0), (0.0, 1.0), (1e-6, 1e-6), (0.5, 1.0), (400.0, 500.0)],
        [IsotropicProfile(), rov_lamp(), SpotProfile(0.02, 0.0), SpotProfile(math.pi, 1.0)],
        [(0, 0, 1), (1, 0, 0), (0, 0, -1)],
    )
)  # fmt: skip


@pytest.mark.slow_but_first
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_extremes_are_finite(dtype):
    for position, P, (b, c), profile, axis in EXTREMES:
        position, axis = (tuple(np.array(v, dtype)) for v in (position, axis))
        lamp = Lamp(position, axis, np.ones(1, dtype), profile, dtype(0.01))
        zero, one = dtype(0), dtype(1)
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            ray = ray_past_lamp(lamp, (zero, zero, zero), (zero, zero, one), dtype(P))
            b_, c_ = np.array([b], dtype), np.array([c], dtype)
            L = lamp_path.single_scattering(lamp, ray, b_, c_, PHASES["mixture"])
        assert np.all(np.isfinite(L))
        assert np.all(L >= 0)


def test_single_precision_serves():
    for position, P, c in BESIDE + IN_VIEW:
        values = []
        for dtype in (np.float64, np.float32):
            cast = np.dtype(dtype).type
            lamp = Lamp(tuple(map(cast, position)), (cast(0), cast(0), cast(1)), np.ones(1, dtype))
            ray = ray_past_lamp(lamp, (cast(0),) * 3, (cast(0), cast(0), cast(1)), cast(P))
            phase = PHASES["hg"]
            values.append(lamp_path.single_scattering(lamp, ray, cast(0.5 * c), cast(c), phase))
        assert values[1] == pytest.approx(values[0], rel=1e-3)


def test_it_is_continuous_where_the_ray_meets_the_lamp():
    # h is held at the radius, or at a thousandth of the distance: no jump, no pole.
    lamp = Lamp((0, 0, 4), (0, 0, -1), np.ones(1), radius=0.02)
    aside = np.array([0.0, 0.01, 0.0199, 0.0201, 0.03])
    L = [single(lamp, (x, 0, 0), (0, 0, 1), 50.0, 0.2, 0.4, PHASES["mixture"]) for x in aside]
    assert L[0] == pytest.approx(L[1], rel=1e-9)
    assert L[2] == pytest.approx(L[3], rel=0.05)
    assert L[4] < L[3]
    far = Lamp((0, 0, 4000), (0, 0, -1), np.ones(1), radius=0.02)
    assert float(ray_past_lamp(far, (0, 0, 0), (0, 0, 1), 1e4).h) == pytest.approx(4000 * NEAREST)


def test_intensity_and_b_are_factors_and_bands_do_not_mix():
    lamp = Lamp((0.5, 0, 3), (0, 0, 1), np.array([1.0, 0.0, 3.0]))
    ray = ray_past_lamp(lamp, (0, 0, 0), (0, 0, 1), 9.0)
    phase = parse_phase("hg:0.9").for_bands(np.ones(3))
    L = lamp_path.single_scattering(lamp, ray, np.full(3, 0.2), np.full(3, 0.4), phase)
    assert L[1] == 0
    assert L[2] == pytest.approx(3 * L[0])
    assert lamp_path.single_scattering(lamp, ray, 0.0, 0.4, phase) == pytest.approx(np.zeros(3))
