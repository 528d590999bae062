"""Voxels that are filled again where things have changed are those that are filled at once."""

from __future__ import annotations

import numpy as np
from underwater_spectral.uw_spectral.shade.filled_voxels import FilledVoxels, Filling, Samples
from underwater_spectral.uw_spectral.shade.grid import Grid

GRID = Grid((-2.0, -2.0, -2.0), 0.25, (16, 16, 16))


def thing(seed, at):
    random = np.random.default_rng(seed)
    normals = random.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Some lie on the border of two voxels, and some beside the box.
    points = np.round((np.asarray(at) + 0.7 * normals) / 0.125, 1) * 0.125
    return Samples(points, normals, random.random((300, 3)), np.full(300, 0.02))


def filling(places):
    keys = [f"{number} {at}".encode() for number, at in enumerate(places)]
    samples = [thing(number, at) for number, at in enumerate(places)]
    return Filling(keys, samples, [number % 3 == 0 for number in range(len(places))])


def test_what_moves_comes_or_goes_leaves_the_voxels_as_if_filled_at_once():
    kept, random = FilledVoxels(), np.random.default_rng(0)
    places = [tuple(random.uniform(-1.5, 1.5, 3)) for _ in range(7)]
    for frame in range(8):
        places[frame % 6] = tuple(random.uniform(-2.0, 2.0, 3))
        if frame == 5:
            places.pop()
        kept.next_frame()
        found = kept.of(GRID, filling(places))
        assert found.equals(FilledVoxels().of(GRID, filling(places)))
        assert 300 < len(found) < GRID.count


def test_no_more_is_kept_than_of_the_last_frame():
    kept = FilledVoxels()
    for z in range(40):
        kept.next_frame()
        kept.of(Grid((-2.0, -2.0, -2.0 - z), 0.25, (16, 16, 16)), filling([(0.0, 0.0, -z)]))
    assert len(kept._before) + len(kept._now) == 2
