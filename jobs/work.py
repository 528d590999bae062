"""Renders passes of a manifest, each claimed first; nothing is decided here."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import bpy

from ..scene import contents
from ..scene.engines import housed, transparent_film
from ..scene.engines.band_engine import BandEngine, Opening, RenderPass
from ..scene.engines.engines import engine_of
from ..scene.materials import own_water
from ..scene.readers import cameras, picture_size
from ..scene.temporary import held
from ..scene.water.occlusion import Cache
from ..uw_spectral.errors import InputError
from . import band_passes, render_region
from .claims import claimed
from .frame_plans import FramePlans
from .manifest import Manifest, Output, View
from .planning import extent_of
from .prepared_scene import prepared, require_usable
from .scene_notes import notes_of_camera, notes_of_scene


@dataclass(frozen=True)
class Task:
    """One pass of a view: its place in the manifest's list."""

    view: View
    number: int


@dataclass(frozen=True)
class Rendered:
    """A pass that is on disk, and what could not be treated in it."""

    task: Task
    file: band_passes.RenderedPass
    notes: tuple[str, ...] = ()

    @property
    def from_before(self) -> Rendered:
        """It, where another process rendered it: a record has the seconds of its own only."""
        return replace(self, file=replace(self.file, seconds=None))


@dataclass(frozen=True)
class Part:
    """Which part of a job is meant; empty for all."""

    passes: tuple[int, ...] = ()
    frames: tuple[int, ...] = ()
    cameras: tuple[str, ...] = ()

    @property
    def is_named(self) -> bool:
        """Whether anything was named."""
        return bool(self.passes or self.frames or self.cameras)

    def tasks(self, manifest: Manifest) -> list[Task]:
        """Return the passes of a manifest that are meant; raise InputError if there are none."""
        _require(self.frames, manifest.frames, "--frames", "frames")
        _require(self.passes, range(len(manifest.passes)), "--passes", "passes")
        _require(self.cameras, [c.name for c in manifest.cameras], "--cameras", "cameras")
        frames = set(self.frames or manifest.frames)
        passes = set(self.passes or range(len(manifest.passes)))
        names = set(self.cameras) or {camera.name for camera in manifest.cameras}
        return [
            Task(view, number)
            for view, number in manifest.tasks()
            if view.frame in frames and view.camera in names and number in passes
        ]


def done(manifest: Manifest, task: Task, *, thorough: bool = True) -> Rendered | None:
    """Return a pass if it is on disk; ``thorough`` reads its pixels, else its header counts."""
    path = manifest.pass_path(task.view, task.number)
    size = manifest.output.size
    key, layers = manifest.key(task.view, task.number), manifest.has_layers(task.number)
    state, stamp = band_passes.look_at(path, key, size, layers=layers)
    if state is not band_passes.State.DONE or stamp is None:
        return None
    if thorough and not band_passes.is_whole(path, size, layers=layers):
        return None
    bands = manifest.passes[task.number].bands
    return Rendered(task, band_passes.RenderedPass(path, bands, stamp.seconds), stamp.notes)


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
    require_usable(scene)
    output = manifest.output
    with own_water.hidden(scene, output.hidden):
        said = notes_of_scene(scene, manifest)  # as it came
    if bpy.app.background:
        made = contents.make_local(scene)
        if made:
            report_note(made)
    bands = 3 if manifest.method.draws_colours else len(manifest.bands_nm)
    picture_size.check_memory(output.size, bands)
    job = _Job(scene, manifest, plans, report_note, said)
    left: list[Task] = []
    with prepared(scene, output.hidden, manifest.stage):
        yield from _round(job, tasks, left, insist=insist, force=False)
        if left:  # by now their workers may have died
            yield from _round(job, left, [], insist=insist, force=insist)


@dataclass(frozen=True)
class _Job:
    """What passes are of; ``said`` are the notes of its scene."""

    scene: bpy.types.Scene
    manifest: Manifest
    plans: FramePlans
    report_note: Callable[[str], None]
    said: tuple[str, ...]


def _round(
    job: _Job, tasks: Iterable[Task], left: list[Task], *, insist: bool, force: bool
) -> Iterator[Rendered]:
    """Render what is not done; what others are rendering is ``left``."""
    manifest = job.manifest
    for camera, of_camera in itertools.groupby(tasks, lambda task: task.view.camera):
        with contextlib.ExitStack() as stack:
            water = _Water(job, camera, stack)
            for task in of_camera:
                kept = done(manifest, task, thorough=insist)
                if kept is not None:
                    yield kept.from_before
                    continue
                path = manifest.pass_path(task.view, task.number)
                band_passes.make_folder(path.parent)
                with claimed(path, force=force) as ours:
                    kept = done(manifest, task, thorough=insist)  # by now
                    found = water.render(task) if ours and kept is None else None
                if found is not None:
                    yield found
                elif kept is not None:
                    yield kept.from_before
                else:
                    left.append(task)


