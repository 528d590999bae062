"""Bands that a scene can be rendered in, and the light of everything to compare them by."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..quality.combinations import BandChoice
from ..quality.methods import Method
from ..quality.picture import Optics
from ..scene.readers import clouds, moving_surface
from ..scene.readers.volume_grids import GridCache
from ..settings.render_plan import RenderPlan, plan_of
from ..settings.scene_settings import EQUAL, OPTIMISED, SceneSettings
from ..uw_spectral.imaging.description import REFERENCE_BANDS

OPTIMISED_COUNTS = (3, 6, 9)
BAND_COUNTS = (3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 16, 18, 21, 24, 27, 32)
_WAVE_RESOLUTION = 64


def _optics(plan: RenderPlan) -> Optics:
    """The water of a plan; the rays bring their own depth."""
    return Optics(plan.viewpoint(0.0), plan.excitation)


def reference_optics(scene: bpy.types.Scene, chosen: SceneSettings) -> Optics:
    """Everything the settings ask for, on many bands."""
    many = replace(chosen, bands=REFERENCE_BANDS, wavelengths="", band_placement=EQUAL)
    plan = plan_of(many)
    floating = clouds.clouds_of(scene, plan.bands.centres)
    grids, _ = GridCache().of(scene, floating.grids)
    found = replace(_optics(plan), caustics=chosen.caustics, clouds=(*floating.blobs, *grids))
    if chosen.surface != moving_surface.WAVES:
        return found
    coarse = replace(chosen, wave_resolution=min(chosen.wave_resolution, _WAVE_RESOLUTION))
    return replace(found, waves=moving_surface.patterns(scene, replace(plan, settings=coarse)))


def band_choices(
    chosen: SceneSettings, keep: frozenset[str], method: Method, *, layered: bool
) -> list[BandChoice]:
    """Bands to choose from: the settings' own if they must stay, all in real time.

    In layered water they are not optimised.
    """
    # Only the elastic light of a calm sea is compared.
    plain = replace(
        chosen,
        inelastic="",
        surface="flat" if chosen.surface == moving_surface.WAVES else chosen.surface,
    )
    if keep & {"bands", "wavelengths", "range_start", "range_end"}:
        plan = plan_of(plain.in_mode(method.mode))
        name = f"{len(plan.bands)}, as given"
        return [BandChoice(name, _optics(plan), {}, len(plan.passes))]
    placements = {EQUAL: BAND_COUNTS, OPTIMISED: OPTIMISED_COUNTS}
    if layered:
        placements = {EQUAL: BAND_COUNTS}
    if "band_placement" in keep:
        placements = {chosen.band_placement: placements[chosen.band_placement]}
    default: dict[str, Any] = {"bands": 0, "wavelengths": "", "band_placement": EQUAL}
    free = replace(plain, **default).in_mode(method.mode)
    if method.draws_colours and EQUAL in placements and free.bands == method.default_bands:
        name = f"{free.bands}, which cost nothing"
        return [BandChoice(name, _optics(plan_of(free)), default)]
    found = []
    for placement, counts in placements.items():
        for count in counts:
            changes = {"bands": count, "wavelengths": "", "band_placement": placement}
            plan = plan_of(replace(plain, **changes))
            name = f"{count} {placement}"
            found.append(BandChoice(name, _optics(plan), changes, len(plan.passes)))
    return found
