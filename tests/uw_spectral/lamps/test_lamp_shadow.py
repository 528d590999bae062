"""What objects keep the light of a lamp from."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_shadow import (
    SIDE,
    lit,
    shadow_directions,
    shadow_map,
)
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture

WATER = lamp_water([0.05], [0.3], seawater_mixture([1.0], [0.02]))


def _wall(distance):
    """A wall across z."""
    z = shadow_directions()[:, 2]
    return shadow_map(np.where(z > 1e-9, distance / np.maximum(z, 1e-9), np.inf))


def _places(count=4000, seed=1):
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(count, 3))
    return u / np.linalg.norm(u, axis=1, keepdims=True)


def test_the_directions_are_where_the_map_is_looked_up():
    """An object in the direction of one entry alone is an object there, and not in the others."""
    u = shadow_directions()
    assert np.linalg.norm(u, axis=1) == pytest.approx(1.0)
    distances = np.random.default_rng(2).uniform(1.0, 9.0, SIDE * SIDE)
    # Entries on the edge of the square are the same direction twice.
    _, first, which = np.unique(u.round(9), axis=0, return_index=True, return_inverse=True)
    distances = distances[first][which.ravel()]
    shadow = shadow_map(distances)
    for factor, wanted in ((0.99, 1.0), (1.11, 0.0)):
        places = tuple((factor * distances[:, None] * u).T[..., None])
        assert lit(shadow, places)[:, 0] == pytest.approx(np.full(len(u), wanted), abs=1e-6)


def test_a_wall_is_where_it_is():
    u = _places()
    shadow = _wall(2.0)
    r = np.random.default_rng(3).uniform(0.1, 30.0, len(u))
    z = r * u[:, 2]
    found = lit(shadow, tuple((r[:, None] * u).T[..., None]))[:, 0]
    assert np.mean(found[z < 1.97] == 1.0) > 0.998
    assert np.mean(found[z > 2.25] == 0.0) > 0.998


def test_the_shadow_of_a_ball_is_as_wide_as_the_ball():
    """Its edge is within an entry, 2.4° to 4.2°, and it covers what the ball does."""
    half = math.radians(25.0)
    u = shadow_directions()
    for axis in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.6, 0.64, 0.48), (-1.0, 0.0, 0.0)):
        cosine = u @ np.array(axis)
        shadow = shadow_map(np.where(cosine > math.cos(half), 2.0, np.inf))
        v = _places(20000)
        found = lit(shadow, tuple(50.0 * v.T[..., None]))[:, 0]
        angle = np.degrees(np.arccos(np.clip(v @ np.array(axis), -1.0, 1.0)))
        assert not found[angle < 25.0 - 4.2].any()
        assert found[angle > 25.0 + 4.2].all()
        covered = math.degrees(math.acos(1.0 - 2.0 * float(1.0 - found.mean())))
        assert covered == pytest.approx(25.0, abs=1.2)


def test_light_along_a_ray_ends_where_the_shadow_begins():
    """A ray through a wall's shadow has the light of its part before it: 1 % of a cut path."""
    lamp = Lamp((1.0, 0.0, 2.0), (0.0, 0.0, 1.0), np.ones(1))
    dark = dataclasses.replace(lamp, shadow=_wall(3.0))
    whole, cut = (ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), P) for P in (50.0, 5.1))
    single, more = lamp_light(dark, whole, WATER)
    wanted, most = lamp_light(lamp, cut, WATER)
    assert single == pytest.approx(wanted, rel=0.02)
    assert 0.8 * most < more < 1.2 * most
    clear = dataclasses.replace(lamp, shadow=shadow_map(np.full(SIDE * SIDE, np.inf)))
    for found, alone in zip(
        lamp_light(clear, whole, WATER), lamp_light(lamp, whole, WATER), strict=True
    ):
        assert found == pytest.approx(alone, rel=1e-12)


def test_a_lamp_in_a_box_lights_nothing_outside():
    box = dataclasses.replace(
        Lamp((0.5, 0.0, 3.0), (0.0, 0.0, -1.0), np.ones(1)),
        shadow=shadow_map(np.full(SIDE * SIDE, 0.1)),
    )
    ray = ray_past_lamp(box, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0)
    assert not np.any(lamp_light(box, ray, WATER))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_nearest_and_farthest_places(dtype):
    shadow = _wall(1e-9)
    for place in ((0.0, 0.0, 0.0), (0.0, 0.0, 1e-6), (1e6, 0.0, 0.0), (0.0, -1e6, -1e6)):
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            found = lit(shadow, tuple(np.full(1, x, dtype) for x in place))
        assert 0.0 <= float(found[0]) <= 1.0
