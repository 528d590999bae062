"""Light that clouds let through and scatter: closed cases, and photons one by one."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.cloud_light import Clouds, Several
from underwater_spectral.uw_spectral.clouds.cloud_numbers import CloudNumbers
from underwater_spectral.uw_spectral.clouds.gaussian_blob import GaussianBlob
from underwater_spectral.uw_spectral.clouds.matter import blunt_phase, suspended_matter
from underwater_spectral.uw_spectral.transfer.sun_beam import half_angle2
from underwater_spectral.validation.cloud_photons import GreyBlob, radiance

SUN = np.array([0.373, 0.0, -0.928])
SUN /= np.linalg.norm(SUN)
VIEWS = {"level": (0.0, 1.0, 0.0), "down": (0.0, 0.766, -0.643), "up": (0.0, 0.866, 0.5)}
SIGMA = 0.5


def _numbers(concentration, *, sun=0.0, spread=0.0, ambient=0.0, albedo=None, at=(0.0, 0.0, 0.0)):
    matter = suspended_matter("minerals", concentration, [550.0])
    blunt, one = blunt_phase(matter.phase), np.ones(3)
    a, b = float(matter.absorption[0]), float(matter.scattering[0])
    if albedo is not None:
        a, b = (1.0 - albedo) * (a + b), albedo * (a + b)
    wide, turned = b * (1.0 - blunt.peak), b * (1.0 - matter.phase.g)
    blob = GaussianBlob.of_axes(at, 2.0 * SIGMA * np.eye(3))
    cloud = CloudNumbers(
        blob.middle, blob.rows, (a + b) * one, (a + wide) * one, wide / (a + wide) * one,
        sun * one, spread * one, ambient * one, 0 * one, 0 * one, 0 * one, 0 * one,
        (a + turned) * one, turned / (a + turned) * one, 0.0,
        blunt.asymmetry, blunt.ceiling, blunt.peak,
    )  # fmt: skip
    return cloud, matter


def _veil(clouds, phases, w, origin, P=60.0):
    found = Clouds(Several(clouds), phases, tuple(SUN))
    origin = [np.array([float(x)]) for x in origin]
    return found.veil(origin, [np.array([x]) for x in w], np.array([P]), half_angle2(w, SUN))


def _middle_radiance(cloud, matter, view, radius=0.5):
    v = np.asarray(view)
    u = np.cross(v, [1.0, 0.2, 0.1])
    u /= np.linalg.norm(u)
    sides = u, np.cross(v, u)
    radii = radius * SIGMA * np.sqrt((np.arange(6) + 0.5) / 6)
    turns = np.arange(6) * np.pi / 3
    places = [
        -6.0 * v + r * (np.cos(t) * sides[0] + np.sin(t) * sides[1]) for r in radii for t in turns
    ]
    seen = [_veil([cloud], [matter.phase], view, place).light[0] for place in places]
    return float(np.mean(seen))


@pytest.mark.parametrize("concentration", [1.0, 20.0, 200.0])
@pytest.mark.parametrize("P", [5.6, 60.0])
def test_a_cloud_that_absorbs_nothing_is_invisible_in_even_light(concentration, P):
    cloud, matter = _numbers(concentration, ambient=4.0 * np.pi, albedo=1.0)
    veil = _veil([cloud], [matter.phase], VIEWS["level"], (0.1, -6.0, 0.2), P)
    assert veil.passed[0] * 1.0 + veil.light[0] == pytest.approx(1.0, abs=2e-3)


def test_two_halves_in_one_place_are_the_whole():
    whole, matter = _numbers(12.0, sun=1.0, ambient=1.0)
    half, _ = _numbers(6.0, sun=1.0, ambient=1.0)
    one = _veil([whole], [matter.phase], VIEWS["up"], (0.0, -6.0, -3.2))
    two = _veil([half, half], [matter.phase] * 2, VIEWS["up"], (0.0, -6.0, -3.2))
    assert two.unscattered == pytest.approx(one.unscattered)
    assert two.passed == pytest.approx(one.passed)
    # Light that is scattered twice is counted in each for itself.
    assert two.light[0] == pytest.approx(one.light[0], rel=0.12)


def test_a_cloud_before_another_dims_it():
    near, matter = _numbers(40.0, at=(0.0, -3.0, 0.0))
    far, _ = _numbers(10.0, ambient=1.0)
    alone = _veil([far], [matter.phase], VIEWS["level"], (0.0, -6.0, 0.0))
    behind = _veil([near, far], [matter.phase] * 2, VIEWS["level"], (0.0, -6.0, 0.0))
    hidden = _veil([near], [matter.phase], VIEWS["level"], (0.0, -6.0, 0.0))
    assert behind.light[0] == pytest.approx(alone.light[0] * hidden.passed[0], rel=0.01)


def test_the_sun_beneath_a_cloud_is_dimmed_by_what_does_not_go_forward():
    cloud, matter = _numbers(10.0, sun=1.0, spread=0.6, ambient=0.4)
    below, beside = 3.0 * SUN, 3.0 * SUN + np.array([0.0, 4.0, 0.0])
    clouds = Clouds(Several([cloud]), [matter.phase], tuple(SUN))
    wide = float(matter.absorption[0] + matter.scattering[0] * (1.0 - matter.phase.g))
    wanted = np.exp(-wide * SIGMA * np.sqrt(2.0 * np.pi))
    assert float(clouds.sunlight_transmittance(list(below))[0]) == pytest.approx(wanted, rel=1e-3)
    assert float(clouds.sunlight_transmittance(list(beside))[0]) == pytest.approx(1.0, abs=1e-3)
    sky = float(clouds.skylight_transmittance(list(below))[0])
    assert sky == pytest.approx(0.4 + 0.6 * wanted, rel=1e-3)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("concentration", "bound"), [(2.0, 0.05), (8.0, 0.09)])
def test_light_of_a_beam_is_that_of_photons(concentration, bound):
    cloud, matter = _numbers(concentration, sun=1.0)
    grey = GreyBlob(SIGMA, float(matter.absorption[0]), float(matter.scattering[0]), matter.phase)
    photons = radiance(grey, SUN, VIEWS)
    found = {name: _middle_radiance(cloud, matter, view) for name, view in VIEWS.items()}
    assert found == pytest.approx(photons, rel=bound)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("concentration", "bound"), [(2.0, 0.04), (8.0, 0.04), (30.0, 0.06)])
def test_light_of_all_sides_is_that_of_photons(concentration, bound):
    cloud, matter = _numbers(concentration, ambient=1.0)
    grey = GreyBlob(SIGMA, float(matter.absorption[0]), float(matter.scattering[0]), matter.phase)
    photons = np.mean(list(radiance(grey, SUN, VIEWS, isotropic=True).values()))
    found = np.mean([_middle_radiance(cloud, matter, view) for view in VIEWS.values()])
    assert found == pytest.approx(photons, rel=bound)
