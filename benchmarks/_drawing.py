"""Water of EEVEE, put into the open scene as a render job does it, to be measured."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..scene import stored_settings
from ..scene.engines import eevee_settings, engines, exr_output
from ..scene.engines.band_engine import Opening, Weights
from ..scene.readers import cameras
from ..scene.water import lamp_rigs, metering, water_body
from ..settings import render_plan
from ..settings.scene_settings import REALTIME, Mode, SceneSettings


@dataclass(frozen=True)
class Drawing:
    """What draws the open scene into a float EXR.

    ``samples`` per pixel are set beforehand; ``change`` gives the water other values, where there
    is any. ``notes`` are what the water could not treat.
    """

    scene: bpy.types.Scene
    write: Callable[[Path], None]
    change: Callable[[SceneSettings], None]
    notes: Sequence[str] = ()

    def picture(self, path: Path, samples: int) -> None:
        """Write a picture."""
        self.scene.eevee.taa_render_samples = samples
        self.write(path)

    def again(self, samples: int) -> None:
        """Render what was last drawn once more, and write nothing."""
        self.scene.eevee.taa_render_samples = samples
        bpy.ops.render.render(scene=self.scene.name)


@contextlib.contextmanager
def drawing(settings: SceneSettings | None, mode: Mode = REALTIME) -> Iterator[Drawing]:
    """Ready the open scene to be drawn by EEVEE, in water or, for None, as it is."""
    scene = bpy.context.scene
    camera = scene.camera
    assert camera is not None, "scenes that are measured have a camera"
    if settings is None:
        with eevee_settings.realtime_settings(scene, camera, samples=1, water=None):
            yield Drawing(
                scene, lambda path: exr_output.write_float_exr(scene, path), lambda _: None
            )
        return
    plan = render_plan.make_plan(settings)
    depth = cameras.camera_depth(camera, plan.column.floor_depth)

    def weights(now: render_plan.RenderPlan) -> Weights:
        return now.reduction(depth, metering.lamplight(scene, camera, now)).weights

    opening = Opening(
        plan, water_body.water_extent(scene, plan.column, depth), depth, weights(plan),
        seed=0, guides=False, froxels=None, device="cpu",
    )  # fmt: skip
    with engines.engine_of("eevee", mode).open(scene, camera, opening) as engine:
        ready = [engine.frame(plan, depth, opening.weights)]

        def write(path: Path) -> None:
            for bands in engine.passes:
                ready[0](bands, path)

        def change(other: SceneSettings) -> None:
            later = render_plan.make_plan(other)
            ready[0] = engine.frame(later, depth, weights(later))

        yield Drawing(scene, write, change, engine.notes)


def hang_lamps(rig: str) -> None:
    """Hang lamps of a rig on the camera of the open scene."""
    if not hasattr(bpy.types.Light, stored_settings.PROPERTY):
        stored_settings.register()
    lamp_rigs.add_rig(bpy.context.scene, rig)


@contextlib.contextmanager
def empty_shader_cache() -> Iterator[dict[str, str]]:
    """Give the environment of a process that finds no compiled shader, and leaves none behind.

    Drivers keep what they compiled (Mesa, NVIDIA), and so does Blender, under XDG_CACHE_HOME.
    """
    with tempfile.TemporaryDirectory() as folder:
        names = (
            "XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR",
            "__GL_SHADER_DISK_CACHE_PATH",
        )  # fmt: skip
        yield {**os.environ, **dict.fromkeys(names, folder)}
