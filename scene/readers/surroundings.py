"""What stands around the cameras of a scene, and the ground below them."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.occlusion.filled_voxels import Filling
from ...uw_spectral.occlusion.grid import Grid
from ...uw_spectral.occlusion.probe_irradiance import MOST_KEPT
from ...uw_spectral.occlusion.probes import ENCLOSED, spiral
from ...uw_spectral.occlusion.voxels import SurfaceVoxels
from .. import marks
from ..rendered import ever_rendered
from .cameras import eye_of
from .mesh_parts import MeshArrays
from .surface_samples import SampleCache, Triangles, visible_triangles

PROBES, ROOM_PROBES = 6000, MOST_KEPT
"""Cells of the grid, at most, and where eyes are enclosed: by few openings errors are large."""
PATH_PROBES = 30_000
"""The same where one grid serves for all frames of a job."""
_PATH_CELLS = (0.8, 0.9)
"""Edges that cells have there rather than that the frames have a grid each, m."""
_LONGEST = 60.0  # m along each axis, of a camera's path that it serves for
VOXELS = 3
"""Voxels along a cell of it."""
_FINE, _FEW = (0.101, 0.121, 0.151, 0.181, 0.211, 0.251), 3000
"""Edges of a cell of it where so many do: about small things, and in tanks."""
CELLS = (0.301, 0.331, 0.361, 0.391, 0.421, 0.461, 0.501, 0.551, 0.601, 0.651, 0.701)
"""Edges of a cell of it, m; few, so that they last. Not round, as places in scenes are: what lies
on the side of a voxel lies on either side of it by rounding."""
_LARGER = (0.751, 0.801, 0.851, 0.901)
"""The same where eyes are enclosed: a room that is cut lets light in where it is."""
_WIDE = (*_LARGER, 0.951, 1.001, 1.101, 1.201, 1.301)
"""The same under wide roofs, far from the eyes."""
_CLEAR = 0.33  # of their distance from surfaces: cells as wide show nothing
_LEAST = 0.301  # m: the smallest cell of the coarse grid
_COARSER = 1.12
_BLOCK, _COARSE_BLOCK = 6, 9  # cells that come and go together when the camera moves
# How far from the camera occlusion is looked for.
_OPTICAL_REACH, _NEAREST, _FARTHEST = 4.0, 6.0, 30.0
_CLOSE = 10.0  # m from the eyes, where small overhangs are looked for
_MARGIN = 1.0  # m around objects
_SIDE = 0.5  # of the height of a place under objects: how far from it there is shade
_LIFTED = 0.5  # of their height: objects farther above the ground do not stand on it
_COARSE = 120_000  # voxels in which such places are looked for
_AHEAD, _AHEAD_INDOORS = 0.9, 0.3
"""Of half a box that is cut down: how far from the eye its middle lies. Under a roof light comes
from behind the camera, too."""
_TALLEST = 15.0  # m, of such a box
_DEEPEST = 0.01  # of the ground lies lower than the box
_COVERED = 0.5  # of the columns of water that end on ground, where there is a floor
_WHOLE = 0.8  # of them: what covers more is ground, though the water has a floor far below
_OCCLUDES = 2.0  # widths of objects below them that they shade a floor
_BELOW_EYE = 0.1  # m
_ROOF = 0.9  # of a seabed above all eyes: it is a roof
_GROUND = 0.25  # of the area of the largest sheet: from there on another is ground, too
_BODY_AREA = 1.0  # m²: smaller objects do not make a seabed of many
_BODY = 0.25  # of its narrower side: higher closed objects are bodies, as hulls are
_HIDDEN = 0.01  # m that a floor lies under the ground which it continues
_WET = 0.05  # depth in m of an eye that came from the air
_LEVEL_VIEW = 3.0  # heights above the water: how far ahead a level view looks into it
_DEPTH_STEP, _COLOUR_STEP = 0.05, 0.01  # of the ground: it should not tremble with the camera
_SOLID = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES"}
_SMALL = 2.5  # voxels
_STEP, _MOST_STEPS = 1.1, 30
_SHEET = 4096.0  # m: half the side of a floor
_SOME_EYES = 64  # of a path are looked at
_LOOKS, _SKIPPED = 256, 1.0  # directions from an eye, and voxels that its own place may fill

Array = NDArray[np.float64]
Place = tuple[float, float, float]
_Seen = tuple[Array, Array, Array, Array, float, Place]


@dataclass(frozen=True)
class Ground:
    """A seabed."""

    depth: float  #: m.
    colour: tuple[float, float, float]  #: Mean base colour, linear Rec.709.
    bottom: float  #: Depth in m of a level floor that lies just under all of it.


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The visible objects of a scene around its cameras; make it with :func:`look_around`."""

    surfaces: Sequence[Triangles]
    eyes: Array  #: Where the camera is, now and at other frames, m, (m, 3).
    ahead: Array  #: Unit vectors to where it looks, (m, 3).
    coarse: SurfaceVoxels
    samples: SampleCache
    box: tuple[Array, Array]  #: What surfaces are looked for in, m; cells may reach beyond it.
    #: That of the water, unless the scene has a seabed.
    floor: Triangles | None = None

    def voxels(self, grid: Grid, *, to_edges: bool = False) -> SurfaceVoxels:
        """Return all surfaces in the cells of a grid."""
        surfaces = self.surfaces if self.floor is None else [*self.surfaces, self.floor]
        filling = _filling(surfaces, grid, self.samples, to_edges=to_edges)
        return self.samples.voxels.of(grid, filling)

    @property
    def middle(self) -> Place:
        """From which cells are counted."""
        return self.samples.middle or (0.0, 0.0, 0.0)

    @functools.cached_property
    def _seabed(self) -> NDArray[np.int32]:
        """The lowest surface of each column of water, none if too few have one below the eyes."""
        far_below = self.floor is not None and not math.isfinite(self.coarse.ground_below)
        if far_below or self._ended.mean() < _COVERED:
            return np.empty(0, np.int32)
        seabed = self._upper
        columns = np.nonzero(seabed.any(axis=2))
        found = self.coarse.number[(*columns, seabed[columns].argmax(axis=1))]
        above = self.coarse.centre[found, 2] > self.eyes[:, 2].max(initial=-np.inf)
        return found[:0] if len(self.eyes) and above.mean() > _ROOF else found

    @functools.cached_property
    def _upper(self) -> NDArray[np.bool_]:
        """Full voxels with water above them."""
        full, water = self.coarse.number >= 0, self.coarse.reachable(self.eyes)
        upper = np.zeros_like(full)
        upper[:, :, :-1] = full[:, :, :-1] & water[:, :, 1:]
        return upper

    @property
    def _ended(self) -> NDArray[np.bool_]:
        """Columns of water that end on what may be a seabed, shape (nx, ny)."""
        return self._upper.any(axis=2) & ~self._only_bodies

    @property
    def is_close_decision(self) -> bool:
        """Whether it hangs on the size of the cells that there is a seabed, or none."""
        ended, grid = self._ended, self.coarse.grid
        fractions = []
        for axis in (0, 1):
            first = grid.lower[axis] + grid.cell * np.arange(ended.shape[axis])
            low, high = (float(end[axis]) for end in self.box)
            within = np.minimum(first + grid.cell, high) - np.maximum(first, low)
            fractions.append(np.maximum(within, 0.0) / max(high - low, grid.cell))
        by_area = float(fractions[0] @ ended @ fractions[1])
        return (by_area < _COVERED) != (ended.mean() < _COVERED)

    @functools.cached_property
    def _bodies(self) -> list[bool]:
        """Which objects are closed and high, as hulls and rocks are, with no eye in them."""
        return [_is_body(surface, self.eyes) for surface in self.surfaces]

    @functools.cached_property
    def _only_bodies(self) -> NDArray[np.bool_]:
        """Columns, shape (nx, ny), in which there is nothing but bodies."""
        grid = self.coarse.grid
        if not any(self._bodies) or self.floor is not None:
            return np.zeros(grid.shape[:2], bool)
        others = np.zeros(grid.count, bool)
        low, high = np.asarray(grid.lower), grid.upper
        for surface, is_body in zip(self.surfaces, self._bodies, strict=True):
            if not is_body:
                points = self.samples.sampled(surface, low, high, grid.cell).points
                others[grid.index(points[grid.inside(points)])] = True
        return ~others.reshape(grid.shape).any(axis=2)

    def _bottom(self, depth: float) -> float:
        """Depth in m of a level floor under all ground, at least about a depth."""
        height = float(self.eyes[:, 2].min(initial=0.0))
        found: list[tuple[float, Triangles, bool]] = []
        for surface, is_body in zip(self.surfaces, self._bodies, strict=True):
            low, high = surface.bounds
            if not is_body and low[2] < height:
                sides = high - low
                has_eye = _has_eye(low, high, self.eyes)
                found.append((float(sides[0] * sides[1]), surface, has_eye))
        largest = max((area for area, _, _ in found), default=0.0)
        lowest = [
            # Of a closed object without an eye, the faces that look up.
            float(surface.bounds[0][2]) if has_eye else surface.lowest_above
            for area, surface, has_eye in found
            if area >= _GROUND * largest
        ]
        return _HIDDEN - min([*lowest, _DEPTH_STEP - depth])

    @functools.cached_property
    def _close(self) -> SurfaceVoxels | None:
        """The surfaces close to the eyes, where small overhangs show."""
        if not len(self.eyes):
            return None
        low = np.maximum(self.coarse.grid.lower, self.eyes.min(axis=0) - _CLOSE)
        high = np.minimum(self.coarse.grid.upper, self.eyes.max(axis=0) + _CLOSE)
        if not (high > low).all():
            return None
        grid = _coarse_grid(low, high, self.middle)
        if grid.cell >= self.coarse.grid.cell:
            return None
        return _on_ground(self.voxels(grid), self.eyes, self.floor)

    @functools.cached_property
    def ground(self) -> Ground | None:
        """The scene's seabed: the lowest surface of the columns of water, if most have one."""
        voxels, lowest = self.coarse, self._seabed
        if not len(lowest) or self.floor is not None:
            return None
        depth = -float(np.median(voxels.centre[lowest, 2]))
        eye = -float(self.eyes[:, 2].min()) if len(self.eyes) else 0.0
        depth = max(depth, eye + _BELOW_EYE)
        colour = voxels.colour[lowest].mean(axis=0)
        red, green, blue = (round(float(c) / _COLOUR_STEP) * _COLOUR_STEP for c in colour)
        depth = round(depth / _DEPTH_STEP) * _DEPTH_STEP
        return Ground(depth, (red, green, blue), self._bottom(depth))

    def under_objects(self) -> tuple[SurfaceVoxels, Grid] | None:
        """Surfaces about the water that objects overhang or wall in, and a grid there; or None."""
        low, high = self._occluded
        if not (high > low).all():
            return None
        shift = np.where(self._roofed, _AHEAD_INDOORS, _AHEAD)[:, None] * _level(self.ahead)
        grid = _near(
            low, high, self.eyes, shift, self.middle, enclosed=self._enclosed, clear=self._clear
        )
        voxels = self.voxels(grid.finer(VOXELS), to_edges=True)
        # What gets through a seabed beside what sticks in it must not make water of what is below.
        return replace(voxels, ground_below=self.coarse.ground_below), grid

    @property
    def _clear(self) -> float:
        """Distance of the eyes from all surfaces, m."""
        if not len(self.eyes) or not len(self.coarse):
            return 0.0
        eyes = self.eyes[:: max(len(self.eyes) // _SOME_EYES, 1)]
        apart = eyes[:, None] - self.coarse.centre
        return float(np.sqrt((apart**2).sum(axis=2).min()))

    def beyond(self, grid: Grid) -> float:
        """How far that water goes on beyond the sides of a grid of it, on average, m."""
        low, high = self._occluded
        outside = np.concatenate([np.asarray(grid.lower) - low, high - grid.upper])
        return float(np.maximum(outside, 0.0)[[0, 1, 3, 4]].mean())

    @functools.cached_property
    def _occluded(self) -> tuple[Array, Array]:
        """Box around the water that something overhangs, walls in, or stands in; empty without."""
        boxes = [self._overhung, self._walled]
        if self._enclosed:
            # At the foot of its walls there is other water, outside.
            (low, high), (first, last) = boxes
            first[:2], last[:2] = np.maximum(first, low)[:2], np.minimum(last, high)[:2]
        found = [box for box in boxes if (box[1] > box[0]).all()] or self._standing or boxes[:1]
        return np.min([box[0] for box in found], axis=0), np.max([box[1] for box in found], axis=0)

    @property
    def _walled(self) -> tuple[Array, Array]:
        """Box around the water that is walled, and its walls; empty without."""
        low, high = self.coarse.between_objects(self.eyes)
        if (high > low).all():
            side = self.coarse.grid.cell * np.array([1.0, 1.0, 0.0])
            low, high = low - side, high + side
            if high[2] > -_MARGIN:
                # What they send up comes back from the surface of the water.
                high[2] = 0.0
        return low, high

    @property
    def _roofed(self) -> NDArray[np.bool_]:
        """Which eyes have something above them."""
        return self.coarse.roofed.ravel()[self.coarse.grid.index(self.eyes)]

    @functools.cached_property
    def _enclosed(self) -> bool:
        """Whether all eyes are under a roof, and see little of the open."""
        voxels = self._close or self.coarse
        inside = voxels.grid.inside(self.eyes)
        if not len(inside) or not inside.all() or not self._roofed.all():
            return False
        eyes = self.eyes[np.unique(voxels.grid.index(self.eyes), return_index=True)[1]]
        ways = np.tile(spiral(_LOOKS), (len(eyes), 1))
        _, met = voxels.trace(np.repeat(eyes, _LOOKS, axis=0), ways, _SKIPPED)
        return bool(((met < 0).reshape(-1, _LOOKS).mean(axis=1) < ENCLOSED).all())

    @property
    def _ground_height(self) -> float:
        """Height in m of what objects stand on, minus infinity without."""
        if self.floor is not None:
            return float(self.floor.bounds[0][2])
        return -math.inf if self.ground is None else -self.ground.depth

    @property
    def _standing(self) -> list[tuple[Array, Array]]:
        """Boxes around objects close to the eyes that stand on the ground, and what they shade."""
        bottom = self._ground_height
        if not math.isfinite(bottom) or not self.surfaces:
            return []
        bounds = np.array([surface.bounds for surface in self.surfaces])
        sides = bounds[:, 1] - bounds[:, 0]
        height, width, length = sides[:, 2], sides[:, :2].min(axis=1), sides[:, :2].max(axis=1)
        # What is wider is ground, however large other ground is.
        stands = (np.minimum(height, length) > _LEAST) & (width < _CLOSE)
        stands &= bounds[:, 0, 2] < height * _LIFTED + bottom
        if len(self.eyes):
            near = self.eyes.min(axis=0) - _CLOSE, self.eyes.max(axis=0) + _CLOSE
            stands &= ((bounds[:, 1] > near[0]) & (bounds[:, 0] < near[1])).all(axis=1)
        margin = _SIDE * height[:, None]
        around = zip((bounds[:, 0] - margin)[stands], (bounds[:, 1] + margin)[stands], strict=True)
        return [(low, np.minimum(high, (np.inf, np.inf, 0.0))) for low, high in around]

    @functools.cached_property
    def _overhung(self) -> tuple[Array, Array]:
        """Box around the water that something overhangs; empty without."""
        looked_at = [voxels for voxels in (self.coarse, self._close) if voxels is not None]
        boxes = [voxels.under_objects(self.eyes) for voxels in looked_at]
        found = [box for box in boxes if (box[1] > box[0]).all()]
        if not found:
            return boxes[0]
        low = np.min([box[0] for box in found], axis=0)
        high = np.max([box[1] for box in found], axis=0)
        if len(self._seabed):
            # Below it, beyond its border, there is nothing to be seen.
            deepest = np.quantile(self.coarse.centre[self._seabed, 2], _DEEPEST)
            low[2] = min(max(low[2], deepest), high[2])
        box = _widened(low, high, _SIDE * (high[2] - low[2]) + _MARGIN)
        # From within a room little is seen of what shades the water around it.
        if _cells(*box, CELLS[0], self.middle).count > ROOM_PROBES and self._enclosed:
            return _widened(low, high, _MARGIN)
        return box


def _widened(low: Array, high: Array, side: float) -> tuple[Array, Array]:
    """Box with a margin, level of ``side`` m, that ends at the surface."""
    margin = np.array([side, side, _MARGIN])
    return low - margin, np.minimum(high + margin, (np.inf, np.inf, 0.0))


def _has_eye(low: Array, high: Array, eyes: Array) -> bool:
    return bool(((eyes > low) & (eyes < high)).all(axis=1).any())


def _is_body(surface: Triangles, eyes: Array) -> bool:
    low, high = surface.bounds
    x, y, z = high - low
    if x * y < _BODY_AREA or z <= _BODY * min(x, y) or _has_eye(low, high, eyes):
        return False
    return surface.is_closed


def has_objects(scene: bpy.types.Scene) -> bool:
    """Whether there is anything in a scene that could be seen, at this frame or another."""
    of_water = set(marks.objects(scene))
    return any(
        item.type in _SOLID or item.instance_collection is not None
        for item in ever_rendered(scene)
        if item not in of_water
    )


def look_around(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    extinction: float,
    path: Sequence[tuple[float, ...]] = (),
    samples: SampleCache | None = None,
    floor: Ground | None = None,
) -> Surroundings:
    """Look at what is visible around a camera, at the scene's current frame.

    Without a camera everything counts alike. How far away objects matter follows from the
    extinction of the clearest band, 1/m. The path is where the camera is at the frames of a job,
    see :func:`.cameras.eye_of`: unless the places lie too far apart, one serves for all, so that
    nothing changes but what moves. The floor is that of the water.
    """
    samples = samples or SampleCache()
    samples.next_frame()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surfaces = list(visible_triangles(depsgraph, marks.objects(scene), samples))
    eyes = [] if camera is None else [eye_of(camera)]
    if len(path) and (np.ptp(np.array(path)[:, :3], axis=0) <= _LONGEST).all():
        eyes += path
    frames = np.array([in_the_water(eye) for eye in eyes], np.float64).reshape(-1, 6)
    places, ahead = frames[:, :3], frames[:, 3:]
    low, high = _around(surfaces, places, extinction, math.inf if floor is None else floor.depth)
    grid = Grid((0.0, 0.0, 0.0), 1.0, (1, 1, 1))
    if np.isfinite([low, high]).all() and (high > low).all():
        if samples.middle is None:
            samples.middle = _middle(surfaces, low, high)
        grid = _coarse_grid(low, high, samples.middle)
    else:
        surfaces = []
    sheet = None if floor is None else _level_sheet(floor, samples.middle)
    filled = samples.voxels if sheet is None else samples.without_floor
    coarse = _on_ground(filled.of(grid, _filling(surfaces, grid, samples)), places, sheet)
    around = Surroundings(surfaces, places, ahead, coarse, samples, (low, high))
    if sheet is None or math.isfinite(coarse.ground_below):
        return around
    around = replace(around, floor=sheet)
    return replace(around, coarse=_on_ground(around.voxels(grid), places, sheet))


def _level_sheet(ground: Ground, middle: Place | None) -> Triangles:
    x, y, _ = np.round(middle or (0.0, 0.0, 0.0))
    sides = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    corners = (sides * _SHEET + np.array([x, y, -ground.depth])).astype(np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    arrays = MeshArrays(corners, triangles, np.zeros(2, np.int32), corners.tobytes(), (0,), ())
    return Triangles(arrays, np.eye(4, dtype=np.float32), np.array([ground.colour]), np.ones(1))


def _on_ground(voxels: SurfaceVoxels, eyes: Array, floor: Triangles | None = None) -> SurfaceVoxels:
    """Surfaces whose lowest ones below all eyes are the ground, if most columns have such.

    What lies closer to the eyes than to a floor of the water is ground if it is wide, else a roof.
    """
    height = float(eyes[:, 2].min(initial=np.inf))
    lowest = voxels.lowest
    below = lowest < height
    covered = below.mean()
    if covered < _COVERED:
        return voxels
    if floor is not None and covered < _WHOLE:
        middle = (float(floor.bounds[0][2]) + min(height, 0.0)) / 2.0
        if np.median(lowest[below]) > middle:
            return voxels
    return replace(voxels, ground_below=height)


def in_the_water(eye: Sequence[float]) -> tuple[float, ...]:
    """Bring an eye that is above the water to where it looks into it.

    Examples
    --------
    >>> in_the_water((0.0, 0.0, 2.0, 0.6, 0.0, -0.8))
    (1.5, 0.0, -0.05, 0.6, 0.0, -0.8)
    >>> in_the_water((0.0, 0.0, -0.02, 1.0, 0.0, 0.0))
    (0.0, 0.0, -0.05, 1.0, 0.0, 0.0)
    """
    x, y, z, *ahead = eye
    if z <= 0.0:
        return (x, y, min(z, -_WET), *ahead)
    way = min(z / max(-ahead[2], 1e-9), _LEVEL_VIEW * z)
    return (x + way * ahead[0], y + way * ahead[1], -_WET, *ahead)


def _around(
    surfaces: Sequence[Triangles], eyes: Array, extinction: float, floor_depth: float = math.inf
) -> tuple[Array, Array]:
    """Box around objects that are not too far from the eyes to matter, and a floor they shade."""
    low, high = (
        np.array([surface.bounds[end] for surface in surfaces]).reshape(-1, 3) for end in (0, 1)
    )
    reach = min(max(_OPTICAL_REACH / max(extinction, 1e-3), _NEAREST), _FARTHEST)
    if len(eyes):
        near = ((high > eyes.min(axis=0) - reach) & (low < eyes.max(axis=0) + reach)).all(axis=1)
        low, high = low[near], high[near]
    width = (high - low)[:, :2].min(axis=1)
    if (low[:, 2] - _OCCLUDES * width < -floor_depth).any():
        low = np.minimum(low, (np.inf, np.inf, -floor_depth))
    low, high = low.min(axis=0, initial=np.inf), high.max(axis=0, initial=-np.inf)
    if len(eyes):
        # Nothing but water may lie between objects and an eye below them.
        level = slice(None, 2)
        below = (eyes[:, level] > low[level]) & (eyes[:, level] < high[level])
        low[2] = min(low[2], eyes[below.all(axis=1), 2].min(initial=np.inf))
        low = np.maximum(low, eyes.min(axis=0) - reach)
        high = np.minimum(high, eyes.max(axis=0) + reach)
    low, high = low - _MARGIN, high + _MARGIN
    high[2] = min(high[2], 0.0)
    return low, high


def _middle(surfaces: Sequence[Triangles], low: Array, high: Array) -> Place:
    """Middle, level, of the widest object that reaches into a box; one of a cell lies there.

    So cells lie alike in a scene wherever that is, and do not move with the camera.
    """
    widest, middle = 0.0, (low + high) / 2.0
    for surface in surfaces:
        first, last = surface.bounds
        area = float(np.prod((last - first)[:2]))
        if area > widest and (last > low).all() and (first < high).all():
            widest, middle = area, (first + last) / 2.0
    return float(middle[0]), float(middle[1]), 0.0


def _cells(low: Array, high: Array, cell: float, middle: Place, block: int = 1) -> Grid:
    """Return cells of the lattice with a block about a place that hold a box."""
    x, y, z = middle
    half = block * cell / 2.0
    return Grid.on_lattice(low, high, cell, block, (x - half, y - half, z))


def _coarse_grid(low: Array, high: Array, middle: Place) -> Grid:
    """Return cells of a lattice that hold a box, as small as :data:`_COARSE` of them allow."""
    cell = _LEAST
    while (grid := _cells(low, high, cell, middle, _COARSE_BLOCK)).count > _COARSE:
        cell *= _COARSER
    return grid


def _level(ahead: Array) -> Array:
    """Level unit vectors to where eyes look."""
    level = ahead * [1.0, 1.0, 0.0]
    return level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-3)


def _near(
    low: Array,
    high: Array,
    eyes: Array,
    ahead: Array,
    middle: Place = (0.0, 0.0, 0.0),
    *,
    enclosed: bool = False,
    clear: float = 0.0,
) -> Grid:
    """Return cells in a box, cut down to what eyes have before them if there are too many.

    Its middle then lies ``ahead`` of them, in halves of its size.

    All eyes have cells if that takes no more than :data:`PATH_PROBES`; else the first has. What is
    cut out for it has the same size wherever it looks, and moves in blocks from ``middle``. How
    far they are ``clear`` of surfaces, m, tells what size of cells does.
    """
    wide = tuple(cell for cell in _WIDE if cell <= _CLEAR * clear)
    larger, most = (_LARGER, ROOM_PROBES) if enclosed else (wide, PROBES)
    for edges, enough in ((_FINE, _FEW), ((*CELLS, *larger), most)):
        for cell in edges:
            if (grid := _cells(low, high, cell, middle)).count <= enough:
                return grid
    cell = CELLS[-1]
    tries = [(len(eyes), PATH_PROBES, longer) for longer in (cell, *_PATH_CELLS)]
    for some, most, edge in (*tries, (1, PROBES, cell)):
        if 0 < some <= len(eyes):
            seen = low, high, eyes[:some], ahead[:some], edge, middle
            grid = _before(*seen)
            if grid.count <= most:
                return _grown(grid, *seen)
    while (grid := _cells(low, high, cell, middle)).count > PROBES:
        cell *= _COARSER
    return grid


def _grown(grid: Grid, *seen: *_Seen) -> Grid:
    """Return more of a box than a grid holds, if cells are left, as where eyes are outside it."""
    for step in range(1, _MOST_STEPS):
        larger = _before(*seen, _STEP**step)
        if larger.count > PROBES:
            break
        grid = larger
    return grid


def _before(
    low: Array,
    high: Array,
    eyes: Array,
    ahead: Array,
    cell: float,
    middle: Place,
    scale: float = 1.0,
) -> Grid:
    """Part of a box that eyes have before them, of the usual size or larger."""
    height = min(high[2] - low[2] + 2.0 * cell, _TALLEST)
    side = scale * (math.sqrt(PROBES * cell / height) - 1.0) * cell
    block = _BLOCK * cell
    about = middle + np.round((eyes + side / 2.0 * ahead - middle) / block) * block
    half = np.array([side, side, _TALLEST]) / 2.0
    first, last = about.min(axis=0) - half, about.max(axis=0) + half
    if height < _TALLEST:
        first[2], last[2] = low[2], high[2]
    first, last = np.maximum(low, first), np.minimum(high, last)
    return _cells(*((first, last) if (last > first).all() else (low, high)), cell, middle)


def _filling(
    surfaces: Sequence[Triangles], grid: Grid, samples: SampleCache, *, to_edges: bool = False
) -> Filling:
    low, high = np.asarray(grid.lower), grid.upper
    # What part of a voxel is covered is told by several samples in it.
    spacing = grid.cell / 2.0 if to_edges else grid.cell
    found = [samples.sampled(surface, low, high, spacing) for surface in surfaces]
    small = [
        np.linalg.norm(np.subtract(*surface.bounds)) < _SMALL * grid.cell for surface in surfaces
    ]
    keys = [surface.key for surface in surfaces]
    return Filling(keys, found, [bool(x) for x in small], to_edges)
