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
from ...uw_spectral.shade.shade_table import ShadeTable, without_shade
from ...uw_spectral.shade.view_cover import KeptPicture, ViewCover, no_cover
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS
from .. import contents
from ..materials import band_colors, fluorescence, realtime_materials
from ..seen import cameras, clouds, lamps, waterline
from ..seen.filled_view import filled_view
from ..seen.snapshot import Snapshot, ViewFromAir
from ..seen.surroundings import Surroundings, has_things
from . import continued_seabed, moving_surface, shade
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
        Where the camera is at the frames of a job, for all of which the shade shall serve.
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
    kept: shade.Kept | None = None,
    shaded: ShadeTable | None = None,
    *,
    unchanged: bool = False,
) -> RealtimeWater:
    """Return the water of EEVEE, see :func:`.realtime_water`.

    Parameters
    ----------
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    kept : Kept, optional
        What may be used again.
    shaded : ShadeTable, optional
        What is known already of the shade; the ground is then the one that was kept.
    unchanged : bool
        Whether things may be taken to be where they were when ``kept`` was filled.

    Raises
    ------
    InputError
        If the camera is orthographic and the water differs with depth.
    """
    chosen, around, kept = plan.settings, None, kept or shade.Kept()
    things = (chosen.diffuse_shadows or chosen.scene_floor) and has_things(scene)
    continues = continued_seabed.may_continue(scene, plan)
    shades = chosen.diffuse_shadows and things
    if not shades:
        shaded = None
    elif chosen.sunlight == 0:
        # The same nodes as by day; there is nothing to shade.
        shaded = without_shade(len(plan.bands))
    if things and shaded is None:
        around = kept.look(scene, eye.camera, plan.column, eye.path)
    ground = kept.ground if things else None
    over = continued_seabed.over(plan, ground)
    solved = over.solved_field(TABLE_STREAMS)
    if shades and around is not None:
        shaded = _shaded(plan, scene, around, eye, kept)
    place = (0.0, 0.0, -eye.depth)
    if eye.camera is not None:
        place = tuple(eye.camera.matrix_world.translation)
    shining = kept.lamp_shadows.of(scene, lamps.plan_lamps(scene, plan), unchanged=unchanged)
    if shining.lamps:
        shining = shining.in_layers(plan.column, plan.phase, eye.depth)
        water = shining.around or plan.lamp_water(max(eye.depth, 0.0))
        shining = shining.with_thrown_back(water, plan.bands, place)
        shining = kept.lamp_shadows.of_thrown(shining)
    reflectances = {
        material.name: reflectance.at(plan.bands.centres)
        for material, reflectance in band_colors.measured_reflectances(scene)
    }
    kinds = realtime_materials.kinds(contents.materials(scene))
    seabed = continued_seabed.depth_of(ground) if continues else None
    cover = _cover(scene, eye, around or kept.looked, over, kept.picture) if shades else None
    seen = Snapshot(
        reflectances, shaded, cover, shining, eye.from_air(scene, plan), kinds, seabed,
        port=cameras.before_water(eye.camera),
        fluorescent=fluorescence.fluorescent_things(contents.materials(scene)),
    )  # fmt: skip
    floating = clouds.clouds_of(scene, plan.bands.centres)
    if floating.objects:
        unseen = floating.unseen_by_eevee(shafts=plan.draws_shafts)
        grids, empty = kept.grids.of(scene, floating.grids, unchanged=unchanged)
        seen = replace(
            seen,
            clouds=_away(floating.puffs, place),
            grids=_away(grids, place),
            cloud_notes=(*unseen, *empty),
        )
    if ground is not None:
        seen = replace(seen, seabed_colour=ground.colour)
    frame = cameras.orthographic_frame(scene, eye.camera)
    if frame is not None:
        seen = replace(seen, frame=frame)
    water = realtime_water(
        over.column, plan.phase, eye.depth, weights, solved=solved, shafts=plan.draws_shafts,
        seen=seen,
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
    return tuple((cloud, math.dist(cloud.puff.middle, place)) for cloud in clouds)


def _cover(
    scene: bpy.types.Scene,
    eye: Eye,
    around: Surroundings | None,
    over: RenderPlan,
    picture: KeptPicture,
) -> ViewCover:
    """Return what of the view things fill; by night and from the air nothing, as nodes have it."""
    view = eye.from_air(scene, over)
    if over.settings.sunlight == 0 or (view is not None and view.in_air):
        return no_cover()
    things = None if around is None else around.things
    return filled_view(scene, eye.camera, things, over.column.floor_depth, picture)


def _shaded(
    plan: RenderPlan,
    scene: bpy.types.Scene,
    around: Surroundings,
    eye: Eye,
    kept: shade.Kept,
) -> ShadeTable:
    """Return the shade of things, whose spectrum few bands tell well enough."""
    few = plan.settings.with_at_most(shade.MOST_BANDS)
    some = plan if few == plan.settings else plan_of(few)
    solved = continued_seabed.over(some, kept.ground).solved_field(TABLE_STREAMS)
    # What the sensor sees decides, in band passes too, so that they agree.
    lit = lamps.lamplight(scene, eye.camera, some, eye.lit_places)
    seen = some.reduction(eye.depth, lit).weights
    table = shade.table_of(around, some.bands, solved, seen, eye.depth, kept)
    return table.on(some.bands.centres, plan.bands.centres)
