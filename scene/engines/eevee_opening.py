"""A scene that is ready for EEVEE: water in it, and Blender's settings for that."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

import bpy

from ...settings.render_plan import RenderPlan
from ..readers import cameras
from ..temporary import render_settings
from ..terms import limits
from ..water import realtime, scene_water
from ..water.frame_water import RealtimeWater
from ..water.water_body import WaterExtent
from . import eevee_settings, planar_picture
from .eevee_frames import EeveeFrames
from .exr_output import write_float_exr

_FEW_PIXELS = 8


@contextlib.contextmanager
def water_in(
    frames: EeveeFrames,
    plan: RenderPlan,
    first: RealtimeWater,
    extent: WaterExtent,
    froxels: int | None,
) -> Iterator[list[str]]:
    """Put the water of a job's first frame into a scene while the block runs.

    Yields what is not treated, or not drawn as it is, a line each.
    """
    scene, camera, eyes = frames.scene, frames.camera, frames.eyes
    notes = [*cameras.clip_notes(camera), *realtime.add_realtime(scene, first, extent)]
    try:
        with eevee_settings.realtime_settings(
            scene, camera, samples=plan.settings.samples, water=first, froxels=froxels
        ):
            if first.shape.shafts:
                _warm_up(scene)
            notes += limits.of_eevee(scene, camera, plan, frames.cache, first, eyes)
            notes += planar_picture.notes(camera, plan, eyes, frames.pictures)
            yield notes + planar_picture.notes_of_air(scene, camera, plan, eyes)
    finally:
        scene_water.remove(scene)


def _warm_up(scene: bpy.types.Scene) -> None:
    """Render a few pixels for nothing.

    The first picture of a process with a volume differs from the same picture later, by up to
    3 % (5.2.3), unless one of another size came before it.
    """
    few = [
        (scene.render, "resolution_x", _FEW_PIXELS),
        (scene.render, "resolution_y", _FEW_PIXELS),
        (scene.render, "resolution_percentage", 100),
        (scene.render, "use_border", False),
        (scene.eevee, "taa_render_samples", 1),
    ]
    with render_settings(scene, few), tempfile.TemporaryDirectory() as folder:
        write_float_exr(scene, Path(folder, "warm_up.exr"))
