"""Where cameras go: around an object, along a line, a way that is given, or anywhere they fit.

Poses are in the axes of Blender, before the scene is lowered; angles in degrees.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.errors import InputError
from .axes import Array, looking_at, rigid, with_roll
from .camera import PinholeCamera
from .quantities import generator
from .tables import SpecTable
from .trajectory_files import READERS, TimedPoses, read_euroc

Point = tuple[float, float, float]
_TRIES = 500
RATE = 10.0
"""Pictures a second of poses that come without times."""


class RoomForPoses(Protocol):
    """What random poses must know of a scene."""

    def clearance(self, point: ArrayLike) -> float:
        """Distance of a point from the nearest object, m; negative inside one."""
        ...

    def seen_fraction(self, camera_to_world: Array, camera: PinholeCamera) -> float:
        """Fraction of the picture in which something is seen, not open water."""
        ...


@dataclass(frozen=True)
class Orbit:
    """Cameras on a circle around a point, which they look at.

    ``elevations`` are angles above the level through the target, ``arc`` the part of the
    circle; a whole one does not repeat its beginning.
    """

    name: str
    target: Point
    radii: tuple[float, ...]
    elevations: tuple[float, ...]
    count: int
    start: float = 0.0
    arc: float = 360.0
    roll: float = 0.0
    rate: float = RATE

    def poses(self) -> Iterator[Array]:
        """Yield the poses, the angle around the target changing fastest."""
        whole = abs(self.arc) >= 360.0
        around = np.linspace(0.0, self.arc, self.count, endpoint=not whole) + self.start
        for radius in self.radii:
            for up in np.radians(self.elevations):
                for turn in np.radians(around):
                    level = radius * np.cos(up)
                    offset = level * np.cos(turn), level * np.sin(turn), radius * np.sin(up)
                    yield looking_at(np.add(self.target, offset), self.target, self.roll)


@dataclass(frozen=True)
class Transect:
    """Cameras at even distances along a line.

    They look along ``heading``, counter-clockwise from +x, or along the line without one, by
    ``pitch`` above level: -90 looks straight down with the heading on top.
    """

    name: str
    start: Point
    end: Point
    count: int
    heading: float | None = None
    pitch: float = 0.0
    roll: float = 0.0
    rate: float = RATE

    def poses(self) -> Iterator[Array]:
        """Yield the poses from start to end."""
        along = np.subtract(self.end, self.start)
        heading = (
            np.degrees(np.arctan2(along[1], along[0])) if self.heading is None else self.heading
        )
        for fraction in np.linspace(0.0, 1.0, self.count):
            yield heading_pose(self.start + fraction * along, heading, self.pitch, self.roll)


@dataclass(frozen=True)
class RandomPoses:
    """Cameras anywhere in a box, looking at points of another.

    Those nearer to an object than ``clearance`` (m), or that see objects in less than ``in_view``
    of the picture, are drawn again.
    """

    name: str
    low: Point
    high: Point
    target_low: Point
    target_high: Point
    count: int
    roll: float = 0.0
    clearance: float = 0.0
    in_view: float = 0.0

    def pose(
        self, seed: int, number: int, camera: PinholeCamera, scene: RoomForPoses | None
    ) -> Array:
        """Return one of its poses for a camera's picture; the same for the same seed and number.

        Raises InputError if no pose fits, or there are constraints and no scene.
        """
        if (self.clearance > 0 or self.in_view > 0) and scene is None:
            raise InputError(
                f"{self.name}: clearance and in_view need the scene; leave them out to plan "
                "without it"
            )
        random = generator(seed, self.name, number)
        inside = hidden = 0
        for _ in range(_TRIES):
            eye = random.uniform(self.low, self.high)
            target = random.uniform(self.target_low, self.target_high)
            roll = random.uniform(-self.roll, self.roll) if self.roll else 0.0
            if np.linalg.norm(eye - target) < 1e-6:
                continue
            pose = looking_at(eye, target, roll)
            if scene is None:
                return pose
            if self.clearance > 0 and scene.clearance(eye) < self.clearance:
                inside += 1
            elif self.in_view > 0 and scene.seen_fraction(pose, camera) < self.in_view:
                hidden += 1
            else:
                return pose
        raise InputError(
            f"{self.name}: of {_TRIES} cameras none fits: {inside} are inside objects or nearer "
            f"than clearance = {self.clearance:g} m, {hidden} have less than in_view = "
            f"{self.in_view:g} of objects in view; change the box from {self.low} to {self.high}, "
            "its targets, or the constraints, or hide what is around all of them in the viewport"
        )


@dataclass(frozen=True, eq=False)
class GivenPoses:
    """A way that is given pose by pose, from a file or from a camera of the scene.

    ``times`` are s; without them ``rate`` poses a second.
    """

    name: str
    given: TimedPoses
    rate: float = RATE

    def poses(self) -> Iterator[Array]:
        """Yield the poses in order."""
        yield from self.given.poses


@dataclass(frozen=True)
class ScenePath:
    """The way of a camera of the scene in its animation, every ``step`` frames.

    Without a name it is the scene's camera, without first and last frame those of the scene.
    """

    name: str
    camera: str = ""
    first: int | None = None
    last: int | None = None
    step: int = 1


WayPoses = Orbit | Transect | GivenPoses
PoseSet = WayPoses | RandomPoses | ScenePath


def timed_poses(poses: WayPoses) -> Iterator[tuple[Fraction, Array]]:
    """Yield the poses of a way, each after its exact time in s."""
    times = poses.given.times if isinstance(poses, GivenPoses) else None
    for number, pose in enumerate(poses.poses()):
        yield (Fraction(number) / Fraction(poses.rate) if times is None else times[number]), pose


def heading_pose(eye: ArrayLike, heading: float, pitch: float, roll: float = 0.0) -> Array:
    """Return the pose of a camera of a heading and a pitch."""
    turn, up = np.radians(heading), np.radians(pitch)
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    high = np.array([0.0, 0.0, 1.0])
    ahead, top = np.cos(up) * along + np.sin(up) * high, np.cos(up) * high - np.sin(up) * along
    return with_roll(np.cross(ahead, top), top, -ahead, eye, roll)


def read_pose_set(table: SpecTable, folder: Path) -> PoseSet:
    """Read one of the tables ``[[poses]]``; files that it names are sought from a folder.

    Raises InputError if a key is unknown or missing, or a value out of its domain, or a file cannot
    be read.
    """
    kind = table.text("kind")
    name = table.text("name", f"{kind} of {table.where}")
    if kind in READERS:
        result = _given(table, name, kind, folder)
    elif kind in _READERS:
        result = _READERS[kind](table, name)
    else:
        known = ", ".join((*_READERS, *READERS))
        raise InputError(f"{table.place('kind')}: {kind!r} is not one of {known}")
    table.close()
    return result


def _rate(table: SpecTable) -> float:
    rate = table.number("rate", RATE)
    if not rate > 0:
        raise InputError(f"{table.place('rate')}: {rate:g} pictures a second; give more than 0")
    return rate


def _given(table: SpecTable, name: str, kind: str, folder: Path) -> GivenPoses:
    reader = READERS[kind]
    if kind == "euroc" and "camera_in_body" in table:
        matrix = np.array(table.numbers("camera_in_body", 16)).reshape(4, 4)
        body = rigid(matrix, table.place("camera_in_body"))
        reader = functools.partial(read_euroc, camera_in_body=body)
    found = reader(folder / table.text("file"))
    every = table.whole("every", 1, least=1)
    times = None if found.times is None else found.times[::every]
    return GivenPoses(name, TimedPoses(found.poses[::every], times), _rate(table))


def _scene_path(table: SpecTable, name: str) -> ScenePath:
    first, last = (table.whole(k) if k in table else None for k in ("first", "last"))
    if first is not None and last is not None and last < first:
        raise InputError(f"{table.where}: frames run from {first} to {last}; exchange them")
    return ScenePath(name, table.text("camera", ""), first, last, table.whole("step", 1, least=1))


def _point(table: SpecTable, key: str) -> Point:
    x, y, z = table.numbers(key, 3)
    return x, y, z


def _orbit(table: SpecTable, name: str) -> Orbit:
    count, values = table.whole("count", least=1), dict[str, tuple[float, ...]]()
    for key, default in (("radius", None), ("elevation", 0.0)):
        quantity = table.quantity(key, default)
        if quantity.drawn:
            raise InputError(f"{table.place(key)}: an orbit draws nothing; give steps to the range")
        values[key] = tuple(float(value) for value in quantity.values)
    if min(values["radius"]) <= 0:
        raise InputError(f"{table.place('radius')}: an orbit has a radius above 0 m")
    if max(map(abs, values["elevation"])) > 90:
        raise InputError(f"{table.place('elevation')}: give angles of -90 to 90°")
    return Orbit(
        name,
        _point(table, "target"),
        values["radius"],
        values["elevation"],
        count,
        table.number("start", 0.0),
        table.number("arc", 360.0),
        table.number("roll", 0.0),
        _rate(table),
    )


def _transect(table: SpecTable, name: str) -> Transect:
    count = table.whole("count", least=1)
    start, end = _point(table, "start"), _point(table, "end")
    if start == end:
        raise InputError(f"{table.where}: start and end are the same point; move one")
    heading = table.number("heading") if "heading" in table else None
    pitch, roll = table.number("pitch", 0.0), table.number("roll", 0.0)
    return Transect(name, start, end, count, heading, pitch, roll, _rate(table))


def _random(table: SpecTable, name: str) -> RandomPoses:
    count = table.whole("count", least=1)
    low, high = _box(table, "low", "high")
    target_low, target_high = _box(table, "target_low", "target_high")
    in_view, clearance = table.number("in_view", 0.0), table.number("clearance", 0.0)
    if not 0 <= in_view <= 1:
        raise InputError(f"{table.place('in_view')}: a fraction is 0 to 1, not {in_view:g}")
    roll = table.number("roll", 0.0)
    return RandomPoses(name, low, high, target_low, target_high, count, roll, clearance, in_view)


def _box(table: SpecTable, low: str, high: str) -> tuple[Point, Point]:
    corners = _point(table, low), _point(table, high)
    if any(a > b for a, b in zip(*corners, strict=True)):
        raise InputError(
            f"{table.where}: the box from {low} = {corners[0]} to {high} = {corners[1]} is empty; "
            "exchange what is larger in the first"
        )
    return corners


_READERS = {"orbit": _orbit, "transect": _transect, "random": _random, "camera": _scene_path}
