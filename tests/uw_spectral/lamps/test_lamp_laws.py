"""Laws that the light of lamps keeps: it adds up, and comes from where it can."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps import virtual_point_lights
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from underwater_spectral.uw_spectral.lamps.multiple_scattering import (
    LampWater,
    lamp_light,
    lamp_water,
)
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase, seawater_mixture

CAMERA = (0.0, 0.0, 0.0)
SPOT = SpotProfile(math.radians(60.0), 0.3)
PLACES = [(x, y, z) for x in (-1.0, 1.5) for y in (1.0, 3.0) for z in (-0.9, 0.4)]


def _lit(lamp: Lamp) -> virtual_point_lights.LitSurfaces:
    """Look from a lamp: a floor 1.2 m below the camera, and a dark wall 5 m before it."""
    rays = virtual_point_lights.rays_of(lamp)
    u, (_, y, z) = rays.directions, lamp.position
    floor = np.where(u[:, 2] < 0, (z + 1.2) / np.maximum(-u[:, 2], 1e-9), np.inf)
    wall = np.where(u[:, 1] > 0, (5.0 - y) / np.maximum(u[:, 1], 1e-9), np.inf)
    is_floor = (floor < wall)[:, None]
    normals = np.where(is_floor, (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    reflectance = np.where(is_floor, (0.6, 0.5, 0.3), (0.1, 0.2, 0.2))
    return virtual_point_lights.LitSurfaces(rays, np.minimum(floor, wall), normals, reflectance)


def _light(lamps: list[Lamp], water: LampWater) -> np.ndarray:
    """Light that objects throw on level patches and into rays."""
    virtual = virtual_point_lights.virtual_point_lights(
        lamps, [_lit(lamp) for lamp in lamps], water, CAMERA
    )
    found = []
    for place in PLACES:
        patches = [patch_past_lamp(lamp, place, (0.0, 0.0, -1.0)) for lamp in virtual]
        pairs = zip(virtual, patches, strict=True)
        found.append(sum(sum(surface_irradiance(*pair, water)) for pair in pairs))
        way = np.array(place) / np.linalg.norm(place)
        rays = [ray_past_lamp(lamp, CAMERA, way, np.full(1, 9.0)) for lamp in virtual]
        found.append(sum(sum(lamp_light(*pair, water)) for pair in zip(virtual, rays, strict=True)))
    return np.array(found)


def _alone(lamps: list[Lamp], index: int) -> list[Lamp]:
    """Return the lamps with all but one switched off."""
    dark = [dataclasses.replace(lamp, intensity=0.0 * lamp.intensity) for lamp in lamps]
    return [*dark[:index], lamps[index], *dark[index + 1 :]]


def _add_up(lamps: list[Lamp], water: LampWater) -> None:
    parts = sum(_light(_alone(lamps, index), water) for index in range(len(lamps)))
    np.testing.assert_allclose(parts, _light(lamps, water), rtol=1e-9)


@pytest.fixture
def water() -> LampWater:
    return lamp_water([0.06, 0.1, 0.4], [0.3, 0.25, 0.2], seawater_mixture([1.0] * 3, [0.02] * 3))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("count", [2, 3, 5])
def test_what_lamps_light_adds_up(count, water, monkeypatch):
    """Of lamps of other colours, powers and beams."""
    spectra = np.array([(1.0, 0.9, 0.8), (0.2, 0.1, 0.0), (3.0, 0.0, 1.0), (0.5,) * 3, (9.0,) * 3])
    lamps = [
        Lamp((0.7 * k - 1.0, 0.3 * k, 0.4 - 0.2 * k), axis, spectra[k], profile)
        for k, (axis, profile) in enumerate(
            [
                ((0.0, 0.0, -1.0), SPOT),
                ((0.0, 0.8, -0.6), SPOT),
                ((0.0, 1.0, 0.0), IsotropicProfile()),
                ((0.6, 0.8, 0.0), SPOT),
                ((0.0, 0.6, -0.8), IsotropicProfile()),
            ]
        )
    ][:count]
    _add_up(lamps, water)
    right = virtual_point_lights.virtual_point_lights

    def wrong(lamps, *others):
        """Plant an error of a tenth where the first lamp is not alone."""
        more = 1.1 if sum(bool(lamp.intensity.any()) for lamp in lamps) > 1 else 1.0
        made = right(lamps, *others)
        return [dataclasses.replace(one, intensity=more * one.intensity) for one in made]

    monkeypatch.setattr(virtual_point_lights, "virtual_point_lights", wrong)
    with pytest.raises(AssertionError):
        _add_up(lamps, water)


WATERS = {
    "clear": ([0.024, 0.062, 0.334], [0.068, 0.054, 0.045]),
    "clear, to 700 nm": ([0.02, 0.06, 0.65], [0.06, 0.05, 0.04]),
    "of little scattering": ([0.018, 0.062, 0.334], [0.004, 0.002, 0.001]),
    "turbid": ([0.15, 0.08, 0.35], [1.5, 1.1, 0.8]),
}
BEAMS = [((0.0, 1.0, 0.0), IsotropicProfile()), ((0.0, 1.0, 0.0), SPOT), ((0.0, -1.0, 0.0), SPOT)]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", WATERS)
def test_far_water_adds_no_light(name):
    """What lies far beyond lamp and camera, where tables end and go on: it was up to 1e15 too much.

    Against bands' own absorption, and against that of the clearest, with which the three bands
    that stand for all are weighed.
    """
    a, b = WATERS[name]
    water = lamp_water(a, b, parse_phase("hg:0.9").for_bands(b))
    far = 1.5 / min(x + 0.1 * y for x, y in zip(a, b, strict=True))
    least = dataclasses.replace(water, a=np.full(3, min(a)))
    for axis, profile in BEAMS:
        lamp = Lamp((0.5, 3.0, 0.3), axis, np.ones(3), profile)
        for in_water in (water, least):
            near, all_of_it = (
                sum(lamp_light(lamp, ray_past_lamp(lamp, CAMERA, (0.0, 1.0, 0.0), P), in_water))
                for P in (np.full(1, far), np.full(1, 1e6))
            )
            _alike(all_of_it, near)
            with pytest.raises(AssertionError):
                _alike(1.1 * all_of_it, near)


def _alike(one: np.ndarray, other: np.ndarray) -> None:
    np.testing.assert_allclose(one, other, rtol=0.04)
