"""Hair, curves without a surface of their own, and points, as ribbons that face an eye."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...uw_spectral.occlusion.visibility_buffer import Surface
from ..materials.mean_colours import mean_colour
from .unusable_places import usable
from .visible_meshes import visible_instances

_MOST_PARTS = 10_000  # of hair or a cloud: of more every second, third, ... is taken
_MOST_STRANDS = 1_000  # of particles, which are read one by one
_THIN = 1e-9

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Threads:
    """Straight parts of threads, or points."""

    starts: Array  #: m, (n, 3).
    ends: Array  #: The same of points, m, (n, 3).
    radii: Array  #: m, (n,).
    colour: Array  #: Linear Rec.709.
    each: float = 1.0  #: How many parts each stands for.

    def usable(self) -> Threads:
        """Return those that have a place and a width."""
        kept = usable(self.starts) & usable(self.ends) & np.isfinite(self.radii)
        return replace(self, starts=self.starts[kept], ends=self.ends[kept], radii=self.radii[kept])

    def ribbons(self, eye: tuple[float, ...]) -> Surface:
        """Return them as they cover what an eye sees."""
        along, middle = (self.ends - self.starts) / 2.0, (self.starts + self.ends) / 2.0
        way = middle - np.asarray(eye)
        radii = self.radii[:, None]
        point = (along**2).sum(axis=1, keepdims=True) < _THIN**2
        # A point is a square of the same area.
        half = np.where(point, np.sqrt(np.pi) / 2.0 * radii, radii)
        other = np.cross(way, np.where(np.abs(way[:, :1]) < np.abs(way[:, 1:2]), *np.eye(2, 3)))
        along = np.where(point, half * _unit(other), along)
        across = half * _unit(np.cross(way, along))
        a, b, c, d = (
            middle + s * along + t * across for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        )
        corners = np.concatenate([np.stack(x, axis=1) for x in ((a, b, c), (a, c, d))])
        return Surface(corners, np.tile(self.colour, (len(corners), 1)), self.each)


def visible_threads(
    depsgraph: bpy.types.Depsgraph, leave_out: Collection[bpy.types.Object] = ()
) -> Iterator[Threads]:
    """Yield hair, hair of particles and clouds of points that renders show, but for some."""
    for found in visible_instances(depsgraph, leave_out):
        item, place = found.object, found.matrix_world
        if not item.visible_camera:
            continue
        if isinstance(item.data, bpy.types.Curves):
            yield _of_curves(item, place).usable()
        elif isinstance(item.data, bpy.types.PointCloud):
            yield _of_points(item, place).usable()
    for item in depsgraph.objects:
        if item.original in leave_out or item.original.hide_render:
            continue
        for system in hair_of(item):
            yield _of_particles(item, system).usable()


def hair_of(item: bpy.types.Object) -> Iterator[bpy.types.ParticleSystem]:
    """Yield the particle systems of an object that are drawn as hair."""
    for system in item.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            yield system


def material_of(item: bpy.types.Object, index: int) -> bpy.types.Material | None:
    """Return the material in the slot of an index, in the last one where there are fewer."""
    slots = item.material_slots
    return slots[min(index, len(slots) - 1)].material if len(slots) else None


def _of_curves(item: bpy.types.Object, place: Matrix) -> Threads:
    data = item.data
    points = _placed(_values(data, "position", 3), place)
    firsts = np.zeros(len(data.curves) + 1, np.int32)
    data.curve_offset_data.foreach_get("value", firsts)
    starts = np.delete(np.arange(len(points)), firsts[1:] - 1)
    every = -(-len(starts) // _MOST_PARTS) or 1
    starts = starts[::every]
    radii = _radii(data, len(points), place)
    middle = (radii[starts] + radii[starts + 1]) / 2.0
    return Threads(points[starts], points[starts + 1], middle, _colour(item, 0), float(every))


def _of_points(item: bpy.types.Object, place: Matrix) -> Threads:
    points = _placed(_values(item.data, "position", 3), place)
    every = -(-len(points) // _MOST_PARTS) or 1
    radii = _radii(item.data, len(points), place)[::every]
    points = points[::every]
    return Threads(points, points, radii, _colour(item, 0), float(every))


def _of_particles(item: bpy.types.Object, system: bpy.types.ParticleSystem) -> Threads:
    settings = system.settings
    shown = len(system.child_particles) or len(system.particles)
    first = len(system.particles) if len(system.child_particles) else 0
    every = -(-shown // _MOST_STRANDS) or 1
    steps = range(2**settings.display_step + 1)
    strands = np.array(
        [
            [system.co_hair(object=item, particle_no=first + strand, step=step) for step in steps]
            for strand in range(0, shown, every)
        ],
        np.float64,
    ).reshape(-1, len(steps), 3)
    starts, ends = strands[:, :-1].reshape(-1, 3), strands[:, 1:].reshape(-1, 3)
    along = (np.arange(len(steps) - 1) + 0.5) / (len(steps) - 1)
    width = settings.root_radius + along * (settings.tip_radius - settings.root_radius)
    radii = np.tile(width * settings.radius_scale, len(strands))
    return Threads(starts, ends, radii, _colour(item, settings.material - 1), float(every))


def _values(data: bpy.types.ID, name: str, size: int) -> Array:
    attribute = data.attributes[name]
    values = np.empty(size * len(attribute.data), np.float32)
    attribute.data.foreach_get("value" if size == 1 else "vector", values)
    return values.astype(np.float64).reshape(-1, size)


def _radii(data: bpy.types.ID, count: int, place: Matrix) -> Array:
    scale = abs(place.to_3x3().determinant()) ** (1.0 / 3.0)
    if "radius" not in data.attributes:
        return np.full(count, 0.01 * scale)
    return _values(data, "radius", 1)[:, 0] * scale


def _placed(points: Array, place: Matrix) -> Array:
    matrix = np.array(place)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _colour(item: bpy.types.Object, slot: int) -> Array:
    return np.array(mean_colour(material_of(item, slot)))


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), _THIN)
