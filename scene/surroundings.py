"""What stands around the cameras of a scene, and the ground below them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.shade.grid import Grid
from ..uw_spectral.shade.voxels import SurfaceVoxels, voxelise
from . import scene_water
from .surface_samples import Triangles, sampled, visible_triangles

PROBES = 6000
"""Cells of the grid, at most."""
VOXELS = 3
"""Voxels along a cell of it."""
CELLS = (0.3, 0.35, 0.42, 0.5, 0.6, 0.7)
"""Edges of a cell of it, m; few, so that they last."""
_BLOCK = 4  # cells that come and go together when the camera moves
_COARSE_CELLS = 0.3 * 1.25 ** np.arange(40)  # m
_COARSE_BLOCK = 8
_OPTICAL_REACH, _NEAREST, _FARTHEST = 4.0, 6.0, 30.0  # how far from the camera shade is looked for
_MARGIN = 1.0  # m around things
_SIDE = 0.5  # of the height of a place under things: how far from it there is shade
_COARSE = 120_000  # voxels in which such places are looked for
_AHEAD, _ASIDE = 1.2, 0.4  # of the reach: where the box lies that is cut down
_COVERED = 0.5  # of the columns of water that end on ground, where there is a floor
_BELOW_EYE = 0.3  # m
_DEPTH_STEP, _COLOUR_STEP = 0.05, 0.01  # of the ground: it should not tremble with the camera
_SOLID = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES"}
_SAMPLES = ("points", "normals", "colours")

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ground:
    """Depth of a seabed in m, and its mean base colour, linear Rec.709."""

    depth: float
    colour: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The visible things of a scene around its cameras; make it with :func:`look_around`.

    Attributes
    ----------
    things : sequence of Triangles
    eyes, ahead : array, shape (m, 3)
        Where cameras are, m, and unit vectors to where they look.
    coarse : SurfaceVoxels
        The surfaces, coarsely.
    """

    things: Sequence[Triangles]
    eyes: Array
    ahead: Array
    coarse: SurfaceVoxels

    @functools.cached_property
    def ground(self) -> Ground | None:
        """The seabed: the lowest surface of the columns of water, if most of them have one."""
        voxels = self.coarse
        if not len(voxels):
            return None
        full, water = voxels.number >= 0, voxels.reachable(self.eyes)
        seabed = np.zeros_like(full)
        seabed[:, :, :-1] = full[:, :, :-1] & water[:, :, 1:]
        found = seabed.any(axis=2)
        if found.mean() < _COVERED:
            return None
        columns = np.nonzero(found)
        lowest = voxels.number[(*columns, seabed[columns].argmax(axis=1))]
        depth = -float(np.median(voxels.centre[lowest, 2]))
        eye = -float(self.eyes[:, 2].min()) if len(self.eyes) else 0.0
        depth = max(depth, eye + _BELOW_EYE)
        colour = voxels.colour[lowest].mean(axis=0)
        red, green, blue = (round(float(c) / _COLOUR_STEP) * _COLOUR_STEP for c in colour)
        return Ground(round(depth / _DEPTH_STEP) * _DEPTH_STEP, (red, green, blue))

    def under_things(self) -> tuple[SurfaceVoxels, Grid] | None:
        """Surfaces about the water that something overhangs, and a grid there; None without."""
        low, high = self.coarse.under_things(self.eyes)
        if not (high > low).all():
            return None
        side = _SIDE * (high[2] - low[2]) + _MARGIN
        margin = np.array([side, side, _MARGIN])
        low, high = low - margin, high + margin
        high[2] = min(high[2], 0.0)
        grid = _near(low, high, self.eyes, self.ahead)
        fine = Grid(grid.lower, grid.cell / VOXELS, _times(grid.shape, VOXELS))
        return _voxels(self.things, fine), grid


def has_things(scene: bpy.types.Scene) -> bool:
    """Whether there is anything in a scene that could be seen, at this frame or another."""
    of_water = set(scene_water.objects(scene))
    return any(
        item.type in _SOLID or item.instance_collection is not None
        for item in scene.objects
        if item not in of_water
    )


