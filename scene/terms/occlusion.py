"""What objects keep of the light of the water, throw back, and hide of a view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self, override

import bpy
import numpy as np

from ...node_groups import realtime_adjacency, realtime_occlusion
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...settings.render_plan import RenderPlan, plan_of
from ...uw_spectral.occlusion.adjacency import Adjacency, adjacency
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ...uw_spectral.occlusion.view_directions import AXES, NORMALS
from ...uw_spectral.occlusion.visibility_buffer import VisibilityBuffer, empty_buffer
from ...uw_spectral.transfer.band_spectra import OcclusionSpectra
from ...uw_spectral.transfer.pixel_parts import COLOURS
from ...uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, TABLE_STREAMS
from ...uw_spectral.transfer.solved_field import SolvedField
from .. import marks
from ..readers.filled_view import filled_view
from ..readers.surroundings import Surroundings, has_objects
from ..water import continued_seabed, metering, occlusion
from ..water.frame_water import FLOOR, RealtimeWater
from ..water.realtime import shadow_resolution
from ..water.term import SceneFrame, Term

_FINEST = 0.001  # detail of the sun's shadow, m: Blender's default
_IN_ROOM = 0.5  # of the light of open water


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
        if not has_occlusion(frame.scene, frame.plan):
            return None
        table = frame.occluded if frame.around is None else table_of(frame, frame.around)
        assert table is not None, "there was no look around"
        field = frame.over.column.solved_field(frame.plan.phase, OCCLUSION_STREAMS)
        around = table.on_patches(np.tile(frame.eye.place, (len(AXES), 1)), NORMALS[AXES])
        return cls(table, field, _buffer(frame), bool(around[:, 0].mean() < _IN_ROOM))

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


def has_occlusion(scene: bpy.types.Scene, plan: RenderPlan) -> bool:
    """Whether objects occlude."""
    return plan.settings.diffuse_shadows and has_objects(scene)


def table_of(frame: SceneFrame, around: Surroundings) -> OcclusionTable:
    """Return the occlusion of objects, whose spectrum few bands tell well enough."""
    plan, eye, cache = frame.plan, frame.eye, frame.cache
    few = plan.settings.with_at_most(occlusion.MOST_BANDS)
    some = plan if few == plan.settings else plan_of(few)
    solved = continued_seabed.over(some, cache.ground).solved_field(TABLE_STREAMS)
    # What the sensor sees decides, in band passes too, so that they agree.
    lit = metering.lamplight(frame.scene, eye.camera, some, eye.lit_places)
    seen = some.reduction(eye.depth, lit).weights
    table = occlusion.table_of(around, some.bands, solved, seen, eye.depth, cache)
    return table.on(some.bands.centres, plan.bands.centres)


def _buffer(frame: SceneFrame) -> VisibilityBuffer:
    """Return what of the view objects fill; by night and from the air nothing, as nodes have it."""
    view = frame.from_air()
    if frame.plan.settings.sunlight == 0 or (view is not None and view.in_air):
        return empty_buffer()
    around = frame.around or frame.cache.looked
    return filled_view(
        frame.scene, frame.eye.camera, None if around is None else around.surfaces,
        frame.over.column.floor_depth, frame.cache.picture,
    )  # fmt: skip