class _Water:
    """The water of a camera's passes: put into the scene when the first of them is rendered."""

    def __init__(self, job: _Job, camera: str, stack: contextlib.ExitStack) -> None:
        self._job, self._camera, self._stack = job, camera, stack
        self._engine: BandEngine | None = None
        self._lamps = 0
        self._notes: tuple[str, ...] = ()
        self._frame: tuple[int, RenderPass] | None = None

    def render(self, task: Task) -> Rendered:
        """Render a pass into its file."""
        scene, manifest, view = self._job.scene, self._job.manifest, task.view
        item = manifest.passes[task.number]
        path = manifest.pass_path(view, task.number)
        engine = self._opened(len(manifest.lamps_of(view.frame)))
        if self._frame is None or self._frame[0] != view.frame:
            scene.frame_set(view.frame)
            plan = self._job.plans.of(view.frame)
            self._frame = view.frame, engine.frame(plan, view.depth, manifest.weights(view))
        engine.draw(item.seed, item.samples)
        key, draw = manifest.key(view, task.number), self._frame[1]
        if manifest.output.transparent and task.number == 0:
            draw = transparent_film.with_alpha(draw, scene)
        seconds = band_passes.render_pass(draw, item.bands, path, key, self._notes)
        return Rendered(task, band_passes.RenderedPass(path, item.bands, seconds), self._notes)

    def _opened(self, count: int) -> BandEngine:
        """Return the engine as it is at the first frame of the job with a number of lamps.

        Whatever is rendered of it: nodes are there for as many, and instances come and go.
        """
        if self._engine is not None and self._lamps == count:
            return self._engine
        self._stack.close()
        self._frame, self._lamps = None, count
        scene, manifest = self._job.scene, self._job.manifest
        output = manifest.output
        of_camera = [view for view in manifest.views if view.camera == self._camera]
        first = next(x for x in of_camera if len(manifest.lamps_of(x.frame)) == count)
        camera = cameras.find_camera(scene, self._camera)
        self._stack.enter_context(_size(scene, output))
        self._stack.enter_context(contents.drawn_by(scene, output.engine.upper()))
        scene.frame_set(first.frame)
        opening = Opening(
            plan=self._job.plans.of(first.frame),
            extent=extent_of(manifest),
            depth=first.depth,
            weights=manifest.weights(first),
            seed=output.seed,
            guides=output.denoise,
            froxels=output.froxels,
            device=output.device,
            eyes=tuple(view.eye for view in of_camera if view.eye),
            cache=Cache(of_job=True),
        )
        said = (*self._job.said, *notes_of_camera(scene, camera, opening, manifest))
        chosen = engine_of(output.engine, output.mode)
        engine = self._stack.enter_context(housed.opened(chosen, scene, camera, opening))
        if engine.passes != [item.bands for item in manifest.passes if item.part == 0]:
            raise InputError(
                "the passes of the manifest are not those of its settings; write it again with "
                "--plan"
            )
        known, self._notes = self._notes, tuple(note for note in (*said, *engine.notes) if note)
        for note in dict.fromkeys(self._notes):
            if note not in known:
                self._job.report_note(note)
        self._engine = engine
        return engine


@contextlib.contextmanager
def _size(scene: bpy.types.Scene, output: Output) -> Iterator[None]:
    """Give a scene the resolution and the render region of a job while the block runs."""
    names = ("resolution_x", "resolution_y", "resolution_percentage")
    wanted = [(scene.render, *row) for row in zip(names, output.resolution, strict=True)]
    with held([*wanted, *render_region.wanted_settings(scene, output.region, output.size)]):
        yield


def _require(named: Iterable[object], known: Iterable[object], option: str, what: str) -> None:
    there = list(known)
    missing = [str(item) for item in sorted(set(named) - set(there), key=str)]
    if missing:
        shown = f"{there[0]} to {there[-1]}" if len(there) > 8 else ", ".join(map(str, there))
        raise InputError(
            f"{option}: the job has no {what} {', '.join(missing)}; there are: {shown}"
        )
