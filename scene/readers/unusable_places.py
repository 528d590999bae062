"""What has no usable place in a scene: not finite, or too far away for single precision."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import ArrayLike, NDArray

from ...uw_spectral.errors import first_of
from .. import marks
from ..rendered import in_rendered_collections

_FARTHEST = 1e6
"""Coordinates from which on objects are left out, m."""
WITH_PLACES = (bpy.types.Mesh, bpy.types.Curves, bpy.types.PointCloud)
"""Data of which :func:`vertices_of` gives places."""
_ONES = Vector((1.0, 1.0, 1.0, 1.0))


def usable(numbers: ArrayLike) -> NDArray[np.bool_]:
    """Whether all numbers of each row are finite and not too far away.

    Examples
    --------
    >>> usable([[0.0, 1.0], [np.nan, 0.0], [0.0, 1e30]]).tolist()
    [True, False, False]
    """
    return (np.abs(np.asarray(numbers)) <= _FARTHEST).all(axis=-1)


def has_place(place: Matrix) -> bool:
    """Whether the matrix of an object is usable."""
    # There may be very many: sums of rows tell it, and numpy takes ten times as long.
    return (place @ _ONES).length <= _FARTHEST


def notes() -> list[str]:
    """Name what is left out of the open scene because of its place; every mesh is looked at."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shown = in_rendered_collections(depsgraph.view_layer)
    lost: dict[str, None] = {}
    torn: dict[str, None] = {}
    meshes: dict[int, bool] = {}
    for found in depsgraph.object_instances:
        item = found.object
        owner = (found.parent or item) if found.is_instance else item
        if owner.hide_render or owner.original not in shown or marks.MARK in owner:
            continue
        if not has_place(found.matrix_world):
            lost[item.name] = None
        elif isinstance(item.data, WITH_PLACES):
            key = item.data.as_pointer()
            if key not in meshes:
                meshes[key] = bool(usable(vertices_of(item.data)).all())
            if not meshes[key]:
                torn[item.name] = None
    said = "not finite, or farther away than 1000 km"
    return [
        f"{what} of {first_of(map(repr, names))}: {said}; left out"
        for what, names in (("place or scale", lost), ("vertices or points", torn))
        if names
    ]


def vertices_of(data: bpy.types.ID) -> NDArray[np.float32]:
    """Vertices of a mesh, or points of hair or a cloud, as they are in its own axes, (v, 3)."""
    is_mesh = isinstance(data, bpy.types.Mesh)
    found, name = (data.vertices, "co") if is_mesh else (data.attributes["position"].data, "vector")
    vertices = np.empty((len(found), 3), dtype=np.float32)
    found.foreach_get(name, vertices.ravel())
    return vertices
