"""What a job adds to its scene: a camera with its lamps, and where it is at each frame.

The scene stays as it is in its file; whoever renders a pass sets the stage anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from ..datasets.cameras_and_rigs import RigLamp

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class StageCamera:
    """A camera; lengths in pixels from the upper left corner of the picture."""

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True)
class StageLamp(RigLamp):
    """A lamp on the camera; ``sha256`` is the content of its file, empty without one."""

    sha256: str = ""

    @property
    def file(self) -> str:
        """The file that ``emission`` names, empty without one."""
        scheme, _, path = self.emission.partition(":")
        return path if scheme == "file" else ""


@dataclass(frozen=True)
class Place:
    """Where the camera is at a frame: its pose in the world, and how far the scene is lowered."""

    camera_to_world: Matrix
    lowered: float = 0.0


@dataclass(frozen=True)
class Stage:
    """A camera, its lamps, and their places by frame.

    ``held`` is the frame at which the animation of the scene stands still.
    """

    camera: StageCamera
    held: int
    lamps: tuple[StageLamp, ...] = ()
    places: Mapping[int, Place] = field(default_factory=dict)

    @property
    def drawn(self) -> dict[str, Any]:
        """All but the places; files count by content, wherever they lie."""
        return _fixed(self.moved(lambda _: ""))

    def moved(self, place: Callable[[str], str]) -> Stage:
        """Return the stage with its files where ``place`` says that they lie."""
        lamps = tuple(
            replace(lamp, emission=f"file:{place(lamp.file)}") if lamp.file else lamp
            for lamp in self.lamps
        )
        return replace(self, lamps=lamps)

    def record(self) -> dict[str, Any]:
        """Return all of it as JSON holds it."""
        places = {str(n): [p.lowered, *p.camera_to_world] for n, p in self.places.items()}
        return {**_fixed(self), "places": places}


def _fixed(stage: Stage) -> dict[str, Any]:
    return {
        "camera": asdict(stage.camera),
        "held": stage.held,
        "lamps": [asdict(x) for x in stage.lamps],
    }


def stage_of(content: Mapping[str, Any]) -> Stage:
    """Return the stage of what :meth:`Stage.record` returned."""
    lamps = tuple(
        StageLamp(**{**lamp, "position": tuple(lamp["position"]), "axis": tuple(lamp["axis"])})
        for lamp in content["lamps"]
    )
    places = {
        int(frame): Place(tuple(map(tuple, rows)), lowered)
        for frame, (lowered, *rows) in content["places"].items()
    }
    return Stage(StageCamera(**content["camera"]), content["held"], lamps, places)
