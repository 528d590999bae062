"""Views as jobs: those that differ by pose alone are frames of one job.

A job has one water, light, camera and rig; its frames are the poses, in all jobs with the same
numbers, so that a moving sea is the same in every water.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from .cameras_and_rigs import CameraRig, DataSetCamera
from .enumeration import PlannedView
from .files import plain_name, plain_names
from .index import IndexedView
from .quantities import LARGEST_SEED, Value
from .specification import DataSetSpec

_DIGITS = 6  # of what tells groups apart


@dataclass(frozen=True)
class ViewJob:
    """Views that are rendered together."""

    name: str
    group: str  #: Of its water, light and rig, whose views show one scene.
    camera: DataSetCamera
    rig: CameraRig
    in_air: bool
    seed: int  #: Of the noise.
    #: One of the views of each frame; others differ by their detector's noise.
    frames: dict[int, PlannedView] = field(default_factory=dict)


def group_views(
    spec: DataSetSpec, views: Iterable[PlannedView], *, seeded: bool, taken: Iterable[str] = ()
) -> tuple[list[ViewJob], dict[str, IndexedView]]:
    """Return the jobs of views, and the views by name, with the place of their pictures.

    ``views`` are in the order of :func:`.enumerate_views`; ``seeded`` is whether the noise of the
    engine has a seed, so that repeats are rendered each; ``taken`` are names of other jobs.
    """
    drawn = {name for name, quantity in spec.settings.items() if quantity.drawn}
    lowered = spec.lowered.values
    jobs: dict[object, ViewJob] = {}
    indexed: dict[str, IndexedView] = {}
    for view in views:
        fixed = {name: value for name, value in view.settings.items() if name not in drawn}
        repeat = view.repeat if seeded else 0
        key = (tuple(fixed.items()), view.camera.name, view.rig.name, repeat)
        if key not in jobs:
            group, seed = _group(fixed, view), (spec.seed + repeat) % (LARGEST_SEED + 1)
            words = [group, view.camera.name] + ([f"seed{repeat}"] if repeat else [])
            there = (*taken, *(job.name for job in jobs.values()))
            (name,) = plain_names([plain_name(*words)], taken=there).values()
            jobs[key] = ViewJob(name, group, view.camera, view.rig, view.in_air, seed)
        job = jobs[key]
        depth = 0 if spec.lowered.drawn else lowered.index(view.lowered)
        frame = 1 + view.pose * len(lowered) + depth
        job.frames.setdefault(frame, view)
        indexed[view.name] = IndexedView(
            view.name, job.name, frame, job.group, view.split, view.noise_seed, view.record()
        )
    return list(jobs.values()), indexed


def _group(fixed: Mapping[str, Value], view: PlannedView) -> str:
    """Name water and rig, and tell them from those that differ by other settings."""
    content = json.dumps([dict(fixed), asdict(view.rig)], sort_keys=True)
    digest = hashlib.sha256(content.encode()).hexdigest()[:_DIGITS]
    return plain_name(Path(str(view.settings["water"])).stem, view.rig.name, digest)
