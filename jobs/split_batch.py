"""The steps of a job that is planned already: work, develop, and how far it is."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import bpy

from ..uw_spectral.errors import InputError
from . import job_files, job_status, render_job
from .job import SplitRequest
from .manifest import Manifest
from .manifest_files import JOB_FILE, read_manifest
from .opening import SceneOpener
from .path_mapping import PathMapping, apply_to_scene, read_path_mapping
from .progress import Progress
from .redevelopment import redeveloped, take_folder
from .rounds import require_fixed
from .tasks import Part


def run(
    request: SplitRequest, path: Path, blend: Path | None, progress: Progress, opener: SceneOpener
) -> None:
    """Do what is asked for with the manifest at a path.

    ``blend`` is the scene, if it is not where the manifest says. Raises InputError if the manifest
    cannot be used here, or passes are missing or cannot be written.
    """
    mapping = PathMapping()
    if request.path_mapping is not None:
        mapping = read_path_mapping(request.path_mapping)
    manifest = mapping.apply_to_manifest(read_manifest(path))
    otherwise = bool(request.changed) or request.denoise is not None
    if otherwise and request.out is not None:
        manifest = redeveloped(manifest, request.changed, request.denoise, request.out)
    elif request.out is not None:
        manifest = replace(manifest, out=request.out)
    if not request.develop:
        require_fixed(manifest, "--status" if request.status else "--from")
    part = Part(request.passes, request.frames, request.cameras)
    if request.status:
        status = job_status.status_of(manifest)
        print(json.dumps(status.record()) if request.json else status.text())
    elif request.develop:
        _develop(manifest, part, progress)
    elif manifest.rendered_in is not None:
        raise InputError(
            f"{path} only develops; the passes are those of {manifest.rendered_in}: name its "
            f"{JOB_FILE}"
        )
    else:
        if opener.is_open:
            opener.take(blend)
        else:
            opener.read(blend or _scene_of(manifest))
        apply_to_scene(mapping)
        _work(manifest, mapping, part, progress)


def _scene_of(manifest: Manifest) -> Path:
    if manifest.scene is None:
        raise InputError(
            "the scene of the manifest was never saved; save it, and name it before --from"
        )
    if not manifest.scene.is_file():
        raise InputError(
            f"the scene of the manifest, {manifest.scene}, is not there; copy it, or name it "
            "before --from"
        )
    return manifest.scene


def _work(manifest: Manifest, mapping: PathMapping, part: Part, progress: Progress) -> None:
    tasks = part.tasks(manifest)
    job_files.check_scene(manifest, job_files.open_blend(), mapping.apply)
    render_job.join(manifest)
    scene, count = bpy.context.scene, 0
    for step in render_job.render_passes(
        scene, manifest, tasks, progress.note, insist=part.is_named
    ):
        progress.report(step)
        count += 1
    new, left = progress.rendered, len(tasks) - count
    progress.say(
        f"done: {new} pass(es) rendered, {count - new} there before"
        + (f", {left} left to other workers" if left else "")
        + f", in {manifest.out}"
    )


def _develop(manifest: Manifest, part: Part, progress: Progress) -> None:
    if part.passes:
        raise InputError("--passes: a picture needs every pass; name --frames or --cameras")
    job_files.check_programs(manifest)
    views = list(dict.fromkeys(task.view for task in part.tasks(manifest)))
    if manifest.rendered_in is not None:
        take_folder(manifest, views)
    count = 0
    for count, view in enumerate(render_job.develop(manifest, views, progress.note), start=1):
        text = f"frame {view.frame} of {view.camera} developed, {count} of {len(views)}"
        progress.tell(text, count, len(views))
    progress.say(f"done: {count} picture(s) in {manifest.out}")
