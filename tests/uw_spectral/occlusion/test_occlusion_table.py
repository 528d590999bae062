"""The table of occlusion, inside its box and beyond it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.occlusion_table import (
    IRRADIANCE,
    SCATTERED,
    occlusion_table,
)
from underwater_spectral.uw_spectral.occlusion.probe_irradiance import ProbeIrradiance
from underwater_spectral.uw_spectral.occlusion.view_directions import NORMALS, around
from underwater_spectral.uw_spectral.transfer.channel_tables import ON_PATH

GRID = Grid((-3.0, -3.0, -8.0), 0.5, (12, 12, 8))
WAYS = ((0.0, 0.0, 1.0), (0.6, 0.0, -0.8), (-0.48, 0.64, 0.6))


def _table(ratio, sunlit, *, beyond, valid=None):
    """Occlusion of a ratio per cell, the same in all bands and ways."""
    ratios = np.broadcast_to(np.asarray(ratio)[..., None, None], (GRID.count, len(NORMALS), 3))
    return occlusion_table(
        _light(ratios, valid, sunlit, 0.8), np.full(3, 0.2), np.ones(3), beyond=beyond
    )


def _light(ratios, valid=None, sunlit=1.0, slope=0.0):
    """The same on patches and on paths."""
    valid = np.ones(GRID.count, bool) if valid is None else valid
    sun = np.full(GRID.count, sunlit)
    return ProbeIrradiance(GRID, valid, ratios, ratios, sun, np.zeros(3), slope)


def _read(table, first, x, w):
    return table.mixed(first, np.array([[x, 0.1, -5.0]]), np.array([w]))[0]


@pytest.mark.parametrize("w", WAYS)
@pytest.mark.parametrize("first", [IRRADIANCE, SCATTERED])
def test_occlusion_ends_beyond_a_box_with_nothing_around(first, w):
    table = _table(0.2, 0.4, beyond=0.0)
    for x in (0.0, 2.6, -2.7):
        np.testing.assert_allclose(_read(table, first, x, w)[0], 0.2, rtol=1e-6)
    # Two cells from the middle of the last it is half of the way.
    np.testing.assert_allclose(_read(table, first, 3.75, w)[0], 0.6, rtol=1e-6)
    np.testing.assert_allclose(_read(table, first, -3.75, w)[0], 0.6, rtol=1e-6)
    far = [_read(table, first, x, w) for x in (10.0, 30.0, 1e4)]
    assert np.diff([numbers[0] for numbers in far]).min() > 0
    assert far[1][0] > 0.96
    np.testing.assert_allclose(far[2][0], 1.0, atol=1e-3)
    assert _read(table, first, 0.0, w)[3] == pytest.approx(0.4)
    assert far[2][3] == pytest.approx(1.0, abs=1e-3)


def test_one_odd_cell_at_the_side_draws_no_stripe_into_the_distance():
    ratio = np.ones(GRID.shape)
    ratio[6, -1] = 0.2
    for beyond in (0.0, 1e9):
        table = _table(ratio.ravel(), 1.0, beyond=beyond)
        places = np.array([(x, 25.0, -5.0) for x in np.arange(-2.0, 2.0, 0.1)])
        found = table.mixed(SCATTERED, places, np.tile([0.0, 1.0, 0.0], (len(places), 1)))[:, 0]
        assert np.ptp(found) < 0.04


def test_where_objects_go_on_occlusion_does():
    ratio = np.where(np.arange(GRID.count) % GRID.shape[2] < 3, 7.0, 0.3)
    # The lowest cells are in the ground.
    table = _table(ratio, 0.1, beyond=1e9, valid=ratio < 1)
    far = _read(table, SCATTERED, 1e5, WAYS[2])
    np.testing.assert_allclose(far, [0.3, 0.0, 0.0, 0.1], atol=1e-3)


def test_what_reaches_out_of_the_top_has_the_light_beyond_on_its_own_top():
    ratio = np.ones(GRID.shape)
    ratio[4:8, 4:8] = 0.0
    table = _table(ratio.ravel(), 1.0, beyond=0.0, valid=ratio.ravel() > 0)
    on_top = table.mixed(IRRADIANCE, np.array([[0.1, 0.1, -3.6]]), np.array([[0.0, 0.0, 1.0]]))[0]
    np.testing.assert_allclose(on_top, [1.0, 0.0, 0.0, 1.0], atol=1e-6)
    # Deeper within the grid it stays dark.
    assert table.mixed(IRRADIANCE, np.array([[0.1, 0.1, -5.0]]), np.array([WAYS[0]]))[0, 0] < 1e-6


def test_far_off_there_is_as_much_of_it_as_lies_in_its_way():
    """Beyond a box that is cut off a floe of 20 m it was as dark as under that without an end."""
    far = np.array([[1e6, 0.0, -5.0]])
    for beyond, wanted in ((0.0, 1.0), (5.0, 1.0 - 0.8 * (1.0 - np.exp(-1.0))), (1e9, 0.2)):
        table = _table(np.full(GRID.count, 0.2), 1.0, beyond=beyond)
        found = table.mixed(SCATTERED, far, np.array([WAYS[0]]))[0, 0]
        np.testing.assert_allclose(found, wanted, rtol=1e-4)


def test_light_keeps_its_spectrum():
    """In a room what comes in, and what is thrown back, have other colours."""
    ratios = np.random.default_rng(5).uniform(0.0, 1.0, (GRID.count, 1, 3))
    ratios = np.tile(ratios, (1, len(NORMALS), 1))
    table = occlusion_table(_light(ratios), np.full(3, 0.2), np.array([3.0, 2.0, 0.2]))
    parts = (IRRADIANCE, table.spectra[:ON_PATH]), (SCATTERED, table.spectra[ON_PATH:])
    for place, (kind, spectra) in itertools.product((7, 500, 1000), parts):
        read = table.mixed(kind, GRID.centres()[place : place + 1], np.array([WAYS[0]]))[0]
        np.testing.assert_allclose(read[0] + read[1:3] @ spectra, ratios[place, 0], atol=1e-5)


def test_level_views_have_the_light_of_level_directions():
    """In two quarters of four they were mixed from above and below, which are 35° off."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    found = around([np.cos(azimuth), np.sin(azimuth), np.zeros(len(azimuth))])
    level = [part * (np.abs(NORMALS[tile.astype(int), 2]) < 1e-9) for tile, part in found]
    np.testing.assert_allclose(np.sum(level, axis=0), 1.0, atol=1e-9)


@pytest.mark.parametrize("lamp", [(1.0, 0.0, 0.0), (0.0, 0.8, 0.6), (-0.6, 0.48, 0.64)])
def test_walls_of_all_slopes_have_the_light_that_falls_on_them(lamp):
    """Six patches, mixed, gave a wall that faces a lamp obliquely 70 %; .15 rms, .13 too little."""
    E = np.maximum(NORMALS @ lamp, 0.0)
    ratios = np.tile(E[None, :, None], (GRID.count, 1, 3))
    table = occlusion_table(_light(ratios), np.full(3, 0.2), np.ones(3))
    walls = np.random.default_rng(4).normal(size=(500, 3))
    walls /= np.linalg.norm(walls, axis=1, keepdims=True)
    found = table.mixed(IRRADIANCE, np.tile([0.1, 0.1, -5.0], (len(walls), 1)), walls)[:, 0]
    facing = walls @ lamp
    off = found - np.maximum(facing, 0.0)
    assert np.sqrt((off**2).mean()) < 0.08
    assert abs(off[facing > 0.3].mean()) < 0.06
