"""Walls of a voxel and more: how much windows in them let through, which of their faces rays meet.

Compared with the geometry itself, for windows of all sizes, wherever they lie in the lattice.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.occlusion.filled_voxels import FilledVoxels, Filling
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.probes import cast

from .test_filled_voxels import block, joined, sheet

CELL = 0.25
GRID = Grid((-3.0, -3.0, -2.25), CELL, (24, 24, 18))
WIDE = 2.6


def wall_with_window(low, size, thick, angle=0.0):
    """Return voxels of a wall of four blocks about a window (x, z), turned about z."""
    x, y, z = low
    far = y + thick
    parts = [
        block((-WIDE, y, -2.0), (x, far, 2.0), 0.08),
        block((x + size, y, -2.0), (WIDE, far, 2.0), 0.08),
        block((x, y, -2.0), (x + size, far, z), 0.08),
        block((x, y, z + size), (x + size, far, 2.0), 0.08),
    ]
    wall, turned = joined(parts), about_z(angle)
    # Where blocks touch there is no surface.
    inner = (np.abs(wall.normals[:, 0]) > 0.5) & (np.abs(wall.points[:, 0]) < WIDE - 0.1)
    wall = wall.some(~inner | (np.abs(wall.points[:, 2] - z - size / 2.0) < size / 2.0))
    points, normals = wall.points @ turned.T, wall.normals @ turned.T
    extents = np.full_like(wall.extents, np.inf) if angle else wall.extents
    wall = dataclasses.replace(wall, points=points, normals=normals, extents=extents)
    return FilledVoxels().of(GRID, Filling([b"wall"], [wall], [False], to_edges=True))


def about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def open_to(voxels, low, size, thick, angle, random, count=3000):
    """Return how many rays through about a window get through voxels, and through it."""
    x, y, z = low
    far = y + thick
    start = random.uniform((-1.5, y - 1.0, -1.2), (1.5, y - 0.4, 1.2), (count, 3))
    to = random.uniform((x - 0.3, y, z - 0.3), (x + size + 0.3, y, z + size + 0.3), (count, 3))
    way = (to - start) / np.linalg.norm(to - start, axis=1, keepdims=True)
    end = start + way * ((far - start[:, 1]) / way[:, 1])[:, None]
    free = np.ones(count, bool)
    for at in (to, end):
        free &= (at[:, 0] > x) & (at[:, 0] < x + size) & (at[:, 2] > z) & (at[:, 2] < z + size)
    turned = about_z(angle)
    gets, _ = voxels.trace(start @ turned.T, way @ turned.T)
    passes = (start + way * gets[:, None])[:, 1] > far + 0.15
    return passes.sum(), free.sum()


@pytest.mark.parametrize("angle", [0.0, 0.35])
def test_windows_in_thick_walls_let_through_what_they_do(angle):
    """They let through .86: what sank beside an edge narrowed them."""
    random, found = np.random.default_rng(1), np.zeros(2)
    for thick, size in ((1.05, 4.0), (1.5, 4.0), (2.2, 4.0), (1.2, 6.0), (4.0, 6.0)):
        for _ in range(5):
            x, z = random.uniform(-0.25, 0.25, 2) - size * CELL / 2.0
            low = x, random.uniform(-0.125, 0.125), z
            place = low, size * CELL, thick * CELL, angle
            found += open_to(wall_with_window(*place), *place, random)
    assert found[0] / found[1] == pytest.approx(1.0, abs=0.08)


def test_a_ray_meets_the_face_that_it_comes_to():
    """The inner face of a wall beside a window was as bright as the sunlit reveal."""
    random, right = np.random.default_rng(2), []
    for _ in range(6):
        x, z = random.uniform(-0.25, 0.25, 2) - 0.5
        low, size, thick = (x, random.uniform(-0.1, 0.1), z), 1.0, 0.6
        voxels, y = wall_with_window(low, size, thick), low[1]
        start = random.uniform((-1.0, y - 1.2, -1.0), (1.0, y - 0.5, 1.0), (2000, 3))
        to = random.uniform((x - 0.2, y, z - 0.2), (x + size + 0.2, y, z + size + 0.2), (2000, 3))
        way = (to - start) / np.linalg.norm(to - start, axis=1, keepdims=True)
        gets, number = voxels.trace(start, way)
        window = (to[:, 0] > x) & (to[:, 0] < x + size) & (to[:, 2] > z) & (to[:, 2] < z + size)
        met = (number >= 0) & ((start + way * gets[:, None])[:, 1] < y + thick)
        side = voxels.side_met(number[met], start[met], way[met])
        facing = voxels.facing.reshape(-1, 3)[side]
        # The wall's inner face looks to where rays come from, reveals do not.
        right.append((facing[:, 1] < -0.9) == ~window[met])
    assert np.concatenate(right).mean() > 0.82


def test_a_shadow_falls_where_it_does():
    """It fell beside its place by as much as 1.8 voxels' height make, on whole voxels or none."""
    to_sun = np.array([-0.25, -0.28, 0.0])
    to_sun[2] = math.sqrt(1.0 - (to_sun**2).sum())
    random, areas, off = np.random.default_rng(3), [], []
    coarse = Grid(GRID.lower, 3 * CELL, tuple(n // 3 for n in GRID.shape))
    for _ in range(10):
        x, y = random.uniform(-0.3, 0.2, 2)
        floor = block((-WIDE, -WIDE, -2.0), (WIDE, WIDE, -1.5), 0.08)
        things = joined([floor, sheet((x, y), (x + 1.1, y + 1.1), 0.5)])
        voxels = FilledVoxels().of(GRID, Filling([b"things"], [things], [False], to_edges=True))
        rays = cast(voxels, coarse, to_sun)
        middle, facing = voxels.middle.reshape(-1, 3), voxels.facing.reshape(-1, 3)
        on_floor = (facing[:, 2] > 0.9) & (np.abs(middle[:, 2] + 1.5) < 0.1)
        dark, place = 1.0 - rays.side_sunlit[on_floor], middle[on_floor, :2]
        dark[(np.abs(place) > 2.2).any(axis=1)] = 0.0
        areas.append(dark.sum() * CELL**2)
        fallen = 2.0 / to_sun[2] * to_sun[:2]
        off.append(np.average(place, axis=0, weights=dark) + fallen - (x + 0.55, y + 0.55))
    assert np.mean(areas) == pytest.approx(1.21, rel=0.1)
    assert np.abs(np.mean(off, axis=0)).max() < 0.2 * CELL
