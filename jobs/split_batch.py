"""The steps of a job that is split over processes: plan, work, develop, and how far it is."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bpy

from ..datasets.index import is_index, read_index
from ..scene.readers.missing_data import require_data
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from . import data_set_batch, job_files, job_status, render_job, same_job
from .job import Job, SplitRequest
from .manifest import Manifest
from .manifest_files import read_manifest, write_manifest
from .opening import SceneOpener
from .path_mapping import PathMapping, apply_to_scene, read_path_mapping
from .planning import plan_job
from .progress import Progress
from .redevelopment import redeveloped, take_folder
from .rounds import require_fixed
from .tasks import Part


def plan(
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


def run(request: SplitRequest, blend: Path | None, progress: Progress, opener: SceneOpener) -> None:
    """Do what is asked for with a manifest.

    ``blend`` is the scene, if it is not where the manifest says. Raises InputError if the manifest
    cannot be used here, or passes are missing or cannot be written.
    """
    path = request.status or request.develop or request.work
    assert path is not None
    if is_index(path):
        _data_set(request, path, blend, progress, opener)
        return
    mapping = PathMapping()
    if request.path_mapping is not None:
        mapping = read_path_mapping(request.path_mapping)
    manifest = mapping.apply_to_manifest(read_manifest(path))
    otherwise = bool(request.changed) or request.denoise is not None
    if otherwise and request.out is not None:
        manifest = redeveloped(manifest, request.changed, request.denoise, request.out)
    elif request.out is not None:
        manifest = replace(manifest, out=request.out)
    if request.develop is None:
        require_fixed(manifest, "--status" if request.status else "--from")
    part = Part(request.passes, request.frames, request.cameras)
    if request.status is not None:
        status = job_status.status_of(manifest)
        print(status.as_json() if request.json else status.text())
    elif request.develop is not None:
        _develop(manifest, part, progress)
    elif manifest.rendered_in is not None:
        raise InputError(
            f"{path} only develops; the passes are those of {manifest.rendered_in}: name its "
            f"{render_job.JOB_FILE}"
        )
    else:
        if opener.is_open:
            opener.take(blend)
        else:
            opener.read(blend or _scene_of(manifest))
        apply_to_scene(mapping)
        _work(manifest, mapping, part, progress)


def _data_set(
    request: SplitRequest, path: Path, blend: Path | None, progress: Progress, opener: SceneOpener
) -> None:
    """Work at a whole data set, by its index."""
    if request.develop or request.path_mapping or request.out or request.frames or request.passes:
        raise InputError(
            f"{path} is a data set: --from renders its jobs, --dataset-export {path.parent} makes "
            f"its files; parts are named with --from {path.parent}/jobs/NAME/job.json"
        )
    index = read_index(path)
    if request.status is not None:
        print(data_set_batch.status(index)[1 if request.json else 0])
    else:
        data_set_batch.work_on(index, progress, opener, blend)


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
    same_job.check_scene(manifest, job_files.open_blend(), mapping.apply)
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
    same_job.check_programs(manifest)
    views = list(dict.fromkeys(task.view for task in part.tasks(manifest)))
    if manifest.rendered_in is not None:
        take_folder(manifest, views)
    count = 0
    for count, view in enumerate(render_job.develop(manifest, views, progress.note), start=1):
        text = f"frame {view.frame} of {view.camera} developed, {count} of {len(views)}"
        progress.tell(text, count, len(views))
    progress.say(f"done: {count} picture(s) in {manifest.out}")
