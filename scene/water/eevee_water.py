"""What EEVEE needs to know of a scene: what stands in its water, made ready for the nodes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...settings.render_plan import RenderPlan, plan_of
from ...uw_spectral.clouds.solved_cloud import Cloud
from ...uw_spectral.errors import InputError
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable, without_occlusion
from ...uw_spectral.occlusion.visibility_buffer import (
    VisibilityBuffer,
    VisibilityCache,
    empty_buffer,
)
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS
from .. import contents
from ..materials import band_colors, fluorescence, realtime_materials
from ..readers import cameras, clouds, lamps, waterline
from ..readers.filled_view import filled_view
from ..readers.frame_inputs import FrameInputs, ViewFromAir
from ..readers.surroundings import Surroundings, has_objects
from . import continued_seabed, moving_surface, occlusion
from .frame_water import RealtimeWater, realtime_water
from .particles import particles_of


@dataclass(frozen=True, eq=False)
class Eye:
    """Where a picture is taken from.

    Attributes
    ----------
    camera : Object or None
        None where there is none.
    depth : float
        That the water is made for, m.
    path : tuple of six floats each
        Where the camera is at the frames of a job, for all of which the occlusion shall serve.
    in_air : bool, optional
        Whether rays begin in the air; by where the camera is without.
    lit_places : tuple of places, optional
        That the camera sees in the light of lamps, see :func:`.seen_places`; looked for without.
    """

    camera: bpy.types.Object | None
    depth: float
    path: Sequence[tuple[float, ...]] = ()
    in_air: bool | None = None
    lit_places: Sequence[tuple[float, ...]] | None = None

    def from_air(self, scene: bpy.types.Scene, plan: RenderPlan) -> ViewFromAir | None:
        """What is special about views from the air; None if a job has none."""
        if self.camera is None:
            return None
        if not moving_surface.may_be_over(self.camera, plan.settings, self.path):
            return None
        eye, in_air = cameras.eye_of(self.camera), self.in_air
        if in_air is None:
            in_air = waterline.is_in_air(eye, moving_surface.heights(scene, plan.settings))
        return ViewFromAir(eye[:3], in_air, eye[3:])


def eevee_water(
    plan: RenderPlan,
    scene: bpy.types.Scene,
    eye: Eye,
    weights: NDArray[np.float64],
    cache: occlusion.Cache | None = None,
    occluded: OcclusionTable | None = None,
    *,
    unchanged: bool = False,
) -> RealtimeWater:
    """Return the water of EEVEE, see :func:`.realtime_water`.

    Parameters
    ----------
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    cache : Kept, optional
        What may be used again.
    occluded : OcclusionTable, optional
        What is known already of the occlusion; the ground is then the one that was kept.
    unchanged : bool
        Whether objects may be taken to be where they were when ``cache`` was filled.

    Raises
    ------
    InputError
        If the camera is orthographic and the water differs with depth.
    """
    chosen, around, cache = plan.settings, None, cache or occlusion.Cache()
    surfaces = (chosen.diffuse_shadows or chosen.scene_floor) and has_objects(scene)
    continues = continued_seabed.may_continue(scene, plan)
    occlusions = chosen.diffuse_shadows and surfaces
    if not occlusions:
        occluded = None
    elif chosen.sunlight == 0:
        # The same nodes as by day; there is nothing to occlude.
        occluded = without_occlusion(len(plan.bands))
    if surfaces and occluded is None:
        around = cache.look(scene, eye.camera, plan.column, eye.path)
    ground = cache.ground if surfaces else None
    over = continued_seabed.over(plan, ground)
    solved = over.solved_field(TABLE_STREAMS)
    if occlusions and around is not None:
        occluded = _occluded(plan, scene, around, eye, cache)
    place = (0.0, 0.0, -eye.depth)
    if eye.camera is not None:
        place = tuple(eye.camera.matrix_world.translation)
    shining = cache.lamp_shadows.of(scene, lamps.plan_lamps(scene, plan), unchanged=unchanged)
    if shining.lamps:
        shining = shining.in_layers(plan.column, plan.phase, eye.depth)
        water = shining.around or plan.lamp_water(max(eye.depth, 0.0))
        shining = shining.with_virtual_lights(water, plan.bands, place)
        shining = cache.lamp_shadows.of_virtual(shining)
    reflectances = {
        material.name: reflectance.at(plan.bands.centres)
        for material, reflectance in band_colors.measured_reflectances(scene)
    }
    kinds = realtime_materials.kinds(contents.materials(scene))
    seabed = continued_seabed.depth_of(ground) if continues else None
    buffer = (
        _buffer(scene, eye, around or cache.looked, over, cache.picture) if occlusions else None
    )
    inputs = FrameInputs(
        reflectances, occluded, buffer, shining, eye.from_air(scene, plan), kinds, seabed,
        port=cameras.before_water(eye.camera),
        fluorescent=fluorescence.fluorescent_objects(contents.materials(scene)),
    )  # fmt: skip
    floating = clouds.clouds_of(scene, plan.bands.centres)
    if floating.objects:
        unseen = floating.unseen_by_eevee(shafts=plan.draws_shafts)
        grids, empty = cache.grids.of(scene, floating.grids, unchanged=unchanged)
        inputs = replace(
            inputs,
            clouds=_away(floating.blobs, place),
            grids=_away(grids, place),
            cloud_notes=(*unseen, *empty),
        )
    if ground is not None:
        inputs = replace(inputs, seabed_colour=ground.colour)
    frame = cameras.orthographic_frame(scene, eye.camera)
    if frame is not None:
        inputs = replace(inputs, frame=frame)
    water = realtime_water(
        over.column, plan.phase, eye.depth, weights, solved=solved, shafts=plan.draws_shafts,
        inputs=inputs,
    )  # fmt: skip
    if eye.camera is not None and frame is not None and water.shape.layered:
        raise InputError(
            f"camera {eye.camera.name!r} is orthographic, and the water differs with depth; EEVEE "
            "draws that for perspective cameras: take one, or Cycles"
        )
    # Nearby the scene has that floor itself.
    particles = particles_of(chosen, plan.column)
    return replace(
        water, column=plan.column, particles=particles, indices_in_water=chosen.indices_in_water
    )


def _away(clouds: Sequence[Cloud], place: Sequence[float]) -> tuple[tuple[Cloud, float], ...]:
    """Return clouds with how far each is from a place, m."""
    return tuple((cloud, math.dist(cloud.blob.middle, place)) for cloud in clouds)


def _buffer(
    scene: bpy.types.Scene,
    eye: Eye,
    around: Surroundings | None,
    over: RenderPlan,
    picture: VisibilityCache,
) -> VisibilityBuffer:
    """Return what of the view objects fill; by night and from the air nothing, as nodes have it."""
    view = eye.from_air(scene, over)
    if over.settings.sunlight == 0 or (view is not None and view.in_air):
        return empty_buffer()
    surfaces = None if around is None else around.surfaces
    return filled_view(scene, eye.camera, surfaces, over.column.floor_depth, picture)


def _occluded(
    plan: RenderPlan,
    scene: bpy.types.Scene,
    around: Surroundings,
    eye: Eye,
    cache: occlusion.Cache,
) -> OcclusionTable:
    """Return the occlusion of objects, whose spectrum few bands tell well enough."""
    few = plan.settings.with_at_most(occlusion.MOST_BANDS)
    some = plan if few == plan.settings else plan_of(few)
    solved = continued_seabed.over(some, cache.ground).solved_field(TABLE_STREAMS)
    # What the sensor sees decides, in band passes too, so that they agree.
    lit = lamps.lamplight(scene, eye.camera, some, eye.lit_places)
    seen = some.reduction(eye.depth, lit).weights
    table = occlusion.table_of(around, some.bands, solved, seen, eye.depth, cache)
    return table.on(some.bands.centres, plan.bands.centres)
