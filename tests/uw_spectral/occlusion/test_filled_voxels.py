"""Voxels that are filled again where objects have changed are those that are filled at once."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.occlusion.filled_voxels import FilledVoxels, Filling, Samples
from underwater_spectral.uw_spectral.occlusion.grid import Grid

GRID = Grid((-2.0, -2.0, -2.0), 0.25, (16, 16, 16))


def surface(seed, at):
    random = np.random.default_rng(seed)
    normals = random.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Some lie on the border of two voxels, and some beside the box.
    points = np.round((np.asarray(at) + 0.7 * normals) / 0.125, 1) * 0.125
    return Samples(points, normals, random.random((300, 3)), np.full(300, 0.02))


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
        assert 300 < len(found) < GRID.count


def test_no_more_is_kept_than_of_the_last_frame():
    cache = FilledVoxels()
    for z in range(40):
        cache.next_frame()
        cache.of(Grid((-2.0, -2.0, -2.0 - z), 0.25, (16, 16, 16)), filling([(0.0, 0.0, -z)]))
    assert len(cache._before) + len(cache._now) == 2


def sheet(low, high, z, spacing=0.025):
    """Samples of both sides of a level rectangle."""
    x, y = (np.arange(a + spacing / 2.0, b, spacing) for a, b in zip(low, high, strict=True))
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), np.full((len(x), len(y)), z)], axis=-1)
    points = np.tile(points.reshape(-1, 3), (2, 1))
    up = np.repeat([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], len(points) // 2, axis=0)
    return Samples(points, up, np.full(points.shape, 0.5), np.full(len(points), spacing**2))


def filled(samples, *, to_edges):
    """Full voxels of an object."""
    filling = Filling([b"thing"], [samples], [False], to_edges)
    return FilledVoxels().of(GRID, filling).number >= 0


def test_planks_and_the_gaps_between_them_are_as_wide_as_they_are():
    """They were up to two voxels wider. Gaps narrower than a voxel close as before."""
    starts = np.arange(-1.95, 1.5, 0.79)
    planks = [sheet((x, -1.95), (x + 0.225, 1.95), 0.1) for x in starts]
    samples = Samples(*(np.concatenate([getattr(p, n) for p in planks])
                        for n in ("points", "normals", "colours", "areas")))  # fmt: skip
    covered = len(planks) * 0.225 * 3.9
    assert filled(samples, to_edges=True).sum() * GRID.cell**2 == pytest.approx(covered, rel=0.1)
    assert filled(samples, to_edges=False).sum() * GRID.cell**2 > 1.5 * covered


def test_walls_and_slopes_hold():
    flat = sheet((-2.0, -2.0), (2.0, 2.0), 0.1)
    assert filled(flat, to_edges=True).any(axis=2).all()
    for turn in np.linspace(0.1, 1.5, 6):
        wide = sheet((-4.0, -2.0), (4.0, 2.0), 0.03)
        c, s = np.cos(turn), np.sin(turn)
        turned = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        slope = Samples(wide.points @ turned, wide.normals @ turned, wide.colours, wide.areas)
        assert np.array_equal(filled(slope, to_edges=True), filled(slope, to_edges=False))
