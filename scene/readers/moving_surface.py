"""The moving surface of a scene at the current frame: its heights, and cameras at it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...settings.descriptions import sea_of
from ...settings.render_plan import RenderPlan
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.surface.caustics import SUN_RADIUS
from ...uw_spectral.surface.raised_waves import RaisedWaves
from ...uw_spectral.surface.wave_patterns import WavePatterns
from ...uw_spectral.transfer.water_column import WAVES
from ..raised_limits import raised_limits
from . import cameras, waterline


@dataclass(frozen=True)
class ViewFromAir:
    """A camera of which some frames may be above the water."""

    camera: Sequence[float]  #: Where it is, m.
    in_air: bool  #: Its rays begin in the air.
    towards: Sequence[float]  #: Unit vector to where it looks.


def wave_time(scene: bpy.types.Scene, settings: SceneSettings) -> float:
    """Time of the waves at the current frame, s: a function of the frame, as it is remapped."""
    seconds = scene.frame_current_final * scene.render.fps_base / scene.render.fps
    return seconds * settings.wave_time_scale


def patterns(scene: bpy.types.Scene, plan: RenderPlan, *, sun_disc: bool = True) -> WavePatterns:
    """Compute the waves of the current frame, blurred by the disc of the sun or not."""
    column = plan.column
    return sea_of(plan.settings).at(
        wave_time(scene, plan.settings),
        column.sun_at_rest,
        column.refractive_index,
        column.floor_depth,
        sun_radius=SUN_RADIUS if sun_disc else 0.0,
    )


def heights(scene: bpy.types.Scene, settings: SceneSettings) -> RaisedWaves | None:
    """Return the heights of the surface at the current frame; None if it is a plane."""
    if settings.surface != WAVES:
        return None
    return sea_of(settings).raised_at(wave_time(scene, settings))


def deepest_trough(settings: SceneSettings) -> float:
    """How far the surface may fall below its mean level, m; 0 if it is a plane."""
    return sea_of(settings).highest_crest() if settings.surface == WAVES else 0.0


def may_be_over(
    camera: bpy.types.Object, settings: SceneSettings, eyes: Sequence[tuple[float, ...]] = ()
) -> bool:
    """Whether a camera may have air before its glass, as :func:`.waterline.above` has it."""
    return waterline.above(camera, eyes, deepest_trough(settings))


def view_from_air(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    settings: SceneSettings,
    eyes: Sequence[tuple[float, ...]] = (),
) -> ViewFromAir | None:
    """What is special about views from the air at the current frame; None if a job has none."""
    if camera is None or not may_be_over(camera, settings, eyes):
        return None
    eye = cameras.eye_of(camera)
    return ViewFromAir(eye[:3], waterline.is_in_air(eye, heights(scene, settings)), eye[3:])


def has_heights(settings: SceneSettings) -> bool:
    """Whether the surface has heights."""
    return settings.surface == WAVES and settings.raised_waves


def limits(
    camera: bpy.types.Object,
    settings: SceneSettings,
    eyes: Sequence[tuple[float, ...]] = (),
    *,
    eevee: bool,
    live: bool = False,
) -> list[str]:
    """Return what is not drawn right of a surface with heights, a line each; none of a plane.

    Heights of the eyes at the frames of a job, m, count; see :func:`.raised_limits`.
    """
    if not has_heights(settings):
        return []
    reach = deepest_trough(settings)
    lowest = min(eye[2] for eye in (cameras.eye_of(camera), *eyes))
    return raised_limits(
        settings.wave_tile,
        eevee=eevee,
        above=may_be_over(camera, settings, eyes),
        below=lowest < reach + waterline.PORT,
        live=live,
    )
