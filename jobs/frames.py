"""Every frame of a job, as its cameras see it: plan, exposure, lamps and clouds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..quality.methods import method_of
from ..scene.engines import port_look, world_picture
from ..scene.readers import cameras, clouds, lamp_records
from ..scene.readers.pinhole import require_pinhole
from ..scene.water import metering
from ..scene.water.water_body import SceneReach, reach_of, scene_reach
from ..settings.render_plan import RenderPlan, make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layers import parse_layers
from . import raw_pictures, receptor_pictures
from .job import Job


@dataclass(frozen=True, eq=False)
class Frame:
    """What is known of a frame; depths, lamplight and eyes are those of each camera."""

    number: int
    plan: RenderPlan
    depths: tuple[float, ...]
    lamplight: tuple[NDArray[np.float64] | None, ...]
    stops: float | None
    eyes: tuple[tuple[float, ...], ...]
    lamps: tuple[Mapping[str, Any], ...]
    clouds: tuple[Mapping[str, Any], ...]
    reach: SceneReach


def frames_of(
    scene: bpy.types.Scene,
    seen_by: list[bpy.types.Object],
    settings_now: Callable[[], SceneSettings],
    job: Job,
) -> list[Frame]:
    """Look at every frame of a job through its cameras, so that errors come early."""
    with _ReachNow(scene) as reach_now:
        frames = _resolved(scene, seen_by, settings_now, job, reach_now)
    first = frames[0].plan.column
    for frame in frames:
        if math.isfinite(frame.plan.column.floor_depth) != math.isfinite(first.floor_depth):
            raise InputError(
                f"--floor-depth is 0 (no floor) in some frames only, such as {frame.number} or "
                f"{frames[0].number}; keyframe it between depths above 0"
            )
    return frames


def _resolved(
    scene: bpy.types.Scene,
    seen_by: list[bpy.types.Object],
    settings_now: Callable[[], SceneSettings],
    job: Job,
    reach_now: Callable[[], SceneReach],
) -> list[Frame]:
    plans: dict[SceneSettings, RenderPlan] = {}
    frames: list[Frame] = []
    for number in job.frames or (scene.frame_current,):
        scene.frame_set(number)
        chosen = world_picture.drawn(scene, settings_now(), job.out).in_mode(job.mode)
        if frames:  # optimised bands stay while animated water changes
            chosen = frames[0].plan.fixed_bands(chosen)
        floor = chosen.floor_depth or math.inf
        if parse_layers(chosen.layers):
            for camera in seen_by:
                require_pinhole(camera)
        depths = tuple(cameras.camera_depth(camera, floor) for camera in seen_by)
        if chosen not in plans:
            plans[chosen] = make_plan(chosen)
            if not frames:
                # From here on the bands are listed, for this frame too.
                fixed = plans[chosen].fixed_bands(chosen)
                if fixed != chosen:
                    plans = {fixed: make_plan(fixed)}
                    chosen = fixed
        plan = plans[chosen]
        raw_pictures.require_raw(plan)
        receptor_pictures.require_bands(plan, method_of(job.engine, job.mode))
        for camera, depth in zip(seen_by, depths, strict=True):
            port_look.look_of(scene, camera, plan, depth)
        lit = tuple(metering.lamplight(scene, camera, plan) for camera in seen_by)
        eyes = tuple(cameras.eye_of(camera) for camera in seen_by)
        stops = metering.metered(scene, seen_by[0], plan, depths[0], lit[0])
        shining, floating = lamp_records.records(scene), clouds.records(scene)
        clouds.clouds_of(scene, plan.bands.centres)
        reach = reach_now().and_of(reach_of(eyes))
        frames.append(Frame(number, plan, depths, lit, stops, eyes, shining, floating, reach))
    return frames


class _ReachNow:
    """How far the objects of a scene reach, computed again where a frame has changed one."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        self._known: SceneReach | None = None

    def __enter__(self) -> Callable[[], SceneReach]:
        # After the frame is set, Blender no longer tells what it has changed.
        bpy.app.handlers.frame_change_post.append(self._look)
        return self._reach

    def __exit__(self, *_: object) -> None:
        bpy.app.handlers.frame_change_post.remove(self._look)

    def _look(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        if scene == self._scene and any(
            isinstance(update.id, bpy.types.Object) and update.id.type not in ("CAMERA", "LIGHT")
            for update in depsgraph.updates
        ):
            self._known = None

    def _reach(self) -> SceneReach:
        self._known = self._known or scene_reach(self._scene)
        return self._known
