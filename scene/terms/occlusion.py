"""What objects keep of the light of the water, throw back, and hide of a view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self, override

import bpy

from ...node_groups import realtime_adjacency, realtime_occlusion
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...uw_spectral.occlusion.adjacency import Adjacency, adjacency
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ...uw_spectral.occlusion.visibility_buffer import VisibilityBuffer
from ...uw_spectral.transfer.band_spectra import OcclusionSpectra
from ...uw_spectral.transfer.pixel_parts import COLOURS
from ...uw_spectral.transfer.solved_field import SolvedField
from .. import marks
from ..water.frame_water import FLOOR, RealtimeWater
from ..water.realtime import shadow_resolution
from ..water.scene_frame import SceneFrame
from ..water.term import Term
from . import scene_occlusion as occlusion

_FINEST = 0.001  # detail of the sun's shadow, m: Blender's default


@dataclass(frozen=True, eq=False)
class OcclusionTerm(Term):
    """What objects do to the light of a frame."""

    table: OcclusionTable  #: What they keep away and throw back.
    low_stream_field: SolvedField  #: Of :class:`.OcclusionSpectra`.
    buffer: VisibilityBuffer | None = None  #: What of the camera's view they fill.
    in_room: bool = False  #: Whether little light reaches the camera's place.

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self | None:
        if not occlusion.has_occlusion(frame.scene, frame.plan):
            return None
        table = occlusion.table(frame)
        field, buffer = occlusion.low_stream_field(frame), occlusion.buffer(frame)
        return cls(table, field, buffer, occlusion.is_in_room(table, frame.eye.place))

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        fills = [] if self.buffer is None else [realtime_adjacency.AdjacencyShape()]
        return [realtime_occlusion.OcclusionShape(), *fills]

    @override
    def projection(self) -> Mapping[str, Any]:
        table = self.table
        spectra = OcclusionSpectra(table.spectra, table.typical, self.low_stream_field)
        return {"occlusion": spectra}

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        found = realtime_occlusion.FIELDS.numbers(self.table.box)
        if self.buffer is not None:
            found |= realtime_adjacency.FIELDS.numbers(self.buffer.view)
        return Numbers({}, found)

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        realtime_occlusion.write_table(marks.part(scene, realtime_occlusion.PART), self.table)
        # A filtered or coarse shadow lets sun in where walls meet or it grazes them: in a dark room
        # nothing is as bright.
        radius, detail = (0.0, _FINEST) if self.in_room else (1.0, shadow_resolution(water))
        for item in marks.suns(scene):
            item.data.shadow_filter_radius, item.data.shadow_maximum_resolution = radius, detail
        if self.buffer is not None:
            self.write_adjacency(scene, water, self.buffer)

    def write_adjacency(
        self, scene: bpy.types.Scene, water: RealtimeWater, buffer: VisibilityBuffer
    ) -> None:
        """Write what objects in a view do to light that is scattered forward."""
        image = marks.part(scene, realtime_adjacency.PART)
        realtime_adjacency.write_adjacency(image, self.adjacency(water, buffer))

    def adjacency(self, water: RealtimeWater, buffer: VisibilityBuffer) -> Adjacency:
        """Return what objects in a view do to light that is scattered forward."""
        floor: int | tuple[float, ...] = water.inputs.seabed_colour
        if FLOOR in water.inputs.reflectances:
            floor = len(COLOURS) + list(water.inputs.reflectances).index(FLOOR)
        return adjacency(buffer, water.projected, water.field.sun, self.table, floor)
