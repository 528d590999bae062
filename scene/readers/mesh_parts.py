"""Parts of meshes, by material and painted attributes, and what they show in the mean."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...uw_spectral.last_used import LastUsed
from ..materials.mean_colours import MeanSurface, attributes_of, mean_surface
from ..materials.surface_points import Array, SurfacePoints, spread
from .unusable_places import usable, vertices_of

_POINTS, _FEWEST = 512, 64  # at which the materials of a mesh, and each of its parts, are evaluated
_STEPS = 2  # from 0 to 1 of a painted attribute, of which parts are told apart
_MOST = 16  # parts of a material
_SIZES = {"FLOAT": 1, "FLOAT_COLOR": 4, "BYTE_COLOR": 4, "BOOLEAN": 1, "INT": 1, "INT8": 1}
_VECTORS = {"FLOAT_VECTOR": 3, "FLOAT2": 2}
_SMALLEST = 1e-30


@dataclass(frozen=True, eq=False)
class Sample:
    """Points on triangles: their corners, vertices, (n, 3), faces, (n,), and weights, (n, 3)."""

    corners: NDArray[np.int32]
    vertices: NDArray[np.int32]
    faces: NDArray[np.int32]
    weights: Array

    def of(self, domain: str, values: NDArray[np.floating]) -> Array | None:
        """Return values of a mesh at the points, shape (n, k)."""
        if domain == "FACE":
            return values[self.faces].astype(np.float64)
        places = {"POINT": self.vertices, "CORNER": self.corners}.get(domain)
        if places is None:
            return None
        return (self.weights[..., None] * values[places]).sum(axis=1, dtype=np.float64)

    def at(self, some: NDArray[np.int64], weights: Array) -> Sample:
        """Return points on some of the triangles."""
        return Sample(self.corners[some], self.vertices[some], self.faces[some], weights)


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Triangles of a mesh, by parts."""

    vertices: NDArray[np.float32]  #: (v, 3).
    triangles: NDArray[np.int32]  #: (t, 3).
    parts: NDArray[np.int32]  #: Of each triangle, (t,).
    digest: bytes  #: The same of two that are the same.
    slots: tuple[int, ...]  #: The material's place of each part.
    samples: tuple[Sample, ...] = field(repr=False)  #: Points of each part.

    def without(self, clear: Collection[int]) -> MeshArrays:
        """Return the triangles but those of some parts."""
        if not clear:
            return self
        kept = ~np.isin(self.parts, list(clear))
        digest = self.digest + repr(sorted(clear)).encode()
        return replace(self, triangles=self.triangles[kept], parts=self.parts[kept], digest=digest)


class MeshCache(LastUsed[bytes, MeshArrays]):
    """Arrays of meshes that are as they were when they were last asked for."""

    def arrays(
        self, mesh: bpy.types.Mesh, materials: Collection[bpy.types.Material | None]
    ) -> MeshArrays:
        """Return the triangles of a mesh with materials."""
        painted = _painted(mesh, materials)
        count = max(len(materials), 1)
        digest = _digest(mesh, count, painted)
        return self.get(digest, lambda: _arrays(mesh, count, painted, digest))

    def opaque(self, arrays: MeshArrays, clear: Collection[int]) -> MeshArrays:
        """Return the triangles but those of some parts."""
        key = arrays.digest + repr(sorted(clear)).encode()
        return self.get(key, lambda: arrays.without(clear))


def means_of(
    arrays: MeshArrays,
    item: bpy.types.Object,
    place: Matrix,
    materials: list[bpy.types.Material | None],
    known: dict[bpy.types.Material | None, MeanSurface],
) -> list[MeanSurface]:
    """Return what the parts of a mesh reflect and cover.

    ``known`` are those of materials that are the same on every surface; found ones are added.
    """
    found = []
    for slot, sample in zip(arrays.slots, arrays.samples, strict=True):
        material = materials[slot] if materials else None
        mean = known.get(material)
        if mean is None:
            points = MeshPoints(len(sample.faces), item, place, mesh=item.data, sample=sample)
            mean = mean_surface(material, points)
            if mean.anywhere:
                known[material] = mean
        found.append(mean)
    return found


@dataclass(frozen=True, eq=False)
class MeshPoints(SurfacePoints):
    """Points on the mesh of an evaluated object."""

    mesh: bpy.types.Mesh = field(kw_only=True)
    sample: Sample = field(kw_only=True)

    @property
    def has_mesh(self) -> bool:
        """Whether they are on a mesh."""
        return True

    def uv(self, name: str = "") -> Array | None:
        """Return coordinates of a UV map, that of renders without a name, shape (n, 3)."""
        layers = self.mesh.uv_layers
        name = name or next((layer.name for layer in layers if layer.active_render), "")
        return self.attribute(name) if name else np.zeros((self.count, 3))

    def attribute(self, name: str) -> Array | None:
        """Return an attribute, shape (n, 1), (n, 3) or (n, 4); the colours without a name."""
        name = name or self.mesh.color_attributes.default_color_name
        found = _read(self.mesh, name, _SIZES | _VECTORS)
        return None if found is None else self.sample.of(*found)

    def generated(self) -> Array | None:
        """Return places in the mesh's own box, shape (n, 3)."""
        mesh, places = self.mesh, self.local()
        size = np.array(mesh.texspace_size)
        return (places - np.array(mesh.texspace_location)) / np.where(size, 2.0 * size, 1.0) + 0.5

    def local(self) -> Array:
        """Return places in the object's space, shape (n, 3)."""
        places = self.sample.of("POINT", vertices_of(self.mesh))
        return np.zeros((1, 3)) if places is None else places

    def normal(self) -> Array:
        """Return normals of the faces in the object's space, shape (n, 3)."""
        normals = np.empty((len(self.mesh.polygons), 3), np.float32)
        self.mesh.polygon_normals.foreach_get("vector", normals.ravel())
        return normals[self.sample.faces].astype(float)


