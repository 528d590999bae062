"""Light among objects, against the water's own solution and against geometry."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from underwater_spectral.uw_spectral.imaging.description import Description
from underwater_spectral.uw_spectral.imaging.optics import resolve
from underwater_spectral.uw_spectral.occlusion import probes
from underwater_spectral.uw_spectral.occlusion.fitted_cells import NUMBERS, FittedCells
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.occlusion_table import OFF_SURFACE, occlusion_table
from underwater_spectral.uw_spectral.occlusion.probe_solution import probe_irradiance
from underwater_spectral.uw_spectral.occlusion.probes import (
    RAYS,
    SETS,
    cast,
    directions,
    set_of,
    spiral,
)
from underwater_spectral.uw_spectral.occlusion.unoccluded_field import (
    UnoccludedField,
    depths_of,
)
from underwater_spectral.uw_spectral.occlusion.view_directions import AXES, NORMALS
from underwater_spectral.uw_spectral.occlusion.voxels import voxelise
from underwater_spectral.uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS
from underwater_spectral.validation.occluded_paths import BoxScene, OccludedPaths

UP, DOWN = AXES[4:]
SEABED = -6.0
MIDDLE = np.array([0.0, 0.0, -3.5])


@functools.cache
def field(floor=math.inf, reflectance=0.4, water="jerlov:IB", surface="flat", amount=1.0):
    import dataclasses

    from underwater_spectral.uw_spectral.imaging.description import (
        BandsDescription,
        FloorDescription,
        SunAndSky,
        SurfaceDescription,
        WaterDescription,
    )

    described = dataclasses.replace(
        Description(),
        water=WaterDescription(water, absorption_factor=amount, scattering_factor=amount),
        light=SunAndSky(sky="clear"),
        surface=SurfaceDescription(surface),
        floor=FloorDescription(floor, str(reflectance)),
        bands=BandsDescription(3),
    )
    return resolve(described).solved_field()


def plate(z, half, step=0.06):
    x, y = np.meshgrid(*[np.arange(-half + step / 2, half, step)] * 2)
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


def light_around(points, solved, reflectance, half=4.0, probes=1500):
    grid = Grid.around((-half, -half, -6.6), (half, half, -1.0), probes, 0.2)
    fine = Grid(grid.lower, grid.cell / 3, tuple(3 * n for n in grid.shape))
    count = (len(points), 1)
    voxels = voxelise(fine, points, np.tile([0.0, 0.0, 1.0], count), np.full((len(points), 3), 0.5))
    rays = cast(voxels, grid, -np.asarray(solved.sun))
    return grid, rays, probe_irradiance(solved, rays, np.full((len(voxels), 3), reflectance))


def test_nothing_disturbs_nothing():
    _, rays, light = light_around(np.zeros((0, 3)), field(), 0.3)
    assert rays.valid.all()
    np.testing.assert_allclose(light.irradiance, 1.0, atol=2e-3)
    off = np.abs(light.scattered - 1.0)
    assert np.quantile(off, 0.99) < 2e-3
    assert off.max() < 6e-3, "some view directions get next to no light"
    assert (light.sunlit == 1).all()


@pytest.mark.slow
def test_a_seabed_of_voxels_is_the_floor_of_the_column():
    """What it sends up and the water scatters back, by the solver without any voxel.

    Without a surface, which would mirror it. Cells of 0.7 m lose up to 8 % of what the water
    scatters.
    """
    water = {"water": "jerlov:II", "surface": "none"}
    bare, over = field(**water), field(-SEABED, **water)
    grid, _, light = light_around(plate(SEABED, 16.0, 0.2), bare, 0.4, 14.0, 14000)
    middle = np.abs(grid.centres()[:, :2]).max(axis=1) < 1.5
    z = grid.centres()[:, 2]
    for level in (-5.6, -4.9):
        at = middle & (np.abs(z - level) < grid.cell / 2)
        ratio = np.median(light.irradiance[at], axis=0)
        y = -float(np.median(z[at]))
        # In red the water itself sends up next to nothing that could be compared with.
        off = (ratio[DOWN] / (over.Eu(y) / bare.Eu(y)))[:2]
        assert off.min() > 0.91
        assert off.max() < 1.02


def test_the_surface_mirrors_what_a_seabed_sends_up():
    """As by the solver without any voxel; light from above was a tenth of that in a white pool.

    In green light comes from beyond the 14 m that there are.
    """
    bare, over = field(amount=2.0), field(1.5, 0.8, amount=2.0)
    grid = Grid((-7.0, -7.0, -2.0), 0.5, (28, 28, 4))
    fine, points = Grid(grid.lower, grid.cell / 3, (84, 84, 12)), plate(-1.5, 7.0)
    count = (len(points), 1)
    voxels = voxelise(fine, points, np.tile([0.0, 0.0, 1.0], count), np.full((len(points), 3), 0.5))
    rays = cast(voxels, grid, -np.asarray(bare.sun))
    light = probe_irradiance(bare, rays, np.full((len(voxels), 3), 0.8))
    unoccluded = [UnoccludedField(one, depths_of(one, grid)) for one in (over, bare)]
    x, y, z = np.abs(grid.centres().T)
    for depth in (0.25, 0.75, 1.25):
        at = (np.maximum(x, y) < 1.5) & (np.abs(z - depth) < 0.1)
        wanted, without = (one.irradiance(np.array([depth]))[0] for one in unoccluded)
        off = (np.median(light.irradiance[at], axis=0) * without / wanted)[[UP, DOWN]]
        np.testing.assert_allclose(off[:, 2], 1.0, atol=0.05)
        np.testing.assert_allclose(off[:, 1], 0.94, atol=0.08)


def test_over_the_floor_of_the_column_a_seabed_changes_nothing():
    grid, _, light = light_around(plate(SEABED, 5.0), field(-SEABED), 0.4)
    above = grid.centres()[:, 2] > SEABED + 1.5 * grid.cell
    for ratio in (light.irradiance[above], light.scattered[above]):
        assert np.abs(np.median(ratio, axis=0) - 1.0).max() < 0.06
        assert np.quantile(np.abs(ratio - 1.0), 0.95) < 0.12


def test_a_black_plate_leaves_the_light_that_paths_find():
    """Beneath it, at three levels, in water that hardly scatters: the mean over the probes."""
    solved, (height, half) = field(water="jerlov:I"), (-2.0, 2.0)
    grid, rays, light = light_around(plate(height, half), solved, 0.0)
    cell = rays.voxels.grid.cell
    half = np.abs(rays.voxels.centre[:, :2]).max() + cell / 2
    middle = rays.voxels.centre[0, 2]
    scene = BoxScene((-half, -half, middle - cell / 2), (half, half, middle + cell / 2))
    levels = np.unique(grid.centres()[:, 2])
    for level in levels[np.argsort(np.abs(levels + 3.5))[:3]]:
        near = np.abs(rays.point[:, :2]).max(axis=1) < 2.5
        at = np.flatnonzero((rays.point[:, 2] == level) & near)
        for band in range(3):
            below, free = (
                OccludedPaths(solved, band, scene, empty=empty).irradiance(rays.point[at], 200)
                for empty in (False, True)
            )
            assert light.irradiance[at, UP, band].mean() == pytest.approx(below / free, rel=0.06)
    column = grid.index([[0.01, 0.01, z] for z in grid.centres()[: grid.shape[2], 2]])
    assert (light.irradiance[column[-1], UP] > 0.97).all()


@pytest.mark.slow
def test_below_a_deck_in_turbid_water_there_is_the_light_that_paths_find(record_property):
    """What is scattered against views, under a deck over sand, near its edge and beside it.

    Light looked at in places even along the rays was up to twice what it is.
    """
    solved, (top, half) = field(-SEABED, 0.4, "jerlov:3C"), (-2.0, 2.6)
    points = np.concatenate([plate(top, half), plate(SEABED, 4.0)])
    _, rays, light = light_around(points, solved, 0.4)
    cell, z = rays.voxels.grid.cell, rays.voxels.centre[:, 2]
    deck = rays.voxels.centre[z > top - 1.0]
    half, middle = np.abs(deck[:, :2]).max() + cell / 2.0, deck[0, 2]
    scene = BoxScene(
        (-half, -half, middle - cell / 2), (half, half, middle + cell / 2), z.min(), 0.4, 0.4
    )
    ways = [*AXES[:5], int((NORMALS @ (0.7, -0.7, 0.0)).argmax())]
    found = []
    for place in ((0.0, 0.0, -4.0), (1.8, 0.0, -4.5), (-1.8, 1.0, -3.2), (3.3, 0.5, -3.5)):
        probe = rays.nearest(np.array([place]))[0]
        for way in ways:
            below, free = (
                OccludedPaths(solved, 1, scene, empty=empty).source(
                    rays.point[probe], NORMALS[way], 40_000
                )
                for empty in (False, True)
            )
            found.append(light.scattered[probe, way, 1] * free / below)
    record_property("ratios", str(np.round(found, 3)))
    # One probe alone has few directions.
    off = np.log(found)
    assert abs(off.mean()) < 0.06
    assert np.sqrt((off**2).mean()) < 0.14


def test_a_grid_whose_water_nothing_reaches_keeps_nothing_away():
    """Under a roof wider than the grid there was none, and Add Water failed."""
    grid, rays, _ = light_around(plate(-2.0, 2.0), field(), 0.5, probes=200)
    rays = dataclasses.replace(rays, valid=np.zeros(grid.count, bool))
    light = probe_irradiance(field(), rays, np.full((len(rays.voxels), 3), 0.5))
    table = occlusion_table(light, np.full(3, 0.2), np.ones(3))
    below = table.on_patches(np.array([[0.0, 0.0, -3.0]]), np.array([[0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(below, [[1.0, 0.0, 0.0, 1.0]], atol=1e-6)


def rays_in_a_room(window=0.0):
    """A room of 3 m, of which one wall has a window of so many metres."""
    x = plate(0.0, 1.5)
    walls = [np.roll(x + np.array([0, 0, s]), k, axis=1) for k in range(3) for s in (-1.5, 1.5)]
    points = np.concatenate(walls)
    normals = np.repeat(np.eye(3)[[2, 2, 0, 0, 1, 1]], len(x), axis=0)
    left = (points[:, 0] < 1.4) | (np.abs(points[:, 1:]) > window / 2.0).any(axis=1)
    points, normals = points[left] + MIDDLE, normals[left]
    grid = Grid.around((-3.0, -3.0, -6.5), (3.0, 3.0, -0.6), 1500, 0.2)
    fine = Grid(grid.lower, grid.cell / 3, tuple(3 * n for n in grid.shape))
    voxels = voxelise(fine, points, normals, np.full((len(points), 3), 0.5))
    return cast(voxels, grid, -np.asarray(field().sun), MIDDLE[None])


def test_in_air_under_a_black_sky_light_comes_from_the_floor_alone():
    """From no direction above: no spread of what comes from there may be asked for."""
    wall = np.array([[1.5, y, z] for y in np.arange(-4, 4, 0.06) for z in np.arange(-6, -1, 0.06)])
    above_floor = field(floor=7.0, reflectance=0.3, surface="none", amount=0.0)
    _, rays, light = light_around(wall, above_floor, 0.5)
    assert np.isfinite(light.irradiance).all()
    assert light.slope < 0
    away = np.flatnonzero(rays.valid & (rays.grid.centres()[:, 0] < -2.0))
    np.testing.assert_allclose(light.irradiance[away, DOWN], 1.0, atol=0.1)


def test_a_closed_room_is_dark():
    rays = rays_in_a_room()
    grid, voxels = rays.grid, rays.voxels
    light = probe_irradiance(field(), rays, np.full((len(voxels), 3), 0.3))
    at = grid.index(MIDDLE)
    assert rays.valid[at]
    # Edges, where a voxel has two walls, are not quite tight.
    assert light.irradiance[at].max() < 0.02
    assert light.scattered[at].max() < 0.02
    assert light.sunlit[at] == 0


def test_weights_of_the_phase_function_add_up():
    grid = Grid((-2.0, -2.0, -6.0), 0.5, (8, 8, 8))
    unoccluded = UnoccludedField(field(), depths_of(field(), grid))
    for kind, streams in itertools.product(range(SETS), (None, OCCLUSION_STREAMS)):
        weights = unoccluded.phase_weights(kind, NORMALS, streams)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-5)
        assert weights.min() >= 0


def test_a_peak_of_fewer_streams_takes_all_that_turns_little():
    """What is left has the mean cosine that the moments say: (χ1 - f) / (1 - f), within 2 %."""
    grid = Grid((-2.0, -2.0, -6.0), 0.5, (8, 8, 8))
    phase = field().phase_at(3.0)
    chi = phase.moments(OCCLUSION_STREAMS)
    wanted = (chi[0] - chi[-1]) / (1.0 - chi[-1])
    ways = directions()
    for kind in range(SETS):
        water = UnoccludedField(field(), depths_of(field(), grid))
        weights = water.phase_weights(kind, ways[kind], OCCLUSION_STREAMS)
        found = np.einsum("nrq,rq->n", weights, ways[kind] @ ways[kind].T) / len(ways[kind])
        np.testing.assert_allclose(found, wanted, atol=0.02)


def test_eight_probes_around_a_point_look_eight_ways():
    kind = set_of(Grid((-2.0, -2.0, -6.0), 0.5, (6, 5, 4))).reshape(6, 5, 4)
    for x, y, z in itertools.product(range(5), range(4), range(3)):
        assert len(np.unique(kind[x : x + 2, y : y + 2, z : z + 2])) == SETS


def test_sets_look_everywhere_alike():
    """Each direction of a set has about the same solid angle, and the eight differ."""
    many, ways = spiral(20000), directions()
    for w in ways:
        count = np.bincount((many @ w.T).argmax(axis=1), minlength=len(w))
        assert count.std() < 0.05 * count.mean()
    closest = [(one @ other.T).max() for one, other in itertools.combinations(ways, 2)]
    assert max(closest) < 1.0 - 1e-6


@pytest.mark.parametrize("planted", [1.1, 0.9])
def test_a_planted_error_of_a_tenth_is_seen(planted):
    """The seabed's reflectance a tenth off moves what comes up from it."""
    bare = field()
    grid, _, right = light_around(plate(SEABED, 5.0), bare, 0.4)
    wrong = light_around(plate(SEABED, 5.0), bare, 0.4 * planted)[2]
    near = (np.abs(grid.centres()[:, :2]).max(axis=1) < 1.5) & (grid.centres()[:, 2] < -5.0)
    near &= grid.centres()[:, 2] > SEABED
    ratio = np.median(wrong.irradiance[near, DOWN] / right.irradiance[near, DOWN])
    assert abs(ratio - 1.0) > 0.04


