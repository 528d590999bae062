"""Triangle shapes as arrays, the solids everything is made of, and their way into Blender."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles, shape (m, 3), of vertices, shape (n, 3), in metres, with attributes.

    ``attributes`` are numbers or linear Rec.709 colours per vertex, shape (n,) or (n, 3), read by
    the materials; ``material`` is the material slot, or one for each triangle.
    """

    vertices: Array
    triangles: NDArray[np.int64]
    attributes: Mapping[str, Array] = field(default_factory=dict)
    material: int | NDArray[np.int64] = 0

    def moved(
        self,
        location: ArrayLike = (0, 0, 0),
        rotation: ArrayLike | None = None,
        scale: ArrayLike = 1.0,
    ) -> Shape:
        """Return the shape scaled, then turned by a 3×3 matrix, then shifted."""
        vertices = self.vertices * np.asarray(scale)
        if rotation is not None:
            vertices = vertices @ np.asarray(rotation).T
        return replace(self, vertices=vertices + np.asarray(location))

    def with_attributes(self, **attributes: Array) -> Shape:
        """Return the shape with attributes added."""
        return replace(self, attributes={**self.attributes, **attributes})

    def with_material(self, slot: int) -> Shape:
        """Return the shape in another material slot."""
        return replace(self, material=slot)

    def normals(self) -> Array:
        """Vertex normals, weighted by area, shape (n, 3)."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        face = np.cross(b - a, c - a)
        normals = np.zeros_like(self.vertices)
        for i in range(3):
            np.add.at(normals, self.triangles[:, i], face)
        return normalised(normals)


def normalised(vectors: Array) -> Array:
    """Vectors of shape (..., 3) at length 1."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def joined(shapes: Iterable[Shape]) -> Shape:
    """One shape from many; an attribute missing in some is zero there."""
    parts = list(shapes)
    starts = np.cumsum([0, *(len(p.vertices) for p in parts)])
    attributes = {}
    for name in dict.fromkeys(name for p in parts for name in p.attributes):
        like = next(p.attributes[name] for p in parts if name in p.attributes)
        attributes[name] = np.concatenate(
            [p.attributes.get(name, np.zeros((len(p.vertices), *like.shape[1:]))) for p in parts]
        )
    return Shape(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)]),
        attributes,
        np.concatenate([np.broadcast_to(p.material, len(p.triangles)) for p in parts]),
    )


def grid_triangles(rows: int, columns: int, closed: bool = False) -> NDArray[np.int64]:
    """Triangles of a grid of vertices, row by row; `closed` joins last and first column."""
    i, j = np.meshgrid(
        np.arange(rows - 1), np.arange(columns if closed else columns - 1), indexing="ij"
    )
    right = (j + 1) % columns
    a, b = i * columns + j, i * columns + right
    c, d = a + columns, b + columns
    corners = np.stack([a, b, d, a, d, c], axis=-1)
    return corners.reshape(-1, 3)


def icosphere(level: int) -> Shape:
    """Unit sphere of 20·4^level triangles."""
    golden = (1 + 5**0.5) / 2
    v = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0]], float)
    vertices = normalised(np.concatenate([v, np.roll(v, 1, axis=1), np.roll(v, 2, axis=1)]))
    # The faces of the convex hull are the triples of mutual neighbours.
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 1.1
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    triangles = np.array(faces)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    shape = Shape(vertices, triangles)
    for _ in range(level):
        shape = subdivided(shape)
        shape = replace(shape, vertices=normalised(shape.vertices))
    return shape


def subdivided(shape: Shape) -> Shape:
    """Split each triangle into four at the middles of its edges; attributes and slots are lost."""
    triangles = shape.triangles
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, first, index = np.unique(
        edges[:, 0] * len(shape.vertices) + edges[:, 1], return_index=True, return_inverse=True
    )
    middles = shape.vertices[edges[first]].mean(axis=1)
    (a, b, c), (ab, bc, ca) = triangles.T, index.reshape(-1, 3).T + len(shape.vertices)
    split = np.stack([a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca], -1).reshape(-1, 3)
    return Shape(np.concatenate([shape.vertices, middles]), split)


