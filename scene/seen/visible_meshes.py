"""The meshes of a scene that renders show, instances included, as the viewport evaluates them."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Hashable, Iterator
from dataclasses import dataclass
from typing import Literal

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...uw_spectral.last_used import LastUsed
from .. import marks
from ..materials.mean_colours import MeanSurface, mask_of, mean_surface
from ..rendered import VERTEX_INSTANCERS, in_rendered_collections
from .unusable_places import has_place, usable, vertices_of

_OPAQUE = 0.5  # coverage from which a surface counts as whole


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Vertices (v, 3), triangles (t, 3) of them, and the material's place by triangle (t,).

    ``digest`` tells whether two have the same, ``masks`` the place in :data:`MASKS` by triangle.
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    slots: NDArray[np.int32]
    digest: bytes
    masks: NDArray[np.int32]


class KeptMeshes(LastUsed[bytes, MeshArrays]):
    """Arrays of meshes that are as they were when they were last asked for."""

    def arrays(
        self, mesh: bpy.types.Mesh, clear: Collection[int], materials: int, mask: str = ""
    ) -> MeshArrays:
        """Return the triangles of a mesh but those of some materials."""
        digest = _digest(mesh, clear, materials, mask)
        return self.get(digest, lambda: _arrays(mesh, clear, materials, mask, digest))


@dataclass(frozen=True, eq=False)
class VisibleMesh:
    """A mesh in its place; ``key`` tells which ones share their arrays.

    ``means`` are what its materials reflect and cover, where rays of a kind were asked for: of each
    one for each of :data:`MASKS` where that makes a difference.
    """

    key: Hashable
    arrays: MeshArrays
    place: Matrix
    materials: list[bpy.types.Material | None]
    means: list[MeanSurface]

    @property
    def is_masked(self) -> bool:
        """Whether the materials differ with an attribute of the mesh."""
        return len(self.means) > len(self.materials)


MASKS = 0.0, 0.5, 1.0
"""Values of an attribute by which a material is mixed, for which its mean colour is known."""

Ray = Literal["camera", "shadow"]
"""A kind of ray that objects can be invisible to."""


def visible_instances(
    depsgraph: bpy.types.Depsgraph, leave_out: Collection[bpy.types.Object] = ()
) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """Yield every object and instance that renders show, as it was last evaluated.

    Parameters
    ----------
    depsgraph : Depsgraph
        An evaluated scene.
    leave_out : collection of Object
        Not these.
    """
    left_out = set(leave_out)
    shown = in_rendered_collections(depsgraph.view_layer)
    for found in depsgraph.object_instances:
        item = found.object
        owner = (found.parent or item) if found.is_instance else item
        if owner.hide_render or owner.original in left_out or owner.original not in shown:
            continue
        if found.is_instance:
            # What geometry nodes and particles show may well be hidden where it stands itself.
            if owner.instance_type != "NONE" and _is_hidden(item):
                continue
        elif not found.show_self or _is_instanced(item):
            continue
        if not has_place(found.matrix_world):
            continue
        yield found


def _is_hidden(item: bpy.types.Object) -> bool:
    """Whether renders do not show an object as an instance; the water hides lamps."""
    return marks.is_hidden(item.original) if item.type == "LIGHT" else item.hide_render


def _is_instanced(item: bpy.types.Object) -> bool:
    """Whether renders show instances of an object at its parent's vertices or faces instead."""
    return item.parent is not None and item.parent.instance_type in VERTEX_INSTANCERS


