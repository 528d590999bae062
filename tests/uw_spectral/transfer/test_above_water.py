"""Light above the water: what the surface lets in and out again, and suns that stand in for it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.surface.refraction import (
    apparent_depth,
    direction_in_air,
    fresnel_reflectance,
    seen_from_air,
)
from underwater_spectral.uw_spectral.transfer.above_water import (
    facing_mirrored,
    flattened_sun,
    glitter_from_above,
    leaving_fraction,
    leaving_irradiance,
    light_in_air,
)
from underwater_spectral.uw_spectral.transfer.radiance_field import Ripples

N = 1.34


def _directions(count: int) -> np.ndarray:
    rng = np.random.default_rng(4)
    v = rng.normal(size=(count, 3))
    v[:, 2] = -np.abs(v[:, 2])
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_a_ray_from_the_air_is_the_one_out_of_the_water_backwards():
    v = _directions(500).T
    reflectance, w, mirrored = seen_from_air(v, (0.0, 0.0, 1.0), N)
    assert np.linalg.norm(w, axis=0) == pytest.approx(1.0)
    back = direction_in_air([-x for x in w], (0.0, 0.0, 1.0), N)
    np.testing.assert_allclose(back, -v, atol=1e-9)
    np.testing.assert_allclose(reflectance, fresnel_reflectance(-w[2], 1.0 / N), rtol=1e-9)
    np.testing.assert_allclose(mirrored[:2], v[:2])


def test_waves_turn_the_ray_about_their_own_normal():
    normal = np.array([0.2, -0.1, 1.0]) / math.sqrt(1.05)
    v = _directions(50).T
    _, w, _ = seen_from_air(v, normal, N)
    across = [np.cross(x.T, normal) for x in (np.array(w), v)]
    np.testing.assert_allclose(N * across[0], across[1], atol=1e-9)


def test_apparent_depth_is_where_the_shortest_way_points():
    rng = np.random.default_rng(7)
    d, y, h = 10.0 ** rng.uniform([[-2], [-1], [-1]], [[1.5], [1.3], [1.3]], (3, 400))
    fraction = np.linspace(0.0, 1.0, 20001)[:, None]
    way = np.hypot(fraction * d, h) + N * np.hypot((1.0 - fraction) * d, y)
    best = fraction[way.argmin(axis=0), 0]
    seeming = apparent_depth(d, y, h, N)
    # By the angle at the camera, of which a step of the search is a part.
    off = np.degrees(np.arctan2(h, best * d) - np.arctan2(h + seeming, d))
    assert np.abs(off).max() < 0.05
    assert np.abs(off).mean() < 0.01


def test_white_light_keeps_its_energy_through_the_surface():
    """What a uniform sky brings in comes out of water that gives all back."""
    cosine = (np.arange(20000) + 0.5) / 20000
    entered = 2.0 * ((1.0 - fresnel_reflectance(cosine, N)) * cosine).mean()
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / N**2)
    out = leaving_fraction(fresnel_reflectance(inside, 1.0 / N), N) * N**2
    np.testing.assert_allclose(2.0 * (out * cosine).mean(), entered, rtol=1e-6)


@pytest.mark.parametrize("surface", ["none", "flat", "waves"])
def test_light_in_air_brings_what_is_below(surface):
    options = {"surface": surface, "illuminant": "clear-sky", "sun_zenith": 50.0, "bands": 4}
    column = make_plan(SceneSettings(water="jerlov:II", **options)).column
    light = light_in_air(column)
    high = math.cos(math.radians(50.0))
    through = column.sun_irradiance / (light.sun * high)
    if surface == "none":
        np.testing.assert_allclose(through, 1.0)
    else:
        assert np.all((through > 0.9) & (through < 0.98))
    np.testing.assert_allclose(light.sky * (1.0 - light.mirrored), column.sky_irradiance)


def test_a_flattened_sun_keeps_shadows_where_they_seem_to_fall():
    """Of an object at one depth on level ground at another, both seen on the axis."""
    sun = np.array([0.3, -0.2, -0.9])
    sun /= np.linalg.norm(sun)
    for angle in (0.0, 30.0, 60.0):
        towards = (0.0, math.sin(math.radians(angle)), -math.cos(math.radians(angle)))
        height = 1e4  # far off, where the view has one direction
        foot = height * math.tan(math.radians(angle))
        seeming = [float(apparent_depth(foot, y, height, N)) for y in (2.0, 3.0)]
        flat = flattened_sun(sun, towards, N)
        shadow = flat[:2] / -flat[2] * (seeming[1] - seeming[0])
        np.testing.assert_allclose(shadow, sun[:2] / -sun[2], rtol=2e-3)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("zenith", [30.0, 60.0, 75.0])
def test_glitter_is_what_thrown_facets_mirror(zenith):
    """Facets of Gaussian slopes, each mirroring the sun by itself, counted by direction."""
    rng, variance, count = np.random.default_rng(3), 0.03, 4_000_000
    slopes = rng.normal(scale=math.sqrt(variance / 2.0), size=(2, count))
    up = 1.0 / np.sqrt(1.0 + (slopes**2).sum(axis=0))
    facet = np.stack([-slopes[0] * up, -slopes[1] * up, up])
    tilt = math.radians(zenith)
    sun = np.array([math.sin(tilt), 0.0, -math.cos(tilt)])
    cosine = -sun @ facet
    mirrored = sun[:, None] + 2.0 * cosine * facet
    # Of a square metre on the level: a facet is larger than what it covers.
    power = np.maximum(cosine, 0.0) / up * fresnel_reflectance(np.maximum(cosine, 0.0), N)
    power = np.where(mirrored[2] > 0.0, power, 0.0) / count
    width = (N - 1.0) ** 2 * variance
    for angle, side in ((zenith, 0.0), (zenith + 8.0, 0.0), (zenith - 15.0, 8.0)):
        a, b = math.radians(angle), math.radians(side)
        towards = np.array([math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)])
        radius = math.radians(2.0)
        near = towards @ mirrored > math.cos(radius)
        seen = power[near].sum() / (2.0 * math.pi * (1.0 - math.cos(radius)))
        ripples = Ripples((0.0, 0.0), width, 1.0, tuple(sun))
        cone = towards + rng.uniform(-1.1, 1.1, size=(20_000, 3)) * radius
        cone /= np.linalg.norm(cone, axis=1, keepdims=True)
        cone = cone[cone @ towards > math.cos(radius)].T
        found = (glitter_from_above(1.0, list(-cone), ripples, N, 0.0) * cone[2]).mean()
        noise = 3.0 / math.sqrt(near.sum())
        assert found == pytest.approx(seen, rel=0.01 + noise)


def test_what_leaves_the_water_is_the_flux_that_the_surface_lets_through():
    """As counted below the surface, where the rays that leave fill a narrower cone."""

    class Field:
        def radiance(self, y, w):
            assert y == 0.0
            return (1.0 + 0.5 * w[0] - 0.8 * w[2])[:, None] * np.array([1.0, 2.0])

    cosine, weight = np.polynomial.legendre.leggauss(400)
    critical = math.sqrt(1.0 - 1.0 / N**2)
    cosine = critical + (1.0 - critical) * (cosine + 1.0) / 2.0
    through = 1.0 - fresnel_reflectance(cosine, 1.0 / N)
    flux = 2.0 * math.pi * (weight * (1.0 - critical) / 2.0 * cosine * through) @ (1 + 0.8 * cosine)
    np.testing.assert_allclose(leaving_irradiance(Field(), N), [flux, 2.0 * flux], rtol=0.01)


def test_a_level_mirror_lights_undersides_as_the_suns_mirror_image_would():
    normal = np.array([0.36, 0.48, -0.8])
    sun = np.array([0.6, 0.0, -0.8])
    rising = sun * [1.0, 1.0, -1.0]
    assert facing_mirrored(normal, sun) == pytest.approx(float(-(normal @ rising)))
    assert facing_mirrored(-normal, sun) == 0.0
    column = make_plan(SceneSettings(water="jerlov:IB", surface="flat", sun_zenith=60.0)).column
    light = light_in_air(column)
    assert light.sun_mirrored == pytest.approx(float(fresnel_reflectance(0.5, N)), rel=1e-3)
