"""EEVEE with the closed form: in band passes, and as a picture of as many passes as it takes."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...settings.render_plan import RenderPlan
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from .. import contents
from ..materials import fluorescence
from ..seen.clouds import objects_of
from ..seen.lamps import plan_lamps
from ..water import closed_form_water, continued_seabed, moving_surface, scene_water
from ..water.closed_form_water import MOST_BANDS, ClosedFormWater
from ..water.shade import Kept
from . import eevee_settings
from .band_engine import BandEngine, Opening, RenderPass, Weights
from .eevee_layers import depth_map
from .exr_output import write_float_exr


def picture_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass that is a part of the picture."""
    count = math.ceil(len(plan.bands) / math.ceil(len(plan.bands) / MOST_BANDS))
    return plan.bands.packed(count)


@contextlib.contextmanager
def closed_form(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening, *, by_band: bool
) -> Iterator[BandEngine]:
    """Water for EEVEE by the closed form while the block runs.

    Parameters
    ----------
    scene, camera
    opening : Opening
    by_band : bool
        Whether passes hold three bands, or parts of the picture.
    """
    plan, kept = opening.plan, opening.kept or Kept(of_job=True)
    continues = continued_seabed.may_continue(scene, plan)
    passes = plan.bands.packed(3) if by_band else picture_passes_of(plan)
    plan.column.require_one_layer("the closed form (--field) knows")
    lamps = bool(plan_lamps(scene, plan).lamps)
    above = moving_surface.may_be_over(camera, plan.settings, opening.eyes)
    closed_form_water.refuse(plan.settings, lamps=lamps, above=above)

    def water_of(now: RenderPlan, weights: Weights) -> ClosedFormWater:
        if continues:
            ground = kept.look(scene, camera, now.column, opening.eyes).ground
            now = continued_seabed.over(now, ground)
        return closed_form_water.closed_form_water(now.column, now.phase, weights)

    def given_of(now: RenderPlan, depth: float, given: Weights | None) -> Weights:
        return now.reduction(depth).weights if given is None else given

    def drawn(water: ClosedFormWater, path: Path) -> NDArray[np.float32]:
        closed_form_water.set_values(scene, water)
        write_float_exr(scene, path)
        return read_exr(path)[0]

    first = water_of(plan, given_of(plan, opening.depth, opening.weights))
    notes = closed_form_water.add(scene, first.of_bands(passes[0], len(passes[0])), opening.extent)
    notes += closed_form_water.notes(plan.settings, plan.phase)
    notes += fluorescence.unseen(contents.materials(scene), "the closed form")
    notes += [f"cloud {x.name!r} is not drawn by --field closed-form" for x in objects_of(scene)]
    try:
        with eevee_settings.realtime_settings(
            scene, camera, samples=plan.settings.samples, water=None
        ):

            def frame(now: RenderPlan, depth: float, given: Weights | None = None) -> RenderPass:
                water = water_of(now, given_of(now, depth, given))
                white = np.maximum(now.viewpoint(depth).light / np.pi, np.finfo(np.float32).tiny)

                def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                    if by_band:
                        scale = white[[*indices, *[indices[-1]] * (3 - len(indices))]]
                        image = drawn(water.of_triple(indices, 1.0 / scale), path) * scale
                    else:
                        # EEVEE cuts what is below zero, and other parts may be above.
                        part = water.of_bands(indices, len(passes[0]))
                        image = drawn(part.of_sign(1.0), path) - drawn(part.of_sign(-1.0), path)
                    write_rgb_exr(path, image)
                    return None

                return render

            yield BandEngine(passes, notes, frame, lambda path: depth_map(scene, path))
    finally:
        scene_water.remove(scene)
