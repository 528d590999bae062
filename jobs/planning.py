"""Plans a job: looks at every frame through every camera, and decides everything once."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import bpy

from ..scene import scripts, view_transform
from ..scene.engines import transparent_film
from ..scene.engines.engines import engine_of
from ..scene.materials import own_water
from ..scene.readers import cameras, picture_size, stereo
from ..scene.water.water_body import SceneReach, WaterExtent, extent_around
from ..settings.scene_settings import SceneSettings
from . import job_files, render_region
from .exposures import developments
from .frames import Frame, frames_of
from .job import Job
from .manifest import (
    Development,
    Exposed,
    ExternalFile,
    Manifest,
    Output,
    View,
    changed,
    folders,
    settings_by_frame,
)
from .passes import device_of, passes_of
from .prepared_scene import prepared, require_usable


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
    device = device_of(scene, engine, job.device)
    frames = frames_of(scene, seen_by, settings_now, job)
    reach = functools.reduce(SceneReach.and_of, (frame.reach for frame in frames))
    extents = {
        extent_around(reach, frame.plan.column, depth)
        for frame in frames
        for depth in (min(frame.depths), max(frame.depths))
    }
    first = frames[0].plan
    view_transform.require_shown(first.settings.tone, first.settings.contrast)
    render = scene.render
    blend = job_files.open_blend()
    output = Output(
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
    picture_size.check_memory(output.size, 3 if engine.method.draws_colours else len(first.bands))
    settings, changes = settings_by_frame((frame.number, frame.plan.settings) for frame in frames)
    developments, views = _views(frames, seen_by)
    return Manifest(
        scene=blend,
        out=job.out,
        scene_sha256=job_files.scene_digest(blend),
        versions=job_files.versions(),
        output=output,
        settings=settings,
        changes=changes,
        frames=tuple(frame.number for frame in frames),
        cameras=folders([camera.name for camera in seen_by]),
        passes=passes_of(engine, first, job),
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


def find_cameras(scene: bpy.types.Scene, job: Job) -> list[bpy.types.Object]:
    """Return the cameras of a job; raise InputError if there is no such camera."""
    return [cameras.find_camera(scene, name) for name in job.cameras or (job.camera,)]


def extent_of(manifest: Manifest) -> WaterExtent:
    """Return the size of the water of a job."""
    return WaterExtent(*manifest.output.extent)


def _exposed(frame: Frame) -> Exposed:
    """Return what a frame is exposed by besides the water."""
    lit = tuple(None if x is None else tuple(x.tolist()) for x in frame.lamplight)
    return Exposed(frame.stops, lit if any(lit) else ())


def _views(
    frames: list[Frame], seen_by: list[bpy.types.Object]
) -> tuple[tuple[Development, ...], tuple[View, ...]]:
    """Return how each frame is developed; its cameras share the exposure of the first."""
    found: dict[Development, int] = {}
    rows: dict[tuple[str, int], View] = {}
    for frame in frames:
        chosen = developments(frame.plan, frame.depths, frame.lamplight, frame.stops)
        for camera, depth, eye, development in zip(
            seen_by, frame.depths, frame.eyes, chosen, strict=True
        ):
            place = found.setdefault(development, len(found))
            rows[camera.name, frame.number] = View(frame.number, camera.name, depth, place, eye)
    views = [rows[camera.name, frame.number] for camera in seen_by for frame in frames]
    return tuple(found), tuple(views)
