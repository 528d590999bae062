"""What the engines do not draw as it is of the light of a scene."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...settings.render_plan import RenderPlan
from ...uw_spectral.transfer.water_column import WaterColumn
from ..readers import cameras, enclosed_places, moving_surface, unknown_colours
from ..rendered import ever_rendered
from ..water import continued_seabed
from ..water.frame_water import RealtimeWater
from ..water.occlusion import Cache
from .inelastic_layers import MOST_ABOVE
from .occlusion import OcclusionTerm

Array = NDArray[np.float64]

_MOST_LENGTHS = 15.0
"""Lengths of scattering below the surface, from which on usual samples find too little of it:
.02 to .6 of it 15 to 29 lengths deep at 256 samples, .9 to 1.2 at 19 with 8192."""
_MOST_VOLUMES = 32
"""Volumes in one place, or above a camera: Cycles looks up from it for those that it is in."""


def of_eevee(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    plan: RenderPlan,
    cache: Cache,
    water: RealtimeWater,
    eyes: Sequence[tuple[float, ...]] | None = None,
) -> list[str]:
    """Return what EEVEE does not draw as it is, a line each.

    Eyes are where the camera is at the frames of a job, m; None in live water.
    """
    occlusion = water.term(OcclusionTerm)
    table = None if occlusion is None else occlusion.table
    found = [
        *continued_seabed.notes(plan, cache.looked),
        *enclosed_places.notes(scene, camera, table, cache.looked),
        *unknown_colours.notes(cache.looked),
    ]
    if camera is not None:
        live, chosen = eyes is None, plan.settings
        found += moving_surface.limits(camera, chosen, eyes or (), eevee=True, live=live)
    return found


def of_cycles(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    cache: Cache,
    eyes: Sequence[tuple[float, ...]],
) -> list[str]:
    """Return what Cycles does not draw as it is, a line each; the water is there."""
    chosen, places = plan.settings, [cameras.eye_of(camera), *eyes]
    return [
        *continued_seabed.notes(plan, cache.looked),
        *unknown_colours.notes(cache.looked),
        *moving_surface.limits(camera, chosen, eyes, eevee=False),
        *of_volumes(scene, places, MOST_ABOVE if chosen.inelastic else 0),
        *of_depths(plan.column, [-place[2] for place in places]),
    ]


def of_depths(column: WaterColumn, depths: Sequence[float]) -> list[str]:
    """Say if cameras are so deep, m, that rays find the surface only by very many samples."""
    deepest = max([0.0, *depths])
    if not (np.any(column.sun_irradiance > 0) or np.any(column.sky_radiance > 0)):
        return []
    tops = [0.0, *(layer.top for layer in column.below)]
    rates = [column.scattering, *(layer.scattering for layer in column.below)]
    ends = np.clip([*tops[1:], deepest], 0.0, deepest)
    passed = sum(
        rate * max(end - top, 0.0) for rate, top, end in zip(rates, tops, ends, strict=True)
    )
    most = float(np.max(passed))
    if most < _MOST_LENGTHS:
        return []
    return [
        f"the camera is {most:.0f} lengths of scattering below the surface, in the band with most; "
        "Cycles finds daylight there by very many samples only, and is too dark with fewer: give "
        "more samples, or take EEVEE"
    ]


def of_volumes(scene: bpy.types.Scene, eyes: Sequence[Sequence[float]], more: int = 0) -> list[str]:
    """Say if there are more volumes in one place than Cycles can tell apart.

    Eyes are where cameras are, m; ``more`` volumes above these are not there yet.
    """
    bpy.context.view_layer.update()
    items = [item for item in ever_rendered(scene) if _is_volume(item)]
    if len(items) + more <= _MOST_VOLUMES:
        return []
    corners = np.array(
        [[x.matrix_world @ Vector(c) for c in x.bound_box] for x in items], np.float64
    )
    low, high = corners.min(axis=1), corners.max(axis=1)
    above = low.copy()
    above[:, 2] = -np.inf
    places = np.array([eye[:3] for eye in eyes], np.float64).reshape(-1, 3)
    most = max(_counts(above, high, places) + more, _counts(low, high, (low + high) / 2.0))
    if most <= _MOST_VOLUMES:
        return []
    return [
        f"{most} volumes (water, its layers, clouds, the scene's own) lie in one place or above a "
        f"camera; Cycles tells {_MOST_VOLUMES} apart, and draws more wrongly: use fewer clouds, or "
        "EEVEE"
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
