"""What a scene requires: looks at it through its camera and lets the optics decide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ..quality.combinations import RAYS, BandChoice, Workload
from ..quality.methods import Method, method_of
from ..quality.picture import Optics
from ..quality.requirements import Requirements, decide
from ..quality.seen_points import SeenPoints
from ..quality.terms import SURFACE, TERMS, WAVES, settings_of, switched_on
from ..scene.as_rendered import as_rendered
from ..scene.engines import world_picture
from ..scene.readers import clouds, moving_surface
from ..scene.readers.cameras import camera_depth
from ..scene.readers.picture_size import rendered_size
from ..scene.readers.view_tracing import trace_from_above, trace_view
from ..scene.readers.volume_grids import GridCache
from ..scene.terms.eevee_water import eevee_water
from ..scene.terms.occlusion import OcclusionTerm
from ..scene.water.frame_water import RealtimeWater
from ..scene.water.occlusion import Cache
from ..scene.water.term import Eye
from ..settings.render_plan import RenderPlan, forget_files, plan_of, quiet
from ..settings.scene_settings import EQUAL, OPTIMISED, SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.description import REFERENCE_BANDS
from ..uw_spectral.transfer.solved_field import SolvedField
from .job import Job

_OPTIMISED_COUNTS = (3, 6, 9)
_BAND_COUNTS = (3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 16, 18, 21, 24, 27, 32)
_WAVE_RESOLUTION = 64
_FRAMES = 5
_OCCLUDED = {"diffuse_shadows": True, "shafts": False}
_SHAFTS_ALONE = {"shafts": True, "diffuse_shadows": False, "scene_floor": False}


@dataclass(frozen=True, eq=False)
class Choice:
    """What was decided, and the settings that bring it about."""

    required: Requirements
    settings: dict[str, Any]

    @property
    def lines(self) -> list[str]:
        """Each decision in a line."""
        return [str(decision) for decision in self.required.decisions]


def choose(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    *,
    target: float,
    budget: float | None = None,
    keep: frozenset[str] = frozenset(),
    others: Sequence[bpy.types.Object] = (),
) -> Choice:
    """Decide what a job needs.

    From above the water, what rays meet in it is weighed as it is seen from just below the surface,
    by the fraction that is let out; sky, objects in the air and waves are not weighed.
    ``settings_now`` returns the settings at the scene's current frame, which moves and comes back;
    those of the first frame that is looked at count. ``target`` is the mean ΔE2000 of what the
    camera sees, objects, floor and open water counting equally; ``budget`` CPU time in s; settings
    in ``keep`` must stay; the choice is made for ``others`` too. Raises InputError if the settings
    cannot be used, no camera sees the water, or it is night.
    """
    forget_files()
    before, method = scene.frame_current, method_of(job.engine, job.mode)
    frames = _sampled_frames(job.frames or (before,))
    try:
        with as_rendered(scene):
            scene.frame_set(frames[0])
            chosen = world_picture.drawn(scene, settings_now())
            if chosen.sunlight == 0:
                raise InputError(
                    "Auto weighs the light of sun and sky, and --sunlight is 0; choose the "
                    "settings of a night by hand (Quality), or choose them by day"
                )
            with quiet():
                plan = plan_of(chosen)
                everything = _reference_optics(scene, chosen)
            views, from_above = _seen_views(
                scene, (camera, *others), frames, plan, everything.view.field, traced=method.traced
            )
    finally:
        scene.frame_set(before)
    end = 0.0
    if not (method.traced or from_above or plan.column.below):
        end = _shaft_end(scene, camera, plan, views[0].depth)
    workload = _workload(scene, job, chosen.samples if "samples" in keep else None, end)
    given = {term.name for term in TERMS if term.setting in keep and job.engine in term.engines}
    on = given & switched_on(vars(chosen))
    if from_above:
        # What the surface mirrors is not weighed.
        on |= {SURFACE, WAVES} & switched_on(vars(chosen))
    with quiet():
        required = decide(
            views,
            everything,
            _band_choices(chosen, keep, method, layered=bool(plan.column.below)),
            target=target,
            budget=budget,
            workload=workload,
            keep=on,
            off=given - on,
        )
    return Choice(required, _changes(chosen, required, method, keep))


def _optics(plan: RenderPlan) -> Optics:
    """The water of a plan; the rays bring their own depth."""
    return Optics(plan.viewpoint(0.0), plan.excitation)


def _reference_optics(scene: bpy.types.Scene, chosen: SceneSettings) -> Optics:
    """Everything the settings ask for, on many bands."""
    many = replace(chosen, bands=REFERENCE_BANDS, wavelengths="", band_placement=EQUAL)
    plan = plan_of(many)
    floating = clouds.clouds_of(scene, plan.bands.centres)
    grids, _ = GridCache().of(scene, floating.grids)
    found = replace(_optics(plan), caustics=chosen.caustics, clouds=(*floating.blobs, *grids))
    if chosen.surface != moving_surface.WAVES:
        return found
    coarse = replace(chosen, wave_resolution=min(chosen.wave_resolution, _WAVE_RESOLUTION))
    return replace(found, waves=moving_surface.patterns(scene, replace(plan, settings=coarse)))


def _band_choices(
    chosen: SceneSettings, keep: frozenset[str], method: Method, *, layered: bool
) -> list[BandChoice]:
    """Bands to choose from: the settings' own if they must stay, all in real time.

    In layered water they are not optimised.
    """
    # Only the elastic light of a calm sea is compared.
    plain = replace(
        chosen,
        inelastic="",
        surface="flat" if chosen.surface == moving_surface.WAVES else chosen.surface,
    )
    if keep & {"bands", "wavelengths", "range_start", "range_end"}:
        plan = plan_of(plain.in_mode(method.mode))
        name = f"{len(plan.bands)}, as given"
        return [BandChoice(name, _optics(plan), {}, len(plan.passes))]
    placements = {EQUAL: _BAND_COUNTS, OPTIMISED: _OPTIMISED_COUNTS}
    if layered:
        placements = {EQUAL: _BAND_COUNTS}
    if "band_placement" in keep:
        placements = {chosen.band_placement: placements[chosen.band_placement]}
    default: dict[str, Any] = {"bands": 0, "wavelengths": "", "band_placement": EQUAL}
    free = replace(plain, **default).in_mode(method.mode)
    if method.draws_colours and EQUAL in placements and free.bands == method.default_bands:
        name = f"{free.bands}, which cost nothing"
        return [BandChoice(name, _optics(plan_of(free)), default)]
    found = []
    for placement, counts in placements.items():
        for count in counts:
            changes = {"bands": count, "wavelengths": "", "band_placement": placement}
            plan = plan_of(replace(plain, **changes))
            name = f"{count} {placement}"
            found.append(BandChoice(name, _optics(plan), changes, len(plan.passes)))
    return found


def _sampled_frames(frames: Sequence[int]) -> list[int]:
    """First, middle, last and a few between."""
    chosen = np.linspace(0, len(frames) - 1, min(_FRAMES, len(frames))).round().astype(int)
    return [frames[i] for i in chosen]


def _seen_views(
    scene: bpy.types.Scene,
    eyes: Sequence[bpy.types.Object],
    frames: Sequence[int],
    plan: RenderPlan,
    field: SolvedField,
    *,
    traced: bool,
) -> tuple[list[SeenPoints], bool]:
    """Return what cameras see of the water at frames, and whether any looks from above it.

    That is as EEVEE or (``traced``) Cycles draws it. Raises InputError if none sees any.
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
    return views, from_above


