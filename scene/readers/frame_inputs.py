"""What a frame of a scene shows, read once: optics and engines take it from here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.clouds.solved_cloud import Cloud
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ...uw_spectral.occlusion.visibility_buffer import VisibilityBuffer
from ..materials.fluorescence import FluorescentObjects
from ..materials.realtime_materials import Kinds
from .lamps import SceneLamps


@dataclass(frozen=True)
class ViewFromAir:
    """A camera of which some frames may be above the water."""

    camera: Sequence[float]  #: Where it is, m.
    in_air: bool  #: Its rays begin in the air.
    towards: Sequence[float]  #: Unit vector to where it looks.


@dataclass(frozen=True, eq=False)
class FrameInputs:
    """What of a scene the light of its water depends on, in the bands of a plan."""

    #: Measured ones, shape (n,), by the names of materials.
    reflectances: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    occlusion: OcclusionTable | None = None  #: What objects keep away and throw back.
    buffer: VisibilityBuffer | None = None  #: What of the camera's view objects fill.
    lamps: SceneLamps = field(default_factory=SceneLamps)
    above: ViewFromAir | None = None  #: Of a camera that may be above the water.
    kinds: Kinds = field(default_factory=Kinds)
    #: Depth in m of the floor that continues the scene's own seabed, infinite while there is no
    #: such seabed; None without that floor.
    seabed: float | None = None
    seabed_colour: tuple[float, float, float] = (0.5, 0.5, 0.5)  #: Linear Rec.709.
    clouds: tuple[tuple[Cloud, float], ...] = ()  #: Blobs, and how far each is from the camera, m.
    grids: tuple[tuple[Cloud, float], ...] = ()  #: Those that have grids, likewise.
    cloud_notes: tuple[str, ...] = ()
    #: Left, bottom, width and height of the picture of an orthographic camera, m.
    frame: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    port: float = 0.0  #: Distance from the camera along its axis at which the water begins, m.
    fluorescent: FluorescentObjects = field(default_factory=FluorescentObjects)
