"""Rays through the meshes of a scene that its renders show.

``Scene.ray_cast`` tries every object with every ray. Here boxes are tried for
all rays at once, and a mesh is searched only by rays that enter its box;
objects and instances that share a mesh share its search tree.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Collection, Hashable, Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from ..materials.mean_colours import Rgb
from .mesh_parts import MeshArrays
from .visible_meshes import Ray, VisibleMesh, visible_meshes

_AT_ONCE = 200_000  # rays times boxes
_FARTHEST = 1e30  # what a search tree takes for infinite
_LOOSE = 1e-5  # of a box, for the rounding of the rays that graze it
_SKEW = 1e-5  # of the squares of a matrix that keeps angles
_FLAT = 1e-12  # determinant of a matrix without inverse, to the cube of its size


@dataclass(frozen=True)
class Hit:
    """What a ray meets: distance in m, unit normal towards the ray, mean colour if it is known."""

    distance: float
    normal: Vector
    colour: Rgb | None


class _Mesh:
    """Triangles; their tree is built when a ray first comes near."""

    def __init__(self, arrays: MeshArrays) -> None:
        self.vertices, self.triangles = arrays.vertices, arrays.triangles
        self.parts = arrays.parts

    @functools.cached_property
    def tree(self) -> BVHTree:
        return _tree(self.vertices, self.triangles)

    @functools.cached_property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the bounding box, shape (8, 3)."""
        ends = np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)], dtype=np.float64)
        return np.array([(ends[i, 0], ends[j, 1], ends[k, 2]) for i, j, k in np.ndindex(2, 2, 2)])


class PlacedMesh:
    """A mesh in its place."""

    def __init__(self, mesh: _Mesh, shown: VisibleMesh) -> None:
        place = shown.place
        self.mesh, self.materials = mesh, shown.materials
        self.colours = [mean.colour for mean in shown.means]
        turned = np.array(place)
        corners = mesh.corners @ turned[:3, :3].T + turned[:3, 3]
        self.low, self.high = corners.min(axis=0), corners.max(axis=0)
        size = np.linalg.norm(turned[:3, :3])
        self.flat = abs(np.linalg.det(turned[:3, :3])) <= _FLAT * size**3
        self.place = place
        self.inverse = Matrix() if self.flat else place.inverted()
        self.turn = self.inverse.to_3x3()

    @functools.cached_property
    def tree(self) -> BVHTree:
        """Search tree; one of its own, in world space, where the place squeezes the mesh flat."""
        return self._world_tree if self.flat else self.mesh.tree

    @functools.cached_property
    def _world_tree(self) -> BVHTree:
        turned = np.array(self.place)
        vertices = self.mesh.vertices @ turned[:3, :3].T + turned[:3, 3]
        return _tree(vertices, self.mesh.triangles)

    @functools.cached_property
    def _keeps_angles(self) -> bool:
        turn = np.array(self.place)[:3, :3]
        square = turn.T @ turn
        return not self.flat and np.allclose(square, square[0, 0] * np.eye(3), atol=_SKEW)

    def distance(self, point: Vector) -> float:
        """Distance of a point from the surface, m."""
        if not self._keeps_angles:
            return float(self._world_tree.find_nearest(point)[3])
        found = self.tree.find_nearest(self.inverse @ point)[0]
        return float((self.place @ found - point).length)

    def cast(
        self, origin: Vector, direction: Vector, farthest: float
    ) -> tuple[float, Vector, int] | None:
        """Distance, normal in the mesh's space and triangle of the first hit."""
        heading = self.turn @ direction
        stretch = heading.length
        limit = min(farthest * stretch, _FARTHEST)
        _, normal, index, distance = self.tree.ray_cast(self.inverse @ origin, heading, limit)
        return None if index is None else (distance / stretch, normal, index)

    def hit(self, direction: Vector, distance: float, normal: Vector, triangle: int) -> Hit:
        """Describe what was hit."""
        # What is squeezed to a point has no normal.
        normal = (self.turn.transposed() @ normal).normalized() if normal.length else direction
        colour = self.colours[self.mesh.parts[triangle]] if self.colours else None
        return Hit(distance, normal if normal.dot(direction) < 0 else -normal, colour)


