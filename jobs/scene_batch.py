"""A batch of a scene: planned, bundled for a farm, or rendered, by what its options decide."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bpy

from ..quality.terms import SHAFTS
from ..scene.readers.missing_data import require_data
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from . import command_line, job_files, render_job, scene_requirements
from .farm import farm_bundle
from .job import AutoRequest, Job, SplitRequest
from .manifest_files import write_manifest
from .opening import SceneOpener
from .planning import find_cameras, plan_job
from .progress import Progress
from .rounds import require_fixed


def run(
    options: argparse.Namespace, request: SplitRequest, progress: Progress, opener: SceneOpener
) -> None:
    """Open a scene and do what is asked for; raise InputError if that cannot be done."""
    job, auto = command_line.job(options), command_line.auto(options)
    opened = opener.take if opener.inside_blender else opener.read
    opened(job.blend)
    scene = bpy.context.scene
    if job.resolution is not None:
        scene.render.resolution_x, scene.render.resolution_y = job.resolution
        scene.render.resolution_percentage = 100
    settings_now = command_line.settings_of(scene, options)
    if auto is not None:
        job, settings_now = _chosen(scene, settings_now, job, auto)
    if request.plan is not None:
        _plan(scene, settings_now, job, request.plan, progress)
    elif request.bundle is not None:
        made = farm_bundle.bundle_job(request.bundle, scene, settings_now, job)
        progress.say(
            f"bundled: {len(made.frames)} frame(s), {made.passes} pass(es), in {request.bundle}"
        )
    else:
        for step in render_job.render(scene, settings_now, job, progress.note):
            progress.report(step)
        progress.say(f"done: {len(job.frames) or 1} frame(s) in {job.out}")


def _plan(
    scene: bpy.types.Scene,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    path: Path,
    progress: Progress,
) -> None:
    """Plan a job and write its manifest; nothing is rendered."""
    manifest = plan_job(scene, settings_now, job)
    require_fixed(manifest, "--plan")
    if manifest.scene is None:
        raise InputError("--plan: the scene was never saved, so no worker can open it; save it")
    job_files.require_all(manifest.files)
    require_data(scene, manifest.frames)
    with contextlib.suppress(OSError):  # of which writing tells
        path.parent.mkdir(parents=True, exist_ok=True)
    write_manifest(path, manifest)
    progress.say(
        f"planned: {len(manifest.frames)} frame(s), {len(manifest.cameras)} camera(s), "
        f"{len(manifest.passes)} pass(es) each, in {path}"
    )


def _chosen(
    scene: bpy.types.Scene, settings_now: Callable[[], SceneSettings], job: Job, auto: AutoRequest
) -> tuple[Job, Callable[[], SceneSettings]]:
    """Return job and settings with what the scene requires."""
    camera, *others = find_cameras(scene, job)
    choice = scene_requirements.choose(
        scene, camera, settings_now, job,
        target=auto.target, budget=auto.budget, keep=auto.keep, others=others,
    )  # fmt: skip
    if auto.explain:
        print("\n".join(choice.lines))
    job = replace(
        job,
        froxels=choice.required.froxels if SHAFTS in choice.required.options else None,
        decisions=tuple(choice.lines),
    )
    return job, lambda: replace(settings_now(), **choice.settings)