def _shaft_end(
    scene: bpy.types.Scene, camera: bpy.types.Object, plan: RenderPlan, depth: float
) -> float:
    """Return how far EEVEE would draw shafts of light before a camera, m; 0 where it draws none."""
    drawn = replace(plan, settings=replace(plan.settings, **_SHAFTS_ALONE))
    eye, every = Eye(camera, depth), np.ones((3, len(plan.bands)))
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


def _workload(scene: bpy.types.Scene, job: Job, samples: int | None, end: float) -> Workload:
    """What the pictures of a job take; ``samples`` are those that are given."""
    render, method = scene.render, method_of(job.engine, job.mode)
    width, height = rendered_size(
        render.resolution_x, render.resolution_y, render.resolution_percentage
    )
    count = max(len(job.frames), 1)
    return Workload(method, width * height / 1e6, count, samples, end, job.denoise)


def _changes(
    chosen: SceneSettings, required: Requirements, method: Method, keep: frozenset[str]
) -> dict[str, Any]:
    """Settings that differ from the ones that were given."""
    wanted = {**required.bands.settings, "samples": required.samples}
    if method.traced:
        wanted["bounces"] = required.bounces
    changed = required.options ^ switched_on(vars(chosen))
    for term in TERMS:
        if term.name in changed and method.engine in term.engines:
            wanted[term.setting] = settings_of(required.options)[term.setting]
    return {
        name: value
        for name, value in wanted.items()
        if name not in keep and getattr(chosen, name) != value
    }
