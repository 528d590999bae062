"""Visibility of the sky by voxels and probes, against casting rays at the meshes themselves."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import marks
from ..scene.seen.ray_casting import Meshes
from ..scene.seen.surroundings import Surroundings
from ..uw_spectral.shade.grid import Grid
from ..uw_spectral.shade.probes import Rays, cast, directions, set_of, spiral
from ..uw_spectral.shade.voxels import SurfaceVoxels

_POINTS, _VIEWS, _STEPS = 150, 60, 4
_WAYS = 128  # to the upper half of the sphere
_FARTHEST = 60.0  # m
_CLOSE = 1.5  # voxels: within that of a surface a point may lie on either side

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Openness:
    """Errors of the share of the sky that is seen: mean, 95 %, and mean with its sign."""

    at: str
    by: str
    mean: float
    most: float
    bias: float


def openness(around: Surroundings, to_sun: Array) -> list[Openness]:
    """Compare at random points of the water, and in the mean along rays of the camera."""
    found = around.under_things()
    if found is None:
        return []
    voxels, grid = found
    rays = cast(voxels, grid, to_sun, around.eyes, around.coarse)
    meshes = Meshes(bpy.context.evaluated_depsgraph_get(), marks.objects(bpy.context.scene))
    rows, rng = [], np.random.default_rng(1)
    for name, points in (
        ("points", _points(voxels, around, rng)),
        ("rays", _along_rays(voxels, around, rng)),
    ):
        exact = _exact(meshes, points.reshape(-1, 3))
        for by, share in (
            ("voxels", _traced(voxels, around.coarse, points.reshape(-1, 3))),
            ("probes", _looked_up(rays, points.reshape(-1, 3))),
        ):
            error = (share - exact).reshape(len(points), -1).mean(axis=1)
            size = np.abs(error)
            rows.append(
                Openness(name, by, float(size.mean()), float(np.quantile(size, 0.95)),
                         float(error.mean()))
            )  # fmt: skip
    return rows


def _points(voxels: SurfaceVoxels, around: Surroundings, rng: np.random.Generator) -> Array:
    reached = voxels.reachable_from(around.coarse, around.eyes).ravel()
    points = voxels.grid.centres()
    low = -np.inf if around.ground is None else -around.ground.depth
    free = np.flatnonzero(reached & _off_surfaces(voxels) & (points[:, 2] > low))
    chosen = rng.choice(free, min(_POINTS, len(free)), replace=False)
    return points[chosen][:, None]


def _off_surfaces(voxels: SurfaceVoxels) -> NDArray[np.bool_]:
    full = np.pad(voxels.number >= 0, 1)
    near = np.zeros(voxels.grid.shape, bool)
    nx, ny, nz = voxels.grid.shape
    for x, y, z in itertools.product(range(3), repeat=3):
        near |= full[x : x + nx, y : y + ny, z : z + nz]
    return ~near.ravel()


def _along_rays(voxels: SurfaceVoxels, around: Surroundings, rng: np.random.Generator) -> Array:
    """Places along rays within a cone of 35° about the view, (rays, steps, 3)."""
    side = rng.normal(size=(8 * _VIEWS, 3))
    ways = around.ahead[0] + 0.7 * rng.uniform(size=(len(side), 1)) * side / np.linalg.norm(
        side, axis=1, keepdims=True
    )
    ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True))[:_VIEWS]
    eyes = np.broadcast_to(around.eyes[0], ways.shape)
    P, _ = voxels.trace(eyes, ways)
    P = np.maximum(P - _CLOSE * voxels.grid.cell, 0.1)
    shares = ((np.arange(_STEPS) + 0.5) / _STEPS) ** 2
    return eyes[:, None] + ways[:, None] * (P[:, None] * shares)[..., None]


def _up() -> Array:
    ways = spiral(2 * _WAYS)
    return ways[ways[:, 2] > 0]


def _exact(meshes: Meshes, points: Array) -> Array:
    ways = _up()
    origin, heading = np.repeat(points, len(ways), axis=0), np.tile(ways, (len(points), 1))
    limit = np.minimum(-origin[:, 2] / heading[:, 2], _FARTHEST)
    return meshes.clear(origin, heading, limit).reshape(len(points), -1).mean(axis=1)


def _traced(voxels: SurfaceVoxels, beyond: SurfaceVoxels, points: Array) -> Array:
    ways = _up()
    origin, heading = np.repeat(points, len(ways), axis=0), np.tile(ways, (len(points), 1))
    t, number = voxels.trace(origin, heading)
    clear = number < 0
    ends = (origin + heading * t[:, None])[clear]
    inside = beyond.grid.inside(ends)
    _, further = beyond.trace(ends[inside], heading[clear][inside], 1.0)
    clear[np.flatnonzero(clear)[inside]] = further < 0
    return clear.reshape(len(points), -1).mean(axis=1)


def _looked_up(rays: Rays, points: Array) -> Array:
    """Mean of the eight probes around points, as a renderer looks them up."""
    grid: Grid = rays.grid
    up = directions()[set_of(grid)][..., 2] > 0
    open_sky = (rays.hit < 0) & ~rays.blocked
    share = (open_sky & up).sum(axis=1) / up.sum(axis=1)
    share = share[rays.nearest(grid.centres())].reshape(grid.shape)
    place = np.clip(grid.position(points), 0.0, np.asarray(grid.shape) - 1.0)
    low = np.minimum(place.astype(int), np.maximum(np.asarray(grid.shape) - 2, 0))
    part, total = place - low, np.zeros(len(points))
    for corner in itertools.product((0, 1), repeat=3):
        at = np.minimum(low + corner, np.asarray(grid.shape) - 1)
        total += share[tuple(at.T)] * np.where(corner, part, 1.0 - part).prod(axis=1)
    return total
