"""Voxels that are filled again where objects have changed are those that are filled at once."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from underwater_spectral.uw_spectral.occlusion.filled_voxels import FilledVoxels, Filling, Samples
from underwater_spectral.uw_spectral.occlusion.grid import Grid

NAMES = "points", "normals", "colours", "areas", "extents", "coverage"
GRID = Grid((-2.0, -2.0, -2.0), 0.25, (16, 16, 16))


def surface(seed, at):
    random = np.random.default_rng(seed)
    normals = random.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Some lie on the border of two voxels, and some beside the box.
    points = np.round((np.asarray(at) + 0.7 * normals) / 0.125, 1) * 0.125
    return Samples(
        points, normals, random.random((300, 3)), np.full(300, 0.02), np.full((300, 3), 0.14),
        np.ones(300),
    )  # fmt: skip


def filling(places, *, to_edges=False):
    keys = [f"{number} {at}".encode() for number, at in enumerate(places)]
    samples = [surface(number, at) for number, at in enumerate(places)]
    small = [number % 3 == 0 for number in range(len(places))]
    return Filling(keys, samples, small, to_edges)


@pytest.mark.parametrize("to_edges", [False, True])
def test_what_moves_comes_or_goes_leaves_the_voxels_as_if_filled_at_once(to_edges):
    cache, random = FilledVoxels(), np.random.default_rng(0)
    places = [tuple(random.uniform(-1.5, 1.5, 3)) for _ in range(7)]
    for frame in range(8):
        places[frame % 6] = tuple(random.uniform(-2.0, 2.0, 3))
        if frame == 5:
            places.pop()
        cache.next_frame()
        wanted = filling(places, to_edges=to_edges)
        found = cache.of(GRID, wanted)
        assert found.equals(FilledVoxels().of(GRID, wanted))
        assert 200 < len(found) < GRID.count


def test_walls_that_move_leave_the_voxels_as_if_filled_at_once():
    """What is behind a side decides where it fills voxels."""
    cache, random = FilledVoxels(), np.random.default_rng(0)

    def wall():
        low = random.uniform(-1.6, 0.6, 3)
        size = np.where(np.arange(3) == random.integers(3), random.uniform(0.02, 0.3), 0.9)
        return block(low, low + size, 0.06)

    walls = [wall() for _ in range(12)]
    for frame in range(60):
        walls[frame % 3] = wall()
        keys = [x.points.tobytes() for x in walls]
        cache.next_frame()
        wanted = Filling(keys, walls, [False] * len(walls), to_edges=True)
        assert cache.of(GRID, wanted).equals(FilledVoxels().of(GRID, wanted)), frame


def test_no_more_is_kept_than_of_the_last_frame():
    cache = FilledVoxels()
    for z in range(40):
        cache.next_frame()
        cache.of(Grid((-2.0, -2.0, -2.0 - z), 0.25, (16, 16, 16)), filling([(0.0, 0.0, -z)]))
    assert len(cache._before) + len(cache._now) == 2


def patches(points, normals, spacing):
    grey, extents = np.full(points.shape, 0.5), np.full(points.shape, spacing)
    areas, whole = np.full(len(points), spacing**2), np.ones(len(points))
    return Samples(points, normals, grey, areas, extents, whole)


def sheet(low, high, z, spacing=0.025):
    """Samples of both sides of a level board of 2 cm."""
    x, y = (np.arange(a + spacing / 2.0, b, spacing) for a, b in zip(low, high, strict=True))
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), np.full((len(x), len(y)), z)], axis=-1)
    above = [0.0, 0.0, 0.01]
    points = np.concatenate([points.reshape(-1, 3) + above, points.reshape(-1, 3) - above])
    up = np.repeat([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], len(points) // 2, axis=0)
    return patches(points, up, spacing)


def filled(samples, *, to_edges):
    """Full voxels of an object."""
    filling = Filling([b"thing"], [samples], [False], to_edges)
    return FilledVoxels().of(GRID, filling).number >= 0


def test_planks_and_the_gaps_between_them_are_as_wide_as_they_are():
    """They were up to two voxels wider. Gaps narrower than a voxel close as before."""
    starts = np.arange(-1.95, 1.5, 0.79)
    planks = [sheet((x, -1.95), (x + 0.225, 1.95), 0.1) for x in starts]
    samples = joined(planks)
    covered = len(planks) * 0.225 * 3.9
    assert filled(samples, to_edges=True).sum() * GRID.cell**2 == pytest.approx(covered, rel=0.1)
    assert filled(samples, to_edges=False).sum() * GRID.cell**2 > 1.5 * covered


def test_slits_of_boards_let_through_as_much_as_they_do():
    """Narrower than a voxel they were closed."""
    width, pitch, found = 0.36, 0.46, []
    for first in np.arange(-2.6, -2.6 + pitch, 0.04):
        boards = [sheet((x, -1.9), (x + width, 1.9), 0.13) for x in np.arange(first, 2.2, pitch)]
        found.append(1.0 - filled(joined(boards), to_edges=True)[2:-2, 2:-2].any(axis=2).mean())
    assert np.mean(found) == pytest.approx(1.0 - width / pitch, abs=0.03)


def test_walls_have_no_slits_however_their_samples_fall():
    """Voxels have two or three of samples a third of them wide; these are spread over them."""
    for spacing in np.arange(0.064, 0.125, 0.007):
        wall = sheet((-2.2, -2.2), (2.2, 2.2), 0.13, spacing)
        assert filled(wall, to_edges=True).any(axis=2).all()
        drawn = dataclasses.replace(wall, extents=np.full(wall.points.shape, np.inf)).some(
            np.random.default_rng(0).random(len(wall.points)) < 0.7
        )
        crossed = filled(drawn, to_edges=False)
        assert (filled(drawn, to_edges=True) | ~crossed)[1:-1, 1:-1].all()


def test_walls_and_slopes_hold():
    flat = sheet((-2.0, -2.0), (2.0, 2.0), 0.1)
    assert filled(flat, to_edges=True).any(axis=2).all()
    for turn in np.linspace(0.1, 1.5, 6):
        wide = sheet((-4.0, -2.0), (4.0, 2.0), 0.03)
        c, s = np.cos(turn), np.sin(turn)
        turned = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        points, normals = wide.points @ turned, wide.normals @ turned
        extents = wide.extents * [c, 1.0, s]
        slope = dataclasses.replace(wide, points=points, normals=normals, extents=extents)
        full, crossed = (
            filled(slope, to_edges=x).any(axis=2 if c > s else 0) for x in (True, False)
        )
        assert full[1:-1, 1:-1][crossed[1:-1, 1:-1]].all()


def block(low, high, spacing=0.025):
    """Samples of the faces of a block, which look outward."""
    low, high, parts = np.asarray(low), np.asarray(high), []
    for axis, side in itertools.product(range(3), (0, 1)):
        steps = [np.arange(a + spacing / 2.0, b, spacing) for a, b in zip(low, high, strict=True)]
        steps[axis] = np.array([(low, high)[side][axis]])
        parts.append(np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3))
    normals = np.repeat(np.kron(np.eye(3), [[-1.0], [1.0]]), [len(x) for x in parts], axis=0)
    points = np.concatenate(parts)
    return patches(points, normals, spacing)


@pytest.mark.parametrize("coverage", [0.1, 0.3, 0.7, 0.96, 1.0])
@pytest.mark.parametrize("to_edges", [False, True])
def test_of_nets_as_much_is_full_as_they_cover(coverage, to_edges):
    grid = Grid((-2.0, -2.0, -2.0), 0.0625, (64, 64, 64))
    whole = sheet((-1.9, -1.9), (1.9, 1.9), 0.03)
    net = dataclasses.replace(whole, coverage=np.full(len(whole.areas), coverage))
    full, left = (
        (FilledVoxels().of(grid, Filling([b"net"], [x], [False], to_edges)).number >= 0).sum()
        for x in (whole, net)
    )
    assert left / full == pytest.approx(1.0 if coverage > 0.95 else coverage, abs=0.02)


def joined(samples):
    return Samples(*(np.concatenate([getattr(x, name) for x in samples]) for name in NAMES))


def test_a_surface_in_which_something_thin_stands_is_whole():
    """Its samples there were taken for rims, and a reef was brighter by what came through."""
    bed = block((-1.9, -1.9, -1.9), (1.9, 1.9, 0.1))
    blades = [block((x, y, 0.05), (x + 0.4, y + 0.02, 0.5)) for x, y in np.eye(2) - 0.3]
    found = FilledVoxels().of(GRID, Filling([b"bed"], [joined([bed, *blades])], [False], True))
    below = found.number[:, :, 7] >= 0
    assert below[1:-1, 1:-1].all()


@pytest.mark.parametrize("thick", [0.35, 0.7])
def test_windows_are_about_as_large_as_they_are(thick):
    """They were up to half a voxel narrower on each side; an eighth of one is left."""
    size, found = 1.1, []
    for x, z in itertools.product(np.arange(-1.0, 0.0, 0.09), np.arange(-0.9, 0.0, 0.31)):
        y = 0.3 * x
        parts = [
            block((-2.0, y, -2.0), (x, y + thick, 2.0)),
            block((x + size, y, -2.0), (2.0, y + thick, 2.0)),
            block((x, y, -2.0), (x + size, y + thick, z)),
            block((x, y, z + size), (x + size, y + thick, 2.0)),
        ]
        free = ~filled(joined(parts), to_edges=True).any(axis=1)
        found.append(free.sum() * GRID.cell**2)
    assert np.mean(found) == pytest.approx((size - 0.25 * GRID.cell) ** 2, rel=0.08)


@pytest.mark.parametrize("thick", [0.02, 0.12])
def test_windows_in_thin_walls_let_through_what_comes_obliquely(thick):
    """A wall of a voxel's thickness kept a fifth of it off, one between two layers of them more."""
    size, random, part = 0.8, np.random.default_rng(0), []
    for z in np.arange(-0.12, 0.13, 0.06):
        low, high = z - thick / 2.0, z + thick / 2.0
        for x, y in random.uniform(-0.6, -0.2, (4, 2)):
            blocks = [
                block((-2.0, -2.0, low), (x, 2.0, high)),
                block((x + size, -2.0, low), (2.0, 2.0, high)),
                block((x, -2.0, low), (x + size, y, high)),
                block((x, y + size, low), (x + size, 2.0, high)),
            ]
            wall = joined(blocks)
            inner = (np.abs(wall.normals[:, 0]) > 0.5) & (np.abs(wall.points[:, 0]) < 1.9)
            inner &= np.abs(wall.points[:, 1] - y - size / 2.0) > size / 2.0  # not of its surface
            wall = wall.some(~inner)
            voxels = FilledVoxels().of(GRID, Filling([b"w"], [wall], [False], True))
            start = np.concatenate([random.uniform(-1.5, 1.5, (2, 4000)), [np.full(4000, -1.0)]]).T
            end = random.uniform((-1.5, -1.5, 1.0), (1.5, 1.5, 1.0), (4000, 3))
            way = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
            gets, _ = voxels.trace(start, way)
            free = np.ones(4000, bool)
            for side in (low, high):
                at = start + way * ((side - start[:, 2]) / way[:, 2])[:, None] - (x, y, 0.0)
                free &= ((at[:, :2] > 0.0) & (at[:, :2] < size)).all(axis=1)
            part.append(((start + way * gets[:, None])[:, 2] > 0.9).mean() / free.mean())
    assert np.mean(part) == pytest.approx(1.0, abs=0.08), part


def test_nothing_fills_nothing():
    assert not filled(patches(*np.zeros((2, 0, 3)), 0.1), to_edges=True).any()
