"""Plans a job: looks at every frame through every camera, and decides everything once."""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import ArrayLike

from ..datasets.quantities import LARGEST_SEED
from ..quality.methods import Device
from ..quality.sampling import parts_of
from ..scene import scripts, view_transform
from ..scene.engines import cycles_settings, transparent_film
from ..scene.engines.band_engine import Engine
from ..scene.engines.engines import engine_of
from ..scene.materials import own_water
from ..scene.readers import cameras, picture_size, stereo
from ..scene.water.water_body import SceneReach, extent_around
from ..settings.render_plan import RenderPlan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from . import job_files, render_region
from .frames import Frame, frames_of
from .job import Job
from .manifest import (
    Development,
    Exposed,
    ExternalFile,
    Manifest,
    Output,
    Pass,
    View,
    changed,
    folders,
    settings_by_frame,
)
from .staging import prepared, require_usable

Light = tuple[RenderPlan, Sequence[ArrayLike | None], float | None]
"""Plan of a frame; the irradiance of lamps that each of its cameras exposes by, shape (n,); and the
stops that the picture of the first asks for, None for those of the light at it."""


def plan_job(
    scene: bpy.types.Scene, settings_now: Callable[[], SceneSettings], job: Job
) -> Manifest:
    """Plan a job; the current frame of the scene moves.

    ``settings_now`` returns the settings at the scene's current frame. Raises InputError if the
    scene or the settings cannot be used.
    """
    require_usable(scene)
    files = job_files.scene_files()  # those of the stage are its own
    hides = settings_now().hide_own_water
    hidden = tuple(item.name for item, _ in own_water.found(scene)) if hides else ()
    with prepared(scene, hidden, job.stage):
        planned = _plan(scene, settings_now, job, files)
    return replace(planned, output=replace(planned.output, hidden=hidden))


def _plan(
    scene: bpy.types.Scene,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    files: tuple[ExternalFile, ...],
) -> Manifest:
    seen_by = [eye for camera in find_cameras(scene, job) for eye in stereo.eyes_of(scene, camera)]
    engine = engine_of(job.engine, job.mode)
    device = _device_of(scene, engine, job.device)
    frames = frames_of(scene, seen_by, settings_now, job)
    first, by_number = frames[0].plan, {frame.number: frame for frame in frames}
    view_transform.require_shown(first.settings.tone, first.settings.contrast)
    output = _planned_output(scene, job, device, seen_by, frames)
    picture_size.check_memory(output.size, 3 if engine.method.draws_colours else len(first.bands))
    settings, changes = settings_by_frame((frame.number, frame.plan.settings) for frame in frames)
    views = [
        View(frame.number, camera.name, frame.depths[place], 0, frame.eyes[place])
        for place, camera in enumerate(seen_by)
        for frame in frames
    ]

    def light_of(number: int) -> Light:
        frame = by_number[number]
        return frame.plan, frame.lamplight, frame.stops

    developments, views = developed_views(views, light_of)
    blend = job_files.open_blend()
    return Manifest(
        scene=blend,
        out=job.out,
        scene_sha256=job_files.scene_digest(blend),
        versions=job_files.versions(),
        output=output,
        settings=settings,
        changes=changes,
        frames=tuple(by_number),
        cameras=folders([camera.name for camera in seen_by]),
        passes=_passes_of(engine, first, job),
        bands_nm=tuple(first.bands.centres.tolist()),
        widths_nm=tuple(first.bands.widths.tolist()),
        developments=developments,
        views=views,
        files=(*job_files.setting_files(settings), *files),
        lamps=changed(((frame.number, frame.lamps) for frame in frames), ()),
        clouds=changed(((frame.number, frame.clouds) for frame in frames), ()),
        exposed=changed(((frame.number, _exposed(frame)) for frame in frames), Exposed()),
        stage=job.stage,
    )


