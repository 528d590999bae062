"""The moving surface of a scene: its waves at the current frame, for either engine."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...node_groups import realtime_waves, water_surface
from ...settings.descriptions import sea_of
from ...settings.render_plan import RenderPlan
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.surface.caustics import SUN_RADIUS
from ...uw_spectral.surface.raised_waves import RaisedWaves
from ...uw_spectral.surface.wave_patterns import WavePatterns
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS
from ...uw_spectral.transfer.sunlit_water import SunlitWater
from ...uw_spectral.transfer.water_column import WAVES
from .. import marks
from ..raised_limits import raised_limits
from ..readers import cameras, waterline
from . import cycles_water, raised_surface
from .frame_numbers import wave_numbers
from .frame_water import RealtimeWater


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


def with_waves(scene: bpy.types.Scene, plan: RenderPlan, water: RealtimeWater) -> RealtimeWater:
    """Return real-time water with the waves of the current frame, or as it is without waves."""
    if plan.settings.surface != WAVES:
        return water
    now = patterns(scene, plan)
    column = plan.column.mixed_above(water.depth)
    lit = SunlitWater(column.solved_field(plan.phase, TABLE_STREAMS))
    contrast = plan.settings.caustics * now.contrast(lit)
    return water.under_waves(now, contrast, plan.settings.caustics)


def move_surface(
    scene: bpy.types.Scene, plan: RenderPlan, middle: Sequence[float] = (0.0, 0.0)
) -> None:
    """Bring the surface of the Cycles reference to the current frame; nothing without waves.

    With heights it is finest about a middle, x and y, m.
    """
    if plan.settings.surface != WAVES:
        return
    # Its sun has a disc already.
    now = patterns(scene, plan, sun_disc=False)
    realtime_waves.write_patterns(marks.images(scene), now, fresh=True)
    material = marks.part(scene, cycles_water.INTERFACE)
    numbers = wave_numbers(now, plan.settings.caustics)
    water_surface.write(material, numbers, plan.column.sun_direction.tolist())
    if now.raised is not None:
        raised_surface.follow(scene, now.raised, middle)
