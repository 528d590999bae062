"""A farm that renders a shot, simulated: hours and waiting for 1 to 1000 workers.

A discrete-event simulation: workers take tasks from one scheduler, start Blender, render passes,
and develop frames. Times of passes, start and development are measured; those of the farm's own
machinery are assumed, see `Costs`.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from .runner import Ask, Page, table

WORKERS = (1, 10, 100, 300, 1000)
SEED = 1
_HOUR = 3600.0


class Order(Enum):
    """When a frame is developed, and what one task is."""

    BY_STEP = "all passes, then frames"
    BY_FRAME = "each frame when its passes are there"
    WHOLE_FRAMES = "one task a frame"


@dataclass(frozen=True)
class Costs:
    """Seconds of a worker, and of the farm's machinery."""

    start: float  #: Blender starts, reads scene and plan, and resolves the water: once a task.
    render: float  #: A pass, on average.
    spread: float  #: Standard deviation of the logarithm of the time of a pass.
    develop: float  #: A frame, from passes to pictures.
    latency: float = 5.0  #: From the choice of a task to its process, up to.
    assign: float = 0.05  #: The scheduler's own time for a task; it chooses one after the other.
    boot: float = 180.0  #: A worker comes up at a moment from 0 to this.


@dataclass(frozen=True)
class Shot:
    """Frames, passes of a frame, and how many of each make a task."""

    frames: int
    passes: int
    passes_per_task: int = 1
    frames_per_development: int = 10


@dataclass(frozen=True)
class Outcome:
    """What came of a shot.

    ``seconds`` until the last picture, ``first_picture`` until the first; ``work`` is rendering
    and developing, ``overhead`` starts and scheduling, ``waiting`` the rest: of all workers,
    in seconds.
    """

    workers: int
    tasks: int
    seconds: float
    first_picture: float
    work: float
    overhead: float

    @property
    def waiting(self) -> float:
        """Seconds in which workers have nothing to do."""
        return self.workers * self.seconds - self.work - self.overhead

    @property
    def efficiency(self) -> float:
        """Fraction of the workers' time that renders and develops."""
        return self.work / (self.workers * self.seconds)


@dataclass(frozen=True)
class _Task:
    """Seconds of work, frames whose passes it renders and how many of each, frames developed."""

    seconds: float
    rendered: tuple[int, ...] = ()
    count: int = 0
    developed: tuple[int, ...] = ()


def simulate(shot: Shot, costs: Costs, workers: int, order: Order, seed: int = SEED) -> Outcome:
    """Render a shot with a number of workers, each of which takes one task at a time.

    ``order`` is which tasks there are, and what they wait for; ``seed`` that of the times of
    passes, latencies and boots.
    """
    random = np.random.default_rng(seed)
    # The mean of a lognormal distribution is that of its logarithm plus half the variance.
    centre = math.log(costs.render) - costs.spread**2 / 2
    times = random.lognormal(centre, costs.spread, (shot.frames, shot.passes))
    ready = deque(_renders(shot, costs, times, order))
    developments = {task.developed[0]: task for task in _developments(shot, costs, order)}
    total = len(ready) + len(developments)
    left = np.full(shot.frames, shot.passes)
    unrendered = shot.frames
    # Workers that come up or are done, by time; a counter keeps the order of equals.
    events: list[tuple[float, int, _Task | None]] = []
    for place, moment in enumerate(random.uniform(0, costs.boot, workers).tolist()):
        heapq.heappush(events, (moment, place, None))
    number, idle, scheduler = workers, 0, 0.0
    work = overhead = last = 0.0
    first_picture = math.inf
    while events:
        now, _, done = heapq.heappop(events)
        woken = 1
        if done is not None:
            last = max(last, now)
            for frame in done.rendered:
                left[frame] -= done.count
                unrendered -= left[frame] == 0
            if done.developed:
                first_picture = min(first_picture, now)
            released = _released(developments, done, left, unrendered, order)
            ready.extendleft(reversed(released))
            woken += min(idle, len(released))
            idle -= woken - 1
        for _ in range(woken):
            if not ready:
                idle += 1
                continue
            task = ready.popleft()
            scheduler = max(scheduler, now) + costs.assign
            wait = scheduler - now + random.uniform(0, costs.latency)
            overhead += wait + costs.start
            work += task.seconds
            number += 1
            heapq.heappush(events, (now + wait + costs.start + task.seconds, number, task))
    return Outcome(workers, total, last, first_picture, work, overhead)


def _renders(shot: Shot, costs: Costs, times: NDArray[np.float64], order: Order) -> Iterable[_Task]:
    for frame in range(shot.frames):
        if order is Order.WHOLE_FRAMES:
            yield _Task(float(times[frame].sum()) + costs.develop, (frame,), shot.passes, (frame,))
            continue
        for first in range(0, shot.passes, shot.passes_per_task):
            part = times[frame, first : first + shot.passes_per_task]
            yield _Task(float(part.sum()), (frame,), len(part))


def _developments(shot: Shot, costs: Costs, order: Order) -> Iterable[_Task]:
    if order is Order.WHOLE_FRAMES:
        return
    size = shot.frames_per_development if order is Order.BY_STEP else 1
    for first in range(0, shot.frames, size):
        frames = tuple(range(first, min(first + size, shot.frames)))
        yield _Task(costs.develop * len(frames), developed=frames)


