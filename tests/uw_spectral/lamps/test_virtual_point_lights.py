"""Light of lamps that objects throw back: its power, and against photons."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, LitPart, LitParts, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_shadow import (
    PART_SIDE,
    SIDE,
    shadow_directions,
    shadow_map,
)
from underwater_spectral.uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.profile import LAMBERT, SpotProfile
from underwater_spectral.uw_spectral.lamps.virtual_point_lights import (
    COUNT,
    LitSurfaces,
    rays_of,
    virtual_point_lights,
)
from underwater_spectral.uw_spectral.octahedron import folded
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture
from underwater_spectral.validation import lamp_photons

PHASE = seawater_mixture([1.0], [0.02])
FLOOR, REFLECTANCE = -1.2, 0.6
SPOT = SpotProfile(math.radians(80.0), 0.4)
DOWN = (0.0, math.sin(0.6), -math.cos(0.6))
CAMERA = (0.0, 0.0, 0.0)


def _over_floor(lamp):
    """Distances to a level floor in every direction, and what it is like."""
    rays = rays_of(lamp)
    u = rays.directions
    height = lamp.position[2] - FLOOR
    distances = np.where(u[:, 2] < 0, height / np.maximum(-u[:, 2], 1e-9), np.inf)
    up = np.tile([0.0, 0.0, 1.0], (len(u), 1))
    return LitSurfaces(rays, distances, up, np.full((len(u), 1), REFLECTANCE))


def _by_many(lamp, surfaces, water, side=8):
    """Lamps for what lies in each of small squares of the map of directions."""
    u = surfaces.rays.directions
    x, y, z = u.T / np.abs(u).sum(axis=-1)
    across, down = (np.minimum((p + 1.0) / 2.0 * side, side - 1) for p in folded(x, y, z))
    squares = down.astype(int) * side + across.astype(int)
    made = []
    for square in np.unique(squares):
        distances = np.where(squares == square, surfaces.distances, np.inf)
        part = dataclasses.replace(surfaces, distances=distances)
        made += virtual_point_lights([lamp], [part], water, CAMERA)
    return [one for one in made if one.intensity[0] > 0]


def test_no_light_is_lost_or_made():
    """Without water a floor under a lamp throws back its fraction of the lamp's power."""
    water = lamp_water([1e-9], [0.0], PHASE)
    lamp = Lamp((0.5, 1.0, 0.3), (0.0, 0.0, -1.0), np.array([2.0]), SPOT)
    surfaces = _over_floor(lamp)
    few = virtual_point_lights([lamp], [surfaces], water, CAMERA)
    for made, near in ((_by_many(lamp, surfaces, water), 0.03), (few, 0.15)):
        power = math.pi * sum(float(one.intensity[0]) for one in made)
        assert power == pytest.approx(REFLECTANCE * 2.0 * SPOT.solid_angle, rel=near)
        assert all(one.axis == pytest.approx((0.0, 0.0, 1.0)) for one in made)
        assert all(one.position[2] == pytest.approx(FLOOR) for one in made)


def test_a_few_lamps_light_a_ceiling_as_many_do():
    water = lamp_water([0.06], [0.36], PHASE)
    lamp = Lamp((0.5, 1.0, 0.3), DOWN, np.ones(1), SPOT)
    surfaces = _over_floor(lamp)
    few, many = (
        virtual_point_lights([lamp], [surfaces], water, CAMERA),
        _by_many(lamp, surfaces, water),
    )
    for point in ((0.0, 1.0, 0.8), (0.5, 2.0, 0.8)):
        assert _on_ceiling(few, point, water) == pytest.approx(
            _on_ceiling(many, point, water), rel=0.05
        )


