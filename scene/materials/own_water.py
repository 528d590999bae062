"""Water that a scene has of its own, which the water of a render would be drawn with twice."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from mathutils import Vector

from .. import contents, marks
from ..animation import curves
from ..rendered import ever_rendered
from ..temporary import held
from .shader_nodes import row_of

_WIDE, _FLAT, _NEAR = 10.0, 0.2, 1.5  # m; height over width; m from z = 0
_CLEAR = 0.3  # transmission from which a surface is clear


ADVICE = "hide it in renders, or switch on Hide own water (--hide-own-water)"
"""What to do about it."""


def notes(scene: bpy.types.Scene) -> Iterator[str]:
    """Say what water of its own a scene has, and what of it is hidden while there is water."""
    hidden = [item.name for item in scene.objects if item.type == "MESH" and marks.HIDDEN in item]
    if hidden:
        yield hidden_note(hidden)
    for item, what in found(scene):
        yield f"{item.name!r} {what}; {ADVICE}"


def hidden_note(names: Sequence[str]) -> str:
    """Say that water of a scene's own is hidden."""
    listed = ", ".join(map(repr, names))
    return f"water of the scene's own is left out, as Hide own water says: {listed}"


@contextlib.contextmanager
def hidden(scene: bpy.types.Scene, names: Sequence[str]) -> Iterator[None]:
    """Leave objects out of renders while the block runs, animated or not."""
    items = [scene.objects[name] for name in names]
    keyed = [(curve, "mute", True) for item in items for curve in curves(item, "hide_render")]
    with held([*keyed, *((item, "hide_render", True) for item in items)]):
        yield


def hide(scene: bpy.types.Scene) -> None:
    """Leave it out of renders and viewport until the scene gives its water back."""
    for item, _ in list(found(scene)):
        marks.hide(item, viewport=True)


def found(scene: bpy.types.Scene) -> Iterator[tuple[bpy.types.Object, str]]:
    """Yield sea surfaces and bodies of water among a scene's meshes, and what each is.

    A surface is wide, nearly level, at z = 0, and refracts; a body is one that the camera is in.
    """
    camera = scene.camera
    known: dict[bpy.types.Material, tuple[bool, bool]] = {}
    for item in ever_rendered(scene):
        if item.type != "MESH" or marks.MARK in item:
            continue
        materials = contents.materials_of(item)
        known |= {m: (_is_clear(m), _is_filled(m)) for m in materials if m not in known}
        clear, filled = (any(known[m][i] for m in materials) for i in (0, 1))
        if not (clear or filled):
            continue
        box = np.array([item.matrix_world @ Vector(corner) for corner in item.bound_box])
        low, high = box.min(axis=0), box.max(axis=0)
        x, y, z = high - low
        level = min(x, y) >= _WIDE and z <= _FLAT * min(x, y)
        if level and low[2] <= _NEAR and high[2] >= -_NEAR and clear:
            yield (
                item,
                "looks like a water surface of the scene's own: the water has one, and both are "
                "drawn",
            )
        elif camera is not None and filled:
            place = np.array(camera.matrix_world.translation)
            if ((place > low) & (place < high)).all():
                yield (
                    item,
                    "has a volume, and the camera is in it: it darkens the water or hides it",
                )


def _is_clear(material: bpy.types.Material) -> bool:
    for node in material.node_tree.nodes:
        row = row_of(node)
        if row is None or not row.refracts:
            continue
        weight = node.inputs[row.clear] if isinstance(row.clear, str) else None
        if weight is None or weight.is_linked or weight.default_value >= _CLEAR:
            return True
    return False


def _is_filled(material: bpy.types.Material) -> bool:
    output = material.node_tree.get_output_node("ALL")
    return output is not None and output.inputs["Volume"].is_linked
