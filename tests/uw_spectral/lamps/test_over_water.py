"""Lamps over the water against rays that are traced through the surface."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_projection import project_lamps
from underwater_spectral.uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.over_water import through_surface
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands
from underwater_spectral.uw_spectral.transfer.rough_surface import WaterSurface
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture

N = 1.34
SPOT = SpotProfile(math.radians(60.0), 0.4)
PHASE = seawater_mixture([1.0], [0.02])
CELL = 0.06  # of the way down


def _tilted(degrees):
    return math.sin(math.radians(degrees)), 0.0, -math.cos(math.radians(degrees))


def _on_axis(tilt, height, depth):
    inside = math.asin(math.sin(math.radians(tilt)) / N)
    return height * math.tan(math.radians(tilt)) + depth * math.tan(inside)


def _rays(axis, slopes, count):
    """Rays of a spot in the air, those that they become in the water, and their power."""
    rng = np.random.default_rng(1)
    cosine = SPOT.edge + (1.0 - SPOT.edge) * rng.random(count)
    turn, sine = 2.0 * math.pi * rng.random(count), np.sqrt(1.0 - cosine**2)
    side = np.cross(axis, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    v = cosine[:, None] * np.array(axis) + (sine * np.cos(turn))[:, None] * side
    v += (sine * np.sin(turn))[:, None] * np.cross(axis, side)
    power = SPOT.value(cosine) * 2.0 * math.pi * (1.0 - SPOT.edge) / count
    level = np.zeros((count, 2))
    if slopes:
        level = rng.normal(0.0, math.sqrt(slopes / 2.0), (count, 2))
    up = np.concatenate([level, np.ones((count, 1))], axis=1)
    power = power * np.maximum(-(v * up).sum(axis=1), 0.0) / np.maximum(-v[:, 2], 1e-9)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    outside = np.maximum(-(v * up).sum(axis=1), 1e-9)
    inside = np.sqrt(1.0 - (1.0 - outside**2) / N**2)
    across = (outside - N * inside) / (outside + N * inside)
    along = (N * outside - inside) / (N * outside + inside)
    power = power * (1.0 - (across**2 + along**2) / 2.0)
    falls = v[:, 2] < -1e-6
    return v[falls], (v / N + (outside / N - inside)[:, None] * up)[falls], power[falls]


def _traced(axis, height, depth, places, slopes=0.0, count=1_500_000):
    """Irradiance on level squares of a spot's rays, each refracted by itself, and its error."""
    v, w, power = _rays(axis, slopes, count)
    at = v[:, :2] * (height / -v[:, 2:]) + w[:, :2] * (depth / -w[:, 2:])
    cell, found = CELL * (height + depth), []
    for place in places:
        hit = np.all(np.abs(at - place) < cell / 2.0, axis=1)
        found.append((power[hit].sum() / cell**2, 1.0 / math.sqrt(hit.sum())))
    return np.array(found).T


def _modelled(axis, height, depth, places, slopes=0.0):
    lamp = through_surface(
        Lamp((0.0, 0.0, height), axis, np.ones(1), SPOT, 1e-3), WaterSurface(N, slopes)
    )
    cell = CELL * (height + depth) * (np.arange(9.0) / 8.0 - 0.5) * 8.0 / 9.0
    x, y = (part.reshape(-1, 1) for part in np.meshgrid(cell, cell))
    found = []
    for place in places:
        at = place[0] + x, place[1] + y, np.full_like(x, -depth)
        patch = patch_past_lamp(lamp, at, (0.0, 0.0, 1.0))
        found.append(float((patch.per_intensity * patch.cosine * lamp.intensity).mean()))
    return np.array(found)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("tilt", "slopes", "beside", "near"),
    [
        (0.0, 0.0, 0.15, 0.03),
        (0.0, 0.02, 0.15, 0.04),
        (20.0, 0.0, 0.1, 0.06),
        (40.0, 0.0, 0.1, 0.1),
    ],
)
@pytest.mark.parametrize(("height", "depth"), [(0.3, 3.0), (2.0, 1.0), (2.0, 3.0), (2.0, 8.0)])
def test_irradiance_below_a_spot_is_that_of_its_rays(tilt, slopes, beside, near, height, depth):
    axis, middle = _tilted(tilt), _on_axis(tilt, height, depth)
    off = beside * (height + depth)
    places = [(middle, 0.0), (middle + off, 0.0), (middle - off, 0.0), (middle, off)]
    traced, noise = _traced(axis, height, depth, places, slopes)
    found = _modelled(axis, height, depth, places, slopes) / traced - 1.0
    assert np.all(np.abs(found) < near + 2.0 * noise)
    assert abs(found[0]) < 0.02 + 2.0 * noise[0]


