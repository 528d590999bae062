"""Water of EEVEE, put into the open scene as a render job does it, to be measured."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import stored_settings
from ..scene.engines import eevee_settings, engines, exr_output
from ..scene.engines.band_engine import Opening, Weights
from ..scene.readers import cameras
from ..scene.water import lamp_rigs, metering, water_body
from ..settings import render_plan
from ..settings.scene_settings import REALTIME, Mode, SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr
from .runner import ROOT


@dataclass(frozen=True)
class Drawing:
    """What draws the open scene into a float EXR, by default at ``path``, a file for the moment.

    ``change`` gives the water other values, where there is any; ``notes`` are what the water could
    not treat.
    """

    scene: bpy.types.Scene
    write: Callable[[Path], None]
    change: Callable[[SceneSettings], None]
    path: Path
    notes: Sequence[str] = ()

    def picture(self, samples: int, path: Path | None = None) -> None:
        """Write a picture of so many samples per pixel."""
        self.scene.eevee.taa_render_samples = samples
        self.write(path or self.path)

    def image(self, samples: int) -> NDArray[np.float64]:
        """Linear RGB of a picture, shape (h, w, 3)."""
        self.picture(samples)
        return read_exr(self.path)[0][..., :3].astype(np.float64)

    def seconds(self, samples: int, clock: Callable[[], float] = time.process_time) -> float:
        """Seconds of a picture by a clock, by default of the processors."""
        start = clock()
        self.picture(samples)
        return clock() - start

    def again(self, samples: int) -> None:
        """Render what was last drawn once more, and write nothing."""
        self.scene.eevee.taa_render_samples = samples
        bpy.ops.render.render(scene=self.scene.name)


@contextlib.contextmanager
def drawing(settings: SceneSettings | None, mode: Mode = REALTIME) -> Iterator[Drawing]:
    """Ready the open scene to be drawn by EEVEE, in water or, for None, as it is."""
    with tempfile.TemporaryDirectory() as folder:
        opened = _dry() if settings is None else _wet(settings, mode)
        with opened as (write, change, notes):
            path = Path(folder, "picture.exr")
            yield Drawing(bpy.context.scene, write, change, path, notes)


type _Ways = tuple[Callable[[Path], None], Callable[[SceneSettings], None], Sequence[str]]


@contextlib.contextmanager
def _dry() -> Iterator[_Ways]:
    scene = bpy.context.scene
    with eevee_settings.realtime_settings(scene, scene.camera, samples=1, water=None):
        yield lambda path: exr_output.write_float_exr(scene, path), lambda _: None, ()


@contextlib.contextmanager
def _wet(settings: SceneSettings, mode: Mode) -> Iterator[_Ways]:
    scene, camera = bpy.context.scene, bpy.context.scene.camera
    assert camera is not None, "scenes that are measured have a camera"
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

        yield write, change, engine.notes


def hang_lamps(rig: str) -> None:
    """Hang lamps of a rig on the camera of the open scene."""
    if not hasattr(bpy.types.Light, stored_settings.PROPERTY):
        stored_settings.register()
    lamp_rigs.add_rig(bpy.context.scene, rig)


def said_by_process(
    tool: str, *arguments: str, timeout: float | None = None, **environment: str
) -> str:
    """Return the last line that a tool of this folder prints in a process with nothing compiled.

    Drivers keep what they compiled (Mesa, NVIDIA), and so does Blender, under XDG_CACHE_HOME.
    InputError tells how it failed.
    """
    command = [sys.executable, "-m", "benchmarks", tool, *arguments]
    with tempfile.TemporaryDirectory() as folder:
        names = (
            "XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR",
            "__GL_SHADER_DISK_CACHE_PATH",
        )  # fmt: skip
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, timeout=timeout,
            env={**os.environ, **dict.fromkeys(names, folder), **environment},
        )  # fmt: skip
    if done.returncode:
        raise InputError(f"{tool} failed: {done.stderr.strip()[-500:]}")
    return done.stdout.splitlines()[-1]
