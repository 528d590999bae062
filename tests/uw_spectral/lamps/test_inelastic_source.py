"""Light of changed wavelength round lamps: laws, an integral of closed form, and photons."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.lamps.emission import parse_emission
from underwater_spectral.uw_spectral.lamps.excited_power import excited_power
from underwater_spectral.uw_spectral.lamps.inelastic_source import (
    LampExcitation,
    inelastic_light,
)
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_harmonics import Harmonics
from underwater_spectral.uw_spectral.lamps.lamp_path import gauss_sum
from underwater_spectral.uw_spectral.lamps.lamp_projection import project_lamps
from underwater_spectral.uw_spectral.lamps.multiple_scattering import (
    BandLight,
    lamp_water,
    light_along,
)
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import band_mean
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.transfer.channels import channels_of
from underwater_spectral.uw_spectral.water.inelastic_processes import EXCITATION
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import HenyeyGreenstein, Isotropic
from underwater_spectral.validation.lamp_inelastic_photons import Photons

SPOT = SpotProfile(math.radians(80.0), 0.5)
AHEAD = (0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)


def _excited(a, b, phase, even=0.02, raman=0.0, degrees=32):
    """One band excites another of the same water."""
    water = Harmonics(np.array([a]), np.array([b]), phase, degrees)
    return LampExcitation(water, np.array([even, raman]).reshape(2, 1, 1))


def _phase(g):
    return BandPhase((HenyeyGreenstein(g) if g else Isotropic(),), np.ones((1, 1)))


@pytest.mark.parametrize("profile", [IsotropicProfile(), SPOT])
def test_all_light_of_the_lamp_is_absorbed_or_emitted_again(profile):
    """Of a power of 4π/a' e of it is emitted; each time that it is scattered it is there again."""
    a, b, e = 0.3, 0.9, 0.02
    excited = _excited(0.5, 0.8, _phase(0.8), e)
    seen = Harmonics(np.array([a]), np.array([b]), _phase(0.8))
    made = inelastic_light(excited, profile, seen, seen.scale)
    x, weight = np.polynomial.legendre.leggauss(48)
    r, dr = (x + 1.0) * 20.0, weight * 20.0
    # Over all bends and azimuths; there are as many on either side.
    azimuth, dz = np.polynomial.legendre.leggauss(12)
    grid = np.meshgrid(r, x, x, np.cos((azimuth + 1.0) * math.pi / 2.0), indexing="ij")
    names = "distance", "turned", "bent", "azimuth"
    at = {name: one[..., None] for name, one in zip(names, grid, strict=True)}
    S = np.exp(made.source.at(**at))[..., 0] * grid[0] * np.exp(-made.decay * grid[0])
    whole = np.einsum("rtbz,r,t,b,z->", S, dr, weight, weight, dz * math.pi) * 2.0 * math.pi
    onward = made.onward.at(length=r[:, None], half=1.0)[:, 0] - made.decay * r
    straight = 4.0 * math.pi * np.exp(onward) @ dr * float(profile.solid_angle)
    power = float(profile.solid_angle) / 0.5 * e
    again = float(seen.scattering[0, 0]) / a
    assert whole + straight == pytest.approx(power * (1.0 + again), rel=0.05)


def _light(excited, profile, water, scale=None):
    """Light of changed wavelength in the bands of a water."""
    seen = water.field.harmonics
    return BandLight(1.0, water, inelastic_light(excited, profile, seen, scale or seen.scale))