@pytest.mark.parametrize(
    ("tilt", "slopes"), [(0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (0.0, 0.03), (30.0, 0.03)]
)
def test_no_light_is_lost_but_what_the_surface_reflects(tilt, slopes):
    lamp = Lamp((0.0, 0.0, 1e-6), _tilted(tilt), np.ones(1), SPOT)
    seen = through_surface(lamp, WaterSurface(N, slopes))
    power = float(seen.intensity[0]) * seen.profile.solid_angle
    _, _, arriving = _rays(_tilted(tilt), slopes, 300_000)
    assert power == pytest.approx(float(arriving.sum()), rel=5e-3)
    assert power < 0.98 * SPOT.solid_angle
    # Just below the surface the lamp is as it is.
    under = Lamp((0.0, 0.0, -1e-6), _tilted(tilt), np.ones(1), SPOT)
    assert through_surface(under, WaterSurface(N, slopes)) is under


def test_without_a_surface_it_is_the_lamp():
    lamp = Lamp((1.0, 2.0, 3.0), _tilted(30.0), np.ones(1), SPOT)
    seen = through_surface(lamp, WaterSurface(1.0))
    assert seen.position == pytest.approx(lamp.position)
    assert seen.axis == pytest.approx(lamp.axis)
    at = np.cos(np.radians([0.0, 10.0, 20.0, 25.0]))
    assert seen.profile.value(at) * seen.intensity == pytest.approx(SPOT.value(at), abs=0.01)


@pytest.mark.parametrize("slopes", [0.005, 0.02])
def test_waves_widen_a_narrow_beam_by_their_slopes(slopes):
    """A slope s turns a ray by s (1 - 1/n), seen from the apparent place by the fraction of the way
    that is in the water.
    """
    narrow, depth = SpotProfile(math.radians(6.0), 0.3), 3.0
    lamp = Lamp((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), np.ones(1), narrow)
    still, wavy = (
        _mean_square(through_surface(lamp, WaterSurface(N, x)).profile) for x in (0.0, slopes)
    )
    wanted = slopes * ((1.0 - 1.0 / N) * depth / (depth + N)) ** 2
    assert wavy - still == pytest.approx(wanted, rel=0.1)


def _mean_square(profile):
    theta = np.linspace(0.0, 0.6, 4001)
    values = profile.value(np.cos(theta)) * np.sin(theta)
    return float((values * theta**2).sum() / values.sum())


def test_only_what_is_in_the_water_takes_light_away():
    """As of the same lamp in the water, as far as the way in it is the same."""
    water = lamp_water([0.3], [0.4], PHASE)
    lamp = Lamp((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), np.ones(1), IsotropicProfile(), dry=2.0)
    without = lamp_water([1e-9], [0.0], PHASE)
    patch = patch_past_lamp(lamp, (0.5, 0.0, -3.0), (0.0, 0.0, 1.0))
    wet = math.hypot(0.5, 5.0) * 3.0 / 5.0
    assert float(patch.wet) == pytest.approx(wet)
    direct, _, _ = surface_irradiance(lamp, patch, water)
    bare, _, _ = surface_irradiance(lamp, patch, without)
    assert float(direct[0] / bare[0]) == pytest.approx(math.exp(-0.7 * wet))
    dry = patch_past_lamp(lamp, (0.5, 0.0, 0.1), (0.0, 0.0, 1.0))
    assert float(dry.per_intensity) == 0.0


def test_light_in_the_water_has_gone_the_wet_way():
    """Along a level ray far below: as of that lamp under water, the dry way's losses apart."""
    lamp = Lamp((0.0, 0.0, 20.0), (0.0, 0.0, -1.0), np.ones(1), dry=20.0)
    under = dataclasses.replace(lamp, dry=0.0)
    ray, water = ((-0.5, 0.0, -1.0), (1.0, 0.0, 0.0), 1.0), lamp_water([0.1], [1e-6], PHASE)
    single, _ = lamp_light(lamp, ray_past_lamp(lamp, *ray), water)
    drowned, _ = lamp_light(under, ray_past_lamp(under, *ray), water)
    assert float(single[0] / drowned[0]) == pytest.approx(math.exp(0.1 * 20.0), rel=1e-3)


@pytest.mark.parametrize("depth", [0.5, 4.0])
def test_projected_light_of_a_lamp_over_the_water_is_that_of_the_bands(depth):
    water = lamp_water([0.1] * 3, [0.2, 0.25, 0.3], seawater_mixture([1.0] * 3, [0.02] * 3))
    lamp = through_surface(
        Lamp((0.0, 0.0, 2.0), _tilted(20.0), np.array([1.0, 2.0, 3.0]), SPOT), WaterSurface(N)
    )
    projected = project_lamps([lamp], water, channels_of_bands(Bands.uniform(3), [0, 1, 2]))
    ray = (0.3, -2.0, -depth), (0.0, 1.0, 0.0), 30.0
    found = projected.path_light(*ray)
    assert found == pytest.approx(sum(lamp_light(lamp, ray_past_lamp(lamp, *ray), water)), rel=0.01)
