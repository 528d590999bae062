"""Renders passes of a manifest, each claimed first; nothing is decided here."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterable, Iterator

import bpy

from ..datasets.files import make_folder
from ..scene import contents, scripts, unlit_scans
from ..scene.materials import own_water
from ..scene.readers import picture_size
from ..scene.readers.missing_data import missing_notes
from ..scene.session import other_scenes
from ..scene.unsupported import unsupported
from . import staging
from .camera_water import CameraWater, SceneJob
from .claims import claimed
from .frame_plans import FramePlans
from .manifest import Manifest
from .tasks import Rendered, Task, done


def render(
    scene: bpy.types.Scene,
    manifest: Manifest,
    tasks: Iterable[Task],
    plans: FramePlans,
    report_note: Callable[[str], None],
    *,
    insist: bool = False,
) -> Iterator[Rendered]:
    """Render the passes that are not done, one at each step of the iteration.

    The scene holds water only while the iteration lasts; closing it early takes the water out and
    keeps the passes that are done. Yields a pass that is on disk, and whether it was rendered here;
    those of other workers that are not finished are left out. ``report_note`` receives what could
    not be treated, a line each.

    Who insists answers for every task: the pixels of passes that are there are read, and in the end
    those are rendered too that another worker has claimed and not finished, since it may be on a
    machine that died. A doubled pass is the same pass. Raises InputError if the scene cannot be
    used, or a pass cannot be written.
    """
    staging.require_usable(scene)
    output = manifest.output
    with own_water.hidden(scene, output.hidden):
        said = _notes_of_scene(scene, manifest)  # as it came
    if bpy.app.background:
        made = contents.make_local(scene)
        if made:
            report_note(made)
    bands = 3 if manifest.method.draws_colours else len(manifest.bands_nm)
    picture_size.check_memory(output.size, bands)
    job = SceneJob(scene, manifest, plans, report_note, said)
    left: list[Task] = []
    with staging.prepared(scene, output.hidden, manifest.stage):
        yield from _round(job, tasks, left, insist=insist, force=False)
        if left:  # by now their workers may have died
            yield from _round(job, left, [], insist=insist, force=insist)


def _round(
    job: SceneJob, tasks: Iterable[Task], left: list[Task], *, insist: bool, force: bool
) -> Iterator[Rendered]:
    """Render what is not done; what others are rendering is ``left``."""
    manifest = job.manifest
    for camera, of_camera in itertools.groupby(tasks, lambda task: task.view.camera):
        with contextlib.ExitStack() as stack:
            water = CameraWater(job, camera, stack)
            for task in of_camera:
                kept = done(manifest, task, thorough=insist)
                if kept is not None:
                    yield kept.from_before
                    continue
                path = manifest.pass_path(task.view, task.number)
                make_folder(path.parent)
                with claimed(path, force=force) as ours:
                    kept = done(manifest, task, thorough=insist)  # by now
                    found = water.render(task) if ours and kept is None else None
                if found is not None:
                    yield found
                elif kept is not None:
                    yield kept.from_before
                else:
                    left.append(task)


def _notes_of_scene(scene: bpy.types.Scene, manifest: Manifest) -> tuple[str, ...]:
    """Return what to know of a scene as it came, a line each."""
    hidden, sky = manifest.output.hidden, manifest.settings.get("sky_picture", "")
    said = (
        *missing_notes(scene, manifest.frames),
        *(*scripts.notes(), *unsupported(scene, sky), *unlit_scans.notes(scene)),
        other_scenes(scene),
        *staging.notes(scene, manifest.stage),
        own_water.hidden_note(hidden) if hidden else "",
    )
    return tuple(filter(None, dict.fromkeys(said)))
