"""Voxels of surfaces, and rays through them, against geometry."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.voxels import voxelise

GRID = Grid((-3.0, -3.0, -6.0), 0.1, (60, 60, 60))


def plate(z, low=(-3.0, -3.0), high=(3.0, 3.0), step=0.04):
    """Samples of a level square."""
    x, y = np.meshgrid(*(np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True)))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


def filled(points, normal=(0.0, 0.0, 1.0), colour=(0.2, 0.3, 0.4)):
    count = (len(points), 1)
    return voxelise(GRID, points, np.tile(normal, count), np.tile(colour, count))


def rays(count, seed=0):
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def test_nothing_passes_a_thin_wall():
    voxels, w = filled(plate(-2.03)), rays(4000)
    origin = np.random.default_rng(1).uniform((-2.5, -2.5, -5.5), (2.5, 2.5, -2.5), (4000, 3))
    distance, number = voxels.trace(origin, w)
    with np.errstate(divide="ignore"):
        up = np.where(w[:, 2] > 0, (-2.03 - origin[:, 2]) / w[:, 2], np.inf)
    side = GRID.exit_distance(origin, w)
    meets = up < side - 0.3
    assert meets.sum() > 800
    assert (number[meets] >= 0).all()
    assert (number[up > side + 0.3] < 0).all()
    # Half a voxel and, where it is grazed, its slant.
    error = np.abs(distance - up)[meets] * w[meets, 2]
    assert error.max() < 0.16
    np.testing.assert_allclose(distance[up > side + 0.3], side[up > side + 0.3], rtol=1e-5)


def test_a_surface_keeps_place_normal_and_colour():
    voxels = filled(plate(-2.03))
    assert len(voxels) == 3600
    np.testing.assert_allclose(voxels.centre[:, 2], -2.03)
    np.testing.assert_allclose(voxels.normal, np.tile([0, 0, 1], (3600, 1)), atol=1e-12)
    np.testing.assert_allclose(voxels.colour, np.tile([0.2, 0.3, 0.4], (3600, 1)))


def test_water_inside_a_solid_is_not_reached():
    top, bottom = (plate(z, (-1.0, -1.0), (1.0, 1.0)) for z in (-2.05, -4.05))
    side = plate(-1.0, (-1.0, -1.0), (1.0, 1.0))
    walls = [
        np.stack(np.roll([side[:, 0], side[:, 1], np.full(len(side), s)], k, 0), 1) - [0, 0, 3.05]
        for k in (1, 2)
        for s in (-0.97, 0.97)
    ]
    voxels = filled(np.concatenate([top, bottom, *walls]))
    reached = voxels.reachable([])
    index = np.unravel_index(GRID.index([(0.0, 0.0, -3.0), (0.0, 0.0, -5.0)]), GRID.shape)
    assert reached[index].tolist() == [False, True]
    assert voxels.reachable([(0.0, 0.0, -3.0)])[index].tolist() == [True, True]


def test_water_under_a_plate_is_found():
    low, high = filled(plate(-2.05, (-1.0, -1.0), (1.0, 1.0))).under_objects([])
    np.testing.assert_allclose(low, (-1.0, -1.0, -6.0), atol=1e-9)
    np.testing.assert_allclose(high, (1.0, 1.0, -2.1), atol=1e-9)
    low, high = filled(plate(-5.99)).under_objects([])
    assert not (high > low).all()


@pytest.mark.parametrize("cell", [0.0, -1.0, np.nan, np.inf])
def test_a_grid_must_have_cells(cell):
    with pytest.raises(InputError, match="grid: cells of"):
        Grid((0.0, 0.0, 0.0), cell, (1, 1, 1))


def test_a_grid_fills_its_box():
    grid = Grid.around((0.0, 0.0, -20.0), (30.0, 8.0, -18.0), 2000, 0.1)
    assert grid.count <= 2000
    assert (np.asarray(grid.lower) <= (0.0, 0.0, -20.0)).all()
    assert (grid.upper >= (30.0, 8.0, -18.0)).all()
    np.testing.assert_array_equal(grid.index(grid.centres()), np.arange(grid.count))


def test_there_is_no_water_under_a_seabed_that_ends():
    """A seabed is a sheet with an edge; round that one would get below it."""
    sheet = plate(-5.03, (-3.0, -3.0), (2.0, 3.0))
    shelf = plate(-3.03, (-1.0, -1.0), (1.0, 1.0))
    voxels = filled(np.concatenate([sheet, shelf]))
    low, _ = voxels.under_objects(np.zeros((0, 3)))
    assert low[2] == pytest.approx(-6.0), "without ground there is water under it"
    grounded = dataclasses.replace(voxels, ground_below=-4.0)
    assert not grounded.equals(voxels)
    low, high = grounded.under_objects(np.zeros((0, 3)))
    np.testing.assert_allclose(low, [-1.0, -1.0, -5.0], atol=0.11)
    np.testing.assert_allclose(high, [1.0, 1.0, -3.1], atol=0.11)
    reached = grounded.reachable(np.zeros((0, 3)))
    assert reached[GRID.shape[0] // 2, GRID.shape[1] // 2, 20], "there is water under the shelf"
    assert reached[-2, 30, 2], "there is water beside the sheet"
