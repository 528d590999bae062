"""The views that a specification stands for, in order, each with a name of its own content.

A view keeps its name whatever else changes in the specification, so that one that is finished
need not be rendered again.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectrum import is_file
from ..uw_spectral.transfer.water_column import WAVES
from .axes import Array
from .cameras_and_rigs import CameraRig, DataSetCamera
from .files import write_text
from .pose_sets import GivenPoses, RandomPoses, RoomForPoses, ScenePath, timed_poses
from .quantities import Value, generator
from .specification import AIR, AMOUNTS, CONSTITUENTS, DataSetSpec
from .trajectory_files import nanoseconds
from .view import SPLITS, Split

_WAVES = ("wind_speed", "wind_direction", "fetch", "wave_seed")
_DIGITS = 16  # of a name
_ROUNDED = 9  # decimals of a pose that count


@dataclass(frozen=True)
class PlannedView:
    """A view to render."""

    name: str  #: Digest of everything but the split.
    pose_set: str
    #: Its place among all poses; views of one pose differ by water, light, camera and noise.
    pose: int
    camera_to_world: Array  #: Shape (4, 4): In Blender's axes, in the lowered scene.
    camera: DataSetCamera
    settings: Mapping[str, Value]
    lowered: float  #: Metres that the scene is lowered by.
    rig: CameraRig
    noise_seed: int
    split: Split  #: The same for all views of a pose.
    repeat: int = 0  #: Which of the pictures that differ by their noise.
    time: Fraction | None = None  #: s; of a pose on a way.

    @property
    def in_air(self) -> bool:
        """Whether there is no water."""
        return self.settings["water"] == AIR

    def record(self) -> dict[str, Any]:
        """Return all of it as JSON holds it."""
        return {
            "name": self.name,
            "pose_set": self.pose_set,
            "pose": self.pose,
            "camera_to_world": self.camera_to_world.tolist(),
            "camera": asdict(self.camera),
            "settings": dict(self.settings),
            "lowered_m": self.lowered,
            "rig": asdict(self.rig),
            "noise_seed": self.noise_seed,
            "split": self.split,
            "repeat": self.repeat,
            "time_s": None if self.time is None else float(self.time),
            "time_ns": None if self.time is None else nanoseconds(self.time),
        }


def enumerate_views(spec: DataSetSpec, scene: RoomForPoses | None = None) -> list[PlannedView]:
    """Return the views of a specification; the same for the same one.

    ``scene`` is for poses that must fit into it. Raises InputError if there are too many, a camera
    is not in the water or inside an object, or no random pose fits.
    """
    poses = list(_poses(spec, scene))
    crossed = itertools.product(*(quantity.values for quantity in spec.settings.values()))
    settings = (dict(zip(spec.settings, values, strict=True)) for values in crossed)
    conditions = list(dict.fromkeys(map(_known, settings)))
    sets = len(spec.lowered.values) * len(spec.cameras) * len(spec.rigs) * spec.repeats
    total = len(poses) * len(conditions) * sets
    if total > spec.most:
        raise InputError(
            f"the specification makes {total} views, more than most_views = {spec.most}: "
            f"{len(poses)} poses × {len(conditions)} waters and lights × {sets} depths, cameras, "
            "rigs and repeats; shorten its lists, or raise most_views"
        )
    splits = _splits(len(poses), spec)
    digests = _digests(spec)
    return [
        view
        for number, pose in enumerate(poses)
        for view in _of_pose(spec, number, pose, conditions, splits[number], digests)
    ]


def unfinished(views: Sequence[PlannedView], done: Container[str]) -> list[PlannedView]:
    """Return the views whose names are not among those that are done."""
    return [view for view in views if view.name not in done]


def write_plan(path: Path, views: Sequence[PlannedView]) -> None:
    """Write views as JSON, one a line; whole under its name, or not at all."""
    write_text(path, "".join(json.dumps(view.record()) + "\n" for view in views))


@dataclass(frozen=True)
class _Pose:
    """A pose, the set that it is of, and its time in s where that is a way.

    ``told_by`` is the time where that tells it from others: a camera moved by hand may wait.
    """

    pose_set: str
    matrix: Array
    time: Fraction | None = None
    told_by: tuple[float, ...] = ()


def _poses(spec: DataSetSpec, scene: RoomForPoses | None) -> Iterator[_Pose]:
    for pose_set in spec.poses:
        if isinstance(pose_set, RandomPoses):
            camera = spec.cameras[0].optics
            for number in range(pose_set.count):
                pose = pose_set.pose(spec.seed, number, camera, scene)
                yield _Pose(pose_set.name, pose)
        elif isinstance(pose_set, ScenePath):
            raise InputError(
                f"{pose_set.name}: the way of a camera needs the scene; plan with --dataset"
            )
        else:
            for number, (time, pose) in enumerate(timed_poses(pose_set)):
                if scene is not None and scene.clearance(pose[:3, 3]) < 0:
                    x, y, z = pose[:3, 3]
                    raise InputError(
                        f"{pose_set.name}: camera {number}, at ({x:g}, {y:g}, {z:g}), is inside a "
                        "object or below the ground; move the poses, or hide what is around all of "
                        "them in the viewport"
                    )
                told_by = (float(time),) if isinstance(pose_set, GivenPoses) else ()
                yield _Pose(pose_set.name, pose, time, told_by)


def _known(values: Mapping[str, Value]) -> tuple[tuple[str, Value], ...]:
    """Settings that tell a view from another: without those that its water takes no note of."""
    water, left_out = values["water"], set[str]()
    if water != CONSTITUENTS:
        left_out |= set(AMOUNTS)
    if not str(water).startswith("jerlov:"):
        left_out.add("water_source")
    if water == AIR:
        left_out |= {"concentration", "absorption_factor", "scattering_factor", "surface", *_WAVES}
    if values.get("surface") not in (None, WAVES):
        left_out |= set(_WAVES)
    return tuple((name, value) for name, value in values.items() if name not in left_out)


def _of_pose(
    spec: DataSetSpec,
    number: int,
    pose: _Pose,
    conditions: Sequence[tuple[tuple[str, Value], ...]],
    split: Split,
    digests: Mapping[str, str],
) -> Iterator[PlannedView]:
    place = np.round(pose.matrix, _ROUNDED) + 0.0  # no negative zero
    key = place.tolist()
    for depth, given in itertools.product(spec.lowered.values, conditions):
        lowered = float(spec.lowered.resolved(depth, spec.seed, "depth", key))
        settings = MappingProxyType(
            {
                name: spec.settings[name].resolved(value, spec.seed, name, key)
                for name, value in given
            }
        )
        for camera, rig, repeat in itertools.product(spec.cameras, spec.rigs, range(spec.repeats)):
            there = place.copy()
            if any(camera.offset):
                there[:3, 3] = np.round(place[:3, 3] + place[:3, :3] @ camera.offset, _ROUNDED)
            there[2, 3] -= lowered
            there.setflags(write=False)
            if settings["water"] != AIR and there[2, 3] >= 0:
                raise InputError(
                    f"{pose.pose_set}: a camera is {there[2, 3]:g} m above the water, whose "
                    "surface is z = 0; move the poses down, or raise scene.depth"
                )
            # The place says where its offset brings it.
            kind = {name: value for name, value in asdict(camera).items() if name != "offset"}
            if not camera.port:  # which sets of earlier versions do not know
                del kind["port"]
            content = [
                there.tolist(),
                kind,
                {name: digests.get(str(value), value) for name, value in settings.items()},
                lowered,
                asdict(rig),
                [spec.seed, repeat],
                *pose.told_by,
            ]
            text = json.dumps(content, sort_keys=True)
            for location, digest in digests.items():
                text = text.replace(json.dumps(location)[1:-1], digest)
            name = hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
            seed = int(generator(spec.seed, "noise", name).integers(2**31))
            yield PlannedView(
                name, pose.pose_set, number, there, camera, settings, lowered, rig, seed, split,
                repeat, pose.time,
            )  # fmt: skip


def _digests(spec: DataSetSpec) -> dict[str, str]:
    """Files by their content, so that a name does not depend on the folder."""
    texts = [str(v) for q in spec.settings.values() for v in q.values]
    texts += [camera.sensor for camera in spec.cameras]
    texts += [lamp.emission for rig in spec.rigs for lamp in rig.lamps]
    found = {}
    for text in texts:
        path = text.removeprefix("file:")
        if text.startswith("file:") and is_file(path):
            found[text] = "file:" + hashlib.sha256(Path(path).read_bytes()).hexdigest()
    return found


def _splits(count: int, spec: DataSetSpec) -> list[Split]:
    """Split of each pose: drawn without replacement, so that the fractions are kept."""
    order = generator(spec.seed, "splits").permutation(count)
    ends = np.round(np.cumsum(spec.fractions) * count)
    places = np.searchsorted(ends, np.arange(count), side="right")
    found = np.empty(count, dtype=int)
    found[order] = np.minimum(places, len(SPLITS) - 1)
    return [SPLITS[place] for place in found]
