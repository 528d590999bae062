"""Lamps where they should not be: every light of theirs is finite, smooth, and has its limit."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.grouping import grouped
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, lamp_disc, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_surface import (
    lamplight,
    patch_past_lamp,
    surface_irradiance,
)
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile, rov_lamp
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture

ORIGIN, AHEAD = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
RADIUS, FAR = 0.02, 1e6
WATER = lamp_water([0.03, 0.05, 0.4], [0.02, 0.4, 1.0], seawater_mixture([1.0] * 3, [0.02] * 3))
CLEAR = lamp_water([0.0] * 3, [0.0] * 3, seawater_mixture([1.0] * 3, [0.02] * 3))
PROFILES = [IsotropicProfile(), rov_lamp(), SpotProfile(math.radians(40), 0.3)]


def _lamp(position, profile=PROFILES[0], power=1.0, axis=(0.0, 0.0, -1.0)) -> Lamp:
    return Lamp(position, axis, np.full(3, power), profile, RADIUS)


def _ahead(lamp, P=FAR, water=WATER):
    """Light in the water along z, of once and of more often, and the lamp's own disc."""
    ray = ray_past_lamp(lamp, ORIGIN, AHEAD, P)
    parts = *lamp_light(lamp, ray, water), lamp_disc(lamp, ray, water.c)
    return np.array(np.broadcast_arrays(*parts))


def _on(lamp, point=ORIGIN, normal=AHEAD, water=WATER):
    """Irradiance: unscattered, scattered from about the lamp, and the rest."""
    return np.array(surface_irradiance(lamp, patch_past_lamp(lamp, point, normal), water))


def _smooth(light, first, last):
    """Return light at places that it is finite and not negative at, and between which it is steady.

    What is steady changes less over smaller steps; a jump does not.
    """
    found = []
    for count in (801, 3201):
        values = light(np.linspace(first, last, count)[:, None])
        assert np.isfinite(values).all()
        assert (values >= 0).all()
        found.append(values)
    coarse, fine = (np.abs(np.diff(values, axis=0)).max(axis=0) for values in found)
    assert (fine <= 0.5 * coarse).all()
    return found[0]


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
def test_a_lamp_that_passes_through_the_camera(profile, axis):
    """Nothing is nearer to a lamp than its radius: light of a lamp around the camera is held."""
    light = _smooth(
        lambda x: _ahead(_lamp((x, 0.0, 0.0), profile, axis=axis))[:2].sum(axis=0), -0.1, 0.1
    )
    inside = light[np.abs(np.linspace(-0.1, 0.1, 801)) < RADIUS]
    if axis[0] == 0.0:
        assert inside == pytest.approx(np.broadcast_to(inside[0], inside.shape), rel=1e-6)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_lamp_that_crosses_the_ray(profile):
    """Its disc is seen within its radius; the glow about it is highest there and held."""
    glow = _smooth(lambda x: _ahead(_lamp((x, 0.0, 3.0), profile))[:2].sum(axis=0), 0.0, 0.2)
    assert (np.diff(glow, axis=0) <= 1e-9).all()
    assert _ahead(_lamp((0.99 * RADIUS, 0.0, 3.0), profile))[2].all()
    assert not _ahead(_lamp((1.01 * RADIUS, 0.0, 3.0), profile))[2].any()


@pytest.mark.parametrize("profile", PROFILES)
def test_a_lamp_behind_a_wall(profile):
    """The water before the wall has light of it; the wall's own front has none that is straight."""
    lamp = _lamp((0.3, 0.0, 5.0), profile)
    light = _smooth(lambda P: _ahead(lamp, P)[:2].sum(axis=0), 0.0, 8.0)
    assert not light[0].any()
    front, back = (_on(lamp, (0.0, 0.0, 4.0), (0.0, 0.0, z)) for z in (-1.0, 1.0))
    assert not front[:2].any()
    assert (front[2] >= 0).all()
    assert (front[2] < 0.1 * back.sum(axis=0)).all()


@pytest.mark.parametrize("profile", PROFILES)
def test_a_lamp_that_comes_to_touch_a_surface(profile):
    """Its light grows as from a disc of its radius, and fades where the surface is inside it."""
    light = _smooth(lambda z: _on(_lamp((0.0, 0.0, z), profile)).sum(axis=0), 0.0, 0.1)
    assert not _on(_lamp(ORIGIN, profile))[:2].any()
    # Scattered light comes to that of the disc.
    assert 0.4 / RADIUS**2 < light.max() < 0.505 / RADIUS**2
    for z in (RADIUS, 0.05, 0.5):
        E = _on(_lamp((0.0, 0.0, z), profile))[0] * np.exp(WATER.c * z)
        assert pytest.approx(np.full(3, 1.0 / (z * z + RADIUS * RADIUS)), rel=1e-6) == E


@pytest.mark.parametrize("distance", [1e-3, 1e3])
@pytest.mark.parametrize("at", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_a_lamp_as_near_and_as_far_as_can_be(distance, at):
    place = tuple(distance * x for x in at)
    lamp = _lamp(place, axis=tuple(-x for x in at))
    light = np.concatenate([_ahead(lamp), _on(lamp)])
    assert np.isfinite(light).all()
    assert (light >= 0).all()
    # 1 km of water leaves nothing; without water it is the inverse square.
    if distance > 1:
        assert light.max() < 1e-12
        E = _on(lamp, normal=at, water=CLEAR)
        assert E[0] == pytest.approx(np.full(3, 1e-6), rel=1e-6)
        assert not E[1:].any()
    # Inside its radius a lamp is where its middle is.
    else:
        still = _ahead(_lamp(ORIGIN, axis=lamp.axis))
        assert _ahead(lamp)[:2] == pytest.approx(still[:2], rel=0.1)


def test_no_power_is_no_light():
    lamp = _lamp((0.3, 0.0, 2.0), power=0.0)
    assert not np.concatenate([_ahead(lamp), _on(lamp)]).any()
    assert not lamplight([lamp], WATER, ORIGIN, [(0.0, 0.0, 3.0)]).any()


def test_a_hundred_lamps_are_a_hundred_times_one():
    """As light adds up, so do they; their shadows are in three groups, none of them empty."""
    one = _lamp((0.4, 0.1, 2.0), rov_lamp())
    lamps = [dataclasses.replace(one, intensity=one.intensity / 100)] * 100
    for light in (_ahead, _on):
        assert sum(light(lamp) for lamp in lamps) == pytest.approx(light(one), rel=1e-9)
    seen = [(0.0, 0.0, 4.0)]
    metered = lamplight(lamps, WATER, ORIGIN, seen)
    assert metered == pytest.approx(lamplight([one], WATER, ORIGIN, seen), rel=1e-9)
    places = np.random.default_rng(1).uniform(-5.0, 5.0, (100, 3))
    assert set(grouped(places, 3)) == {0, 1, 2}