def _read(
    mesh: bpy.types.Mesh, name: str, sizes: Mapping[str, int]
) -> tuple[str, NDArray[np.float32]] | None:
    """Return domain and values, shape (m, k), of an attribute of one of some types."""
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.data_type not in sizes:
        return None
    size = sizes[attribute.data_type]
    whole = attribute.data_type.startswith(("INT", "BOOL"))
    values = np.empty(size * len(attribute.data), np.int32 if whole else np.float32)
    attribute.data.foreach_get({4: "color", 1: "value"}.get(size, "vector"), values)
    values = values.reshape(-1, size).astype(np.float32, copy=False)
    return attribute.domain, np.pad(values, ((0, 0), (0, 1))) if size == 2 else values


def _painted(
    mesh: bpy.types.Mesh, materials: Iterable[bpy.types.Material | None]
) -> dict[str, tuple[str, NDArray[np.float32]]]:
    """Return domains and values of the attributes of a mesh by which its materials differ."""
    names = set().union(*map(attributes_of, materials))
    if "" in names:
        names.add(mesh.color_attributes.default_color_name)
    found = {name: _read(mesh, name, _SIZES) for name in sorted(names - {"", None})}
    return {name: read for name, read in found.items() if read is not None}


_READ_AT_ONCE = {
    "position": ("vector", np.float32, 3),
    ".corner_vert": ("value", np.int32, 1),
    ".corner_edge": ("value", np.int32, 1),
    "material_index": ("value", np.int32, 1),
}
"""Attributes that decide what triangles a mesh has; they are read as they lie in memory."""


def _digest(
    mesh: bpy.types.Mesh, materials: int, painted: Mapping[str, tuple[str, NDArray[np.float32]]]
) -> bytes:
    """Return what differs where the triangles of a mesh or their parts do."""
    digest = hashlib.sha1(usedforsecurity=False)
    digest.update(repr((len(mesh.polygons), materials)).encode())
    for name, (field_, kind, size) in _READ_AT_ONCE.items():
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            values = np.empty(size * len(attribute.data), kind)
            attribute.data.foreach_get(field_, values)
            digest.update(name.encode())
            digest.update(values.data)
    for name, (domain, values) in painted.items():
        digest.update(f"{name} {domain}".encode())
        digest.update(np.ascontiguousarray(values).data)
    return digest.digest()


def _arrays(
    mesh: bpy.types.Mesh,
    materials: int,
    painted: Mapping[str, tuple[str, NDArray[np.float32]]],
    digest: bytes,
) -> MeshArrays:
    found = mesh.loop_triangles
    count = len(found)
    corners, faces = np.empty((count, 3), np.int32), np.empty(count, np.int32)
    triangles = np.empty((count, 3), np.int32)
    found.foreach_get("loops", corners.ravel())
    found.foreach_get("vertices", triangles.ravel())
    found.foreach_get("polygon_index", faces)
    slots = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    vertices = vertices_of(mesh)
    known = usable(vertices)
    if not known.all():
        kept = known[triangles].all(axis=1)
        corners, faces, triangles = corners[kept], faces[kept], triangles[kept]
        vertices = np.where(known[:, None], vertices, 0)
    middles = Sample(corners, triangles, faces, np.full((1, 3), 1.0 / 3.0))
    used = np.minimum(slots[faces], materials - 1)
    numbers, parts = _numbered(used, [middles.of(*values) for values in painted.values()])
    one, other = (vertices[triangles[:, n]] - vertices[triangles[:, 0]] for n in (1, 2))
    areas = np.linalg.norm(np.cross(one, other), axis=1) + _SMALLEST
    each = max(_POINTS // max(len(numbers), 1), _FEWEST)
    samples = [
        _drawn(middles, np.flatnonzero(parts == n), areas, each) for n in range(len(numbers))
    ]
    return MeshArrays(vertices, triangles, parts, digest, tuple(numbers), tuple(samples))


def _numbered(
    slots: NDArray[np.int32], painted: Iterable[Array | None]
) -> tuple[list[int], NDArray[np.int32]]:
    """Return the slots of parts, and the part of each triangle by slots and painted values."""
    levels = [
        np.rint(np.nan_to_num(np.clip(x, 0.0, 1.0)) * _STEPS)[:, :3]
        for x in painted
        if x is not None
    ]
    rows = np.concatenate([slots[:, None], *levels], axis=1).astype(np.int32)
    found, parts = np.unique(rows, axis=0, return_inverse=True)
    if len(found) > _MOST * len(np.unique(slots)):
        found, parts = np.unique(slots[:, None], axis=0, return_inverse=True)
    return found[:, 0].tolist(), parts.reshape(-1).astype(np.int32)


def _drawn(of: Sample, some: NDArray[np.int64], areas: NDArray[np.floating], count: int) -> Sample:
    """Return points that are spread evenly over the areas of some triangles."""
    ends = np.cumsum(areas[some], dtype=np.float64)
    along, u, v = spread(count, 3).T
    first = np.searchsorted(ends, along * ends[-1])
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    return of.at(some[np.minimum(first, len(some) - 1)], np.stack([1.0 - u - v, u, v], axis=1))
