"""The steps of a data set: what is asked for; plan, render, export."""

from __future__ import annotations

import argparse
import functools
from dataclasses import replace
from pathlib import Path

import bpy

from ..datasets.index import NAME, read_index
from ..datasets.specification import read_spec
from ..scene.session import select_scene
from ..settings.scene_settings import flag
from ..uw_spectral.errors import InputError
from . import command_line, job_files, render_job
from .data_set_jobs import SetJobs, export, read_jobs
from .data_set_plan import plan_data_set
from .job import SplitRequest
from .opening import SceneOpener
from .progress import Progress

_DECIDED = ("quality", "target_delta_e", "time_budget")
_SET = {"sensor", "white_balance", "exposure"}  # by each [[camera]]


def is_wanted(options: argparse.Namespace) -> bool:
    """Whether the options ask for a data set; raise InputError where others do not go with it."""
    if options.dataset is None and options.dataset_export is None:
        if options.dataset_plan:
            raise InputError("--dataset-plan needs --dataset and a specification")
        return False
    if options.dataset is not None and options.dataset_export is not None:
        raise InputError("--dataset exports in the end; leave out --dataset-export")
    given = vars(options)
    wrong = [flag(name) for name in _DECIDED if name in given]
    for name, there in (
        ("--plan", options.plan), ("--bundle", options.bundle), ("--from", options.manifest),
        ("--status", options.status), ("--frames", options.frames), ("--camera", options.camera),
        ("--cameras", options.cameras), ("--resolution", options.resolution),
        ("--seed", options.seed), ("--parts", options.parts != 1),
    ):  # fmt: skip
        wrong += [name] if there else []
    if wrong:
        raise InputError(
            f"{', '.join(wrong)}: not with a data set, whose specification names cameras, poses "
            "and seed; --dataset-plan plans, and --from OUT/dataset.json renders a fraction"
        )
    return True


def with_render_options(options: argparse.Namespace, arguments: list[str]) -> argparse.Namespace:
    """Return the options with those of a specification, which the command line overrides."""
    if options.dataset is None:
        return options
    spec = read_spec(options.dataset)
    try:
        found = command_line.parse([*spec.render, *arguments])
    except InputError as error:
        raise InputError(f"{options.dataset}: [render], or the command line: {error}") from error
    both = [name for name in {*spec.settings, *_SET} if name in vars(found)]
    if both:
        named = ", ".join(flag(name) for name in sorted(both))
        raise InputError(f"{named}: {options.dataset} decides; change it there")
    return found


def run(options: argparse.Namespace, progress: Progress, opener: SceneOpener) -> None:
    """Do what is asked for of a data set; raise InputError if that cannot be done."""
    if options.dataset is None:
        index = read_index(options.dataset_export / NAME)
        spec, jobs = read_spec(index.spec), read_jobs(index)
        _develop(jobs, progress)
        opened = functools.partial(_opened, jobs, opener)
        progress.say(export(jobs, spec, opened, progress.note))
        return
    spec = read_spec(options.dataset)
    _open(options.blend or spec.scene, options.dataset, opener)
    scene = bpy.context.scene
    settings_now = command_line.settings_of(scene, options)
    index = plan_data_set(scene, spec, options.dataset, settings_now, command_line.job(options))
    jobs = read_jobs(index)
    jobs.require_room(spec)
    progress.say(
        f"planned: {len(index.views)} view(s) in {len(index.jobs)} job(s), in {index.folder}"
    )
    if options.dataset_plan:
        return
    _render(jobs, progress, insist=True)
    progress.say(export(jobs, spec, lambda: scene, progress.note))


def work_on(
    request: SplitRequest, path: Path, blend: Path | None, progress: Progress, opener: SceneOpener
) -> None:
    """Say how far the set of an index is, or render what nobody else is rendering of it."""
    if request.develop or request.path_mapping or request.out or request.frames or request.passes:
        raise InputError(
            f"{path} is a data set: --from renders its jobs, --dataset-export {path.parent} makes "
            f"its files; parts are named with --from {path.parent}/jobs/NAME/job.json"
        )
    jobs = read_jobs(read_index(path))
    if request.status:
        print(jobs.status()[1 if request.json else 0])
        return
    _open(blend or jobs.index.scene, jobs.index.folder / NAME, opener)
    _render(jobs, progress, insist=False)


def _render(jobs: SetJobs, progress: Progress, *, insist: bool) -> None:
    """Render the passes of a set that are not done; the scene is open.

    Those who insist answer for all of them and develop; else what others are rendering is left to
    them.
    """
    left = {name: views for name in jobs.manifests if (views := jobs.missing_views(name))}
    total = sum(len(tasks) for views in left.values() for tasks in views.values())
    passes, seen = 0, set[tuple[str, int]]()
    for name, views in left.items():
        manifest, scene = jobs.manifests[name], bpy.context.scene
        job_files.check_scene(manifest, job_files.open_blend())
        if insist:
            steps = render_job.render_views(scene, manifest, list(views), progress.note)
        else:
            tasks = [task for of_view in views.values() for task in of_view]
            steps = render_job.render_passes(scene, manifest, tasks, progress.note, insist=False)
        for step in steps:
            passes += 1
            seen.add((name, step.frame))
            progress.report(replace(step, number=passes, total=total))
    progress.say(
        f"done: {len(seen)} of {len(jobs.index.views)} view(s) rendered here, in "
        f"{jobs.index.folder}"
    )


def _open(blend: Path | None, named: Path, opener: SceneOpener) -> None:
    if opener.is_open:
        opener.take()
        return
    if blend is None and not bpy.data.filepath:
        raise InputError(
            f"{named} names no scene; write file = 'scene.blend' into its [scene], or name a scene "
            "before the options"
        )
    if blend is not None and not blend.is_file():
        raise InputError(
            f"the scene {blend} of {named} is not there; correct file in its [scene], or name "
            "a scene before the options"
        )
    opener.read(blend)


def _opened(jobs: SetJobs, opener: SceneOpener) -> bpy.types.Scene:
    _open(jobs.index.scene, jobs.index.folder / NAME, opener)
    name = next(iter(jobs.manifests.values())).output.scene_name
    if name:
        select_scene(name)
    return bpy.context.scene


def _develop(jobs: SetJobs, progress: Progress) -> None:
    """Develop what is rendered and has no pictures yet; what is not rendered may come later."""
    for name, manifest in jobs.manifests.items():
        left = jobs.rendered(name)
        if left:
            job_files.check_programs(manifest)
        developed = render_job.develop(manifest, left, progress.note)
        for number, view in enumerate(developed, start=1):
            progress.tell(f"{name}: frame {view.frame} developed", number, len(left))
