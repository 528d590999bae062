"""The example wreck: her plates are solid, her hold is dark, and light falls in where it should."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.examples.parts.shapes import Shape, grid_triangles
from underwater_spectral.examples.parts.solids import clipped, open_edges, surface_net, thickened
from underwater_spectral.examples.scenes import count_triangles
from underwater_spectral.examples.wreck import hull
from underwater_spectral.examples.wreck.layout import aboard, world
from underwater_spectral.tests.examples.built import (
    assert_materials_end_in_an_output,
    closed_shape,
    distance,
    floor_under,
    fresh,
    openness,
    unread,
    world_vertices,
)


@pytest.fixture(scope="module")
def wreck() -> bpy.types.Scene:
    return fresh("wreck", 1)


def volume(shape: Shape) -> float:
    a, b, c = (shape.vertices[shape.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def test_a_surface_net_is_closed_and_lies_on_the_surface() -> None:
    axis = np.arange(-12, 13) * 0.1
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    ball = surface_net(np.linalg.norm(grid, axis=-1) - 1, (-1.2, -1.2, -1.2), 0.1)
    assert open_edges(ball) == 0
    assert volume(ball) == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert np.linalg.norm(ball.vertices, axis=1) == pytest.approx(1, abs=0.01)


def test_a_cut_plate_is_closed_and_has_a_hole() -> None:
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 40), np.linspace(0, 1, 40)))
    sheet = Shape(np.stack([x, y, 0 * x], axis=1), grid_triangles(40, 40), {"along": x})
    cut = clipped(sheet, np.hypot(x - 0.5, y - 0.5) - 0.3)
    assert cut.attributes["along"] == pytest.approx(cut.vertices[:, 0])
    plate = thickened(cut, 0.1)
    assert open_edges(plate) == 0
    assert volume(plate) == pytest.approx(0.1 * (1 - np.pi * 0.09), rel=0.01)
    assert plate.vertices[:, 2].min() == pytest.approx(-0.1)


def test_ship_and_world(wreck) -> None:
    points = np.array([(13.0, 0, 4), (0, 3, 0), (-5, -2, 1)])
    assert aboard(world(points)) == pytest.approx(points)
    # Heeled: her port side is turned up.
    assert world((0, 1, 0))[2] > world((0, -1, 0))[2]


def test_size_of_the_draft(wreck) -> None:
    rendered, stored = count_triangles()
    assert 50_000 < rendered < 150_000
    assert stored < rendered


def test_no_light_no_water(wreck) -> None:
    assert wreck.world is None
    assert {item.type for item in wreck.objects} == {"MESH", "CAMERA"}
    assert max(points[:, 2].max() for points in world_vertices().values()) < -5


@pytest.mark.usefixtures("wreck")
@pytest.mark.parametrize("name", ["Hull", "Deck", "Bulkheads", "Hold floor"])
def test_plates_and_planks_are_solid(name) -> None:
    shape = closed_shape(bpy.data.objects[name])
    assert open_edges(shape) == 0
    assert volume(shape) > 0


def test_she_lies_18_to_25_m_deep(wreck) -> None:
    plates = world_vertices()["Hull"]
    assert plates[:, 2].min() > -25
    assert plates[:, 2].max() < -16
    assert 24 < np.ptp(aboard(plates)[:, 0]) < 28


def test_the_hold_is_dark_but_for_breach_and_hatches(wreck) -> None:
    inside = [world((x, -1.5, 1.8)) for x in (-2.0, 2.0, 7.5)]
    assert np.mean([openness(wreck, point) for point in inside]) < 0.2
    under_hatch = world((hull.HATCHES[0][0], 0.0, 3.4))
    assert openness(wreck, under_hatch) > 0.2
    assert openness(wreck, world((-5.5, -1.0, 2.0))) < 0.08


def test_one_sees_in_through_the_breach(wreck) -> None:
    graph = bpy.context.evaluated_depsgraph_get()
    x, z = hull.BREACH
    seen = 0
    for along in np.linspace(-1.2, 1.2, 9):
        origin, target = world((x + along, 8, z + 0.6)), world((x + along, 0.5, z - 0.2))
        way = target - origin
        hit, point, *_ = wreck.ray_cast(graph, origin, way / np.linalg.norm(way))
        seen += hit and aboard(point)[1] < 1.5
    assert seen >= 4


@pytest.mark.usefixtures("wreck")
def test_materials_are_whole() -> None:
    assert_materials_end_in_an_output()
    assert unread() == []


def test_cameras_are_in_the_water(wreck) -> None:
    cameras = [item for item in wreck.objects if item.type == "CAMERA"]
    assert {item.name for item in cameras} == {"Wreck", "Breach", "Hold"}
    assert wreck.camera.name == "Wreck"
    for item in cameras:
        eye = np.array(item.matrix_world.translation)
        assert floor_under(wreck, eye) < eye[2] < -5, item.name
        assert distance(wreck, eye) > 0.4, item.name
    x, y, z = aboard(np.array(bpy.data.objects["Hold"].matrix_world.translation))
    assert hull.HOLD[0] < x < hull.HOLD[1]
    assert abs(y) < hull.half_width(x, z) - 0.3
    assert hull.CEILING < z < hull.DEPTH


@pytest.mark.slow
def test_a_seed_fixes_the_scene(wreck) -> None:
    first = {name: points.copy() for name, points in world_vertices().items()}
    fresh("wreck", 1)
    again = world_vertices()
    assert first.keys() == again.keys()
    assert all(np.array_equal(first[name], again[name]) for name in first)
    fresh("wreck", 4)
    assert not np.array_equal(first["Hull"], world_vertices()["Hull"])
