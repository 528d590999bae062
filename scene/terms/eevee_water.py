"""The water of EEVEE, with all terms of its light, read of a scene."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.occlusion.occlusion_table import OcclusionTable, without_occlusion
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS
from .. import contents
from ..materials import band_colors, material_kinds
from ..readers import cameras
from ..readers.surroundings import has_objects
from ..water import continued_seabed
from ..water.frame_water import FrameInputs, RealtimeWater, realtime_water
from ..water.occlusion import Cache
from ..water.term import Eye, SceneFrame
from .all_terms import TERMS
from .occlusion import has_occlusion


def eevee_water(
    plan: RenderPlan,
    scene: bpy.types.Scene,
    eye: Eye,
    weights: NDArray[np.float64],
    cache: Cache | None = None,
    occluded: OcclusionTable | None = None,
    *,
    unchanged: bool = False,
) -> RealtimeWater:
    """Return the water of EEVEE, see :func:`.realtime_water`; waves come on top.

    ``weights`` are linear RGB per unit radiance of each band, (3, n). What is known of the
    occlusion may be given, with the ground that the cache kept then; ``unchanged`` is whether
    objects may be taken to be where they were when it was filled. InputError if the camera is
    orthographic and the water differs with depth.
    """
    chosen, cache = plan.settings, cache or Cache()
    surfaces = (chosen.diffuse_shadows or chosen.scene_floor) and has_objects(scene)
    if not has_occlusion(scene, plan):
        occluded = None
    elif chosen.sunlight == 0:
        # The same nodes as by day; there is nothing to occlude.
        occluded = without_occlusion(len(plan.bands))
    around = None
    if surfaces and occluded is None:
        around = cache.look(scene, eye.camera, plan.column, eye.path)
    ground = cache.ground if surfaces else None
    over = continued_seabed.over(plan, ground)
    seen = SceneFrame(scene, plan, eye, cache, over, around, occluded, unchanged)
    found = [term.read(seen) for term in TERMS]
    continues = continued_seabed.may_continue(scene, plan)
    frame = cameras.orthographic_frame(scene, eye.camera)
    inputs = FrameInputs(
        {
            material.name: reflectance.at(plan.bands.centres)
            for material, reflectance in band_colors.measured_reflectances(scene)
        },
        material_kinds.kinds(contents.materials(scene)),
        continued_seabed.depth_of(ground) if continues else None,
        terms=tuple(term for term in found if term is not None),
    )
    if ground is not None:
        inputs = replace(inputs, seabed_colour=ground.colour)
    if frame is not None:
        inputs = replace(inputs, frame=frame)
    solved = over.solved_field(TABLE_STREAMS)
    shafts = plan.draws_shafts and seen.from_air() is None
    water = realtime_water(
        over.column, plan.phase, eye.depth, weights, solved=solved, shafts=shafts, inputs=inputs
    )
    if eye.camera is not None and frame is not None and water.field.layered:
        raise InputError(
            f"camera {eye.camera.name!r} is orthographic, and the water differs with depth; EEVEE "
            "draws that for perspective cameras: take one, or Cycles"
        )
    # Nearby the scene has that floor itself.
    return replace(water, column=plan.column, indices_in_water=chosen.indices_in_water)
