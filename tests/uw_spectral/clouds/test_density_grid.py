"""Clouds with grids: columns against integrals, and their light against that of blobs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.cloud_light import Clouds, Several
from underwater_spectral.uw_spectral.clouds.cloud_numbers import CloudNumbers
from underwater_spectral.uw_spectral.clouds.density_grid import (
    BLOCK,
    STEPS,
    WAYS,
    DensityGrid,
    Grid,
    escape_column,
    node_counts,
)
from underwater_spectral.uw_spectral.clouds.gaussian_blob import FAR, GaussianBlob
from underwater_spectral.uw_spectral.clouds.matter import blunt_phase, suspended_matter
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.transfer.sun_beam import half_angle2

SUN = np.array([0.373, 0.2, -0.928])
SUN /= np.linalg.norm(SUN)
BLOB = GaussianBlob.of_axes((0.0, 3.0, -5.0), np.diag([1.0, 0.8, 1.2]) @ np.eye(3))
TURNED = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


def _of_blob(blob=BLOB, count=48, reach=1.75):
    """Nodes in a turned box that hold the density of a blob."""
    axes = TURNED * (2.0 * reach / (count - 1))
    corner = np.asarray(blob.middle) - axes @ np.full(3, (count - 1) / 2.0)
    empty = DensityGrid(np.zeros((count,) * 3), corner, axes)
    density = np.asarray(blob.density(list(np.moveaxis(empty.places(), -1, 0))))
    for axis in range(3):
        np.moveaxis(density, axis, 0)[[0, -1]] = 0.0
    return dataclasses.replace(empty, density=density)


def _rough(count=32):
    """Nodes of noise that differs within a few of them, in a box of 2 m."""
    density = np.random.default_rng(3).random((count,) * 3)
    for axis in range(3):
        density = (np.roll(density, 1, axis) + density + np.roll(density, -1, axis)) / 3.0
    density = np.maximum(density - 0.45, 0.0) * 8.0
    for axis in range(3):
        np.moveaxis(density, axis, 0)[[0, -1]] = 0.0
    step = 2.0 / (count - 1)
    return DensityGrid(density, np.array([-1.0, 2.0, -6.0]), TURNED * step)


def _numbers(concentration, *, albedo=None, sun=1.0, spread=0.4, ambient=0.6):
    matter = suspended_matter("minerals", concentration, [450.0, 550.0, 650.0])
    blunt, one = blunt_phase(matter.phase), np.ones(3)
    a, b = matter.absorption, matter.scattering
    if albedo is not None:
        a, b = (1.0 - albedo) * (a + b), albedo * (a + b)
    wide, turned = b * (1.0 - blunt.peak), b * (1.0 - matter.phase.g)
    cloud = CloudNumbers(
        BLOB.middle, BLOB.rows, a + b, a + wide, wide / (a + wide),
        sun * one, spread * one, ambient * one, 0.1 * one, 0.1 * one, 0.1 * one, 0.01 * one,
        a + turned, turned / (a + turned), 3.0, blunt.asymmetry, blunt.ceiling, blunt.peak,
    )  # fmt: skip
    return cloud, matter


def _rays(count=80, y=0.0):
    rng = np.random.default_rng(1)
    w = np.array([rng.normal(size=count) * 0.12, np.ones(count), rng.normal(size=count) * 0.12])
    w /= np.linalg.norm(w, axis=0)
    return [np.full((count, 1), x) for x in (0.0, y, -5.0)], [x[:, None] for x in w]


def _veil(clouds, phase, P=FAR, y=0.0):
    origin, w = _rays(y=y)
    found = Clouds(Several(clouds), [phase], tuple(SUN))
    return found.veil(origin, w, np.full((len(w[0]), 1), P), half_angle2(w, list(SUN)))


def _trilinear(grid, places):
    """Density of a grid at places, shape (n, 3), without its own look-up."""
    u = (places - grid.corner) @ np.linalg.inv(grid.axes).T
    total = np.zeros(len(u))
    for corner in np.ndindex(2, 2, 2):
        node = np.floor(u).astype(int) + corner
        weight = np.prod(1.0 - np.abs(u - node), axis=1)
        inside = np.all((node >= 0) & (node < grid.density.shape), axis=1)
        held = np.clip(node, 0, np.array(grid.density.shape) - 1)
        total += np.where(inside, weight * grid.density[tuple(held.T)], 0.0)
    return total


def test_transmittance_is_that_of_an_integral_of_the_density():
    rough, (origin, w) = _rough(), _rays()
    cloud, matter = _numbers(2.0)
    cloud = dataclasses.replace(cloud, grid=rough.lit(SUN, 1.0))
    found, off = _veil([cloud], matter.phase), []
    s = (np.arange(4000) + 0.5) / 4000 * 6.0
    for ray in range(len(w[0])):
        places = [float(x[ray, 0]) + float(d[ray, 0]) * s for x, d in zip(origin, w, strict=True)]
        column = _trilinear(rough, np.stack(places, axis=-1)).sum() * 6.0 / 4000
        if column > 0.1:
            wanted = np.exp(-cloud.extinction * column)
            off.append(np.abs(found.unscattered[ray] / wanted - 1.0).max())
    assert len(off) > 30
    assert np.quantile(off, 0.95) < 0.02
    assert np.max(off) < 0.03


def test_columns_towards_the_sun_are_integrals_inside_the_box_and_outside():
    rough = _rough()
    grid = rough.lit(SUN, 1.0)
    rng = np.random.default_rng(2)
    middle = rough.corner + rough.axes @ np.full(3, 15.5)
    anywhere = middle + rng.uniform(-2.2, 2.2, (100, 3))
    at_nodes = rough.corner + rng.integers(1, 31, (100, 3)) @ rough.axes.T
    s = (np.arange(3000) + 0.5) / 3000 * 8.0
    # The mean error, of columns up to 1.2 m.
    for places, bound in ((anywhere, 0.015), (at_nodes, 0.006)):
        found = grid.towards_sun(list(places.T[..., None]), list(-SUN))[:, 0]
        wanted = [_trilinear(rough, x - SUN * s[:, None]).sum() * 8.0 / 3000 for x in places]
        assert np.sqrt(np.mean((found - wanted) ** 2)) < bound
        assert np.sqrt(np.mean(np.square(wanted))) > 10.0 * bound


def test_ways_out_are_those_of_a_blob():
    axes = np.eye(3) * (3.5 / 47)
    corner = np.asarray(BLOB.middle) - 1.75
    places = list(np.moveaxis(DensityGrid(np.zeros((48,) * 3), corner, axes).places(), -1, 0))
    grid = DensityGrid(np.asarray(BLOB.density(places)), corner, axes)
    for way, found in zip(WAYS, grid.outwards, strict=True):
        wanted = BLOB.along(places, list(way)).column(FAR)
        np.testing.assert_allclose(found, wanted, atol=0.03)
        # The thinnest side is .4 m from middle to a standard deviation.
        assert found.max() > 0.9


@pytest.mark.slow
def test_what_escapes_is_a_mean_over_all_sides():
    density = np.zeros((21, 21, 21))
    density[5:16, 5:16, 5:16] = 1.0
    grid = DensityGrid(density, np.full(3, -1.0), np.eye(3) * 0.1)
    transmittance = np.exp(-3.0 * escape_column(grid.outwards, 3.0))
    directions = np.random.default_rng(4).normal(size=(1500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    s = (np.arange(150) + 0.5) / 150 * 1.8
    # Below a face, an edge and a corner, where a cloud is bright, and deeper.
    for node in ((6, 10, 10), (6, 6, 10), (6, 6, 6), (8, 8, 8)):
        place = grid.places()[node]
        columns = [_trilinear(grid, place + d * s[:, None]).sum() * 1.8 / 150 for d in directions]
        assert transmittance[node] == pytest.approx(
            np.mean(np.exp(-3.0 * np.array(columns))), rel=0.08
        )


def test_the_blob_that_is_most_like_it_is_its_own():
    blob = _of_blob().blob()
    assert blob.middle == pytest.approx(BLOB.middle, abs=1e-3)
    assert blob.size == pytest.approx(BLOB.size, rel=0.02)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("concentration", [2.0, 8.0])
@pytest.mark.parametrize(
    ("y", "P"), [(0.0, 3.2), (0.0, FAR), (2.8, FAR)], ids=["end in it", "past it", "from within"]
)
def test_a_grid_of_a_blob_shines_as_the_blob_does(concentration, y, P):
    cloud, matter = _numbers(concentration)
    gridded = dataclasses.replace(cloud, grid=_of_blob().lit(SUN, float(cloud.transport.mean())))
    one, other = _veil([cloud], matter.phase, P, y), _veil([gridded], matter.phase, P, y)
    assert other.light == pytest.approx(one.light, rel=0.02)
    assert other.passed == pytest.approx(one.passed, abs=0.004)


def test_a_blob_in_its_grid_is_one_cloud_twice_as_dense():
    cloud, matter = _numbers(6.0)
    gridded = dataclasses.replace(cloud, grid=_of_blob().lit(SUN, float(cloud.transport.mean())))
    two = _veil([cloud, cloud], matter.phase)
    for found in ([cloud, gridded], [gridded, dataclasses.replace(gridded)]):
        mixed = _veil(found, matter.phase)
        assert mixed.passed == pytest.approx(two.passed, abs=0.005)
        assert mixed.light == pytest.approx(two.light, rel=0.02)


def test_a_grid_that_absorbs_nothing_is_invisible_in_even_light():
    cloud, matter = _numbers(20.0, albedo=1.0, sun=0.0, spread=0.0, ambient=4.0 * np.pi)
    cloud = dataclasses.replace(cloud, water=np.zeros(3), ambient_decay=np.zeros(3))
    cloud = dataclasses.replace(cloud, grid=_rough().lit(SUN, float(cloud.transport.mean())))
    veil = _veil([cloud], matter.phase)
    assert veil.passed + veil.light == pytest.approx(np.ones_like(veil.light), abs=2e-3)


def test_objects_below_are_occluded_by_the_column_towards_the_sun():
    cloud, matter = _numbers(8.0)
    gridded = dataclasses.replace(cloud, grid=_of_blob().lit(SUN, 1.0))
    below = list(np.asarray(BLOB.middle) + 3.0 * SUN)
    one, other = (
        Clouds(Several([x]), [matter.phase], tuple(SUN)).sunlight_transmittance(below)
        for x in (cloud, gridded)
    )
    assert np.max(one) < 0.7
    assert other == pytest.approx(one, rel=0.015)


def test_nothing_of_a_grid_is_above_the_water():
    axes = np.eye(3) * 0.5
    grid = DensityGrid(np.ones((5, 5, 5)), np.array([0.0, 0.0, -1.25]), axes).wet()
    assert grid.density[..., :3].min() == 1.0
    assert grid.density[..., 3:].max() == 0.0


@pytest.mark.parametrize("size", [(1, 1, 1), (4, 1, 1), (10, 10, 1), (0.3, 9, 2), (1, 1, 40)])
def test_nodes_have_room_in_a_block(size):
    nx, ny, nz = node_counts(size)
    across = BLOCK[0] // nx
    assert -(-nz // across) * ny <= BLOCK[1]
    assert max(nx, ny, nz) >= 50
    # A ray meets no more nodes than twice its steps, but for margins.
    assert max(nx, ny, nz) <= 2 * STEPS


def test_a_grid_that_moves_keeps_its_ways_out():
    one = _rough()
    elsewhere = dataclasses.replace(one, corner=one.corner + 1.0)
    assert dataclasses.replace(one).or_known(one) is one
    assert elsewhere.or_known(one) is elsewhere
    assert elsewhere.outwards is one.outwards
    turned = dataclasses.replace(one, axes=one.axes @ TURNED)
    assert turned.or_known(one).outwards is not one.outwards


def test_flat_objects_are_named():
    with pytest.raises(InputError, match="flat"):
        node_counts((1.0, 0.0, 1.0))
    with pytest.raises(InputError, match="flat"):
        DensityGrid(np.zeros((4, 4, 4)), np.zeros(3), np.zeros((3, 3))).lit(SUN, 1.0)


def test_a_line_meets_a_box_where_it_does():
    grid = Grid((0.0, 0.0, 0.0), tuple(np.eye(3).ravel()), (3, 3, 3), None)
    entry, end = grid.crossing((-2.0, 1.0, 1.0), (1.0, 0.0, 0.0))
    assert (entry, end) == (2.0, 4.0)
    entry, end = grid.crossing((-2.0, 5.0, 1.0), (1.0, 0.0, 0.0))
    assert entry > end
