"""Scattered light that finds its way round objects, against points drawn in the whole water."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_shadow import (
    scattered_lit,
    shadow_directions,
    shadow_map,
    transmitted_in_shadow,
)
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile
from underwater_spectral.uw_spectral.lamps.soft_shadow import soft_map
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

PHASE = parse_phase("hg:0.6").for_bands([0.4])
WATER = lamp_water([0.1], [0.4], PHASE)
RADIUS = 0.35  # of a disc 1 m above the lamp


def _lamp(distances, profile=None):
    profile = profile or IsotropicProfile()
    shadow = shadow_map(distances)
    return Lamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), np.ones(1), profile, 1e-3, shadow=shadow)


def _disc():
    u = shadow_directions()
    across = np.hypot(u[:, 0], u[:, 1]) / np.maximum(u[:, 2], 1e-9)
    return np.where((u[:, 2] > 0) & (across < RADIUS), 1.0 / np.maximum(u[:, 2], 1e-9), np.inf)


def _crosses(start, end):
    """Whether straight ways cross the disc."""
    step = end[..., 2] - start[..., 2]
    fraction = (1.0 - start[..., 2]) / np.where(step == 0.0, 1e-9, step)
    at = start + fraction[..., None] * (end - start)
    return (fraction > 0) & (fraction < 1) & (np.hypot(at[..., 0], at[..., 1]) < RADIUS)


def _drawn(x, profile, count=2_000_000):
    """Fraction of the light scattered once that arrives at x, by points of the whole water."""
    rng = np.random.default_rng(3)
    u = rng.normal(size=(count, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    r = 12.0 * rng.random(count)
    y = u * r[:, None]
    d = np.linalg.norm(x - y, axis=1)
    # Of r² dr over 1/r²; near the place the others' 1/d² is cut off.
    s2 = (1.0 - ((x - y) * u).sum(axis=1) / d) / 2.0
    p = np.asarray(PHASE.per_steradian(s2[:, None]))[:, 0]
    weight = p * np.exp(-0.5 * (r + d)) / np.maximum(d, 0.03) ** 2 * profile.value(u[:, 2])
    arrives = ~_crosses(np.zeros_like(y), y) & ~_crosses(y, np.broadcast_to(x, y.shape))
    return float((weight * arrives).sum() / weight.sum())


def _walked(x, profile, orders, count=300_000):
    """Fraction of the light scattered up to so often that arrives at x, by photons that walk."""
    rng = np.random.default_rng(5)
    at, way = np.zeros((count, 3)), rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    weight, free, got = profile.value(way[:, 2]) * np.ones(count), np.ones(count, bool), []
    for _ in range(orders):
        there = at - np.log(rng.random(count))[:, None] / 0.5 * way
        free = free & ~_crosses(at, there)
        at, weight = there, weight * 0.8
        d = np.linalg.norm(x - at, axis=1)
        s2 = (1.0 - ((x - at) * way).sum(axis=1) / d) / 2.0
        p = np.asarray(PHASE.per_steradian(s2[:, None]))[:, 0]
        light = weight * p * np.exp(-0.5 * d) / np.maximum(d, 0.1) ** 2
        arrives = free & ~_crosses(at, np.broadcast_to(x, at.shape))
        got.append(((light * arrives).sum(), light.sum()))
        mu = (1.36 - (0.64 / (0.4 + 1.2 * rng.random(count))) ** 2) / 1.2
        across = np.cross(way, rng.normal(size=(count, 3)))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        way = way * mu[:, None] + across * np.sqrt(1.0 - mu * mu)[:, None]
    arrived, whole = np.sum(got, axis=0)
    return float(arrived / whole)


_PLACES = [(0.0, 0.0, 2.0), (0.2, 0.0, 3.0), (1.2, 0.0, 2.0)]
_PROFILES = [IsotropicProfile(), SpotProfile(math.radians(90.0), 0.4)]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("profile", _PROFILES)
@pytest.mark.parametrize("x", _PLACES)
def test_once_scattered_it_is_what_points_of_all_water_bring(x, profile):
    soft = soft_map(_lamp(_disc(), profile), WATER, 1)
    found = float(np.ravel(scattered_lit(soft, x))[0])
    assert found == pytest.approx(_drawn(np.array(x), profile), abs=0.07)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("profile", _PROFILES)
@pytest.mark.parametrize("x", _PLACES)
def test_more_often_scattered_it_is_what_photons_bring(x, profile):
    soft = soft_map(_lamp(_disc(), profile), WATER, 3)
    found = float(np.ravel(scattered_lit(soft, x))[0])
    assert found == pytest.approx(_walked(np.array(x), profile, 3), abs=0.1)


def test_without_objects_all_of_it_arrives():
    soft = soft_map(_lamp(np.full(len(shadow_directions()), np.inf)), WATER)
    np.testing.assert_allclose(soft.values, 1.0)


def test_behind_a_wall_there_is_little():
    u = shadow_directions()[:, 2]
    soft = soft_map(_lamp(np.where(u > 0, 1.0 / np.maximum(u, 1e-9), np.inf)), WATER)
    place = (0.0, 0.0, 3.0)
    assert float(np.ravel(scattered_lit(soft, place))[0]) < 0.1
    before = (0.0, 0.0, -1.0)
    assert float(np.ravel(scattered_lit(soft, before))[0]) > 0.85
    assert float(np.ravel(transmitted_in_shadow(soft, place))[0]) < 0.1


def _seen(camera, w, g, count=400_000, reach=20.0):
    """Fraction of the light scattered at least twice that a ray has behind the disc, by photons."""
    rng = np.random.default_rng(5)
    phase = parse_phase(f"hg:{g}").for_bands([0.4])
    at, way = np.zeros((count, 3)), rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    weight, free, arrived, whole = 1.0, np.ones(count, bool), 0.0, 0.0
    for _ in range(6):
        there = at - np.log(rng.random(count))[:, None] / 0.5 * way
        free = free & ~_crosses(at, there)
        at, weight = there, weight * 0.8
        # Places on the ray that are spread evenly in the angle that the photon sees it under.
        near = (at - camera) @ w
        h = np.maximum(np.linalg.norm(at - camera - near[:, None] * w, axis=1), 0.02)
        low, high = np.arctan2(-near, h), np.arctan2(reach - near, h)
        t = near + h * np.tan(low + (high - low) * rng.random(count))
        x = camera + t[:, None] * w
        d = np.linalg.norm(x - at, axis=1)
        u = (x - at) / d[:, None]
        first, last = (
            np.asarray(phase.per_steradian((1.0 - mu[:, None]) / 2.0))[:, 0]
            for mu in ((u * way).sum(axis=1), -(u @ w))
        )
        light = weight * first * last * np.exp(-0.5 * (d + t)) * (high - low) / h
        clear = ~_crosses(at, x) & ~_crosses(x, np.broadcast_to(camera, x.shape))
        arrived, whole = arrived + (light * free * clear).sum(), whole + light.sum()
        root = (1.0 - g * g) / (1.0 - g + 2.0 * g * rng.random(count))
        mu = (1.0 + g * g - root * root) / (2.0 * g)
        across = np.cross(way, rng.normal(size=(count, 3)))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        way = way * mu[:, None] + across * np.sqrt(1.0 - mu * mu)[:, None]
    return arrived / whole


@pytest.mark.slow_but_first
@pytest.mark.parametrize("beside", [0.7, 1.0, 1.4])
def test_there_is_a_glow_beside_a_disc_before_a_lamp(beside):
    """With hard shadows it is .16, .33 and .34 of what it is without the disc."""
    water = lamp_water([0.1], [0.4], parse_phase("hg:0.8").for_bands([0.4]))
    lamp = _lamp(_disc())
    lamp = dataclasses.replace(lamp, soft=soft_map(lamp, water))
    camera, at = np.array([0.3, 0.0, 4.0]), np.array([beside, 0.0, 1.0])
    w = (at - camera) / np.linalg.norm(at - camera)
    ray = ray_past_lamp(lamp, camera, tuple(w), 20.0)
    unhidden = dataclasses.replace(lamp, shadow=None, soft=None)
    found, without = (float(lamp_light(one, ray, water)[1][0]) for one in (lamp, unhidden))
    assert found / without == pytest.approx(_seen(camera, w, 0.8), abs=0.08)
