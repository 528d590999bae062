"""How far a job is, by the files of its passes alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from .band_passes import State
from .claims import claim_path, is_living
from .manifest import Manifest
from .picture_files import is_developed
from .tasks import Task, state_of


@dataclass(frozen=True)
class PassStatus:
    """A pass that is not done, and why."""

    frame: int
    camera: str
    number: int
    state: State
    is_claimed: bool


@dataclass(frozen=True)
class JobStatus:
    """Passes of a job, counted.

    ``seconds_left`` is the time for the rest by one worker as fast as those before; None
    while no pass is done. ``pictures`` counts the views that are developed.
    """

    total: int
    done: int
    pictures: int
    views: int
    seconds_spent: float
    seconds_left: float | None
    unfinished: tuple[PassStatus, ...]

    @property
    def counts(self) -> dict[str, int]:
        """How many passes are in each state, and how many of them somebody is rendering."""
        found = Counter(item.state for item in self.unfinished)
        return {
            "done": self.done,
            "broken": found[State.BROKEN],
            "missing": found[State.MISSING],
            "of_another_job": found[State.OTHER],
            "being_rendered": sum(item.is_claimed for item in self.unfinished),
        }

    def text(self) -> str:
        """Return the status in lines."""
        counts = self.counts
        lines = [
            f"{self.done} of {self.total} passes done, {self.pictures} of {self.views} pictures"
        ]
        lines += [
            f"{counts[name]} {name.replace('_', ' ')}"
            for name in ("broken", "missing", "of_another_job", "being_rendered")
            if counts[name]
        ]
        lines += [
            f"{item.state.value}: frame {item.frame}, camera {item.camera}, pass {item.number}"
            for item in self.unfinished
            if item.state in (State.BROKEN, State.OTHER)
        ]
        if self.seconds_left is not None:
            lines.append(f"{self.seconds_left:.0f} s left for one worker")
        return "\n".join(lines)

    def record(self) -> dict[str, Any]:
        """Return the status as JSON holds it."""
        return {
            "passes": self.total,
            **self.counts,
            "pictures": self.pictures,
            "views": self.views,
            "seconds_spent": self.seconds_spent,
            "seconds_left": self.seconds_left,
            "unfinished": [
                {
                    "frame": item.frame,
                    "camera": item.camera,
                    "pass": item.number,
                    "state": item.state.value,
                    "being_rendered": item.is_claimed,
                }
                for item in self.unfinished
            ],
        }


def status_of(manifest: Manifest) -> JobStatus:
    """Look at the files of a job; pixels are not read."""
    unfinished: list[PassStatus] = []
    seconds: list[list[float]] = [[] for _ in manifest.passes]
    left = [0] * len(manifest.passes)
    for view, number in manifest.tasks():
        state, stamp = state_of(manifest, Task(view, number))
        if state is State.DONE and stamp is not None:
            seconds[number].append(stamp.seconds)
            continue
        left[number] += 1
        is_claimed = is_living(claim_path(manifest.pass_path(view, number)))
        unfinished.append(PassStatus(view.frame, view.camera, number, state, is_claimed))
    spent = sum(map(sum, seconds))
    done = sum(map(len, seconds))
    return JobStatus(
        total=done + len(unfinished),
        done=done,
        pictures=sum(is_developed(manifest, view) for view in manifest.views),
        views=len(manifest.views),
        seconds_spent=spent,
        seconds_left=_left(seconds, left, spent / done) if done else None,
        unfinished=tuple(unfinished),
    )


def _left(seconds: list[list[float]], left: list[int], default: float) -> float:
    """Return the seconds that passes take which are left; the first of a worker is slower."""
    return sum(
        count * (sorted(took)[len(took) // 2] if took else default)
        for took, count in zip(seconds, left, strict=True)
    )
