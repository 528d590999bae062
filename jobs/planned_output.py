"""What a job renders besides the settings of its water, as its scene has it."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import bpy

from ..quality.methods import Device
from ..scene import scripts
from ..scene.engines import transparent_film
from ..scene.water.water_body import SceneReach, extent_around
from . import render_region
from .frames import Frame
from .job import Job
from .manifest import Output


def planned_output(
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
