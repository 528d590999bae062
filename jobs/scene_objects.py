"""The objects of a scene that a data set tells apart, with their categories and models."""

from __future__ import annotations

import re
from collections.abc import Sequence

import bpy

from ..datasets.index import SceneObject
from ..scene.rendered import in_rendered_collections, rendered_layer
from ..uw_spectral.errors import InputError

_CATEGORY, _CATEGORY_ID = "category", "category_id"  # custom properties of an object
_COPY = re.compile(r"\.\d{3,}$")
_UNSEEN = {"CAMERA", "LIGHT", "LIGHT_PROBE", "SPEAKER", "EMPTY", "LATTICE", "ARMATURE"}


def objects_of(scene: bpy.types.Scene, held: int) -> list[SceneObject]:
    """Return the objects of a scene that can be seen, at a frame.

    Their category is their custom property ``category``, else the name of their collection (their
    own where all are in the same one), else that of their data; its number in COCO is the custom
    property ``category_id``, as BlenderProc has it.
    """
    scene.frame_set(held)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    names = set[str]()
    models: dict[object, int] = {}
    found = []
    shown = [
        item
        for item in in_rendered_collections(rendered_layer(scene))
        if item.type not in _UNSEEN and not item.hide_render
    ]
    categories = _categories(scene, shown)
    for item in sorted(shown, key=lambda item: item.name):
        if item.name in names:
            raise InputError(
                f"two objects are named {item.name!r}, of different files, and an instance is told "
                "by its name; rename one of them"
            )
        names.add(item.name)
        place, turn, scale = item.evaluated_get(depsgraph).matrix_world.decompose()
        size = tuple(round(x, 4) for x in scale)
        key = (item.data.name_full if item.data else item.name_full, size)
        pose = turn.to_matrix().to_4x4()
        pose.translation = place
        rows = tuple(tuple(float(x) for x in row) for row in pose)
        number = models.setdefault(key, len(models) + 1)
        found.append(SceneObject(item.name, *categories[item], number, rows))
    return found


def _categories(
    scene: bpy.types.Scene, shown: Sequence[bpy.types.Object]
) -> dict[bpy.types.Object, tuple[str, int | None]]:
    """Name and number of each object's category; a number that several names have names it."""
    owners = {
        item: [c.name for c in item.users_collection if c != scene.collection] for item in shown
    }
    one = len({tuple(names[:1]) for names in owners.values()}) == 1

    def name_of(item: bpy.types.Object) -> str:
        if item.get(_CATEGORY):
            return str(item[_CATEGORY])
        if owners[item]:
            return _COPY.sub("", item.name) if one else owners[item][0]
        return str(item.data.name if item.data else item.name)

    found = {item: (name_of(item), _number(item)) for item in shown}
    names: dict[int, set[str]] = {}
    for name, number in found.values():
        if number is not None:
            names.setdefault(number, set()).add(name)
    several = {number for number, known in names.items() if len(known) > 1}
    found = {
        item: (f"category {number}" if number in several else name, number)
        for item, (name, number) in found.items()
    }
    numbers: dict[str, int | None] = {}
    for item, (name, number) in found.items():
        if numbers.setdefault(name, number) != number:
            raise InputError(
                f"object {item.name!r}: others of category {name!r} have another {_CATEGORY_ID}, "
                "or none; give all objects of a category the same"
            )
    return found


def _number(item: bpy.types.Object) -> int | None:
    number = item.get(_CATEGORY_ID)
    if number is None:
        return None
    if not isinstance(number, int) or number < 0:
        raise InputError(
            f"object {item.name!r}: its custom property {_CATEGORY_ID!r} is {number!r}; give a "
            "whole number, 0 or more"
        )
    return number
