"""Closed solids: the surface of a field, and cut sheets made thick."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .shapes import Shape

Array = NDArray[np.float64]
_CORNERS = np.array(list(np.ndindex(2, 2, 2)))
# The edges of a cell, as pairs of its corners.
_EDGES = [
    (a, b)
    for a in range(8)
    for b in range(a + 1, 8)
    if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1
]


def surface_net(values: Array, origin: ArrayLike, spacing: float) -> Shape:
    """Closed surface around where a field is negative (naive surface nets, Gibson 1998).

    ``values``, shape (nx, ny, nz), are positive on the outermost points, or the surface stays open
    there; ``origin`` is where ``values[0, 0, 0]`` is, ``spacing`` between values, m.
    """
    inside = values < 0
    count = np.zeros(np.array(values.shape) - 1, np.int8)
    for i, j, k in _CORNERS:
        count += inside[i : i + count.shape[0], j : j + count.shape[1], k : k + count.shape[2]]
    cells = np.argwhere((count > 0) & (count < 8))
    at_corner = [values[tuple((cells + corner).T)] for corner in _CORNERS]
    total, crossings = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for a, b in _EDGES:
        crossed = (at_corner[a] < 0) != (at_corner[b] < 0)
        low, high = at_corner[a][crossed], at_corner[b][crossed]
        along = (low / (low - high))[:, None]
        total[crossed] += _CORNERS[a] + along * (_CORNERS[b] - _CORNERS[a])
        crossings[crossed] += 1
    vertices = np.asarray(origin) + spacing * (cells + total / crossings[:, None])
    number = np.full(count.shape, -1)
    number[tuple(cells.T)] = np.arange(len(cells))
    triangles = []
    for axis in range(3):
        here = np.moveaxis(inside, axis, 0)
        ends = np.moveaxis(number, axis, 0)
        # An edge that leaves the solid is crossed by the face of the four cells around it.
        leaves = here[:-1, 1:-1, 1:-1] != here[1:, 1:-1, 1:-1]
        i, j, k = np.argwhere(leaves).T
        quad = [ends[i, j, k], ends[i, j + 1, k], ends[i, j + 1, k + 1], ends[i, j, k + 1]]
        outwards = here[i, j + 1, k + 1] != (axis == 1)
        corners = np.stack(quad, axis=1)
        corners[~outwards] = corners[~outwards, ::-1]
        triangles += [corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]
    return Shape(vertices, np.concatenate(triangles))


def clipped(shape: Shape, keep: Array) -> Shape:
    """Cut a shape along the zero line of a number per vertex, and keep where it is positive.

    Attributes follow by linear interpolation; material slots must be one for all.
    """
    keep = np.where(keep == 0, 1e-9, keep)
    columns = {"": shape.vertices, **shape.attributes}
    added: dict[str, list[Array]] = {name: [] for name in columns}
    total, kept = len(shape.vertices), []
    positive = keep[shape.triangles] > 0
    kept.append(shape.triangles[positive.all(axis=1)])
    for corners_kept in (1, 2):
        some = positive.sum(axis=1) == corners_kept
        triangles = shape.triangles[some]
        # Turn each so that the corner that is alone comes first.
        alone = np.argmax(positive[some] == (corners_kept == 1), axis=1)
        turned = (alone[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(triangles, turned, axis=1).T
        cuts = []
        for other in (b, c):
            # The same edge is cut at the same point from both sides.
            low, high = np.minimum(a, other), np.maximum(a, other)
            edges, index = np.unique(np.stack([low, high], 1), axis=0, return_inverse=True)
            along = keep[edges[:, 0]] / (keep[edges[:, 0]] - keep[edges[:, 1]])
            for name, values in columns.items():
                t = along.reshape(-1, *[1] * (values.ndim - 1))
                added[name].append(values[edges[:, 0]] * (1 - t) + values[edges[:, 1]] * t)
            cuts.append(total + index.ravel())
            total += len(edges)
        ab, ac = cuts
        if corners_kept == 1:
            kept.append(np.stack([a, ab, ac], axis=1))
        else:
            kept += [np.stack([b, c, ab], axis=1), np.stack([c, ac, ab], axis=1)]
    whole = {name: np.concatenate([columns[name], *parts]) for name, parts in added.items()}
    return _welded(Shape(whole.pop(""), np.concatenate(kept), whole, shape.material))


def _welded(shape: Shape) -> Shape:
    """Shape without unused vertices, and with one for those at one place."""
    used = np.unique(shape.triangles)
    _, first, index = np.unique(
        shape.vertices[used], axis=0, return_index=True, return_inverse=True
    )
    new = np.full(len(shape.vertices), -1)
    new[used] = index.ravel()
    triangles = new[shape.triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    at = used[first]
    attributes = {name: values[at] for name, values in shape.attributes.items()}
    return Shape(shape.vertices[at], triangles, attributes, shape.material)


def thickened(shape: Shape, thickness: float) -> Shape:
    """Closed plate from a sheet, grown against its normals; attributes are on both sides."""
    back = shape.vertices - thickness * shape.normals()
    edges = shape.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    sorted_edges = np.sort(edges, axis=1)
    _, index, count = np.unique(sorted_edges, axis=0, return_inverse=True, return_counts=True)
    rim = edges[count[index.ravel()] == 1]
    n = len(shape.vertices)
    a, b = rim.T
    walls = np.concatenate([np.stack([b, a, a + n], 1), np.stack([b, a + n, b + n], 1)])
    return Shape(
        np.concatenate([shape.vertices, back]),
        np.concatenate([shape.triangles, shape.triangles[:, ::-1] + n, walls]),
        {name: np.concatenate([values, values]) for name, values in shape.attributes.items()},
        shape.material,
    )


def open_edges(shape: Shape) -> int:
    """Count the edges that do not have the same number of triangles on either side."""
    edges = shape.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    key = np.minimum(*edges.T) * len(shape.vertices) + np.maximum(*edges.T)
    sign = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, index = np.unique(key, return_inverse=True)
    return int(np.count_nonzero(np.bincount(index.ravel(), sign)))
