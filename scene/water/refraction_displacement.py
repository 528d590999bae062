"""Moves objects to where they seem to lie beyond the surface, in EEVEE's vertices.

Those under water seen from the air, and those in the air seen from the water.

Materials get a displacement, and coarse meshes a subdivision that is not saved with them. Both
leave with the water.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import Graph
from .. import contents
from ..readers.unusable_places import vertices_of
from ..readers.visible_meshes import visible_instances

_BEFORE = "uw_displacement"
_MODIFIER, _MODIFIER_UID = "UW Subdivision", "uw_subdivision"
_LONGEST = 0.25  # size of a face that stays whole, over its distance from the camera
_LONGEST_ABOVE = 0.15  # the same in the air: near the rim of the window places bend more
_MOST_LEVELS = 7
_MOST_FACES, _MOST_OF_ALL = 300_000, 1_000_000
"""Of an object, and of a scene with all its instances; beyond, EEVEE may never end."""
_MOST_PLACES = 16  # of instances of an object that are looked at
_HALVING = {"SUBSURF", "MULTIRES"}


def insert(
    materials: Iterable[bpy.types.Material],
    group: bpy.types.ShaderNodeTree,
    reach: float,
    *,
    from_air: bool = True,
) -> list[str]:
    """Let the vertices of materials move as a group of :mod:`.realtime_refraction` says.

    A vertex moves by at most the ``reach``, m; ``from_air`` is whether the camera is in the air.
    Returns what could not be treated, one line each.
    """
    notes = []
    for material in materials:
        tree = material.node_tree
        output = None if tree is None else tree.get_output_node("EEVEE")
        if tree is None or output is None or not material.is_editable or _BEFORE in material:
            continue
        socket = output.inputs["Displacement"]
        if socket.is_linked:
            where = "under water" if from_air else "above the water"
            eye = "the air" if from_air else "below"
            notes.append(
                f"material {material.name!r} is displaced; {where} it is not drawn where "
                f"refraction puts it, seen from {eye}"
            )
            continue
        material[_BEFORE] = [material.displacement_method, str(material.max_vertex_displacement)]
        material.displacement_method = "DISPLACEMENT"
        material.max_vertex_displacement = reach
        node = Graph(tree).node("ShaderNodeGroup", node_tree=group)
        tree.links.new(node.outputs[0], socket)
    return notes


def give_back(kept: Iterable[bpy.types.Material]) -> None:
    """Give materials their own displacement back, but for those that stay wet."""
    held = set(kept)
    for material in [m for m in bpy.data.materials if _BEFORE in m and m not in held]:
        method, reach = material[_BEFORE]
        material.displacement_method, material.max_vertex_displacement = method, float(reach)
        del material[_BEFORE]


def subdivide(scene: bpy.types.Scene, camera: Sequence[float], *, from_air: bool = True) -> None:
    """Subdivide meshes beyond the surface whose edges are too long to be bent as refraction asks.

    ``from_air`` is whether the camera, m, is in the air, and the meshes in the water.
    """
    parts = [
        part
        for part in _parts(scene, np.array(camera), from_air=from_air).values()
        if part.item.is_editable and _MODIFIER not in part.item.modifiers
    ]
    while sum(part.total for part in parts) > _MOST_OF_ALL:
        largest = max(parts, key=lambda part: part.total if part.levels else 0)
        if not largest.levels:
            break
        largest.levels -= 1
    for part in parts:
        if part.levels > 0:
            modifier = part.item.modifiers.new(_MODIFIER, "SUBSURF")
            modifier.subdivision_type = "SIMPLE"
            modifier.levels = modifier.render_levels = part.levels
            modifier.show_expanded = False
            part.item[_MODIFIER_UID] = modifier.persistent_uid


def unite(scenes: Iterable[bpy.types.Scene]) -> None:
    """Take the subdivisions out again, but for those of some scenes."""
    held = {item for scene in scenes for item in contents.objects(scene)}
    for item in bpy.data.objects:
        if not item.is_editable or item in held:
            continue
        uid = item.pop(_MODIFIER_UID, None)
        for modifier in [m for m in item.modifiers if m.persistent_uid == uid]:
            item.modifiers.remove(modifier)


@dataclass
class _Part:
    """An object, its faces as renders have them, how often it is there, and halvings of these."""

    item: bpy.types.Object
    faces: int
    instances: int = 0
    levels: int = 0

    @property
    def total(self) -> int:
        """Faces that are drawn of it."""
        return self.faces * self.instances * 4**self.levels


def _parts(
    scene: bpy.types.Scene, camera: NDArray[np.float64], *, from_air: bool
) -> dict[bpy.types.Object, _Part]:
    """Return the objects with meshes that are seen, as they are after all their modifiers."""
    known = set(contents.objects(scene))
    found: dict[bpy.types.Object, _Part] = {}
    for instance in visible_instances(bpy.context.evaluated_depsgraph_get()):
        item, mesh = instance.object.original, instance.object.data
        if item not in known or not isinstance(mesh, bpy.types.Mesh) or not len(mesh.polygons):
            continue
        part = found.setdefault(item, _Part(item, len(mesh.polygons) * _more_in_renders(item)))
        part.instances += 1
        if part.instances <= _MOST_PLACES:
            wanted = _levels(mesh, np.array(instance.matrix_world), camera, from_air=from_air)
            affordable = math.floor(math.log(max(_MOST_FACES / part.faces, 1.0), 4))
            part.levels = max(part.levels, min(wanted, affordable, _MOST_LEVELS))
    return found


def _more_in_renders(item: bpy.types.Object) -> int:
    """How many faces renders have for one that the viewport has."""
    halvings = [m for m in item.modifiers if m.type in _HALVING and m.show_render]
    return 4 ** max(sum(m.render_levels - m.levels for m in halvings), 0)


def _levels(
    mesh: bpy.types.Mesh, place: NDArray[np.float64], camera: NDArray[np.float64], *, from_air: bool
) -> int:
    """How often the faces of a mesh should be halved in each direction."""
    places = vertices_of(mesh) @ place[:3, :3].T + place[:3, 3]
    corners, starts = (np.empty(len(x), np.int32) for x in (mesh.loops, mesh.polygons))
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    low, high = (f.reduceat(places[corners], starts) for f in (np.minimum, np.maximum))
    away = np.linalg.norm(np.maximum(np.maximum(low - camera, camera - high), 0.0), axis=1)
    longest = _LONGEST if from_air else _LONGEST_ABOVE
    size = np.linalg.norm(high - low, axis=1) / (longest * np.maximum(away, 1.0))
    moves = low[:, 2] < 0 if from_air else high[:, 2] > 0
    coarsest = float(np.nan_to_num(np.where(moves, size, 0.0), posinf=0.0).max())
    return math.ceil(math.log2(max(coarsest, 1.0)))
