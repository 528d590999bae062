"""The meshes of a scene that renders show, instances included, as the viewport evaluates them."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator
from dataclasses import dataclass
from typing import Literal

import bpy
from mathutils import Matrix

from .. import marks
from ..materials.mean_colours import MeanSurface
from ..rendered import VERTEX_INSTANCERS, in_rendered_collections
from .mesh_parts import MeshArrays, MeshCache, means_of
from .unusable_places import has_place

OPAQUE = 0.5
"""Coverage from which a surface counts as whole."""


@dataclass(frozen=True, eq=False)
class VisibleMesh:
    """A mesh in its place."""

    key: Hashable  #: Which ones share their arrays.
    arrays: MeshArrays
    place: Matrix
    materials: list[bpy.types.Material | None]
    #: What its parts reflect and cover, where rays of a kind were asked for.
    means: list[MeanSurface]


Ray = Literal["camera", "shadow"]
"""A kind of ray that objects can be invisible to."""


def visible_instances(
    depsgraph: bpy.types.Depsgraph, leave_out: Collection[bpy.types.Object] = ()
) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """Yield objects and instances that renders show, as last evaluated, but what is left out."""
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
    cache: MeshCache | None = None,
    least: float = OPAQUE,
) -> Iterator[VisibleMesh]:
    """Yield every mesh with triangles that renders show, but what is left out.

    Rays of a kind, ``"camera"`` or ``"shadow"``, meet neither objects that are invisible to them,
    nor surfaces that cover less than the ``least``.
    """
    cache = cache or MeshCache()
    meshes: dict[Hashable, tuple[MeshArrays, list[MeanSurface]]] = {}
    known: dict[bpy.types.Material | None, MeanSurface] = {}
    for found in visible_instances(depsgraph, leave_out):
        item, place = found.object, found.matrix_world.copy()
        if not isinstance(item.data, bpy.types.Mesh):
            continue
        if ray is not None and not getattr(item, f"visible_{ray}"):
            continue
        materials = [slot.material for slot in item.material_slots]
        key = item.data.as_pointer(), *(x and x.as_pointer() for x in materials)
        if key not in meshes:
            arrays, means = cache.arrays(item.data, materials), []
            if ray is not None:
                means = means_of(arrays, item, place, materials, known)
            clear = [n for n, mean in enumerate(means) if mean.coverage < least]
            meshes[key] = cache.opaque(arrays, clear), means
        arrays, means = meshes[key]
        if len(arrays.triangles):
            yield VisibleMesh(key, arrays, place, materials, means)
