"""What terms of light are read of: a scene at a frame, seen from somewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...settings.render_plan import RenderPlan
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ..readers import moving_surface
from ..readers.moving_surface import ViewFromAir
from ..readers.surroundings import Surroundings
from .occlusion import Cache
from .water_body import WaterExtent


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