def test_walls_of_a_room_are_lit_evenly_through_a_window(monkeypatch):
    """Of a window of .9 m the rays of one set find 0 or 1 per probe: walls would be blotched."""
    rays = rays_in_a_room(window=0.9)
    grid, voxels = rays.grid, rays.voxels
    at = rays.point
    inside = rays.valid & (np.abs(at - MIDDLE).max(axis=1) < 1.3) & (at[:, 0] < 0.5)
    towards = AXES[0]  # patches that face the window

    def scatter():
        light = probe_irradiance(field(), rays, np.full((len(voxels), 3), 0.02))
        found, places = light.irradiance[inside, towards].mean(axis=1), at[inside]
        near = np.linalg.norm(places[:, None] - places, axis=2)
        pairs = (near > 0) & (near < 1.1 * grid.cell)
        return np.abs(np.log(found[:, None] / found))[pairs].mean(), found.mean()

    even, mean = scatter()
    monkeypatch.setattr(probes, "ENCLOSED", 0.0)
    blotched, before = scatter()
    assert even < 0.6 * blotched
    assert mean == pytest.approx(before, rel=0.25)


def test_all_sets_together_see_every_direction_once_and_snells_window_apart():
    """What one of a set's stands for is wide: through a window came light from beside it."""
    known, ways = UnoccludedField(field(), (0.5, 6.0)), np.arange(RAYS)[None]
    E, image = np.zeros((2, len(NORMALS), 3)), []
    for kind in range(SETS):
        for narrow in (False, True):
            light = known.along(np.full((1, 1), 3.5), kind, ways, narrow=narrow)
            total = (light.scattered + light.single + light.image)[0]
            E[int(narrow)] += np.einsum(
                "rn,nrp->pn", total, known.patch_weights(kind, narrow=narrow)[0]
            )
        image.append(light.image[0].mean(axis=1))
    np.testing.assert_allclose(E[1, AXES], E[0, AXES], rtol=0.01)
    # Below the water's surface a clear sky is darker than what that mirrors beside it.
    z, image = directions()[..., 2].ravel(), np.concatenate(image)
    beside, in_it = ((z > a) & (z < b) for a, b in ((0.5, 0.61), (0.73, 0.85)))
    assert image[in_it].mean() < 0.15 * image[beside].mean()


