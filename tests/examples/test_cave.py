"""The example cave: closed rock, little sky, and a clear way through."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from underwater_spectral.examples.cave.layout import FRAMES
from underwater_spectral.examples.cave.rock import SHAFTS, swim_path
from underwater_spectral.examples.parts.solids import open_edges
from underwater_spectral.examples.scenes import count_triangles
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
def cave() -> bpy.types.Scene:
    return fresh("cave", 1)


def test_size_of_the_draft(cave) -> None:
    rendered, stored = count_triangles()
    assert 60_000 < rendered < 150_000
    assert stored < rendered


def test_no_light_no_water(cave) -> None:
    assert cave.world is None
    assert {item.type for item in cave.objects} == {"MESH", "CAMERA"}
    assert max(points[:, 2].max() for points in world_vertices().values()) < -2


def test_the_rock_is_one_closed_solid(cave) -> None:
    rock = closed_shape(bpy.data.objects["Rock"])
    assert open_edges(rock) == 0
    a, b, c = (rock.vertices[rock.triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 > 5000


def test_the_roof_is_thick_but_for_its_holes(cave) -> None:
    """Well outside the rims of the holes, what is over the diver is rock, and thick."""
    rock = closed_shape(bpy.data.objects["Rock"])
    tree = BVHTree.FromPolygons(rock.vertices.tolist(), rock.triangles.tolist())
    thick = []
    for y in np.arange(-13, 13.1, 0.5):
        point = swim_path(y)[0]
        for x in point[0] + np.array([-1.5, 0, 1.5]):
            away = min(np.hypot(x - s.axis(z)[0], y - s.axis(z)[1]) - s.radius
                       for s in SHAFTS for z in (-5.0, -7.0, -10.0))  # fmt: skip
            if away < 2.2:
                continue
            below, *_ = tree.ray_cast(Vector((x, y, point[2])), Vector((0, 0, 1)))
            above, *_ = tree.ray_cast(Vector((x, y, 0)), Vector((0, 0, -1)))
            assert below is not None
            thick.append(above.z - below.z)
    assert len(thick) > 20
    assert min(thick) > 0.8


def test_little_sky_is_seen_from_the_cave(cave) -> None:
    along = {y: openness(cave, swim_path(y)[0]) for y in np.arange(-13.0, 13.1, 1.0)}
    assert np.mean(list(along.values())) < 0.15
    # Light falls through the large hole, and next to none a few metres on.
    assert openness(cave, (*SHAFTS[1].axis(-11.0), -11.0)) > 0.05
    assert along[-4.0] < 0.05


def test_each_hole_lets_the_sun_in(cave) -> None:
    """Some straight way up leads from the sand to the sky through each hole."""
    graph = bpy.context.evaluated_depsgraph_get()
    for shaft in SHAFTS:
        foot = np.array([*shaft.axis(-13.0), -13.0])
        up = np.array([*shaft.axis(-4.0), -4.0]) - foot
        assert not cave.ray_cast(graph, foot, up / np.linalg.norm(up))[0]


@pytest.mark.usefixtures("cave")
def test_materials_are_whole() -> None:
    assert_materials_end_in_an_output()
    assert unread() == []


def test_cameras_are_in_the_water(cave) -> None:
    cameras = [item for item in cave.objects if item.type == "CAMERA"]
    assert {item.name for item in cameras} == {"Beams", "Entrance", "Swim"}
    assert cave.camera.name == "Beams"
    for item in cameras:
        eye = np.array(item.matrix_world.translation)
        assert floor_under(cave, eye) < eye[2] < -5, item.name
        assert distance(cave, eye) > 0.4, item.name


def test_the_swimmer_goes_through_and_touches_nothing(cave) -> None:
    solids = [closed_shape(item) for item in bpy.data.objects
              if item.name.startswith(("Rock", "Boulder", "Seafloor"))]  # fmt: skip
    trees = [BVHTree.FromPolygons(s.vertices.tolist(), s.triangles.tolist()) for s in solids]
    swimmer = bpy.data.objects["Swim"]
    assert (cave.frame_start, cave.frame_end) == (1, FRAMES)
    eyes, views = [], []
    for frame in range(1, FRAMES + 1):
        cave.frame_set(frame)
        matrix = np.array(swimmer.matrix_world)
        eyes.append(matrix[:3, 3])
        views.append(-matrix[:3, 2])
        nearest = min(tree.find_nearest(Vector(eyes[-1]), 5.0)[3] or 5.0 for tree in trees)
        assert nearest > 0.5, frame
    cave.frame_set(1)
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    assert steps.max() < 1.3 * steps.min()
    turns = np.degrees(np.arccos(np.einsum("ij,ij->i", views[1:], views[:-1])))
    assert turns.max() < 6
    assert np.abs(np.diff(turns)).max() < 1.5
    # From before one mouth to the other.
    assert eyes[0][1] < -20
    assert eyes[-1][1] > 14
    assert openness(cave, eyes[0]) > 0.5 < openness(cave, eyes[-1]) + 0.4


@pytest.mark.slow
def test_a_seed_fixes_the_scene(cave) -> None:
    first = {name: points.copy() for name, points in world_vertices().items()}
    fresh("cave", 1)
    again = world_vertices()
    assert first.keys() == again.keys()
    assert all(np.array_equal(first[name], again[name]) for name in first)
    fresh("cave", 4)
    assert not np.array_equal(first["Rock"], world_vertices()["Rock"])
