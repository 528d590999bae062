"""What the cameras of a job see of the water at a few of its frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from ..uw_spectral.errors import InputError
from ..uw_spectral.transfer.solved_field import SolvedField

_FRAMES = 5
_OCCLUDED = {"diffuse_shadows": True, "shafts": False}
_SHAFTS_ALONE = {"shafts": True, "diffuse_shadows": False, "scene_floor": False}


def sampled_frames(frames: Sequence[int]) -> list[int]:
    """First, middle, last and a few between."""
    chosen = np.linspace(0, len(frames) - 1, min(_FRAMES, len(frames))).round().astype(int)
    return [frames[i] for i in chosen]


@dataclass(frozen=True, eq=False)
class SeenViews:
    """What cameras see of the water, and whether any looks from above it."""

    views: list[SeenPoints]
    from_above: bool


def seen_views(
    scene: bpy.types.Scene,
    eyes: Sequence[bpy.types.Object],
    frames: Sequence[int],
    plan: RenderPlan,
    field: SolvedField,
    *,
    traced: bool,
) -> SeenViews:
    """Return what cameras see of the water at frames, as EEVEE or (``traced``) Cycles draws it.

    Raises InputError if none sees any.
    """
    column, views, from_above = plan.column, list[SeenPoints](), False
    occlusion = replace(plan, settings=replace(plan.settings, **_OCCLUDED))
    every = np.ones((3, len(plan.bands)))
    rays = RAYS // (len(frames) * len(eyes))
    cache = Cache()
    for frame in frames:
        scene.frame_set(frame)
        for eye in eyes:
            depth = camera_depth(eye, column.floor_depth)
            if depth > 0.0:
                seen = trace_view(scene, eye, column, field, rays=rays)
                if not traced:
                    water = eevee_water(occlusion, scene, Eye(eye, depth), every, cache)
                    seen = _with_occlusion(seen, water)
            else:
                from_above = True
                seen = trace_from_above(scene, eye, column, field, rays=rays).seen
            if seen is not None:
                views.append(seen)
    if not views:
        raise InputError(
            f"camera {eyes[0].name!r} is above the water and sees only sky; turn it down, or "
            "choose the settings by hand (Quality)"
        )
    if from_above or column.below:
        # Shafts are not drawn then, in no frame of a job.
        views = [replace(view, path_sunlit=np.ones((len(view), 1), dtype=bool)) for view in views]
    return SeenViews(views, from_above)


def shaft_end(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    seen: SeenViews,
    *,
    traced: bool,
) -> float:
    """Return how far EEVEE would draw shafts of light before a camera, m; 0 where it draws none."""
    if traced or seen.from_above or plan.column.below:
        return 0.0
    drawn = replace(plan, settings=replace(plan.settings, **_SHAFTS_ALONE))
    eye, every = Eye(camera, seen.views[0].depth), np.ones((3, len(plan.bands)))
    shafts = eevee_water(drawn, scene, eye, every).shafts
    return 0.0 if shafts is None else shafts.end


def _with_occlusion(seen: SeenPoints, water: RealtimeWater) -> SeenPoints:
    """What is seen, with what objects keep of the light as EEVEE draws it."""
    occlusion = water.term(OcclusionTerm)
    if occlusion is None or occlusion.buffer is None:
        return seen
    table, buffer = occlusion.table, occlusion.buffer
    hit, rate = np.isfinite(seen.distance), float(water.field.extinction.mean())
    P = np.where(hit, seen.distance, table.box.reach)
    points = seen.origin + seen.direction * P[:, None]
    on_it = table.on_patches(points, seen.normal)[:, 0]
    on_way = table.along(seen.origin, seen.direction, P, rate)[:, 0]
    return replace(seen, openness=np.where(hit, on_it, 1.0), path_openness=on_way, buffer=buffer)
