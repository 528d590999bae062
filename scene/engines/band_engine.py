"""What an engine is: facts about it, and what it renders once there is water in a scene.

Another renderer is a file that makes an :class:`Engine`, and a row of :data:`.engines.ENGINES`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...quality.methods import Device, Method
from ...settings.render_plan import RenderPlan
from ..water.occlusion import Cache
from ..water.water_body import WaterExtent

Weights = NDArray[np.float64]
"""Linear RGB per unit radiance of each band, shape (3, n)."""

RenderPass = Callable[[tuple[int, ...], Path], FrameLayers | None]
"""Renders the bands of one pass into a float EXR; returns its layers, if any are wanted."""


class ReadyFrame(Protocol):
    """Readies the current frame.

    Its plan may have other values than the first one; the camera is at a depth in m. Weights
    count where an engine draws colours; by default they are those of plan and depth.
    """

    def __call__(
        self, plan: RenderPlan, depth: float, weights: Weights | None = None, /
    ) -> RenderPass:
        """Return what renders a pass."""
        ...


def _same_noise(_: int, __: int) -> None:
    """Leave the noise as it is."""


@dataclass(frozen=True)
class BandEngine:
    """Water in a scene, ready to be rendered."""

    passes: list[tuple[int, ...]]  #: Bands of each.
    notes: list[str]
    frame: ReadyFrame  #: Readies the current frame.
    #: Renders planar depth of it, m, infinite in open water, with a file beside a path for the
    #: moment.
    depth: Callable[[Path], NDArray[np.float64]]
    #: Sets seed and samples of the passes that follow.
    draw: Callable[[int, int], None] = _same_noise


@dataclass(frozen=True, eq=False)
class Opening:
    """What an engine begins with: the first frame of the job, whatever part of it is rendered."""

    plan: RenderPlan
    extent: WaterExtent
    depth: float
    weights: Weights
    seed: int
    guides: bool
    froxels: int | None
    device: Device
    eyes: tuple[tuple[float, ...], ...] = ()
    """Where the camera is at the frames of the job, see :attr:`.manifest.View.eye`."""
    cache: Cache | None = None
    """What was seen already of the first frame."""


Open = Callable[
    [bpy.types.Scene, bpy.types.Object, Opening], contextlib.AbstractContextManager[BandEngine]
]
"""Puts water into a scene for a camera, and takes it out after the block."""


@dataclass(frozen=True)
class Engine:
    """What can render, and how."""

    method: Method
    open: Open
    passes: Callable[[RenderPlan], list[tuple[int, ...]]]  #: Bands of each pass.
