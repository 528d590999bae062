"""Occlusion of a scene, computed for a frame unless it is known already."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ...settings.render_plan import RenderPlan, plan_of
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable
from ...uw_spectral.occlusion.view_directions import AXES, NORMALS
from ...uw_spectral.occlusion.visibility_buffer import VisibilityBuffer, empty_buffer
from ...uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, TABLE_STREAMS
from ...uw_spectral.transfer.solved_field import SolvedField
from ..readers.filled_view import filled_view
from ..readers.surroundings import Surroundings, has_objects
from ..water import continued_seabed, metering, occlusion
from ..water.scene_frame import SceneFrame

_IN_ROOM = 0.5  # of the light of open water


def has_occlusion(scene: bpy.types.Scene, plan: RenderPlan) -> bool:
    """Whether objects occlude."""
    return plan.settings.diffuse_shadows and has_objects(scene)


def table(frame: SceneFrame) -> OcclusionTable:
    """Return what objects keep away and throw back, computed where there was a look around."""
    if frame.around is not None:
        return table_of(frame, frame.around)
    assert frame.occluded is not None, "there was no look around"
    return frame.occluded


def is_in_room(table: OcclusionTable, place: Sequence[float]) -> bool:
    """Whether little light reaches a place, m."""
    return bool(
        table.on_patches(np.tile(place, (len(AXES), 1)), NORMALS[AXES])[:, 0].mean() < _IN_ROOM
    )


def low_stream_field(frame: SceneFrame) -> SolvedField:
    """Return the field of :class:`.OcclusionSpectra`."""
    return frame.over.column.solved_field(frame.plan.phase, OCCLUSION_STREAMS)


def buffer(frame: SceneFrame) -> VisibilityBuffer:
    """Return what of the view objects fill; by night and from the air nothing, as nodes have it."""
    view = frame.from_air()
    if frame.plan.settings.sunlight == 0 or (view is not None and view.in_air):
        return empty_buffer()
    around = frame.around or frame.cache.looked
    return filled_view(
        frame.scene, frame.eye.camera, None if around is None else around.surfaces,
        frame.over.column.floor_depth, frame.cache.picture,
    )  # fmt: skip


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