def visible_meshes(
    depsgraph: bpy.types.Depsgraph,
    leave_out: Collection[bpy.types.Object] = (),
    ray: Ray | None = None,
    kept: KeptMeshes | None = None,
) -> Iterator[VisibleMesh]:
    """Yield every mesh with triangles that renders show.

    Parameters
    ----------
    depsgraph : Depsgraph
        An evaluated scene.
    leave_out : collection of Object
        Not these.
    ray : {"camera", "shadow"}, optional
        What rays of a kind meet: neither objects that are invisible to them, nor surfaces that
        let most light through.
    """
    kept = kept or KeptMeshes()
    meshes: dict[tuple[int, frozenset[int], str], MeshArrays] = {}
    known: dict[bpy.types.Material | None, MeanSurface] = {}
    for found in visible_instances(depsgraph, leave_out):
        item = found.object
        if not isinstance(item.data, bpy.types.Mesh):
            continue
        if ray is not None and not getattr(item, f"visible_{ray}"):
            continue
        materials = [slot.material for slot in item.material_slots]
        means: list[MeanSurface] = []
        if ray is not None:
            known |= {x: mean_surface(x) for x in materials if x not in known}
            means = [known[x] for x in materials]
        clear = frozenset(n for n, mean in enumerate(means) if mean.coverage < _OPAQUE)
        mask = _mask_in(item.data, materials) if means else ""
        if mask:
            means = [mean_surface(x, value) for x in materials for value in MASKS]
        key = item.data.as_pointer(), clear, mask
        if key not in meshes:
            meshes[key] = kept.arrays(item.data, clear, len(materials), mask)
        if len(meshes[key].triangles):
            place = found.matrix_world.copy()
            yield VisibleMesh(key, meshes[key], place, materials, means)


_READ_AT_ONCE = {
    "position": ("vector", np.float32, 3),
    ".corner_vert": ("value", np.int32, 1),
    ".corner_edge": ("value", np.int32, 1),
    "material_index": ("value", np.int32, 1),
}
"""Attributes that decide what triangles a mesh has; they are read as they lie in memory."""


def _mask_in(mesh: bpy.types.Mesh, materials: Collection[bpy.types.Material | None]) -> str:
    """Attribute of a mesh's vertices by which one of its materials is mixed, if it has one."""
    for name in filter(None, map(mask_of, materials)):
        attribute = mesh.attributes.get(name)
        if attribute is not None and (attribute.domain, attribute.data_type) == ("POINT", "FLOAT"):
            return name
    return ""


def _digest(mesh: bpy.types.Mesh, clear: Collection[int], materials: int, mask: str) -> bytes:
    """Return what differs where the triangles of a mesh or their materials do."""
    digest = hashlib.sha1(usedforsecurity=False)
    digest.update(repr((len(mesh.polygons), sorted(clear), materials)).encode())
    masks = {mask: ("value", np.float32, 1)} if mask else {}
    for name, (field, kind, size) in (_READ_AT_ONCE | masks).items():
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            values = np.empty(size * len(attribute.data), kind)
            attribute.data.foreach_get(field, values)
            digest.update(name.encode())
            digest.update(values.data)
    return digest.digest()


def _arrays(
    mesh: bpy.types.Mesh, clear: Collection[int], materials: int, mask: str, digest: bytes
) -> MeshArrays:
    """Return the triangles of a mesh but those of some materials."""
    found = mesh.loop_triangles
    vertices = vertices_of(mesh)
    triangles = np.empty((len(found), 3), dtype=np.int32)
    found.foreach_get("vertices", triangles.ravel())
    slots = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    polygons = np.empty(len(found), dtype=np.int32)
    found.foreach_get("polygon_index", polygons)
    used = slots[polygons]
    if clear:
        kept = ~np.isin(np.minimum(used, materials - 1), list(clear))
        triangles, used = triangles[kept], used[kept]
    known = usable(vertices)
    if not known.all():
        kept = known[triangles].all(axis=1)
        triangles, used, vertices = (
            triangles[kept],
            used[kept],
            np.where(known[:, None], vertices, 0),
        )
    levels = np.zeros(len(triangles), dtype=np.int32)
    if mask:
        values = np.empty(len(vertices), dtype=np.float32)
        mesh.attributes[mask].data.foreach_get("value", values)
        mean = np.nan_to_num(np.clip(values[triangles].mean(axis=1), 0.0, 1.0))
        levels = np.rint(mean * (len(MASKS) - 1)).astype(np.int32)
    return MeshArrays(vertices, triangles, used, digest, levels)
