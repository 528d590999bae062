"""Water that objects beside it wall in: which is, by how many directions are closed to it."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.voxels import SurfaceVoxels
from underwater_spectral.uw_spectral.occlusion.walls import RAYS, hidden_rays

GRID = Grid((-10.0, -10.0, -9.0), 0.5, (40, 40, 18))
NOBODY = np.zeros((0, 3))


def _blocks(*boxes):
    """Voxels on sand, with the skins of closed blocks in them, as two corners of voxels each."""
    full = np.zeros(GRID.shape, bool)
    full[:, :, 0] = True
    for (x0, y0, z0), (x1, y1, z1) in boxes:
        full[x0:x1, y0:y1, z0:z1] = True
        full[x0 + 1 : x1 - 1, y0 + 1 : y1 - 1, z0 + 1 : z1 - 1] = False
    number = np.where(full, np.cumsum(full).reshape(full.shape) - 1, -1).astype(np.int32)
    count = int(full.sum())
    sides, colour, extent = (
        np.zeros((count, 2, 3)),
        np.zeros((count, 3)),
        np.full((count, 2), np.inf),
    )
    return SurfaceVoxels(GRID, number, sides, sides, colour, extent, ground_below=-2.0)


def _marched(full, at):
    """Directions that are closed to a voxel, by walking along each."""
    closed = 0
    for x, y, z in ((2, 0, 1), (1, 0, 1), (1, 0, 2), (2, 2, 1), (1, 1, 1), (1, 1, 2)):
        for u, v in ((x, y), (-y, x), (-x, -y), (y, -x)):
            step = np.array((u, v, z))
            halves = np.trunc(step / 2).astype(int)
            ends = [at + k * step for k in range(1, 40)]
            ends = [p for p in ends if (p >= 0).all() and (p < full.shape).all()]
            closed += any(full[tuple(p)] or full[tuple(p - halves)] for p in ends)
    return closed


def test_all_voxels_at_once_find_what_a_walk_from_each_does():
    random = np.random.default_rng(3)
    full = random.random((23, 17, 12)) < 0.01
    found = hidden_rays(full)
    for at in random.integers(0, full.shape, (200, 3)):
        assert found[tuple(at)] == _marched(full, at)
    assert 0 < np.median(found) < RAYS


def test_a_canyon_is_walled_and_what_is_open_beside_it_is_not():
    walls = [((16, 8, 0), (18, 32, 14)), ((22, 8, 0), (24, 32, 14))]
    low, high = _blocks(*walls).between_objects(NOBODY)
    # So is what is beside its walls of 6.5 m, no farther off than they are high.
    np.testing.assert_allclose([low[0], high[0]], [-7.0, 7.0], atol=0.5)
    np.testing.assert_allclose([low[1], high[1]], [-8.5, 8.5], atol=0.5)
    assert -9.0 <= low[2] <= -8.5
    assert -3.5 <= high[2] <= -2.0, "not above its walls"
    assert not np.greater(*reversed(_blocks(*walls).under_objects(NOBODY))).all(), "no roof"


def test_the_foot_of_a_cliff_is_walled_but_not_what_is_far_from_it():
    low, high = _blocks(((30, 0, 0), (40, 40, 17))).between_objects(NOBODY)
    # As far off as it is high, but for the 1.5 m that such water is deep.
    assert 5.0 - low[0] == pytest.approx(8.0 - 1.5, abs=0.5)
    assert high[0] == 5.0


@pytest.mark.parametrize(
    "block",
    [((19, 19, 0), (22, 22, 3)), ((19, 19, 0), (23, 23, 4)), ((20, 20, 0), (21, 21, 17))],
    ids=["1 m", "1.5 m", "pole"],
)
def test_about_small_and_thin_objects_nothing_is_walled(block):
    low, high = _blocks(block).between_objects(NOBODY)
    assert not (high > low).all()
