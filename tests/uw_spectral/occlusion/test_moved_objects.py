"""What is taken from another frame: rays to the bit, and light within half a percent."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.tests.uw_spectral.occlusion.test_probe_irradiance import field, plate
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.probe_solution import WaterCache, probe_irradiance
from underwater_spectral.uw_spectral.occlusion.probes import Rays, cast
from underwater_spectral.uw_spectral.occlusion.voxels import voxelise

GRID = Grid.on_lattice((-3.6, -3.6, -6.6), (3.6, 3.6, -0.9), 0.45)
FINE = Grid(GRID.lower, GRID.cell / 3, tuple(3 * n for n in GRID.shape))
COARSE = Grid.on_lattice((-6.0, -6.0, -7.0), (6.0, 6.0, 0.0), 0.4)


def surfaces(at):
    """Voxels of a roof over a seabed, and of a ball."""
    w = np.random.default_rng(1).normal(size=(4000, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    points = np.concatenate([plate(-6.0, 6.0, 0.1), plate(-2.0, 1.5), at + 0.2 * w])
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    normals[-len(w) :] = w
    colours = np.full((len(points), 3), 0.5)
    return [voxelise(grid, points, normals, colours) for grid in (FINE, COARSE)]


def rays(at, before=None):
    near, far = surfaces(at)
    return cast(near, GRID, -np.asarray(field().sun), [(0.0, 0.0, -4.0)], far, before)


def light(found, waters=None, before=None):
    reflectance = np.full((len(found.voxels), 3), 0.4)
    return probe_irradiance(field(), found, reflectance, waters, before)


def off(one, other):
    """Largest relative difference of two lights, of what is less than 2 % of it that."""
    found = []
    for name in ("irradiance", "scattered"):
        u, v = (getattr(x, name)[x.valid & other.valid].astype(float) for x in (one, other))
        found.append((np.abs(u - v) / np.maximum(v, 0.02)).max())
    return max(found)


def test_rays_that_serve_again_are_those_that_would_be_cast():
    first = rays((0.0, 0.0, -4.0))
    for at in ((0.0, 0.3, -4.0), (2.0, -1.0, -5.4), (-3.4, 3.3, -3.0), (0.0, 0.0, -4.0)):
        again, anew = rays(at, first), rays(at)
        for part in dataclasses.fields(Rays):
            one, other = (getattr(x, part.name) for x in (again, anew))
            if isinstance(one, np.ndarray):
                np.testing.assert_array_equal(one, other, err_msg=part.name)
        changed = (again.distance != first.distance) | (again.hit != first.hit)
        assert changed.mean() < 0.5


@pytest.mark.slow
def test_light_that_starts_from_another_frame_is_what_it_would_be_by_itself():
    waters, first = WaterCache(), rays((0.0, 0.0, -4.0))
    before = light(first, waters)
    for at in ((0.3, 0.0, -4.0), (0.2, -0.3, -4.2), (0.0, 0.4, -4.4)):
        found = rays(at, first)
        again, anew = light(found, waters, before), light(found)
        assert not again.serves, "it was not solved anew"
        assert off(anew, before) > 0.1, "the ball occludes"
        assert off(again, anew) < 0.005


def test_an_object_that_is_back_where_it_was_leaves_the_light_of_then():
    waters, first = WaterCache(), rays((0.0, 0.0, -4.0))
    before = light(first, waters)
    again = light(rays((0.0, 0.0, -4.0), first), waters, before)
    np.testing.assert_array_equal(again.irradiance, before.irradiance)
    np.testing.assert_array_equal(again.scattered, before.scattered)


def test_no_more_waters_are_kept_than_a_few():
    waters = WaterCache()
    for level in range(5):
        grid = Grid((0.0, 0.0, -6.0 - level), 0.5, (4, 4, 4))
        water = waters.of(field(), grid)
        assert waters.of(field(), grid) is water
    assert len(waters._known) == 2
