"""Plans a job: looks at every frame through every camera, and decides everything once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy

from ..scene import view_transform
from ..scene.engines.engines import engine_of
from ..scene.materials import own_water
from ..scene.readers import cameras, picture_size, stereo
from ..settings.scene_settings import SceneSettings
from . import job_files
from .exposures import Light, developed_views
from .frames import Frame, frames_of
from .job import Job
from .manifest import Exposed, ExternalFile, Manifest, View, changed, folders, settings_by_frame
from .planned_output import device_of, passes_of, planned_output
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
    first, by_number = frames[0].plan, {frame.number: frame for frame in frames}
    view_transform.require_shown(first.settings.tone, first.settings.contrast)
    output = planned_output(scene, job, device, seen_by, frames)
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


def _exposed(frame: Frame) -> Exposed:
    """Return what a frame is exposed by besides the water."""
    lit = tuple(None if x is None else tuple(x.tolist()) for x in frame.lamplight)
    return Exposed(frame.stops, lit if any(lit) else ())