def _released(
    developments: dict[int, _Task], done: _Task, left: NDArray[np.int_], unrendered: int,
    order: Order,
) -> list[_Task]:  # fmt: skip
    """Take out the developments that nothing keeps any longer."""
    if order is Order.BY_STEP:
        frames = list(developments) if unrendered == 0 else []
    else:
        frames = [frame for frame in done.rendered if left[frame] == 0 and frame in developments]
    return [developments.pop(frame) for frame in frames]


# Measured, in CPU seconds on two cores that other work kept busy: the reef of examples/ with the
# options of `python3 dev.py example`, Cycles, 480 x 270 pixels, 32 samples, denoised; one process,
# by time.process_time before the first pass, around each pass, and after the last.
_CORES = 2
_SMALL_PIXELS, _LARGE_PIXELS = 480 * 270, 3840 * 2160
_START, _DEVELOP = 2.99, 0.65
_PASSES = (49.2, 48.5, 47.2, 44.9, 44.1, 40.6, 37.4, 36.8, 34.3)
_SHOT = Shot(frames=2 * 60 * 24, passes=9)
# A pass of EEVEE on a graphics card: assumed, to show what short passes do.
_SHORT = 10.0


def measured() -> Costs:
    """Return what a 4K frame costs a worker of two cores."""
    scale, mean = _LARGE_PIXELS / _SMALL_PIXELS, float(np.mean(_PASSES))
    spread = float(np.log(_PASSES).std(ddof=1))
    return Costs(_START, mean / _CORES * scale, spread, _DEVELOP * scale)


def scaling_limit(shot: Shot, costs: Costs, order: Order, efficiency: float) -> int:
    """Return the most workers, of numbers a tenth apart, that are used so well."""
    best, workers = 1, 1
    while workers < 4 * shot.frames * shot.passes:
        if simulate(shot, costs, workers, order).efficiency < efficiency:
            break
        best, workers = workers, max(workers + 1, round(1.1 * workers))
    return best


def measure(_: Ask) -> Mapping[str, object]:
    """Simulate the shot."""
    slow = measured()
    short = replace(slow, render=_SHORT)
    grouped = replace(_SHOT, passes_per_task=_SHOT.passes)
    workers = []
    for count in WORKERS:
        found, step = (simulate(_SHOT, slow, count, x) for x in (Order.BY_FRAME, Order.BY_STEP))
        hours = found.seconds / _HOUR
        workers.append([
            count, f"{hours:.4g}", f"{100 * found.efficiency:.1f} %", f"{_SHOT.frames / hours:.4g}",
            f"{found.first_picture / _HOUR:.3g}", f"{step.first_picture / _HOUR:.3g}",
        ])  # fmt: skip
    limits = []
    for kind, costs in (("4K in Cycles", slow), (f"passes of {_SHORT:g} s", short)):
        for what, shot, order in (
            ("a task a pass, developed at the end", _SHOT, Order.BY_STEP),
            ("a task a pass, developed frame by frame", _SHOT, Order.BY_FRAME),
            ("a task for the passes of a frame, then developed", grouped, Order.BY_FRAME),
            ("a task a frame, developed in it", _SHOT, Order.WHOLE_FRAMES),
        ):
            now = 100 * simulate(shot, costs, 1000, order).efficiency
            most = (scaling_limit(shot, costs, order, fraction) for fraction in (0.9, 0.5))
            limits.append([f"{kind}, {what}", f"{now:.0f} %", *most])
    heads = ("workers", "hours", "efficiency", "pictures per hour", "first picture, h", "by step")
    return {
        "a_pass": slow.render, "apart": math.exp(slow.spread), "small": float(np.mean(_PASSES)),
        "start": slow.start, "develop": slow.develop,
        "workers": table(heads, workers),
        "limits": table(("job", "with 1000", "90 % until, workers", "50 % until"), limits),
    }  # fmt: skip


PAGE = Page(
    "A simulated farm",
    """
Times of Blender are measured on one machine, the farm is simulated with seed 1: two minutes, 2880
frames of 3840 × 2160 pixels in 9 bands, a pass each. Files, lost workers, licences and other jobs
are not in it.

Seconds: a pass {a_pass:.0f}, × or ÷ {apart:.2f} (the reef in Cycles, {small:.1f} CPU s for 480 ×
270 at 32 samples, denoised; 2 cores; × 64 for the pixels), start of a task {start:.1f}, development
of a frame {develop:.1f}, measured; scheduler 0.05 a task, from choice to process 0 to 5, a worker
comes up after 0 to 180, assumed.

## Workers and hours
Frames are developed in turn, as by Flamenco; last, the first picture where all passes come first,
as by a step of Open Job Description (the hours are nearly the same).

{workers}

## Where it stops
Up to so many workers a tenth of the rented time is lost at most, or half.

{limits}

- Passes on several workers let four to five times as many workers help as whole frames do.
- Where passes are short, several passes a task (`PassesPerTask`, `passes_per_task`) or whole frames
  pay.
- In the end the scheduler is the limit: 20 tasks a second.
""",
)
