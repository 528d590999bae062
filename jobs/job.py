"""What a batch is asked to do, besides the settings of its scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..quality.methods import Device, Engine, Mode
from .stage import Stage


@dataclass(frozen=True)
class AutoRequest:
    """What is to be chosen automatically.

    ``target`` is a mean ΔE2000, ``budget`` CPU time in s, or None; settings
    in ``keep`` were given and stay.
    """

    target: float
    budget: float | None
    explain: bool
    keep: frozenset[str]


@dataclass(frozen=True)
class Job:
    """What a batch renders besides the scene's settings.

    ``cameras`` are those of a job of several, else ``camera`` is the one, None for the
    scene's. ``froxels`` are the steps of the shafts' volume, None for the usual ones;
    ``decisions`` the lines that explain what was chosen automatically. ``device`` is None for
    the scene's; ``parts`` are renders of a pass with other seeds, whose mean it is; ``stage``
    is what is added to the scene; ``denoise`` is of developed pictures, what is measured stays as
    rendered.
    """

    blend: Path | None
    engine: Engine
    mode: Mode
    frames: tuple[int, ...]
    camera: str | None
    resolution: tuple[int, int] | None
    seed: int
    out: Path
    resume: bool
    denoise: bool
    froxels: int | None = None
    decisions: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    device: Device | None = None
    parts: int = 1
    stage: Stage | None = None


@dataclass(frozen=True)
class SplitRequest:
    """What to do with a manifest, instead of planning, rendering and developing in one go.

    ``plan`` is where to write one, ``bundle`` the folder of a job for a farm; ``source`` is one to
    read, or the index of a data set: to ``develop`` it or to say its ``status``, else to work at.
    ``passes``, ``frames`` and ``cameras`` are the part of the job that is meant, empty for all;
    ``out`` is the folder of the results, if it is not the manifest's; ``path_mapping`` a file of
    rules by which files lie elsewhere. ``changed`` are settings, and ``denoise``, that pictures are
    developed by instead of the manifest's.
    """

    plan: Path | None = None
    bundle: Path | None = None
    source: Path | None = None
    develop: bool = False
    status: bool = False
    json: bool = False
    passes: tuple[int, ...] = ()
    frames: tuple[int, ...] = ()
    cameras: tuple[str, ...] = ()
    out: Path | None = None
    path_mapping: Path | None = None
    changed: Mapping[str, Any] = field(default_factory=dict)
    denoise: bool | None = None