def test_without_scattering_it_is_the_integral_along_the_ray():
    excited = _excited(0.4, 0.0, _phase(0.0), 0.01, 0.02)
    water = lamp_water([0.2], [0.0], _phase(0.0))
    lamp = Lamp((0.3, 0.0, 1.5), (0.0, 0.6, 0.8), np.ones(1), SPOT, 1e-3)
    ray = ray_past_lamp(lamp, ORIGIN, AHEAD, 6.0)
    light = _light(excited, SPOT, water)
    found = float(light_along(lamp, ray, light)[1][0])
    t = np.linspace(0.0, 6.0, 200_001)
    place = np.stack([np.full_like(t, -0.3), 0.0 * t, t - 1.5], axis=-1)
    r = np.linalg.norm(place, axis=1)
    shining = SPOT.value(place @ np.array(lamp.axis) / r) / (r * r) * np.exp(-0.4 * r - 0.2 * t)
    raman = (1.0 + 0.53 * (place[:, 2] / r) ** 2) / (1.0 + 0.53 / 3.0)
    wanted = np.trapezoid(shining * (0.01 + 0.02 * raman), t) / (4.0 * math.pi)
    assert found == pytest.approx(wanted, rel=0.01)


def _plan(water, kind, nm):
    bands = 30 if nm is None else 3
    more = {} if nm is None else {"wavelengths": f"{nm - 20},{nm},{nm + 10}"}
    return make_plan(SceneSettings(water=water, inelastic=kind, bands=bands, **more))


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("water", "kind", "nm"),
    [
        ("bio:chl=5", "chlorophyll", 685.0),
        ("bio:chl=5", "raman", 530.0),
        ("bio:chl=5,cdom=0.3", "cdom", 520.0),
        ("jerlov:IB", "raman", 530.0),
        ("jerlov:3C", "raman", 560.0),
    ],
)
def test_photons_find_it(water, kind, nm, request):
    """Round an isotropic lamp, by the angle from it, at 1 to 8 m: no more than 13 free paths."""
    fast = request.config.option.markexpr == "not slow"
    plan = _plan(water, kind, nm)
    excited = plan.lamp_excitation()
    column, exciting = plan.column, plan.excitation
    phases = exciting.phase.weights, plan.phase.weights[:, 1:2]
    photons = Photons(
        np.ones(len(EXCITATION)),
        np.append(exciting.column.absorption, column.absorption[1]),
        np.append(exciting.column.scattering, column.scattering[1]),
        BandPhase(plan.phase.components, np.concatenate(phases, axis=1)),
        excited.matrices[..., 1],
    )
    assert exciting.phase.components == plan.phase.components
    farthest = 6.0 if plan.column.attenuation[1] > 1.6 else 8.0
    spheres = (1.0, 2.0) if fast else (1.0, 2.0, 4.0, farthest)
    edges = np.radians([10.0, 30.0, 75.0, 105.0, 170.0])[[0, 1, 2, 4] if fast else slice(None)]
    traced = photons.radiance(spheres, edges, 20_000 if fast else 150_000, 1, 10)
    mean = traced.mean(axis=0)
    cv = traced.std(axis=0, ddof=1) / math.sqrt(len(traced)) / mean
    found = _about(plan, excited.by(np.ones(len(EXCITATION))), spheres, edges)
    off = np.abs(found / mean - 1.0)
    assert np.all(off < np.maximum(3.0 * cv, 0.05)), (off, cv)
    # What would pass must not be anything.
    assert np.median(cv) < 0.02
    assert not np.all(np.abs(1.1 * found / mean - 1.0) < np.maximum(3.0 * cv, 0.05))


def _about(plan, excited, spheres, edges):
    water = lamp_water(plan.column.absorption, plan.column.scattering, plan.phase)
    lamp = Lamp(ORIGIN, AHEAD, np.ones(1), radius=1e-3)
    light = _light(excited, lamp.profile, water)
    x, weight = np.polynomial.legendre.leggauss(8)
    found = np.empty((len(spheres), len(edges) - 1))
    for k, j in np.ndindex(found.shape):
        angle = (edges[j] + edges[j + 1] + (edges[j + 1] - edges[j]) * x) / 2.0
        w = np.sin(angle)[:, None], 0.0 * angle[:, None], np.cos(angle)[:, None]
        ray = ray_past_lamp(lamp, (0.0, 0.0, -spheres[k]), w, 1e6)
        L = light_along(lamp, ray, light)[1][:, 1]
        found[k, j] = np.average(L, weights=weight * np.sin(angle))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("light", ["led", "led:450,20"])