@pytest.mark.slow_but_first
@pytest.mark.parametrize("turn", [0.0, 0.02])
def test_light_changes_steadily_past_a_ball(turn):
    """Of a vehicle's two lamps that come near a ball by 3 cm a frame, or turn by one degree."""
    water, ceiling = lamp_water([0.06], [0.36], PHASE), ((-0.5, 3.5, 0.6), (0.0, 3.5, 0.6))
    light = []
    for frame in range(40):
        y, angle = (0.0, turn * frame) if turn else (0.03 * frame, 0.0)
        cosine, sine = math.cos(angle), math.sin(angle)
        axis = (0.98 * sine, 0.98 * cosine, -0.2)
        lamps = [Lamp((x * cosine, y - x * sine, 0.3), axis, np.ones(1), SPOT) for x in (-0.5, 0.5)]
        made = virtual_point_lights(
            lamps, [_with_ball(lamp) for lamp in lamps], water, (0.0, y, 0.0)
        )
        light.append([_on_ceiling(made, point, water) for point in ceiling])
    change = np.diff(np.log(light), axis=0)
    # 3 % at worst is what is wanted of whole frames.
    assert np.abs(np.diff(change, axis=0)).max() < 0.015


def _with_ball(lamp, middle=(0.4, 4.0, -0.6), radius=0.6, reflectance=0.2):
    """Put a dark ball on the floor."""
    floor, o = _over_floor(lamp), np.array(lamp.position) - middle
    u = floor.rays.directions
    past = (u @ o) ** 2 - (o @ o - radius**2)
    distances = np.where(past > 0, -(u @ o) - np.sqrt(np.maximum(past, 0.0)), np.inf)
    near = ((distances > 0) & (distances < floor.distances))[:, None]
    distances = np.where(near[:, 0], distances, floor.distances)
    normals = (o + np.where(near, distances[:, None], 0.0) * u) / radius
    return LitSurfaces(
        floor.rays,
        distances,
        np.where(near, normals, floor.normals),
        np.where(near, reflectance, floor.reflectance),
    )


def _on_ceiling(lamps, point, water):
    patches = [patch_past_lamp(one, point, (0.0, 0.0, -1.0)) for one in lamps]
    return sum(
        float(np.sum(surface_irradiance(*pair, water))) for pair in zip(lamps, patches, strict=True)
    )


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("height", "near"), [(0.3, 0.25), (0.6, 0.06)])
def test_what_is_near_a_lit_floor_gets_its_light(height, near):
    """Parts against many lamps; those that stand for all would not do."""
    water = lamp_water([0.06], [0.05], PHASE)
    lamp = Lamp((0.5, 1.0, 0.3), DOWN, np.ones(1), SPOT)
    surfaces, point = _over_floor(lamp), (0.2 + height / 2.0, 2.2, FLOOR + height)
    few = virtual_point_lights([lamp], [surfaces], water, CAMERA)
    many = _without_parts(_by_many(lamp, surfaces, water, 32))
    in_parts, wanted, whole = (
        sum(
            float(surface_irradiance(one, patch_past_lamp(one, point, (0, 0, -1)), water)[0][0])
            for one in made
        )
        for made in (few, many, _without_parts(few))
    )
    assert in_parts == pytest.approx(wanted, rel=near)
    assert abs(whole - wanted) > 2.0 * abs(in_parts - wanted)


def _without_parts(lamps):
    return [dataclasses.replace(one, parts=None) for one in lamps]


def test_a_part_has_a_shadow():
    water = lamp_water([1e-9], [0.0], PHASE)
    wall = np.where(shadow_directions(PART_SIDE)[:, 0] > 0.0, 0.5, np.inf)
    place, up = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    part = LitPart(place, up, np.ones(1), 0.1, shadow_map(wall, PART_SIDE))
    lamp = Lamp(place, up, np.ones(1), LAMBERT, 0.1, virtual=1.0, parts=LitParts((part,)))
    free, hidden = (
        surface_irradiance(lamp, patch_past_lamp(lamp, (x, 0.0, 1.0), (0.0, 0.0, -1.0)), water)[0]
        for x in (-1.0, 1.0)
    )
    # 45° at both ends, √2 m away.
    assert free == pytest.approx(0.5 / 2.01, rel=1e-3)
    assert hidden == 0.0


def test_nothing_lit_makes_dark_lamps():
    water = lamp_water([0.06] * 2, [0.36] * 2, seawater_mixture([1.0] * 2, [0.02] * 2))
    lamp = Lamp((0.5, 1.0, 0.3), DOWN, np.ones(2), SPOT)
    floor = _over_floor(lamp)
    nothing = dataclasses.replace(floor, distances=np.full(len(floor.distances), np.inf))
    black = dataclasses.replace(floor, reflectance=np.zeros((len(floor.distances), 2)))
    for lamps, surfaces in (([], []), ([lamp], [nothing]), ([lamp], [black])):
        made = virtual_point_lights(lamps, surfaces, water, CAMERA)
        assert len(made) == COUNT
        assert all(np.array_equal(one.intensity, [0.0, 0.0]) for one in made)


