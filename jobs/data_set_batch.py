"""The steps of a data set: plan, render, export; and how far it is."""

from __future__ import annotations

import argparse
import functools
import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ..datasets.formats import FORMATS
from ..datasets.index import NAME, Index, read_index
from ..datasets.specification import DataSetSpec, read_spec
from ..scene import stored_settings
from ..scene.session import select_scene
from ..settings.scene_settings import SceneSettings, flag
from ..uw_spectral.errors import InputError
from . import (
    command_line,
    data_set_export,
    job_files,
    job_status,
    render_job,
    same_job,
)
from .data_set_plan import plan_data_set
from .manifest import Manifest, View
from .manifest_files import read_manifest
from .opening import SceneOpener
from .picture_files import is_developed
from .progress import Progress
from .tasks import Part, Task, done

_DECIDED = ("quality", "target_delta_e", "time_budget")
_SET = {"sensor", "white_balance", "exposure"}  # by each [[camera]]
_GB = 1e9
_PIXEL_BYTES = 150  # of pictures, depth and layers
_SMALLER = 0.4  # what compression leaves, about


@dataclass(frozen=True)
class DataSetRequest:
    """What is asked for: a specification to plan and render, or a set to export."""

    spec: Path | None
    export: Path | None
    only_plan: bool


def request_of(options: argparse.Namespace) -> DataSetRequest | None:
    """Return what the options ask for of a data set; None if nothing."""
    spec, export = options.dataset, options.dataset_export
    if spec is None and export is None:
        if options.dataset_plan:
            raise InputError("--dataset-plan needs --dataset and a specification")
        return None
    if spec is not None and export is not None:
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
    return DataSetRequest(spec, export, options.dataset_plan)


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


def run(
    request: DataSetRequest,
    options: argparse.Namespace,
    progress: Progress,
    opener: SceneOpener,
) -> None:
    """Do what is asked for of a data set; raise InputError if that cannot be done."""
    if request.spec is None:
        assert request.export is not None
        index = read_index(request.export / NAME)
        spec = read_spec(index.spec)
        _develop(index, progress)
        progress.say(
            data_set_export.export(
                index, spec, functools.partial(_opened, index, opener), progress.note
            )
        )
        return
    spec = read_spec(request.spec)
    _open(options.blend or spec.scene, request.spec, opener)
    scene = bpy.context.scene
    chosen = command_line.job(options)

    def settings_now() -> SceneSettings:
        return command_line.merge(stored_settings.stored_settings(scene), options)

    index = plan_data_set(scene, spec, request.spec, settings_now, chosen)
    _check_room(index, spec)
    progress.say(
        f"planned: {len(index.views)} view(s) in {len(index.jobs)} job(s), in {index.folder}"
    )
    if request.only_plan:
        return
    render(index, progress, insist=True)
    progress.say(data_set_export.export(index, spec, lambda: scene, progress.note))


def render(index: Index, progress: Progress, *, insist: bool) -> None:
    """Render the passes of a set that are not done; the scene is open.

    Those who insist answer for all of them and develop; else what others are rendering is left to
    them.
    """
    left = {name: tasks for name in index.jobs if (tasks := _left(index, name))}
    passes, total, seen = 0, sum(map(len, left.values())), set[tuple[str, int]]()
    for name, tasks in left.items():
        manifest, scene = _manifest(index, name), bpy.context.scene
        same_job.check_scene(manifest, job_files.open_blend())
        if insist:
            views = list(dict.fromkeys(task.view for task in tasks))
            steps = render_job.render_views(scene, manifest, views, progress.note)
        else:
            steps = render_job.render_passes(scene, manifest, tasks, progress.note, insist=False)
        for step in steps:
            passes += 1
            seen.add((name, step.frame))
            progress.report(replace(step, number=passes, total=total))
    progress.say(
        f"done: {len(seen)} of {len(index.views)} view(s) rendered here, in {index.folder}"
    )


def status(index: Index) -> tuple[str, str]:
    """Return how far a set is, in lines and as JSON."""
    found = {name: job_status.status_of(_manifest(index, name)) for name in index.jobs}
    lines = [f"{name}: {of_job.text().splitlines()[0]}" for name, of_job in found.items()]
    content = {name: json.loads(of_job.as_json()) for name, of_job in found.items()}
    return "\n".join(lines), json.dumps(content)


def work_on(index: Index, progress: Progress, opener: SceneOpener, blend: Path | None) -> None:
    """Render what nobody else is rendering of a set."""
    _open(blend or index.scene, index.folder / NAME, opener)
    render(index, progress, insist=False)


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


def _opened(index: Index, opener: SceneOpener) -> bpy.types.Scene:
    _open(index.scene, index.folder / NAME, opener)
    name = _manifest(index, index.jobs[0]).output.scene_name
    if name:
        select_scene(name)
    return bpy.context.scene


def _develop(index: Index, progress: Progress) -> None:
    """Develop what is rendered and has no pictures yet; what is not rendered may come later."""
    for name in index.jobs:
        manifest = _manifest(index, name)
        by_view: dict[View, list[Task]] = {}
        for task in _tasks(index, name, manifest):
            by_view.setdefault(task.view, []).append(task)
        left = [
            view
            for view, tasks in by_view.items()
            if not is_developed(manifest, view)
            and all(done(manifest, task, thorough=False) for task in tasks)
        ]
        if left:
            same_job.check_programs(manifest)
        developed = render_job.develop(manifest, left, progress.note)
        for number, view in enumerate(developed, start=1):
            progress.tell(f"{name}: frame {view.frame} developed", number, len(left))


def _manifest(index: Index, name: str) -> Manifest:
    return read_manifest(index.manifest(name))


def _tasks(index: Index, name: str, manifest: Manifest) -> list[Task]:
    frames = tuple(index.frames(name))
    return Part(frames=frames).tasks(manifest) if frames else []


def _left(index: Index, name: str) -> list[Task]:
    """Return the passes of the views of a job that have no pictures."""
    manifest = _manifest(index, name)
    tasks = _tasks(index, name, manifest)
    views = dict.fromkeys(task.view for task in tasks)
    left = {view for view in views if not is_developed(manifest, view)}
    return [task for task in tasks if task.view in left]


def _check_room(index: Index, spec: DataSetSpec) -> None:
    """Refuse a set that the disk cannot hold."""
    needed, of_formats = 0.0, sum(FORMATS[name].pixel_bytes for name in spec.outputs.formats)
    for name in index.jobs:
        manifest = _manifest(index, name)
        width, height = manifest.output.size
        pixel = _PIXEL_BYTES + of_formats + 8 * len(manifest.bands_nm)
        for view in dict.fromkeys(task.view for task in _tasks(index, name, manifest)):
            if not is_developed(manifest, view):
                needed += _SMALLER * width * height * pixel
    free = shutil.disk_usage(index.folder).free
    if needed > free:
        raise InputError(
            f"the set takes about {needed / _GB:.3g} GB, and {index.folder} has {free / _GB:.3g} "
            "GB free; make room, choose another --out, or shorten the specification"
        )
