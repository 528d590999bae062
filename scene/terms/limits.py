"""What the engines do not draw as it is of the light of a scene."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...settings.render_plan import RenderPlan
from ..readers import cameras, enclosed_places, moving_surface, unknown_colours
from ..water import continued_seabed, deep_cameras, volume_stack
from ..water.frame_water import RealtimeWater
from ..water.occlusion import Cache
from .inelastic_layers import MOST_ABOVE
from .occlusion import OcclusionTerm


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
        *volume_stack.notes(scene, places, MOST_ABOVE if chosen.inelastic else 0),
        *deep_cameras.notes(plan.column, [-place[2] for place in places]),
    ]
