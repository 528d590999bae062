"""The contract of the terms of light, and what they are read of: a scene at a frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...settings.render_plan import RenderPlan
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ...uw_spectral.spectra.bands import Bands
from ..readers import moving_surface
from ..readers.moving_surface import ViewFromAir
from ..readers.shown_lamps import ShownLamp
from ..readers.surroundings import Surroundings
from .occlusion import Cache
from .water_body import WaterExtent

if TYPE_CHECKING:
    from .frame_water import RealtimeWater

type Follower = tuple[bpy.types.Light, ShownLamp]
"""A lamp of the water, and the scene's own that it follows."""


@dataclass(frozen=True, eq=False)
class Eye:
    """Where a picture is taken from."""

    camera: bpy.types.Object | None  #: None where there is none.
    depth: float  #: That the water is made for, m.
    #: Where the camera is at the frames of a job, for all of which the occlusion shall serve.
    path: Sequence[tuple[float, ...]] = ()
    #: Places that the camera sees in the light of lamps, see :func:`.seen_places`; looked for
    #: without.
    lit_places: Sequence[tuple[float, ...]] | None = None

    @property
    def place(self) -> tuple[float, ...]:
        """Where it is, m."""
        if self.camera is None:
            return 0.0, 0.0, -self.depth
        return tuple(self.camera.matrix_world.translation)


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """A frame of a scene, for the water of a plan."""

    scene: bpy.types.Scene
    plan: RenderPlan
    eye: Eye
    cache: Cache  #: What may be used again.
    over: RenderPlan  #: The plan over the scene's own ground, which lights the water.
    around: Surroundings | None = None  #: What there is, where it was looked for.
    occluded: OcclusionTable | None = None  #: What is known already of the occlusion.
    #: Objects may be taken to be where they were when the cache was filled.
    unchanged: bool = False
    extent: WaterExtent | None = None  #: Of the water that is there already.

    def from_air(self) -> ViewFromAir | None:
        """What is special about views from the air; None if a job has none."""
        return moving_surface.view_from_air(
            self.scene, self.eye.camera, self.plan.settings, self.eye.path
        )


class Term:
    """A term of light: read of a scene, drawn by EEVEE as it is then, and given to Cycles.

    Every part is optional. The data-blocks that its nodes read are of its shapes.
    """

    @classmethod
    def read(cls, frame: SceneFrame) -> Self | None:
        """Return what EEVEE draws of it in a frame, if there is any."""
        del frame
        return None

    @classmethod
    def add_to_cycles(cls, frame: SceneFrame) -> list[str]:
        """Put it into the water of Cycles; returns what is not drawn right, one line each."""
        del frame
        return []

    @classmethod
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        """Bring it to a frame; returns what differs by band, (n,), by view-layer property."""
        del frame
        return {}

    @property
    def floating(self) -> float:
        """Mean size of what it lets float in the water, m; 0 if nothing floats."""
        return 0.0

    @property
    def is_near(self) -> bool:
        """Whether there is something nearer than a camera commonly sees."""
        return False

    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        """Return what decides its nodes; nothing without."""
        del water
        return ()

    def projection(self) -> Mapping[str, Any]:
        """Return its arguments of :func:`.project`."""
        return {}

    def excitation(self, bands: Bands) -> NDArray[np.float64]:
        """Weights of bands by which it makes other light of theirs, (3, n), or (0, n)."""
        return np.zeros((0, len(bands)))

    def numbers(self, water: RealtimeWater) -> Numbers:
        """Return its contents of UW Values."""
        del water
        return Numbers()

    def prepare(self, scene: bpy.types.Scene) -> list[str]:
        """Ready the rest of a scene that has got water; returns what could not be, a line each."""
        del scene
        return []

    def followers(self) -> Sequence[Follower]:
        """Make lamps that follow the scene's own, each with the one that it follows."""
        return ()

    def fits(self, scene: bpy.types.Scene) -> bool:
        """Whether the water of a scene has what :meth:`write` needs."""
        del scene
        return True

    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        """Give the water of a scene what differs by frame, besides numbers."""
