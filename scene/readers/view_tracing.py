"""What a camera sees: the first object that each of its rays meets, and the shadows there.

The scene's own objects are looked at as they are in the viewport. Textures are
taken for their material's plain colour, lamps and glass for nothing special.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...quality.combinations import RAYS
from ...quality.seen_points import SeenPoints, openness
from ...uw_spectral.surface.refraction import seen_from_air
from ...uw_spectral.transfer.light_from_above import light_from_above
from ...uw_spectral.transfer.solved_field import SolvedField
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import marks
from . import cameras
from .ray_casting import Meshes
from .waterline import PORT

_WIDTH, _HEIGHT = 48, 27  # rays of a frame; a few of them are looked at more closely
_STEPS = 6  # looks for shadow along a ray
_SKYWARD = 16  # looks for shadow of the light from above
_REACH = 4.0  # optical depths of the clearest band that are looked at
_FARTHEST = 500.0
_FARTHEST_ENTRY = 1000.0  # m, where a ray is let into the water that hardly goes down
_UNDER = 1e-3  # m, how far under the surface rays go on
_OBLIQUE = 0.1  # cosine to the camera's axis at which its glass ends
_OFF_SURFACE = 1e-3
_PLAIN = (0.5, 0.5, 0.5)


@dataclass(frozen=True, eq=False)
class ViewFromAbove:
    """What a camera over the water sees, by m rays, or one with the waterline on its glass."""

    direction: NDArray[np.float64]  #: Unit vectors, (m, 3).
    #: Of the water against what is before each; 1 where the camera's glass is in the water, (m,).
    relative_index: NDArray[np.float64]
    #: What those that go down meet in the water, in their order; each counts by its fraction of the
    #: picture that is let through the surface.
    seen: SeenPoints | None


def trace_view(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    column: WaterColumn,
    field: SolvedField,
    *,
    rays: int = RAYS,
    grid: tuple[int, int] = (_WIDTH, _HEIGHT),
    skyward: int = _SKYWARD,
    steps: int = _STEPS,
) -> SeenPoints:
    """Return what a camera under water sees at the current frame, by about so many ``rays``.

    They are picked from a finer picture of the ``grid``, across and down. The field gives the light
    from above; ``skyward`` is the number of rays towards it from each place, ``steps`` how often
    shadow is looked for along a ray.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = Meshes(depsgraph, marks.objects(scene), "camera")
    rays_of_view = cameras.ray_arrays(scene, camera.evaluated_get(depsgraph), *grid)
    first = _first_seen(*rays_of_view, column, meshes)
    return _with_shadows(first.subsample(rays), column, field, meshes, skyward, steps)


def trace_from_above(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    column: WaterColumn,
    field: SolvedField,
    *,
    rays: int | None = None,
    grid: tuple[int, int] = (_WIDTH, _HEIGHT),
    skyward: int = _SKYWARD,
) -> ViewFromAbove:
    """Return what a camera over the water sees at the current frame, but for objects in the air.

    As :func:`trace_view`; of those rays in the water all are looked at by default.
    """
    origin, direction = cameras.ray_arrays(scene, camera, *grid)
    forward = np.array(cameras.turn_of(camera) @ Vector((0.0, 0.0, -1.0)))
    glass = origin[:, 2] + PORT * direction[:, 2] / np.maximum(direction @ forward, _OBLIQUE)
    n = np.where((glass > 0) & column.reflects, column.refractive_index, 1.0)
    down = np.flatnonzero(direction[:, 2] < 0)
    if not len(down):
        return ViewFromAbove(direction, n, None)
    v = direction[down]
    to_water = np.minimum(-origin[down, 2] / v[:, 2], _FARTHEST_ENTRY)
    place = origin[down] + v * to_water[:, None]
    place[:, 2] = -_UNDER
    R, refracted, _ = seen_from_air(tuple(v.T), (0.0, 0.0, 1.0), n[down])
    towards = np.stack(np.broadcast_arrays(*refracted), axis=1)
    meshes = Meshes(bpy.context.evaluated_depsgraph_get(), marks.objects(scene), "camera")
    first = _first_seen(place, towards, column, meshes)
    first = replace(first, pixels=(1.0 - R) / np.sum(1.0 - R))
    few = first if rays is None else first.subsample(rays)
    return ViewFromAbove(direction, n, _with_shadows(few, column, field, meshes, skyward, _STEPS))