def tube(points: ArrayLike, radii: ArrayLike, sides: int = 6, tip: float | None = None) -> Shape:
    """Tube along a line of points, shape (n, 3), closed by a tip at its end.

    ``tip`` is its length; by default the last radius, i.e. rounded.
    """
    points = np.asarray(points, float)
    radii = np.broadcast_to(np.asarray(radii, float), len(points))
    tangents = normalised(np.gradient(points, axis=0))
    # The axis least along the line as a whole keeps the rings from twisting.
    reference = np.eye(3)[np.argmin(np.abs(tangents).max(axis=0))]
    u = normalised(np.cross(tangents, reference))
    w = np.cross(tangents, u)
    angle = np.arange(sides) * 2 * np.pi / sides
    ring = np.cos(angle)[:, None] * u[:, None] + np.sin(angle)[:, None] * w[:, None]
    rings = points[:, None] + radii[:, None, None] * ring
    end = points[-1] + tangents[-1] * (radii[-1] if tip is None else tip)
    vertices = np.concatenate([rings.reshape(-1, 3), end[None]])
    last = (len(points) - 1) * sides + np.arange(sides)
    cap = np.stack([last, np.roll(last, -1), np.full(sides, len(vertices) - 1)], axis=1)
    return Shape(vertices, np.concatenate([grid_triangles(len(points), sides, True), cap]))


def revolved(profile: ArrayLike, sides: int = 24) -> Shape:
    """Turn a profile of (radius, z) rows around the z axis; list it from the bottom up."""
    radius, z = np.asarray(profile, float).T
    angle = np.arange(sides) * 2 * np.pi / sides
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    vertices = np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=-1)
    return Shape(vertices.reshape(-1, 3), grid_triangles(len(radius), sides, True))


def torus(major: float, minor: float, segments: int = 24, sides: int = 8) -> Shape:
    """Ring around the z axis."""
    s, t = np.meshgrid(
        np.arange(segments) * 2 * np.pi / segments,
        np.arange(sides) * 2 * np.pi / sides,
        indexing="ij",
    )
    r = major + minor * np.cos(t)
    vertices = np.stack([r * np.cos(s), r * np.sin(s), minor * np.sin(t)], axis=-1)
    triangles = grid_triangles(segments + 1, sides, True) % (segments * sides)
    return Shape(vertices.reshape(-1, 3), triangles)


def box(size: ArrayLike, center: ArrayLike = (0, 0, 0)) -> Shape:
    """Box with its own vertices per face, so that it shades flat."""
    faces = []
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    for axis in range(3):
        for sign in (-1, 1):
            face = np.insert(corners[::sign], axis, sign, axis=1)
            face = face if axis != 1 else face[::-1]
            faces.append(Shape(face, np.array([[0, 1, 2], [0, 2, 3]])))
    return joined(faces).moved(center, scale=np.asarray(size, float) / 2)


def rotation_to(axis: ArrayLike, spin: float = 0.0) -> Array:
    """3×3 matrix that turns +z to `axis`, after a spin about +z in radians."""
    z = normalised(np.asarray(axis, float))
    helper = np.array([0.0, 1, 0]) if abs(z[1]) < 0.9 else np.array([1.0, 0, 0])
    x = normalised(np.cross(helper, z))
    turned = np.stack([x, np.cross(z, x), z], axis=1)
    c, s = np.cos(spin), np.sin(spin)
    return turned @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def to_mesh(
    shape: Shape, name: str, materials: Iterable[bpy.types.Material], smooth: bool = True
) -> bpy.types.Mesh:
    """Make a Blender mesh; numbers become float attributes, triples colours, "uv" a UV map."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.vertices, (), shape.triangles)
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set(
        "material_index", np.broadcast_to(shape.material, len(shape.triangles)).astype(np.int32)
    )
    for key, values in shape.attributes.items():
        if key == "uv":
            layer = mesh.uv_layers.new(name="UVMap")
            layer.uv.foreach_set("vector", values[shape.triangles.ravel()].ravel())
        elif values.ndim == 1:
            mesh.attributes.new(key, "FLOAT", "POINT").data.foreach_set("value", values)
        else:
            colors = np.concatenate([values, np.ones((len(values), 1))], axis=1)
            mesh.attributes.new(key, "FLOAT_COLOR", "POINT").data.foreach_set(
                "color", colors.ravel()
            )
    if smooth:
        mesh.shade_smooth()
    else:
        mesh.shade_flat()
    mesh.update()
    return mesh


def place(
    mesh: bpy.types.Mesh,
    collection: bpy.types.Collection,
    location: ArrayLike = (0, 0, 0),
    rotation: ArrayLike | None = None,
    scale: ArrayLike = 1.0,
    name: str | None = None,
) -> bpy.types.Object:
    """Put an object that shares `mesh` into the scene; `rotation` is a 3×3 matrix."""
    item = bpy.data.objects.new(name or mesh.name, mesh)
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if rotation is None else np.asarray(rotation)) * np.asarray(scale)
    matrix[:3, 3] = location
    item.matrix_world = Matrix(matrix.tolist())
    collection.objects.link(item)
    return item
