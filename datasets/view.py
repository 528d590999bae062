"""A view of a data set: what an exporter needs to know of one picture."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np

from ..uw_spectral.errors import InputError
from .axes import Array, rigid, world_to_opencv
from .camera import PinholeCamera

Split = Literal["train", "val", "test"]
SPLITS: tuple[Split, ...] = get_args(Split)
AIR = "air"
"""A water that is none: the same views without it."""


@dataclass(frozen=True)
class SeenInstance:
    """An object in a picture."""

    number: int  #: Its value in the picture of instances; 1 or more, 0 being none.
    category: str
    #: Shape (4, 4): Its pose, m.
    object_to_world: Array = dataclasses.field(default_factory=lambda: np.eye(4), compare=False)
    model: int = 1  #: Number of its shape: instances of one mesh share it.
    #: 8-bit picture of all of it, what hides it left out; not 0 where it is.
    silhouette: Path | None = None
    category_id: int | None = None  #: Number of its category, where the scene gives one.

    def __post_init__(self) -> None:
        if not 1 <= self.number <= np.iinfo(np.uint16).max:
            raise InputError(
                f"instance of {self.category}: its number must be 1 to 65535, got {self.number}"
            )
        pose = rigid(self.object_to_world, f"instance {self.number} ({self.category})")
        object.__setattr__(self, "object_to_world", pose)


@dataclass(frozen=True)
class DataSetView:
    """A picture, the camera that took it, and what else is known.

    Raises InputError if the pose is none, or the split unknown.
    """

    name: str  #: Unlike that of every other view of the set.
    image: Path
    camera: PinholeCamera
    #: Shape (4, 4): Pose in Blender's axes: the camera looks along its -z, y is up; m, world z up.
    camera_to_world: Array = dataclasses.field(compare=False)
    split: Split = "train"
    depth: Path | None = None  #: Planar depth, 16-bit PNG in mm (:func:`.write_depth_png`).
    mask: Path | None = None  #: 8-bit picture, 0 where the picture is to be left out.
    #: 16-bit picture of the instances' numbers (:func:`.write_instance_map`).
    instance_map: Path | None = None
    instances: tuple[SeenInstance, ...] = ()
    #: What else is known, as JSON holds it: water, depth, truth.
    metadata: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        pose = rigid(self.camera_to_world, f"view {self.name}")
        object.__setattr__(self, "camera_to_world", pose)
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))
        if self.split not in SPLITS:
            raise InputError(
                f"view {self.name}: split {self.split!r} is not one of {', '.join(SPLITS)}"
            )
        numbers = [item.number for item in self.instances]
        if len(set(numbers)) < len(numbers):
            raise InputError(f"view {self.name}: two instances share a number; number them anew")

    @property
    def world_to_opencv(self) -> Array:
        """Matrix from the world to the camera in OpenCV's axes, shape (4, 4)."""
        return world_to_opencv(self.camera_to_world)

    def project(self, points: Array) -> Array:
        """Image coordinates of world points, shape (..., 3) to (..., 2); NaN behind the camera."""
        pose = self.world_to_opencv
        return self.camera.project(np.asarray(points) @ pose[:3, :3].T + pose[:3, 3])


def check_views(views: Sequence[DataSetView]) -> None:
    """Refuse an empty set, and views of the same name."""
    if not views:
        raise InputError("data set: there is no view to write; render some first")
    seen = set[str]()
    for view in views:
        if view.name in seen:
            raise InputError(
                f"data set: two views are named {view.name!r}; give each a name of its own"
            )
        seen.add(view.name)


def category_numbers(views: Iterable[DataSetView], first: int) -> dict[str, int]:
    """Return the numbers of the categories of all instances, in the order of their names."""
    names = {item.category for view in views for item in view.instances}
    return {name: number for number, name in enumerate(sorted(names), first)}