def _with_shadows(
    seen: SeenPoints,
    column: WaterColumn,
    field: SolvedField,
    meshes: Meshes,
    skyward: int,
    steps: int,
) -> SeenPoints:
    end = np.minimum(seen.reached, _to_surface(seen.origin, seen.direction))
    along = end[:, None] * (np.arange(steps) + 0.5) / steps
    stations = seen.origin[:, None] + seen.direction[:, None] * along[..., None]
    to_sun = -np.asarray(column.sun_direction, dtype=np.float64)
    on_surface = np.isfinite(seen.distance)
    points = seen.origin + seen.direction * np.where(on_surface, seen.distance, 0.0)[:, None]
    points = points[on_surface] + seen.normal[on_surface] * _OFF_SURFACE
    upward = light_from_above(field, max(seen.depth, 0.0), skyward)
    sunlit, fraction = np.ones(len(seen), dtype=bool), np.ones(len(seen))
    facing = seen.normal[on_surface] @ to_sun > 0
    sunlit[on_surface] = facing & _clear(meshes, points[:, None], to_sun)[:, 0]
    fraction[on_surface] = openness(
        seen.normal[on_surface], upward, _clear(meshes, points[:, None], upward)
    )
    return replace(
        seen, sunlit=sunlit, path_sunlit=_clear(meshes, stations, to_sun), openness=fraction
    )


def _first_seen(
    origin: NDArray[np.float64], direction: NDArray[np.float64], column: WaterColumn, meshes: Meshes
) -> SeenPoints:
    """What rays meet, its shadows not looked for yet."""
    count = len(origin)
    hits = meshes.first(origin, direction, _to_surface(origin, direction))
    distance = np.array([hit.distance if hit else math.inf for hit in hits])
    normal = np.array([hit.normal if hit else -w for hit, w in zip(hits, direction, strict=True)])
    colour = np.array([hit.colour if hit else _PLAIN for hit in hits])
    to_floor = _along(origin[:, 2] + column.floor_depth, -direction[:, 2])
    on_floor = to_floor < distance
    return SeenPoints(
        origin,
        direction,
        distance=np.minimum(distance, to_floor),
        normal=np.where(on_floor[:, None], [0.0, 0.0, 1.0], normal),
        colour=colour,
        sunlit=np.ones(count, dtype=bool),
        path_sunlit=np.ones((count, 1), dtype=bool),
        reach=min(_REACH / max(float(column.attenuation.min()), 1e-6), _FARTHEST),
        on_floor=on_floor,
        openness=np.ones(count),
        path_openness=np.ones(count),
        pixels=np.full(count, 1.0 / count),
    )


def _clear(
    meshes: Meshes, points: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether nothing stands between points, shape (m, k or 1, 3), and the surface, (m, k)."""
    points, directions = np.broadcast_arrays(points, directions)
    rays = points.reshape(-1, 3), directions.reshape(-1, 3)
    return meshes.clear(*rays, _to_surface(*rays)).reshape(points.shape[:-1])


def _to_surface(origin: NDArray[np.float64], direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance along rays to the water's surface, shape (m,); infinite for those that go down."""
    return _along(np.maximum(-origin[:, 2], 0.0), direction[:, 2])


def _along(distance: NDArray[np.float64], speed: NDArray[np.float64]) -> NDArray[np.float64]:
    away = speed <= 0
    return np.where(away, np.inf, distance / np.where(away, 1.0, speed))
