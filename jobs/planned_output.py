"""What a job renders besides the settings of its water, by its scene, and in which passes."""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Sequence

import bpy

from ..datasets.quantities import LARGEST_SEED
from ..quality.methods import Device
from ..quality.sampling import parts_of
from ..scene import scripts
from ..scene.engines import cycles_settings, transparent_film
from ..scene.engines.band_engine import Engine
from ..scene.water.water_body import SceneReach, extent_around
from ..settings.render_plan import RenderPlan
from ..uw_spectral.errors import InputError
from . import render_region
from .frames import Frame
from .job import Job
from .manifest import Output, Pass


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


def device_of(scene: bpy.types.Scene, engine: Engine, wanted: Device | None) -> Device:
    """Return what a job renders on: what was asked for, else what the scene says."""
    if wanted is not None and not engine.method.traced:
        raise InputError(
            f"--device: {engine.method.engine} cannot be told what to render on; leave it out"
        )
    if wanted is None and engine.method.traced:
        return cycles_settings.device_of(scene)
    return wanted or "cpu"


def passes_of(engine: Engine, plan: RenderPlan, job: Job) -> tuple[Pass, ...]:
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
        return _parts(engine, plan, job.seed, parts, fraction)
    if parts > samples:
        raise InputError(
            f"--parts: {parts} parts of {samples} samples; take fewer, or more samples"
        )
    # The same for every part: Cycles, keeping its data, draws other numbers after a change of it.
    return _parts(engine, plan, job.seed, parts, math.ceil(samples / parts))


def _parts(
    engine: Engine, plan: RenderPlan, seed: int, parts: int, samples: int
) -> tuple[Pass, ...]:
    return tuple(
        Pass(bands, part, part_seed(seed, part), samples)
        for bands in engine.passes(plan)
        for part in range(parts)
    )


def part_seed(seed: int, part: int) -> int:
    """Return the seed of a part; that of the job for the first.

    Parts of jobs with neighbouring seeds share none.
    """
    if part == 0:
        return seed
    digest = hashlib.sha256(f"{seed} {part}".encode()).digest()
    return int.from_bytes(digest[:4], "big") % LARGEST_SEED