class Meshes:
    """Every mesh that renders show, less what is left out, until the depsgraph is evaluated again.

    ``ray`` is what rays are cast for, see :func:`.visible_meshes`.
    """

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        leave_out: Collection[bpy.types.Object] = (),
        ray: Ray | None = None,
    ) -> None:
        meshes: dict[Hashable, _Mesh] = {}
        self.instances: list[PlacedMesh] = []
        for shown in visible_meshes(depsgraph, leave_out, ray):
            if shown.key not in meshes:
                meshes[shown.key] = _Mesh(shown.arrays)
            self.instances.append(PlacedMesh(meshes[shown.key], shown))
        low, high = (
            np.array([getattr(i, end) for i in self.instances]).reshape(-1, 3)
            for end in ("low", "high")
        )
        loose = _LOOSE * (np.abs(low) + np.abs(high) + 1.0)
        self._low, self._high = low - loose, high + loose

    def first(
        self,
        origin: NDArray[np.float64],
        direction: NDArray[np.float64],
        farthest: NDArray[np.float64],
    ) -> list[Hit | None]:
        """Return what rays, origins and unit vectors of shape (m, 3), meet before a distance, m."""
        hits: list[Hit | None] = []
        for start, heading, limit, near in self.near(origin, direction, farthest):
            best = None
            for entry, instance in near:
                if entry >= limit:
                    break
                found = instance.cast(start, heading, limit)
                if found is not None:
                    limit, best = found[0], (instance, found)
            hits.append(best[0].hit(heading, *best[1]) if best else None)
        return hits

    def clear(
        self,
        origin: NDArray[np.float64],
        direction: NDArray[np.float64],
        farthest: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        """Whether rays meet nothing, shape (m,); arguments as for :meth:`first`."""
        if not self.instances:
            return np.ones(len(origin), dtype=bool)
        return np.array(
            [
                all(instance.cast(start, heading, limit) is None for _, instance in near)
                for start, heading, limit, near in self.near(origin, direction, farthest)
            ],
            dtype=bool,
        )

    def near(
        self,
        origin: NDArray[np.float64],
        direction: NDArray[np.float64],
        farthest: NDArray[np.float64],
    ) -> Iterator[tuple[Vector, Vector, float, list[tuple[float, PlacedMesh]]]]:
        """Each ray with the instances whose boxes it enters, the nearest first."""
        direction = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
        step = max(_AT_ONCE // max(len(self.instances), 1), 1)
        for first in range(0, len(origin), step):
            rays = slice(first, first + step)
            o, w = origin[rays], direction[rays]
            far = farthest[rays, None]
            near = np.zeros_like(far)
            for axis in range(3):
                at, speed = o[:, axis, None], 1.0 / w[:, axis, None]
                one, other = (self._low[:, axis] - at) * speed, (self._high[:, axis] - at) * speed
                near = np.maximum(near, np.minimum(one, other))
                far = np.minimum(far, np.maximum(one, other))
            row, which = np.nonzero(near <= far)
            entry = near[row, which]
            order = np.lexsort((entry, row))
            entries, numbers = entry[order].tolist(), which[order].tolist()
            ends = np.searchsorted(row, np.arange(len(o)), side="right").tolist()
            limits = farthest[rays].tolist()
            for start, heading, limit, (one, other) in zip(
                o.tolist(), w.tolist(), limits, itertools.pairwise((0, *ends)), strict=True
            ):
                near_ray = zip(entries[one:other], numbers[one:other], strict=True)
                boxes = [(at, self.instances[number]) for at, number in near_ray]
                yield Vector(start), Vector(heading), limit, boxes


def _tree(vertices: NDArray, triangles: NDArray[np.int32]) -> BVHTree:
    return BVHTree.FromPolygons(vertices.tolist(), triangles.tolist(), all_triangles=True)
