"""The index of a data set: its views, and the job and frame where each is rendered.

One JSON file beside the jobs; paths in it are relative to its folder.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..uw_spectral.errors import InputError
from .axes import Array
from .camera import PinholeCamera
from .files import joined, relative, write_text
from .view import Split

KIND = "underwater-spectral data set"
FORMAT = 1
NAME = "dataset.json"
_PLACED = ("job", "frame", "group")


@dataclass(frozen=True)
class IndexedView:
    """A view of the index."""

    name: str
    job: str
    frame: int
    group: str
    split: Split
    noise_seed: int
    record: Mapping[str, Any]

    @property
    def camera(self) -> PinholeCamera:
        """Its camera."""
        optics = self.record["camera"]["optics"]
        return PinholeCamera(**{**optics, "distortion": tuple(optics["distortion"])})

    @property
    def camera_to_world(self) -> Array:
        """Its pose in Blender's axes, shape (4, 4)."""
        return np.array(self.record["camera_to_world"], dtype=np.float64)

    @property
    def lowered(self) -> float:
        """Metres that the scene is lowered by."""
        return float(self.record["lowered_m"])


@dataclass(frozen=True)
class SceneObject:
    """An object of the scene, as it is before the scene is lowered.

    ``category_id`` numbers its category where the scene says how; ``model`` numbers shapes: objects
    of one mesh and size share it.
    """

    name: str
    category: str
    category_id: int | None
    model: int
    object_to_world: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Index:
    """A data set, planned.

    ``rendered`` is what all jobs share besides the views: engine, mode, settings; ``jobs`` are
    their folders below ``jobs``; the views are in order.
    """

    folder: Path
    spec: Path
    scene: Path
    scene_sha256: str
    rendered: Mapping[str, Any]
    jobs: tuple[str, ...]
    views: Mapping[str, IndexedView]
    objects: tuple[SceneObject, ...]

    def manifest(self, job: str) -> Path:
        """Return the manifest of a job."""
        return job_folder(self.folder, job) / "job.json"

    def frames(self, job: str) -> list[int]:
        """Return the frames of a job that the set needs."""
        return sorted({view.frame for view in self.views.values() if view.job == job})


def job_folder(folder: Path, job: str) -> Path:
    """Return the folder of a job."""
    return folder / "jobs" / job


def write_index(path: Path, index: Index) -> None:
    """Write an index, a view a line; whole under its name, or not at all."""
    head = {
        "kind": KIND,
        "format": FORMAT,
        "spec": relative(index.spec, path.parent),
        "scene": relative(index.scene, path.parent),
        "scene_sha256": index.scene_sha256,
        "rendered": dict(index.rendered),
        "jobs": index.jobs,
    }
    rows = [
        {**view.record, **{name: getattr(view, name) for name in _PLACED}}
        for view in index.views.values()
    ]
    parts = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in head.items()]
    parts += [f'"views": {_lines(rows)}', f'"things": {_lines(map(asdict, index.objects))}']
    write_text(path, "{\n" + ",\n".join(parts) + "\n}\n")


def read_index(path: Path) -> Index:
    """Read an index; raise InputError if the file is missing, damaged, or of another format."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"cannot read {path}: {error.strerror}; plan the data set with --dataset"
        ) from error
    except ValueError as error:
        raise InputError(f"{path} is damaged ({error}); delete it and plan again") from error
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise InputError(f"{path} is no index of a data set; plan one with --dataset")
    if content.get("format") != FORMAT:
        raise InputError(
            f"{path} has format {content.get('format')!r}, and this extension reads {FORMAT}; use "
            "the version that wrote it"
        )
    folder = path.absolute().parent
    try:
        views = [
            IndexedView(
                **{name: row[name] for name in ("name", *_PLACED, "split", "noise_seed")},
                record={name: value for name, value in row.items() if name not in _PLACED},
            )
            for row in content["views"]
        ]
        objects = tuple(
            SceneObject(
                **{
                    "category_id": None,
                    **row,
                    "object_to_world": tuple(map(tuple, row["object_to_world"])),
                }
            )
            for row in content["things"]
        )
        return Index(
            folder,
            Path(joined(content["spec"], folder)).resolve(),
            Path(joined(content["scene"], folder)).resolve(),
            content["scene_sha256"],
            content["rendered"],
            tuple(content["jobs"]),
            {view.name: view for view in views},
            objects,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path} is damaged ({type(error).__name__}: {error}); delete it and plan again"
        ) from error


def is_index(path: Path) -> bool:
    """Whether a file is an index, by its first line after the brace."""
    try:
        with path.open(encoding="utf-8") as file:
            return KIND in file.readline() + file.readline()
    except (OSError, UnicodeDecodeError):
        return False


def _lines(rows: Any) -> str:  # noqa: ANN401 - what JSON holds
    return "[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]"