def look_around(
    scene: bpy.types.Scene, camera: bpy.types.Object | None, extinction: float
) -> Surroundings:
    """Look at what is visible around a camera, at the scene's current frame.

    Parameters
    ----------
    scene : Scene
    camera : Object or None
        Without one everything counts alike.
    extinction : float
        Of the clearest band, 1/m: decides how far away things matter.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    things = list(visible_triangles(depsgraph, scene_water.objects(scene)))
    eyes = [] if camera is None else [camera.evaluated_get(depsgraph)]
    frames = np.array([eye.matrix_world for eye in eyes], np.float64).reshape(-1, 4, 4)
    places, ahead = frames[:, :3, 3], -frames[:, :3, 2]
    ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    low, high = _around(things, places, extinction)
    grid = Grid((0.0, 0.0, 0.0), 1.0, (1, 1, 1))
    if np.isfinite([low, high]).all() and (high > low).all():
        grid = _coarse_grid(low, high)
    else:
        things = []
    return Surroundings(things, places, ahead, _voxels(things, grid))


def _around(things: Sequence[Triangles], eyes: Array, extinction: float) -> tuple[Array, Array]:
    """Box around things that are not too far from the eyes to matter."""
    low, high = (np.array([thing.bounds[end] for thing in things]).reshape(-1, 3) for end in (0, 1))
    low, high = low.min(axis=0, initial=np.inf), high.max(axis=0, initial=-np.inf)
    reach = min(max(_OPTICAL_REACH / max(extinction, 1e-3), _NEAREST), _FARTHEST)
    if len(eyes):
        low = np.maximum(low, eyes.min(axis=0) - reach)
        high = np.minimum(high, eyes.max(axis=0) + reach)
    low, high = low - _MARGIN, high + _MARGIN
    high[2] = min(high[2], 0.0)
    return low, high


def _coarse_grid(low: Array, high: Array) -> Grid:
    """Return cells of a lattice that hold a box, as small as :data:`_COARSE` of them allow."""
    for cell in _COARSE_CELLS:
        grid = Grid.on_lattice(low, high, float(cell), _COARSE_BLOCK)
        if grid.count <= _COARSE:
            break
    return grid


def _near(low: Array, high: Array, eyes: Array, ahead: Array) -> Grid:
    """Return at most :data:`PROBES` cells in a box, cut down to what eyes have before them."""
    fitting = [cell for cell in CELLS if np.prod(high - low) <= PROBES * cell**3]
    cell, reach = fitting[0] if fitting else CELLS[-1], _FARTHEST
    grid = Grid.on_lattice(low, high, cell)
    while grid.count > PROBES:
        if len(eyes) and reach > _NEAREST:
            reach *= 0.95
        else:
            cell *= 1.1
        grid = Grid.on_lattice(*_before(low, high, eyes, ahead, reach, _BLOCK * cell), cell)
    return grid


def _before(
    low: Array, high: Array, eyes: Array, ahead: Array, reach: float, block: float
) -> tuple[Array, Array]:
    """Part of a box that eyes have before them, moving in blocks; all of it if that is none."""
    if not len(eyes):
        return low, high
    seen = np.concatenate([eyes, eyes + _AHEAD * reach * ahead])
    first, last = seen.min(axis=0) - _ASIDE * reach, seen.max(axis=0) + _ASIDE * reach
    first, last = (np.round(corner / block) * block for corner in (first, last))
    first, last = np.maximum(low, first), np.minimum(high, last)
    return (first, last) if (last > first).all() else (low, high)


def _voxels(things: Sequence[Triangles], grid: Grid) -> SurfaceVoxels:
    found = [sampled(thing, np.asarray(grid.lower), grid.upper, grid.cell) for thing in things]
    joined = (
        np.concatenate([np.empty((0, 3)), *(getattr(x, part) for x in found)]) for part in _SAMPLES
    )
    return voxelise(grid, *joined)


def _times(shape: tuple[int, int, int], factor: int) -> tuple[int, int, int]:
    x, y, z = shape
    return factor * x, factor * y, factor * z
