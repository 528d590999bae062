"""The lamps that renders show: objects, and their instances, each where it is."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
from mathutils import Matrix

from ...node_groups.node_mathematics import MARK
from .. import marks
from ..rendered import (
    VERTEX_INSTANCERS,
    in_rendered_collections,
    is_hidden_by_animation,
    rendered_layer,
)
from .lamp_files import KINDS
from .visible_meshes import visible_instances

_INSTANCING = (bpy.types.Object, bpy.types.NodeTree, bpy.types.ParticleSettings)


@dataclass(frozen=True, eq=False)
class ShownLamp:
    """A lamp of a scene, not evaluated, in its place in the world, m; and what instances it."""

    item: bpy.types.Object
    place: Matrix
    instancer: bpy.types.Object | None = None

    @property
    def light(self) -> bpy.types.Light:
        """Its data."""
        return self.item.data

    @property
    def name(self) -> str:
        """That of the object, with that of what instances it."""
        of = "" if self.instancer is None else f" of {self.instancer.name}"
        return f"{self.item.name}{of}"

    @property
    def is_above(self) -> bool:
        """Whether it is above the water."""
        return self.place.translation.z > 0.0

    @property
    def moves(self) -> bool:
        """Whether it may come to another place; instances may."""
        return self.instancer is not None or moves(self.item)


def shown_lamps(scene: bpy.types.Scene) -> list[ShownLamp]:
    """Return the lamps that renders show, those that an animation hides too: objects by name first.

    Instances are those of the scene as it is evaluated now.
    """
    own = [
        ShownLamp(item, item.matrix_world.copy())
        for item in in_rendered_collections(rendered_layer(scene))
        if is_lamp(item)
        and MARK not in item
        and (not marks.is_hidden(item) or is_hidden_by_animation(item))
        and not (item.parent and item.parent.instance_type in VERTEX_INSTANCERS)
    ]
    return sorted(own, key=lambda lamp: lamp.item.name_full) + _instances()


def _instances() -> list[ShownLamp]:
    if not _may_be_instanced():
        return []
    found = [
        ShownLamp(one.object.original, one.matrix_world.copy(), one.parent.original)
        for one in visible_instances(bpy.context.evaluated_depsgraph_get())
        if one.is_instance and is_lamp(one.object)
    ]
    return sorted(found, key=lambda lamp: lamp.name)


def _may_be_instanced() -> bool:
    """Whether an instance may be a lamp: else not every blade of grass needs to be looked at."""
    lamps = [item for item in bpy.data.objects if is_lamp(item) and MARK not in item]
    if any(_hangs_on_instancer(item) for item in lamps):
        return True
    users = bpy.data.user_map(subset={*lamps, *bpy.data.collections})
    return any(
        isinstance(user, _INSTANCING) and MARK not in user
        for found in users.values()
        for user in found
    )


def _hangs_on_instancer(item: bpy.types.Object | None) -> bool:
    while item is not None and item.instance_type not in VERTEX_INSTANCERS:
        item = item.parent
    return item is not None


def is_lamp(item: bpy.types.Object) -> bool:
    """Whether an object is a lamp of a kind that can light water."""
    return item.type == "LIGHT" and item.data.type in KINDS


def moves(item: bpy.types.Object | None) -> bool:
    """Whether an object may come to another place: keyed, driven, bound, or by a simulation."""
    while item is not None:
        if item.animation_data is not None or item.constraints or item.rigid_body is not None:
            return True
        # A bone is posed, and what deforms a mesh or a lattice carries what hangs on a point of it.
        if item.parent is not None and item.parent_type != "OBJECT":
            return True
        item = item.parent
    return False
