"""The batch render: command line in, pictures, spectra and records out."""

from __future__ import annotations

import argparse
import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TextIO

import bpy

from ..quality.terms import SHAFTS
from ..scene import stored_settings
from ..scene.readers import picture_size
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import DataWarning, InputError
from ..uw_spectral.spectra.sensor import list_sensors
from ..uw_spectral.water.named import list_waters
from . import command_line, data_set_batch, render_job, scene_requirements, split_batch
from .farm import farm_bundle
from .job import AutoRequest, Job
from .opening import SceneOpener
from .planning import find_cameras
from .progress import Progress

_GO_ON = "The same command goes on; without a data set or --from, it takes --resume"


def main(
    arguments: Sequence[str], *, inside_blender: bool, program: str = "render_bands.py"
) -> int:
    """Run a batch and report errors in one line each.

    Returns 0 if everything was written, 2 if the input cannot be used, 130 if it was stopped.
    """
    try:
        with _notes_to_stderr():
            options = command_line.parse(arguments, program)
            options = data_set_batch.with_render_options(options, list(arguments))
            run(options, inside_blender=inside_blender)
    except InputError as error:
        print(f"{program}: {error}", file=sys.stderr)
        _print_failure(arguments, str(error))
        return 2
    except KeyboardInterrupt:
        print(f"\n{program}: stopped; finished passes stay. {_GO_ON}", file=sys.stderr)
        _print_failure(arguments, "stopped")
        return 130
    except SystemExit as stop:  # argparse, after --help
        return int(stop.code or 0)
    except BaseException as error:
        _print_failure(arguments, repr(error))
        raise
    return 0


def run(options: argparse.Namespace, *, inside_blender: bool) -> None:
    """Render what the options ask for; raise InputError if that cannot be done."""
    if options.list_sensors:
        print("\n".join(list_sensors()))
        return
    if options.list_waters:
        for source, names in list_waters().items():
            print(f"{source}: {', '.join(names)}")
        return
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    asked = data_set_batch.request_of(options)
    progress = Progress(options.progress, options.quiet)
    opener = SceneOpener(progress.note, options.scene, options.trust_scripts, inside_blender)
    if asked is not None:
        data_set_batch.run(asked, options, progress, opener)
        return
    split = command_line.split(options)
    if split is not None and split.plan is None and split.bundle is None:
        split_batch.run(split, options.blend, progress, opener)
        return
    job, auto = command_line.job(options), command_line.auto(options)
    if job.resolution is not None:
        picture_size.check_resolution(job.resolution)
    opener.open(job.blend)
    scene = bpy.context.scene
    if job.resolution is not None:
        scene.render.resolution_x, scene.render.resolution_y = job.resolution
        scene.render.resolution_percentage = 100

    def settings_now() -> SceneSettings:
        return command_line.merge(stored_settings.stored_settings(scene), options)

    if auto is not None:
        job, settings_now = _chosen(scene, settings_now, job, auto)
    if split is not None and split.plan is not None:
        split_batch.plan(scene, settings_now, job, split.plan, progress)
        return
    if split is not None and split.bundle is not None:
        made = farm_bundle.bundle_job(split.bundle, scene, settings_now, job)
        progress.say(
            f"bundled: {len(made.frames)} frame(s), {made.passes} pass(es), in {split.bundle}"
        )
        return
    for step in render_job.render(scene, settings_now, job, progress.note):
        progress.report(step)
    progress.say(f"done: {len(job.frames) or 1} frame(s) in {job.out}")


def _chosen(
    scene: bpy.types.Scene,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    auto: AutoRequest,
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


@contextlib.contextmanager
def _notes_to_stderr() -> Iterator[None]:
    """Print caveats of the data as notes, other warnings as usual."""
    plain = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if issubclass(category, DataWarning):
            print(f"note: {message}", file=sys.stderr)
        else:
            plain(message, category, filename, lineno, file, line)

    with warnings.catch_warnings():
        warnings.simplefilter("always", DataWarning)
        warnings.showwarning = show
        yield


def _print_failure(arguments: Sequence[str], text: str) -> None:
    if "openjd" in arguments or "--progress=openjd" in arguments:
        Progress("openjd").fail(text)
