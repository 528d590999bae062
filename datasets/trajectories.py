"""Ways of the cameras of a set: views in order of time, of one water, light and depth."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from ..uw_spectral.errors import InputError
from .axes import Array, inverse, turned
from .files import plain_name
from .set_files import SetFiles
from .trajectory_files import nanoseconds
from .view import DataSetView

_LEVEL = 1e-6  # m, and of a rotation: what two cameras side by side may differ by


@dataclass(frozen=True)
class Trajectory:
    """A way that one or more cameras went together, named as a folder.

    ``poses`` are their numbers, without those that are not rendered; ``times`` are ns; ``cameras``
    are the views of each camera, one a pose.
    """

    name: str
    poses: tuple[int, ...]
    times: tuple[int, ...]
    cameras: Mapping[str, tuple[DataSetView, ...]]

    @property
    def steps(self) -> Iterator[tuple[int, int]]:
        """Places of poses with that of the next pose, where both are there."""
        for place, (here, there) in enumerate(pairwise(self.poses)):
            if there == here + 1:
                yield place, place + 1

    def pair(self, wanted: str) -> tuple[tuple[DataSetView, ...], tuple[DataSetView, ...] | None]:
        """Return the views of the left camera, and of the right one if there are two.

        Raises InputError, which names the format ``wanted``, if there are more, the two do not
        stand side by side, or a lens distorts.
        """
        both = list(self.cameras.items())
        if any(any(views[0].camera.distortion) for _, views in both):
            raise InputError(
                f"{wanted}, {self.name}: its pictures have no lens distortion; undistort them first"
            )
        if len(both) == 1:
            return both[0][1], None
        if len(both) == 2:
            (_, one), (_, two) = both
            apart = baseline(one[0], two[0])
            if apart is not None:
                return (one, two) if apart > 0 else (two, one)
        raise InputError(
            f"{wanted}, {self.name}: {len(both)} cameras ({', '.join(self.cameras)}); it has one, "
            "or two of the same lens that differ by their offset to the right alone; leave out "
            "the others, or the format"
        )


def baseline(one: DataSetView, two: DataSetView) -> float | None:
    """Return how far a camera stands to the right of another of the same lens, m; None if not."""
    between = between_cameras(one, two)
    level = np.allclose(between[:3, :3], np.eye(3), atol=_LEVEL)
    level = level and np.allclose(between[1:3, 3], 0.0, atol=_LEVEL)
    return float(between[0, 3]) if level and one.camera == two.camera and between[0, 3] else None


def between_cameras(one: DataSetView, two: DataSetView) -> Array:
    """Return the pose of a camera in the axes of another, both OpenCV's, shape (4, 4)."""
    return inverse(turned(one.camera_to_world)) @ turned(two.camera_to_world)


def trajectories(files: SetFiles, wanted: str) -> list[Trajectory]:
    """Return the ways of a set, in order; views of random poses are on no way.

    Raises InputError, which names the format ``wanted``, if views were planned without times.
    """
    found: dict[tuple[object, ...], dict[str, dict[int, DataSetView]]] = {}
    for view in files.views:
        of_view = view.metadata
        if "time_s" not in of_view:
            raise InputError(
                f"{wanted}: view {view.name} has no time, as planned by an earlier version; plan "
                "the set again (--dataset, --dataset-plan), and export it"
            )
        if of_view["time_s"] is None:
            continue
        key = tuple(of_view.get(name) for name in ("pose_set", "group", "lowered_m", "repeat"))
        by_camera = found.setdefault(key, {})
        by_camera.setdefault(of_view["camera"], {})[of_view["pose"]] = view
    ways = [
        _way(name, cameras)
        for name, cameras in zip(_names(found, files), found.values(), strict=True)
    ]
    return [way for way in ways if way.poses]


def _names(keys: Iterable[tuple[object, ...]], files: SetFiles) -> list[str]:
    """Name ways by poses and group, and by depth and repeat where these tell them apart."""
    rows, found = list(keys), []
    several = {row[:2] for row in rows if sum(row[:2] == other[:2] for other in rows) > 1}
    for pose_set, group, lowered, repeat in rows:
        words = [files.pose_set_names[str(pose_set)], str(group)]
        if (pose_set, group) in several:
            words += [f"{lowered:g}m", *([f"repeat{repeat}"] if repeat else [])]
        found.append(plain_name(*words))
    return found


def _way(name: str, cameras: Mapping[str, Mapping[int, DataSetView]]) -> Trajectory:
    """Take the poses that all cameras have."""
    first, *others = cameras.values()
    poses = sorted(set(first).intersection(*others))
    return Trajectory(
        name,
        tuple(poses),
        tuple(_time(first[pose]) for pose in poses),
        MappingProxyType({n: tuple(seen[pose] for pose in poses) for n, seen in cameras.items()}),
    )


def _time(view: DataSetView) -> int:
    """Return the time of a view, ns; sets of earlier versions have seconds alone."""
    of_view = view.metadata
    return of_view.get("time_ns", nanoseconds(Fraction(of_view["time_s"])))
