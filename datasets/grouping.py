"""Views as jobs: those that differ by pose alone are frames of one job.

A job has one water, light, camera and rig; its frames are the poses, in all jobs with the same
numbers, so that a moving sea is the same in every water.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


from .enumeration import PlannedView
from .quantities import Value
from .specification import DataSetCamera, DataSetSpec, Rig


@dataclass(frozen=True)
class ViewJob:
    """Views that are rendered together.

    Parameters
    ----------
    name : str
        Of its folder.
    camera : DataSetCamera
    rig : Rig
    settings : mapping
        Of all frames.
    in_air : bool
    seed : int
        Of the noise.
    frames : mapping of int to PlannedView
        One of the views of each frame; others differ by their detector's noise.
    """

    name: str
    camera: DataSetCamera
    rig: Rig
    settings: Mapping[str, Value]
    in_air: bool
    seed: int
    frames: dict[int, PlannedView] = field(default_factory=dict)

    def settings_of(self, frame: int) -> Mapping[str, Value]:
        """Return the settings of a frame, what is drawn included."""
        return self.frames[frame].settings


@dataclass(frozen=True)
class Place:
    """Where the picture of a view is: job and frame."""

    job: str
    frame: int


def group_views(
    spec: DataSetSpec, views: Iterable[PlannedView], *, seeded: bool, first: int = 0
) -> tuple[list[ViewJob], dict[str, Place]]:
    """Return the jobs of views, and where the picture of each view will be.

    Parameters
    ----------
    spec : DataSetSpec
    views : iterable of PlannedView
        In the order of :func:`.enumerate_views`.
    seeded : bool
        Whether the noise of the engine has a seed, so that repeats are rendered each.
    first : int
        Number of the first job.
    """
    drawn = {name for name, quantity in spec.settings.items() if quantity.drawn}
    lowered = spec.lowered.values
    jobs: dict[object, ViewJob] = {}
    places: dict[str, Place] = {}
    for view in views:
        fixed = {name: value for name, value in view.settings.items() if name not in drawn}
        repeat = view.repeat if seeded else 0
        key = (tuple(fixed.items()), view.camera.name, view.rig.name, repeat)
        if key not in jobs:
            name = _folder(first + len(jobs), view, repeat)
            seed = spec.seed + repeat
            jobs[key] = ViewJob(name, view.camera, view.rig, fixed, view.in_air, seed)
        job = jobs[key]
        depth = 0 if spec.lowered.drawn else lowered.index(view.lowered)
        frame = 1 + view.pose * len(lowered) + depth
        job.frames.setdefault(frame, view)
        places[view.name] = Place(job.name, frame)
    return list(jobs.values()), places


def _folder(number: int, view: PlannedView, repeat: int) -> str:
    words = [str(view.settings["water"]).rsplit("/", 1)[-1], view.camera.name, view.rig.name]
    words += [str(repeat)] if repeat else []
    plain = re.sub(r"[^A-Za-z0-9.-]+", "_", "-".join(words)).strip("_.")
    return f"{number:03d}-{plain}"


