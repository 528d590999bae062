"""A whole job in one process: planned, rendered and developed frame by frame.

The steps are those of a job that is split over processes and machines.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ..datasets.files import make_folder
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError, first_of
from . import band_passes, pictures, work
from .claims import claim_path, claimed, is_living
from .frame_plans import FramePlans
from .job import Job
from .manifest import (
    Development,
    Exposed,
    Manifest,
    View,
    changed,
    differences,
    settings_by_frame,
)
from .manifest_files import JOB_FILE, read_manifest, write_manifest
from .picture_files import files_of
from .planning import plan_job
from .rounds import Rounds
from .tasks import Rendered, Task


@dataclass(frozen=True)
class Step:
    """One pass that is on disk: the ``number``-th of ``total`` passes of the job.

    ``picture`` is what is shown of the view, if that was its last pass.
    """

    frame: int
    rendered: band_passes.RenderedPass
    number: int
    total: int
    camera: str = ""
    picture: Path | None = None


def render(
    scene: bpy.types.Scene,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    report_note: Callable[[str], None],
) -> Generator[Step]:
    """Render a job; yield each pass that was just written, or found when resuming.

    The scene holds water only while the iteration lasts; closing it early takes the water out and
    keeps the passes that are done. ``settings_now`` returns the settings at the scene's current
    frame; ``report_note`` receives what could not be treated, a line each. Raises InputError if the
    scene, the settings or the output folder cannot be used.
    """
    planned = plan_job(scene, settings_now, job)
    with _alone(planned.out):
        manifest = begin(planned, resume=job.resume)
        views = [view for view in manifest.views if view.frame in set(planned.frames)]
        yield from render_views(scene, manifest, views, report_note)


@contextlib.contextmanager
def _alone(out: Path) -> Iterator[None]:
    """Let no other whole job begin in a folder while the block runs."""
    make_folder(out)
    place = out / JOB_FILE
    with claimed(place) as ours:
        if not ours:
            raise InputError(
                f"{out}: another process renders into this folder; wait for it, or choose another "
                f"--out (if it has ended, delete {claim_path(place)}); nothing was overwritten"
            )
        yield


def render_views(
    scene: bpy.types.Scene,
    manifest: Manifest,
    views: Sequence[View],
    report_note: Callable[[str], None],
) -> Generator[Step]:
    """Render and develop views of a job, one pass at each step of the iteration."""
    plans, rounds = FramePlans(manifest), Rounds(manifest, views)
    finished: dict[View, dict[int, Rendered]] = {}
    steps = work.render(scene, manifest, rounds.tasks(), plans, report_note, insist=True)
    for number, found in enumerate(steps, start=1):
        view = found.task.view
        of_view = finished.setdefault(view, {})
        of_view[found.task.number] = found
        picture = None
        if rounds.has_all(view, len(of_view)):
            ready = finished.pop(view)
            for note in pictures.develop(manifest, view, [ready[n] for n in sorted(ready)], plans):
                report_note(note)
            picture = files_of(manifest, view).shown
        total = max(rounds.total, number)
        yield Step(view.frame, found.file, number, total, view.camera, picture)


def render_passes(
    scene: bpy.types.Scene,
    manifest: Manifest,
    tasks: Sequence[Task],
    report_note: Callable[[str], None],
    *,
    insist: bool,
) -> Iterator[Step]:
    """Render passes of a job, of which others may render some, as :func:`.work.render` does."""
    plans = FramePlans(manifest)
    steps = work.render(scene, manifest, tasks, plans, report_note, insist=insist)
    for number, found in enumerate(steps, start=1):
        view = found.task.view
        yield Step(view.frame, found.file, number, len(tasks), view.camera)


def begin(manifest: Manifest, *, resume: bool) -> Manifest:
    """Make the output folder a job's own, from its beginning or to go on.

    To resume is to go on with the passes that are there, if the same job made them. Returns the
    job, with the frames that are there; its water is as wide as theirs. Raises InputError if the
    folder cannot be written to, another job's passes are there, or workers render some.
    """
    make_folder(manifest.out)
    place = manifest.out / JOB_FILE
    if not resume:
        passes = [manifest.pass_path(view, number) for view, number in manifest.tasks()]
        for path in passes:
            if is_living(claim_path(path)):
                raise InputError(
                    f"another process renders {path}; wait for it, or choose another --out; "
                    "nothing was overwritten"
                )
        try:
            for view in manifest.views:
                passes += files_of(manifest, view).all()
            for path in passes:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"cannot write to {manifest.out}: {error.strerror}; choose another --out"
            ) from error
    elif place.exists():
        earlier = _read(place)
        others = differences(earlier, manifest)
        if others:
            raise InputError(
                f"--resume: {manifest.out} was rendered with other values of {', '.join(others)}; "
                "use the same ones, or another --out"
            )
        manifest = _with_earlier(earlier, manifest)
    write_manifest(place, manifest)
    return manifest


def _with_earlier(earlier: Manifest, now: Manifest) -> Manifest:
    """Return a job with the frames of an earlier one beside its own, in order.

    The water is as wide as the wider one. Frames of both are as they are planned now. Jobs of other
    cameras or passes have no frames in common; then this is the job as it is now. The jobs have no
    :func:`.manifest.differences`.
    """
    extents = zip(earlier.output.extent, now.output.extent, strict=True)
    wide, deep = (max(pair) for pair in extents)
    made = replace(now, output=replace(now.output, extent=(wide, deep)))
    old = [frame for frame in earlier.frames if frame not in now.frames]
    if not old or earlier.cameras != now.cameras or earlier.passes != now.passes:
        return made
    source = dict.fromkeys(old, earlier) | dict.fromkeys(now.frames, now)
    frames = tuple(sorted(source))
    settings, changes = settings_by_frame((n, source[n].settings_of(n)) for n in frames)
    developments, views = _grown_views(source, frames, now)
    return replace(
        made,
        frames=frames,
        settings=settings,
        changes=changes,
        developments=developments,
        views=views,
        lamps=changed(((n, source[n].lamps_of(n)) for n in frames), ()),
        clouds=changed(((n, source[n].clouds_of(n)) for n in frames), ()),
        exposed=changed(((n, source[n].exposed_of(n)) for n in frames), Exposed()),
    )


def _grown_views(
    source: Mapping[int, Manifest], frames: tuple[int, ...], now: Manifest
) -> tuple[tuple[Development, ...], tuple[View, ...]]:
    """Cameras in turn, the frames of each in order."""
    found: dict[Development, int] = {}
    known = {
        id(job): {(view.camera, view.frame): view for view in job.views} for job in source.values()
    }
    views = []
    for camera in now.cameras:
        for frame in frames:
            job = source[frame]
            view = known[id(job)][camera.name, frame]
            chosen = job.developments[view.development]
            views.append(replace(view, development=found.setdefault(chosen, len(found))))
    return tuple(found), tuple(views)


def join(manifest: Manifest) -> None:
    """Begin to work at a job in its output folder, maybe beside other workers.

    Raises InputError if the folder cannot be written to, or holds another job.
    """
    make_folder(manifest.out)
    place = manifest.out / JOB_FILE
    if not place.exists():
        write_manifest(place, manifest)
        return
    others = differences(_read(place), manifest)
    if others:
        raise InputError(
            f"{manifest.out} holds another job, with other values of {', '.join(others)}; plan "
            "with another --out, or delete the folder; nothing was overwritten"
        )


def _read(place: Path) -> Manifest:
    try:
        return read_manifest(place)
    except InputError as error:
        # A pass says itself what it is.
        raise InputError(
            f"{place} cannot be used: it is damaged, or of another version. Move it out of the "
            "folder and repeat the command: passes of this very job stay, others are rendered "
            "again"
        ) from error


def develop(
    manifest: Manifest, views: Sequence[View], report_note: Callable[[str], None]
) -> Iterator[View]:
    """Develop the views whose passes are all done; yield each that was just written.

    ``report_note`` receives what could not be done, a line each. Raises InputError in the end, if
    passes of other views are missing.
    """
    plans, rounds, missing = FramePlans(manifest), Rounds(manifest), []
    for view in views:
        there, absent = rounds.rendered(view)
        if absent:
            numbers = ", ".join(map(str, absent))
            missing.append(f"frame {view.frame} of {view.camera}, {numbers}")
            continue
        for note in pictures.develop(manifest, view, there, plans):
            report_note(note)
        yield view
    if missing:
        raise InputError(
            f"not developed, passes are missing: {first_of(missing, between='; ')}; render them "
            "with --from and --frames; the other pictures are finished"
        )
