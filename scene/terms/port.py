"""A camera that looks through a port, where the water begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self, override

from ...node_groups.realtime_rays import PORT, PortShape
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ..readers import cameras
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term


@dataclass(frozen=True, eq=False)
class PortTerm(Term):
    """The water begins at a distance from the camera along its axis, m."""

    distance: float

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self | None:
        distance = cameras.before_water(frame.eye.camera)
        return cls(distance) if distance > 0.0 else None

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        return (PortShape(),)

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        return Numbers({}, {PORT: self.distance})
