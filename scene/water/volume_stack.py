"""Whether Cycles keeps count of the volumes in a scene."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..rendered import ever_rendered

Array = NDArray[np.float64]

_MOST = 32
"""Volumes in one place, or above a camera: Cycles looks up from it for those that it is in."""


def notes(scene: bpy.types.Scene, eyes: Sequence[Sequence[float]], more: int = 0) -> list[str]:
    """Say if there are more volumes in one place than Cycles can tell apart.

    Eyes are where cameras are, m; ``more`` volumes above these are not there yet.
    """
    bpy.context.view_layer.update()
    items = [item for item in ever_rendered(scene) if _is_volume(item)]
    if len(items) + more <= _MOST:
        return []
    corners = np.array(
        [[x.matrix_world @ Vector(c) for c in x.bound_box] for x in items], np.float64
    )
    low, high = corners.min(axis=1), corners.max(axis=1)
    above = low.copy()
    above[:, 2] = -np.inf
    places = np.array([eye[:3] for eye in eyes], np.float64).reshape(-1, 3)
    most = max(_counts(above, high, places) + more, _counts(low, high, (low + high) / 2.0))
    if most <= _MOST:
        return []
    return [
        f"{most} volumes (water, its layers, clouds, the scene's own) lie in one place or above a "
        f"camera; Cycles tells {_MOST} apart, and draws more wrongly: use fewer clouds, or EEVEE"
    ]


def _counts(low: Array, high: Array, places: Array) -> int:
    within = (places[:, None] >= low) & (places[:, None] <= high)
    return int(within.all(axis=2).sum(axis=1).max(initial=0))


def _is_volume(item: bpy.types.Object) -> bool:
    """Whether an object is filled with something that absorbs, scatters or emits."""
    outputs = [
        slot.material.node_tree.get_output_node("CYCLES")
        for slot in item.material_slots
        if slot.material is not None and slot.material.node_tree is not None
    ]
    return item.type == "VOLUME" or any(x and x.inputs["Volume"].is_linked for x in outputs)
