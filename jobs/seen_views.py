"""What the cameras of a job see of the water at a few of its frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np

from ..quality.combinations import RAYS
from ..quality.seen_points import SeenPoints
from ..scene.readers.cameras import camera_depth
from ..scene.readers.view_tracing import trace_from_above, trace_view
from ..scene.terms.eevee_water import eevee_water
from ..scene.terms.occlusion import OcclusionTerm
from ..scene.water.frame_water import RealtimeWater
from ..scene.water.occlusion import Cache
from ..scene.water.scene_frame import Eye
from ..settings.render_plan import RenderPlan
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.water_column import WaterColumn

_FRAMES = 5


def sampled_frames(frames: Sequence[int]) -> list[int]:
    """First, middle, last and a few between."""
    chosen = np.linspace(0, len(frames) - 1, min(_FRAMES, len(frames))).round().astype(int)
    return [frames[i] for i in chosen]


def seen_views(
    scene: bpy.types.Scene,
    eyes: Sequence[bpy.types.Object],
    frames: Sequence[int],
    column: WaterColumn,
    field: SolvedField,
    occlusion: RenderPlan | None,
) -> tuple[list[SeenPoints], bool]:
    """Return what cameras see of the water at frames, and whether any looks from above it.

    ``occlusion`` is what EEVEE draws the occlusion of objects with, if it does.
    """
    views: list[SeenPoints] = []
    from_above = False
    rays = RAYS // (len(frames) * len(eyes))
    cache = Cache()
    for frame in frames:
        scene.frame_set(frame)
        for eye in eyes:
            depth = camera_depth(eye, column.floor_depth)
            if depth > 0.0:
                seen = trace_view(scene, eye, column, field, rays=rays)
                if occlusion is not None:
                    every = np.ones((3, len(occlusion.bands)))
                    seen = _with_occlusion(
                        seen, eevee_water(occlusion, scene, Eye(eye, depth), every, cache)
                    )
                views.append(seen)
                continue
            from_above = True
            seen = trace_from_above(scene, eye, column, field, rays=rays).seen
            if seen is not None:
                views.append(seen)
    return views, from_above


def _with_occlusion(seen: SeenPoints, water: RealtimeWater) -> SeenPoints:
    """What is seen, with what objects keep of the light as EEVEE draws it."""
    occlusion = water.term(OcclusionTerm)
    if occlusion is None or occlusion.buffer is None:
        return seen
    table, buffer = occlusion.table, occlusion.buffer
    hit, rate = np.isfinite(seen.distance), float(water.field.extinction.mean())
    P = np.where(hit, seen.distance, table.box.reach)
    points = seen.origin + seen.direction * P[:, None]
    on_it, on_way = (
        table.on_patches(points, seen.normal)[:, 0],
        table.along(seen.origin, seen.direction, P, rate)[:, 0],
    )
    return replace(seen, openness=np.where(hit, on_it, 1.0), path_openness=on_way, buffer=buffer)
