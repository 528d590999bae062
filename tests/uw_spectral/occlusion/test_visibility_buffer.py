"""What objects fill of a view, and what they block of light scattered forward."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from underwater_spectral.uw_spectral.occlusion.point_spread import (
    fraction_on_path,
    fraction_within,
    spread,
)
from underwater_spectral.uw_spectral.occlusion.view_map import SIZE, view_map
from underwater_spectral.uw_spectral.occlusion.visibility_buffer import (
    Surface,
    VisibilityBuffer,
    VisibilityCache,
    empty_buffer,
    visibility_buffer,
)
from underwater_spectral.uw_spectral.water.phase_functions import HenyeyGreenstein

PHASE = HenyeyGreenstein(0.9)
VIEW = view_map((0.0, 0.0, -5.0), np.eye(3), math.radians(60.0))
MIDDLE = slice(SIZE // 2 - 1, SIZE // 2 + 1)


def buffer_of(*bodies: np.ndarray, floor_depth: float = math.inf) -> VisibilityBuffer:
    """What grey triangles cover."""
    surfaces = [Surface(x, np.full((len(x), 3), 0.5)) for x in bodies]
    return visibility_buffer(VIEW, surfaces, floor_depth)


def ball(distance: float, angle: float, parts: int) -> np.ndarray:
    """Triangles of a ball of an angular radius straight ahead of the view."""
    theta, phi = np.linspace(0, math.pi, parts // 2 + 1), np.linspace(0, 2 * math.pi, parts + 1)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    points = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    points = points * distance * math.sin(angle) + np.array([0.0, 0.0, -5.0 - distance])
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    some = [np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]
    return np.concatenate([x.reshape(-1, 3, 3) for x in some])


def test_the_fraction_of_a_phase_function_is_its_integral():
    """Henyey-Greenstein's is known in closed form."""
    g, cosine = 0.9, np.cos(np.radians([0.5, 5.0, 30.0, 90.0, 170.0]))
    beyond = (1 - g * g) / (2 * g) * (1 / np.sqrt(1 + g * g - 2 * g * cosine) - 1 / (1 + g))
    np.testing.assert_allclose(fraction_within(PHASE, np.arccos(cosine)), 1 - beyond, atol=2e-3)


@pytest.mark.parametrize("parts", [16, 64])
@pytest.mark.parametrize("degrees", [3.0, 10.0, 30.0])
def test_a_ball_fills_its_solid_angle_and_blocks_what_the_formula_says(degrees, parts):
    angle = math.radians(degrees)
    buffer = buffer_of(ball(4.0, angle, parts))
    solid = 2 * math.pi * (1 - math.cos(angle))
    np.testing.assert_allclose(buffer.covered.sum() * VIEW.texel, solid, rtol=0.06)
    blocked = spread(buffer.covered, PHASE, float(VIEW.per_unit))[MIDDLE, MIDDLE].mean()
    np.testing.assert_allclose(blocked, fraction_on_path(PHASE, np.tan([angle])), rtol=0.04)


def test_a_wall_of_two_triangles_fills_the_view_without_a_seam():
    x = 200.0
    corners = np.array([[-x, -x], [x, -x], [x, x], [-x, x]])
    corners = np.column_stack([corners, np.full(4, -8.0)])
    buffer = buffer_of(corners[[[0, 1, 2], [0, 2, 3]]])
    assert buffer.covered[SIZE // 4 : -SIZE // 4, SIZE // 4 : -SIZE // 4].min() > 0.99


def test_what_lies_on_the_floor_of_the_water_is_part_of_it():
    surface = ball(4.0, math.radians(10.0), 16)
    assert buffer_of(surface, floor_depth=4.2).covered.max() == 0.0
    assert buffer_of(surface, floor_depth=20.0).covered.max() > 0.9


@pytest.mark.parametrize("turned", [False, True])
def test_the_inside_of_a_sheet_hides_what_lies_behind(turned):
    """A bright floor far behind the wall of a pipe was seen in its place."""
    corners = 40.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    sheet, wall = (
        np.column_stack([corners, np.full(4, -5.0 - far)])[[[0, 1, 2], [0, 2, 3]]]
        for far in (2.0, 30.0)
    )
    sheet = sheet[:, ::-1] if turned else sheet
    buffer = buffer_of(sheet, wall)
    np.testing.assert_allclose(buffer.distance[MIDDLE, MIDDLE], 2.0, rtol=0.01)
    np.testing.assert_allclose(buffer.normal[MIDDLE, MIDDLE], [[[0, 0, 1]] * 2] * 2, atol=1e-6)
    of_ball = buffer_of(ball(4.0, math.radians(10.0), 64), wall)
    front = 4.0 * (1.0 - math.sin(math.radians(10.0)))
    np.testing.assert_allclose(of_ball.distance[MIDDLE, MIDDLE], front, rtol=0.01)


def test_nothing_blocks_nothing():
    assert not empty_buffer().covered.any()
    assert not buffer_of().covered.any()


def test_what_stays_is_kept_and_what_moves_is_drawn_anew():
    cache, asked = VisibilityCache(), []

    def surface(name: str, at: float) -> tuple[bytes, Callable[[], Surface]]:
        corners = ball(4.0, math.radians(8.0), 16) + np.array([at, 0.0, 0.0])

        def make() -> Surface:
            asked.append(name)
            return Surface(corners, np.full((len(corners), 3), 0.5))

        return f"{name} {at}".encode(), make

    for frame in range(4):
        bodies = dict(
            [surface("rock", -1.0), surface("reef", 0.4), surface("fish", 1.0 + 0.1 * frame)]
        )
        asked.clear()
        found = cache.buffer(VIEW, bodies)
        asked_now = list(asked)
        fresh = visibility_buffer(VIEW, [make() for make in bodies.values()])
        np.testing.assert_allclose(found.covered, fresh.covered, atol=1e-9)
        np.testing.assert_allclose(found.normal, fresh.normal, atol=1e-9)
    assert asked_now == ["fish"]


def test_what_lies_behind_is_not_in_the_picture():
    behind = ball(4.0, math.radians(10.0), 16) * [1.0, 1.0, -1.0] - [0.0, 0.0, 10.0]
    assert buffer_of(behind).covered.max() == 0.0