def test_light_of_an_object_that_is_seen_begins_beyond_ten_degrees():
    """What is bent by less is the light of the object itself, in what is carried forward."""
    place = Lamp((0.3, 0.0, 0.0), (0.0, -1.0, 0.0), np.ones(1), SPOT, virtual=1.0)
    ray = (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 5.0
    assert ray_past_lamp(place, *ray).first == ray_past_lamp(place, *ray).near
    at = dataclasses.replace(place, position=(0.3, 4.0, 0.0))
    before = ray_past_lamp(at, *ray, before_surface=True)
    angle = math.atan2(before.h, -before.first)
    assert math.degrees(angle) == pytest.approx(10.0, abs=1e-3)
    lamp = dataclasses.replace(at, virtual=0.0)
    assert ray_past_lamp(lamp, *ray, before_surface=True).first == before.near


def test_no_light_comes_through_a_wall():
    """The water before an object in the shadow of a wall has no light of the lamp beyond both."""
    toward = -shadow_directions()[:, 2]
    wall = shadow_map(np.where(toward > 0, 0.8 / np.maximum(toward, 1e-9), np.inf))
    lamp = Lamp((0.1, 0.0, 5.0), (0.0, 0.0, -1.0), np.ones(1), SPOT, 1e-3, shadow=wall)
    water = lamp_water([0.06], [0.36], PHASE)
    ray = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 4.0
    behind, lit = (
        float(sum(lamp_light(one, ray_past_lamp(one, *ray, before_surface=True), water))[0])
        for one in (lamp, dataclasses.replace(lamp, shadow=None))
    )
    assert behind < 1e-3 * lit


@pytest.mark.slow
@pytest.mark.parametrize(("a", "b"), [(0.06, 0.36), (0.3, 0.3)])
def test_water_over_a_lit_floor_against_paths(a, b):
    """Its mean by many lamps within 10 % of traced paths, which know it within 4 %, and by few as
    much below at most; without what the floor throws back most of the light is missing.
    """
    room = pytest.importorskip("underwater_spectral.validation.lamp_room")
    # The left blocks of a row just above the middle, seen at 30 to 8° from it.
    view, chosen = room.View(2, 20, 0.06), slice(0, 8)
    x = (np.arange(20) + 0.5 - 10.0)[chosen] * view.size
    w = np.stack([x, np.ones_like(x), np.full_like(x, view.size / 2.0)], axis=-1)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    lamp = Lamp((0.5, 1.0, 0.3), DOWN, np.ones(1), SPOT, 1e-3)
    nothing = np.zeros((0, 6))
    phase, kept = room.cut(lamp_photons.tables_of(PHASE), math.radians(3.0))
    paths = room.traced(
        view, [lamp], (a, kept * b), phase, room.Room(FLOOR, nothing, nothing, np.zeros((1, 3))),
        np.array([REFLECTANCE]), 1, 100_000,
    )[0, chosen].mean(axis=0)  # fmt: skip
    whole = paths.mean()
    assert paths.std(ddof=1) / math.sqrt(room.BATCHES) < 0.04 * whole
    water, surfaces = lamp_water([a], [b], PHASE), _over_floor(lamp)
    lit = dataclasses.replace(lamp, shadow=shadow_map(surfaces.distances[: SIDE**2]))
    few, many = (
        virtual_point_lights([lamp], [surfaces], water, CAMERA),
        _by_many(lamp, surfaces, water),
    )
    without, by_few, by_many = (
        np.mean([sum(_in_water(one, ray, water) for one in lamps) for ray in w])
        for lamps in ([lit], [lit, *few], [lit, *many])
    )
    assert without < 0.5 * whole
    assert by_many == pytest.approx(whole, rel=0.1)
    assert by_few == pytest.approx(by_many, rel=0.1)


def _in_water(lamp, w, water):
    ray = ray_past_lamp(lamp, CAMERA, tuple(w), 1e6)
    return float(sum(lamp_light(lamp, ray, water))[0])