def developed_views(
    views: Sequence[View], light_of: Callable[[int], Light]
) -> tuple[tuple[Development, ...], tuple[View, ...]]:
    """Return how views are developed, and the views, each with its place in that list.

    The cameras of a frame share the exposure of the first.
    """
    by_frame: dict[int, list[View]] = {}
    for view in views:
        by_frame.setdefault(view.frame, []).append(view)
    found, places = dict[Development, int](), dict[View, int]()
    for frame, seen in by_frame.items():
        plan, lamplight, stops = light_of(frame)
        for view, lit in zip(seen, lamplight, strict=True):
            light = None if lit is None else np.asarray(lit, np.float64)
            camera = plan.viewpoint(view.depth, stops, light)
            stops, reduction = camera.stops, camera.reduction
            weights = tuple(map(tuple, reduction.weights.tolist()))
            chosen = Development(reduction.description, weights)
            places[view] = found.setdefault(chosen, len(found))
    return tuple(found), tuple(replace(view, development=places[view]) for view in views)


def find_cameras(scene: bpy.types.Scene, job: Job) -> list[bpy.types.Object]:
    """Return the cameras of a job; raise InputError if there is no such camera."""
    return [cameras.find_camera(scene, name) for name in job.cameras or (job.camera,)]


def _exposed(frame: Frame) -> Exposed:
    """Return what a frame is exposed by besides the water."""
    lit = tuple(None if x is None else tuple(x.tolist()) for x in frame.lamplight)
    return Exposed(frame.stops, lit if any(lit) else ())


def _planned_output(
    scene: bpy.types.Scene,
    job: Job,
    device: Device,
    seen_by: Sequence[bpy.types.Object],
    frames: Sequence[Frame],
) -> Output:
    """Return what is rendered of frames that cameras see, with water for all of them."""
    render = scene.render
    reach = functools.reduce(SceneReach.and_of, (frame.reach for frame in frames))
    extents = [
        extent_around(reach, frame.plan.column, depth)
        for frame in frames
        for depth in (min(frame.depths), max(frame.depths))
    ]
    return Output(
        engine=job.engine,
        mode=job.mode,
        device=device,
        resolution=(render.resolution_x, render.resolution_y, render.resolution_percentage),
        seed=job.seed,
        denoise=job.denoise,
        froxels=job.froxels,
        extent=(max(e.half_width for e in extents), max(e.bottom for e in extents)),
        decisions=job.decisions,
        scripts=scripts.scripts_run(),
        scene_name=scene.name,
        region=render_region.region_of(scene),
        crop=render.use_border and render.use_crop_to_border,
        transparent=render.film_transparent
        and job.stage is None
        and not any(
            transparent_film.why_opaque(camera, frame.plan.settings, frame.eyes)
            for frame in frames
            for camera in seen_by
        ),
    )


def _device_of(scene: bpy.types.Scene, engine: Engine, wanted: Device | None) -> Device:
    """Return what a job renders on: what was asked for, else what the scene says."""
    if wanted is not None and not engine.method.traced:
        raise InputError(
            f"--device: {engine.method.engine} cannot be told what to render on; leave it out"
        )
    if wanted is None and engine.method.traced:
        return cycles_settings.device_of(scene)
    return wanted or "cpu"


def _passes_of(engine: Engine, plan: RenderPlan, job: Job) -> tuple[Pass, ...]:
    """Return the passes of a frame; raise InputError if a job's parts do not suit them."""
    samples, parts = plan.settings.samples, job.parts
    if parts > 1 and not engine.method.traced:
        raise InputError(
            f"--parts: the noise of {engine.method.engine} has no seed; use --engine cycles"
        )
    if plan.settings.noise and engine.method.traced:
        if parts > 1:
            raise InputError("--parts: --noise has parts of its own; leave one of them out")
        parts, fraction = parts_of(samples)
    elif parts > samples:
        raise InputError(
            f"--parts: {parts} parts of {samples} samples; take fewer, or more samples"
        )
    else:
        # The same for every part: Cycles, keeping its data, draws other numbers after a change.
        fraction = math.ceil(samples / parts)
    return tuple(
        Pass(bands, part, _part_seed(job.seed, part), fraction)
        for bands in engine.passes(plan)
        for part in range(parts)
    )


def _part_seed(seed: int, part: int) -> int:
    """Return the seed of a part; that of the job for the first.

    Parts of jobs with neighbouring seeds share none.
    """
    if part == 0:
        return seed
    digest = hashlib.sha256(f"{seed} {part}".encode()).digest()
    return int.from_bytes(digest[:4], "big") % LARGEST_SEED
