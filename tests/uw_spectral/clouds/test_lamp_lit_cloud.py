"""Light of lamps in clouds: photons one by one, sums along rays, objects in the same place."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds import lamp_lit_cloud
from underwater_spectral.uw_spectral.clouds.cloud_light import Clouds, Several
from underwater_spectral.uw_spectral.clouds.cloud_numbers import with_escapes
from underwater_spectral.uw_spectral.clouds.density_grid import DensityGrid
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, LitPart, LitParts
from underwater_spectral.uw_spectral.lamps.lamp_projection import project_lamps
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile
from underwater_spectral.uw_spectral.mathematics import NUMPY
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.cloud_photons import GreyBlob, radiance

from .test_cloud_light import SIGMA, SUN, VIEWS, _numbers

TORCH = (0.4, -3.0, 0.2)
CHANNELS = channels_of_bands(Bands.uniform(3), [0, 1, 2])
SIDES = VIEWS | {"side": (1.0, 0.0, 0.0), "against": (0.0, -1.0, 0.0)}


def _water(a=(0.05, 0.07, 0.3), b=(0.2, 0.18, 0.15)):
    phase = parse_phase("fournier-forand:1.10,0.0183").for_bands(list(b))
    return lamp_water(list(a), list(b), phase)


def _torch(profile=None):
    towards = -np.array(TORCH) / np.linalg.norm(TORCH)
    return Lamp(TORCH, tuple(towards), np.ones(3), profile or IsotropicProfile(), 0.02)


def _clouds(*found):
    numbers, phases = [with_escapes(one) for one, _ in found], [matter.phase for _, matter in found]
    return Clouds(Several(numbers), phases, tuple(SUN))


def _disc(view, radius=0.5):
    """Origins of parallel rays about the middle, and their direction."""
    v = np.asarray(view)
    u = np.cross(v, [1.0, 0.2, 0.1])
    u /= np.linalg.norm(u)
    radii = radius * SIGMA * np.sqrt((np.arange(6) + 0.5) / 6)
    places = [
        -60.0 * v + r * (np.cos(t) * u + np.sin(t) * np.cross(v, u))
        for r in radii
        for t in np.arange(6) * np.pi / 3
    ]
    return list(np.array(places).T[..., None]), [np.full((36, 1), x) for x in v]


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("concentration", "bound"), [(2.0, 0.05), (8.0, 0.09)])
def test_light_of_a_lamp_is_that_of_photons(concentration, bound):
    cloud, matter = _numbers(concentration)
    empty = lamp_water([0.0] * 3, [1e-9] * 3, parse_phase("isotropic").for_bands([1e-9] * 3))
    projected = project_lamps([_torch()], empty, CHANNELS, clouds=SIGMA)
    grey = GreyBlob(SIGMA, float(matter.absorption[0]), float(matter.scattering[0]), matter.phase)
    photons = radiance(grey, SUN, SIDES, lamp=TORCH, count=200_000)
    found = {}
    for name, view in SIDES.items():
        light = lamp_lit_cloud.path_light(
            projected, _clouds((cloud, matter)), *_disc(view), np.full((36, 1), 200.0)
        )
        found[name] = float(light[:, 0].mean())
    assert found == pytest.approx(photons, rel=bound)


@pytest.mark.slow
@pytest.mark.parametrize("profile", [IsotropicProfile(), SpotProfile(math.radians(50.0), 0.5)])
def test_a_black_cloud_takes_light_of_the_water_along_both_ways(profile):
    cloud, matter = _numbers(12.0, albedo=0.0, at=(0.0, 0.0, 0.0))
    projected = project_lamps([_torch(profile)], _water(), CHANNELS, clouds=SIGMA)
    origin, w = (0.0, -3.0, 0.0), (0.0, 1.0, 0.0)
    found = lamp_lit_cloud.path_light(projected, _clouds((cloud, matter)), origin, w, 8.0)
    # The light of the water up to each distance, of which each piece is dimmed for itself.
    ends = np.linspace(1e-3, 8.0, 400)[:, None]
    pieces = np.diff(projected.path_light(origin, w, ends), axis=0)
    s = 0.5 * (ends[1:] + ends[:-1])
    start = [np.full_like(s, x) for x in origin]
    seen = cloud.blob.along(start, w).column(s)
    places = [x + along * s for x, along in zip(origin, w, strict=True)]
    way = [x - x0 for x, x0 in zip(places, TORCH, strict=True)]
    r = np.sqrt(sum(x * x for x in way))
    lit = cloud.blob.along(TORCH, [x / r for x in way]).column(r)
    transmittance = np.exp(-cloud.scaled * seen - cloud.transport * lit)
    assert found == pytest.approx((pieces * transmittance).sum(axis=0), rel=0.03)
    # Most of it comes from before the cloud: all of that is untouched.
    near, middle = (projected.path_light(origin, w, P) for P in (1.4, 3.0))
    assert np.all(found > near)
    assert np.all(found < middle)


def test_what_floats_is_lit_as_a_white_object_in_its_place():
    torch = _torch(SpotProfile(math.radians(50.0), 0.5))
    projected = project_lamps([torch], _water(), CHANNELS, clouds=SIGMA)
    ((_, light),) = projected.lights()
    for r, s in ((1.0, 1.5), (3.0, 2.5), (5.0, 4.0)):
        place = np.array(torch.position) + r * np.array(torch.axis)
        normal = [-x for x in torch.axis]
        D, F = projected.reflected(list(place), normal, (1.0, 1.0, 1.0), s)
        found = light.floating_at(r, s) / (r * r + torch.radius**2)
        assert found == pytest.approx(math.pi * (D + F), rel=0.04)


def test_a_cloud_aside_changes_nothing():
    projected = project_lamps([_torch()], _water(), CHANNELS, clouds=SIGMA)
    ray = (0.0, -3.0, 0.0), (0.0, 1.0, 0.0), 8.0
    aside = lamp_lit_cloud.path_light(projected, _clouds(_numbers(30.0, at=(90.0, 0.0, 0.0))), *ray)
    assert aside == pytest.approx(projected.path_light(*ray), rel=1e-6)


def test_two_halves_in_one_place_are_the_whole_by_lamp():
    projected = project_lamps([_torch()], _water(), CHANNELS, clouds=SIGMA)
    ray = (0.1, -3.0, 0.0), (0.0, 1.0, 0.0), 8.0
    whole = lamp_lit_cloud.path_light(projected, _clouds(_numbers(2.0)), *ray)
    halves = lamp_lit_cloud.path_light(projected, _clouds(_numbers(1.0), _numbers(1.0)), *ray)
    # Light that is scattered twice is counted in each for itself.
    assert halves == pytest.approx(whole, rel=0.06)


def test_a_lamp_within_a_cloud_is_added_up_in_few_steps(monkeypatch):
    torch = Lamp((0.2, 0.1, 0.0), (0.0, 1.0, 0.0), np.ones(3), IsotropicProfile(), 0.02)
    projected = project_lamps([torch], _water(), CHANNELS, clouds=SIGMA)
    ray = (0.0, -2.0, 0.0), (0.0, 1.0, 0.0), 8.0
    few = lamp_lit_cloud.path_light(projected, _clouds(_numbers(6.0)), *ray)
    monkeypatch.setattr(lamp_lit_cloud, "STEPS", 200)
    many = lamp_lit_cloud.path_light(projected, _clouds(_numbers(6.0)), *ray)
    assert few == pytest.approx(many, rel=0.05)


def test_what_lies_behind_a_cloud_is_lit_through_it():
    cloud, matter = _numbers(10.0)
    torch, behind = _torch(), (-0.4, 3.0, -0.2)
    transmittance = lamp_lit_cloud.transmittance_to_surface(_clouds((cloud, matter)), torch, behind)
    wide = float(matter.absorption[0] + matter.scattering[0] * (1.0 - matter.phase.g))
    assert transmittance == pytest.approx(
        np.exp(-wide * SIGMA * math.sqrt(2.0 * math.pi)), rel=1e-3
    )
    aside = lamp_lit_cloud.transmittance_to_surface(
        _clouds((cloud, matter)), torch, (-6.0, -3.0, 0.0)
    )
    assert aside == pytest.approx(1.0, abs=1e-3)


def _gridded(found, torch, count=48):
    """Clouds of a blob whose density is at nodes."""
    cloud, matter = found
    axes = np.eye(3) * (3.6 / (count - 1))
    corner = np.asarray(cloud.middle, dtype=float) - 1.8
    empty = DensityGrid(np.zeros((count,) * 3), corner, axes)
    density = np.asarray(cloud.blob.density(list(np.moveaxis(empty.places(), -1, 0))))
    grid = replace(empty, density=density).lit(SUN, float(cloud.transport.mean()), [torch.position])
    return Clouds(Several([replace(cloud, grid=grid)]), [matter.phase], tuple(SUN))


@pytest.mark.slow
@pytest.mark.parametrize(("concentration", "bound"), [(2.0, 0.05), (8.0, 0.09)])
def test_light_of_a_lamp_in_a_grid_is_that_of_photons(concentration, bound):
    cloud, matter = _numbers(concentration)
    empty = lamp_water([0.0] * 3, [1e-9] * 3, parse_phase("isotropic").for_bands([1e-9] * 3))
    projected = project_lamps([_torch()], empty, CHANNELS, clouds=SIGMA)
    grey = GreyBlob(SIGMA, float(matter.absorption[0]), float(matter.scattering[0]), matter.phase)
    photons = radiance(grey, SUN, SIDES, lamp=TORCH, count=200_000)
    found = {}
    for name, view in SIDES.items():
        light = lamp_lit_cloud.path_light(
            projected, _gridded((cloud, matter), _torch()), *_disc(view), np.full((36, 1), 200.0)
        )
        found[name] = float(light[:, 0].mean())
    assert found == pytest.approx(photons, rel=bound)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("place", [(0.2, 0.1, 0.0), (0.0, -2.2, 0.3)], ids=["in it", "outside"])
def test_a_lamp_shines_in_a_grid_as_in_its_blob(place):
    torch = Lamp(place, (0.0, 1.0, 0.0), np.ones(3), IsotropicProfile(), 0.02)
    projected = project_lamps([torch], _water(), CHANNELS, clouds=SIGMA)
    for side in (0.0, 0.3, -0.5):
        ray = [np.array([x]) for x in (side, -3.0, 0.1)], (0.0, 1.0, 0.0), np.array([8.0])
        one = lamp_lit_cloud.path_light(projected, _clouds(_numbers(6.0)), *ray)
        other = lamp_lit_cloud.path_light(projected, _gridded(_numbers(6.0), torch), *ray)
        assert other == pytest.approx(one, rel=0.05)


@pytest.mark.slow
def test_columns_to_a_lamp_are_those_of_the_blob():
    found = _numbers(6.0)
    for place in ((0.2, 0.1, 0.0), TORCH):
        torch = Lamp(place, (0.0, 1.0, 0.0), np.ones(3))
        ((cloud, gridded),) = [(found[0], _gridded(found, torch).group.clouds[0])]
        ends = np.random.default_rng(5).uniform(-3.0, 3.0, (400, 3))
        way = list((ends - place).T[..., None])
        one = cloud.from_lamp(0, place, way, NUMPY)
        other = gridded.from_lamp(0, place, way, NUMPY)
        assert other == pytest.approx(one, abs=0.03)
        assert np.max(one) > 0.6


def test_what_stands_for_objects_lights_clouds_by_its_outline_alone():
    part = LitPart((0.0, -3.0, 0.0), (0.0, 1.0, 0.0), np.ones(3), 0.1)
    lamps = [replace(_torch(), virtual=1.0, parts=parts) for parts in (None, LitParts((part,)))]
    plain, virtual = project_lamps(lamps, _water(), CHANNELS, clouds=SIGMA).projected
    assert plain.floating.max() > 0
    np.testing.assert_array_equal(virtual.floating, plain.floating)
