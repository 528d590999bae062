"""Renders passes of a manifest, each claimed first; nothing is decided here."""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from ..scene import colour_space, contents, scripts, unlit_scans
from ..scene.as_rendered import as_rendered
from ..scene.engines import housed, transparent_film
from ..scene.engines.band_engine import BandEngine, Engine, Opening, RenderPass
from ..scene.engines.engines import engine_of
from ..scene.marks import require_no_water
from ..scene.materials import own_water
from ..scene.readers import cameras, picture_size, stereo, unusable_places
from ..scene.readers.missing_data import missing_notes
from ..scene.readers.own_seabed import floor_note
from ..scene.readers.surroundings import has_objects
from ..scene.session import other_scenes
from ..scene.temporary import held
from ..scene.unsupported import unsupported, unsupported_of_camera
from ..scene.water.occlusion import Cache
from ..uw_spectral.errors import InputError
from . import band_passes, render_region, staging
from .claims import claimed
from .frame_plans import FramePlans
from .manifest import Manifest, Output, View
from .planning import extent_of


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
        """Return the passes of a manifest that are meant; raise InputError if the job has no such
        passes.
        """
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
    """Return a pass if it is on disk: all its pixels if ``thorough``, else by its header and
    length.
    """
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
) -> Iterator[tuple[Rendered, bool]]:
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
    require_no_water(scene)
    with own_water.hidden(scene, manifest.output.hidden):
        said = _said(scene, manifest)  # of the scene as it came
    if bpy.app.background:
        made = contents.make_local(scene)
        if made:
            report_note(made)
    else:
        contents.require_local(scene)
    colour_space.require_rec709()
    picture_size.check_memory(
        manifest.output.size,
        3 if _engine(manifest).method.draws_colours else len(manifest.bands_nm),
    )
    left: list[Task] = []
    with (
        own_water.hidden(scene, manifest.output.hidden),
        as_rendered(scene),
        stereo.two_eyes(scene),
        staging.staged(scene, manifest.stage),
    ):
        rounds = functools.partial(_round, scene, manifest, plans, report_note, said, insist)
        yield from rounds(tasks, left, force=False)
        if left:  # by now their workers may have died
            yield from rounds(left, [], force=insist)


def _said(scene: bpy.types.Scene, manifest: Manifest) -> tuple[str, ...]:
    """Return what to know of a scene, a line each."""
    hidden = manifest.output.hidden
    said = (
        *missing_notes(scene, manifest.frames),
        *(*scripts.notes(), *unsupported(scene), *unlit_scans.notes(scene), other_scenes(scene)),
        *staging.notes(scene, manifest.stage),
        own_water.hidden_note(hidden) if hidden else "",
    )
    return tuple(filter(None, dict.fromkeys(said)))


def _round(
    scene: bpy.types.Scene,
    manifest: Manifest,
    plans: FramePlans,
    report_note: Callable[[str], None],
    said: tuple[str, ...],
    thorough: bool,
    tasks: Iterable[Task],
    left: list[Task],
    *,
    force: bool,
) -> Iterator[tuple[Rendered, bool]]:
    for camera, of_camera in itertools.groupby(tasks, lambda task: task.view.camera):
        with contextlib.ExitStack() as stack:
            water = _Water(scene, manifest, camera, plans, stack, report_note, said)
            for view, of_view in itertools.groupby(of_camera, lambda task: task.view):
                for task in of_view:
                    kept = done(manifest, task, thorough=thorough)
                    if kept is not None:
                        yield kept, False
                        continue
                    path = manifest.pass_path(view, task.number)
                    band_passes.make_folder(path.parent)
                    with claimed(path, force=force) as ours:
                        kept = done(manifest, task, thorough=thorough)  # by now
                        found = water.render(task) if ours and kept is None else None
                    if found is not None:
                        yield found, True
                    elif kept is not None:
                        yield kept, False
                    else:
                        left.append(task)


class _Water:
    """The water of a camera's passes: put into the scene when the first of them is rendered."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        manifest: Manifest,
        camera: str,
        plans: FramePlans,
        stack: contextlib.ExitStack,
        report_note: Callable[[str], None],
        said: tuple[str, ...],
    ) -> None:
        self._said = said
        self._scene, self._manifest, self._plans = scene, manifest, plans
        self._camera, self._stack, self._report = camera, stack, report_note
        self._engine: BandEngine | None = None
        self._lamps = 0
        self._notes: tuple[str, ...] = ()
        self._frame: tuple[int, RenderPass] | None = None

    def render(self, task: Task) -> Rendered:
        """Render a pass into its file."""
        manifest, view = self._manifest, task.view
        item = manifest.passes[task.number]
        path = manifest.pass_path(view, task.number)
        engine = self._opened(len(manifest.lamps_of(view.frame)))
        if self._frame is None or self._frame[0] != view.frame:
            self._scene.frame_set(view.frame)
            ready = engine.frame(self._plans.of(view.frame), view.depth, _weights(manifest, view))
            self._frame = view.frame, ready
        engine.draw(item.seed, item.samples)
        key, draw = manifest.key(view, task.number), self._frame[1]
        if manifest.output.transparent and task.number == 0:
            draw = transparent_film.with_alpha(draw, self._scene)
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
        scene, manifest = self._scene, self._manifest
        of_camera = [view for view in manifest.views if view.camera == self._camera]
        first = next(x for x in of_camera if len(manifest.lamps_of(x.frame)) == count)
        camera = cameras.find_camera(scene, self._camera)
        self._stack.enter_context(_size(scene, manifest.output))
        self._stack.enter_context(contents.drawn_by(scene, manifest.output.engine.upper()))
        scene.frame_set(first.frame)
        plan, output = self._plans.of(first.frame), manifest.output
        eyes = tuple(view.eye for view in of_camera if view.eye)
        cache, ground = Cache(of_job=True), None
        if math.isfinite(plan.column.floor_depth) and has_objects(scene):
            ground = cache.look(scene, camera, plan.column, eyes).ground
        opening = Opening(
            plan=plan,
            extent=extent_of(manifest),
            depth=first.depth,
            weights=_weights(manifest, first),
            seed=output.seed,
            guides=output.denoise,
            froxels=output.froxels,
            device=output.device,
            eyes=eyes,
            cache=cache,
        )
        # Before the water is there.
        traced = _engine(manifest).method.traced
        said = (
            *self._said,
            *unsupported_of_camera(scene, camera, traced=traced),
            "" if output.transparent else transparent_film.note(scene, camera, plan.settings, eyes),
            floor_note(plan, ground),
            *unusable_places.notes(),
        )
        engine = self._stack.enter_context(housed.opened(_engine(manifest), scene, camera, opening))
        if engine.passes != [item.bands for item in manifest.passes if item.part == 0]:
            raise InputError(
                "the passes of the manifest are not those of its settings; write it again with "
                "--plan"
            )
        known, self._notes = self._notes, tuple(note for note in (*said, *engine.notes) if note)
        for note in dict.fromkeys(self._notes):
            if note not in known:
                self._report(note)
        self._engine = engine
        return engine


def _engine(manifest: Manifest) -> Engine:
    return engine_of(manifest.output.engine, manifest.output.mode)


def _weights(manifest: Manifest, view: View) -> np.ndarray:
    return np.array(manifest.developments[view.development].weights)


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
