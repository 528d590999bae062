"""Passes of a job as tasks: which are meant, and which are on disk."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ..uw_spectral.errors import InputError
from . import band_passes
from .manifest import Manifest, View


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
        passes, cameras = range(len(manifest.passes)), [x.name for x in manifest.cameras]
        frames = set(_meant(self.frames, manifest.frames, "frames"))
        numbers = set(_meant(self.passes, passes, "passes"))
        names = set(_meant(self.cameras, cameras, "cameras"))
        return [
            Task(view, number)
            for view, number in manifest.tasks()
            if view.frame in frames and view.camera in names and number in numbers
        ]


def _meant(named: Iterable[object], known: Sequence[object], what: str) -> Iterable[object]:
    """Return what is named, all that is known if nothing is; refuse what is not known."""
    missing = [str(item) for item in sorted(set(named) - set(known), key=str)]
    if missing:
        shown = f"{known[0]} to {known[-1]}" if len(known) > 8 else ", ".join(map(str, known))
        raise InputError(
            f"--{what}: the job has no {what} {', '.join(missing)}; there are: {shown}"
        )
    return named or known


def done(manifest: Manifest, task: Task, *, thorough: bool = True) -> Rendered | None:
    """Return a pass if it is on disk; ``thorough`` reads its pixels, else its header counts."""
    state, stamp = state_of(manifest, task)
    if state is not band_passes.State.DONE or stamp is None:
        return None
    path, layers = manifest.pass_path(task.view, task.number), manifest.has_layers(task.number)
    if thorough and not band_passes.is_whole(path, manifest.output.size, layers=layers):
        return None
    bands = manifest.passes[task.number].bands
    return Rendered(task, band_passes.RenderedPass(path, bands, stamp.seconds), stamp.notes)


def state_of(manifest: Manifest, task: Task) -> tuple[band_passes.State, band_passes.Stamp | None]:
    """Return the state of a pass by its header, and its stamp."""
    view, number = task.view, task.number
    path, key = manifest.pass_path(view, number), manifest.key(view, number)
    layers = manifest.has_layers(number)
    return band_passes.look_at(path, key, manifest.output.size, layers=layers)


def by_pass(manifest: Manifest, rendered: Iterable[Rendered]) -> list[list[Rendered]]:
    """Return the parts of each pass of a view; ``rendered`` are in order."""
    each = itertools.groupby(rendered, lambda item: item.task.number // manifest.parts)
    return [list(parts) for _, parts in each]