def test_channels_are_what_the_bands_add_up_to(light):
    plan = _plan("bio:chl=5,cdom=0.3", "all", None)
    shape = parse_emission(light)
    known = (EXCITATION.centres > shape.range[0]) & (EXCITATION.centres < shape.range[1])
    chosen = Bands(EXCITATION.centres[known], EXCITATION.widths[known])
    intensity = np.zeros(len(EXCITATION))
    intensity[known] = band_mean(shape, chosen)
    excited = plan.lamp_excitation().by(intensity)
    channels = channels_of(plan.bands, parse_sensor("cie1931").response_in(plan.bands))
    water = plan.lamp_water(10.0)
    lamp = Lamp((0.4, 0.0, 0.0), AHEAD, np.zeros(len(plan.bands)), SPOT)
    once, twice = (
        project_lamps([lamp], water, channels, excited=[excited.by(np.full(20, lamps))])
        for lamps in (1.0, 2.0)
    )
    assert not np.any(project_lamps([lamp], water, channels).path_light(ORIGIN, AHEAD, 5.0))
    light = _light(excited, SPOT, water, once.in_water.field.harmonics.scale)
    for P, tilt in ((0.5, 0.2), (2.0, 0.0), (6.0, 0.1), (6.0, -0.4)):
        w = (math.sin(tilt), 0.0, math.cos(tilt))
        L = light_along(lamp, ray_past_lamp(lamp, ORIGIN, w, P), light)[1]
        wanted, found = channels.project(L), once.path_light(ORIGIN, w, P)
        assert found == pytest.approx(wanted, rel=0.03, abs=0.03 * wanted.max())
        assert twice.path_light(ORIGIN, w, P) == pytest.approx(2.0 * found, rel=1e-4)


def test_more_nodes_change_little():
    excited = _excited(0.3, 0.5, _phase(0.9), 0.01, 0.01)
    water = lamp_water([0.2], [0.5], _phase(0.9))
    for at, axis in (((0.4, 0, 0.1), (0, 0, 1)), ((1.0, 0, 4.0), (0, 0, -1))):
        for profile in (IsotropicProfile(), SPOT):
            lamp = Lamp(at, axis, np.ones(1), profile)
            ray = ray_past_lamp(lamp, ORIGIN, AHEAD, 6.0)
            light = _light(excited, profile, water)
            few, many = (
                light_along(lamp, ray, light, integrate=way)[1]
                for way in (gauss_sum, lambda _, term: gauss_sum(200, term))
            )
            assert few == pytest.approx(many, rel=0.03)


@pytest.mark.parametrize("profile", [IsotropicProfile(), SPOT])
def test_water_emits_what_it_absorbs_of_the_light(profile):
    """All light is absorbed in the end: its scalar irradiance over all water is power over a."""
    a, even, raman = 0.5, 0.02, 0.01
    excited = _excited(a, 0.8, _phase(0.8), even, raman)
    emitted = excited_power(excited, profile, 40.0)
    lamp = Lamp(ORIGIN, AHEAD, np.ones(1), profile, 1e-3)
    x, weight = np.polynomial.legendre.leggauss(96)
    r, dr = 20.0 * (1.0 + x) ** 2 / 2.0, 20.0 * (1.0 + x) * weight
    r, mu = np.meshgrid(r, x, indexing="ij")
    place = np.sqrt(1.0 - mu**2) * r, 0.0 * r, mu * r
    # Towards directions whose mean is that over all.
    power, solid = 0.0, 2.0 * math.pi * weight
    for onward in np.concatenate([np.eye(3), -np.eye(3)]):
        L = emitted.radiance(lamp, [p[..., None] for p in place], tuple(onward))[..., 0]
        power += 4.0 * math.pi / 6.0 * float(np.einsum("rm,r,m->", L * r**2, dr, solid))
    assert power == pytest.approx(float(profile.solid_angle) * (even + raman) / a, rel=0.03)