def test_what_is_in_a_room_is_enclosed_and_what_is_beside_it_not():
    """Else dark insides of things would darken the sand beside them for those outside."""
    rays = rays_in_a_room()
    outside, far = MIDDLE + np.array([[0.0, 2.3, 0.0], [100.0, 0.0, 0.0]])
    assert rays.enclosed(MIDDLE[None])
    assert not rays.enclosed(np.stack([outside, far]))
    assert rays.enclosed(np.stack([outside, MIDDLE]))


def test_walls_have_the_light_that_is_there_and_not_the_one_before_them():
    """Light that changes from 2.5 to 5.5 across a room."""
    rays = rays_in_a_room()
    grid, light = rays.grid, 4.0 + rays.point[:, 0] - MIDDLE[0]
    tiles = np.tile(light[:, None, None], (1, len(NORMALS), NUMBERS))
    atlas = np.pad(
        tiles[rays.stand_in].transpose(1, 0, 2).reshape(-1, *grid.shape, NUMBERS),
        ((0, 0), *[(1, 1)] * 3, (0, 0)),
    )
    off = OFF_SURFACE * grid.cell
    FittedCells(rays).fit_faces(atlas, tiles, off)
    for x, facing in ((-1.5, AXES[0]), (1.5, AXES[1])):
        wall = MIDDLE + [[x, y, z] for y in (-0.8, 0.0, 0.7) for z in (-0.6, 0.5)]
        at = grid.position(wall + off * NORMALS[facing]) + 1.0
        found = map_coordinates(atlas[facing, ..., 0], at.T, order=1)
        np.testing.assert_allclose(found, 4.0 + x, rtol=0.1)
