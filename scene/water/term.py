"""The contract of the terms of light."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...uw_spectral.spectra.bands import Bands
from ..readers.shown_lamps import ShownLamp
from .scene_frame import SceneFrame

if TYPE_CHECKING:
    from .frame_water import RealtimeWater

type Follower = tuple[bpy.types.Light, ShownLamp]
"""A lamp of the water, and the scene's own that it follows."""


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
