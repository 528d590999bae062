"""What it takes to plan long shots, frame by frame, and how large their manifests are.

    python3 dev.py run -m benchmarks long_plans [--frames N]

Blender's own cube under water, keyframed over the shot, is planned for 100 frames and for N. A
plan that grows faster than its frames has a ratio above that of the frames. CPU time of the
process; what is read once, such as sensors, is read before.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..jobs import command_line, planning
from ..jobs.manifest import read_manifest, write_manifest
from ..scene import stored_settings
from ..uw_spectral.errors import DataWarning

_FEW, _MANY = 100, 10_000
_CASES: dict[str, tuple[str, ...]] = {
    "the camera": (),
    "camera, cube and two lamps": ("cube", "lamps"),
    "camera and chlorophyll": ("water",),
    "camera, cube, two lamps and chlorophyll": ("cube", "lamps", "water"),
}


def main(arguments: Sequence[str]) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=_MANY)
    last = parser.parse_args(arguments).frames
    warnings.simplefilter("ignore", DataWarning)
    stored_settings.register()
    print(f"| what moves | engine | {_FEW} frames, s | {last} frames, s | ratio | MB | read, s |")
    print("|---|---|---|---|---|---|---|")
    for name, moving in _CASES.items():
        scene = _scene(moving, last)
        for engine in ("eevee", "cycles"):
            _planned(scene, engine, 2)
            (few, *_), (many, size, read) = (_planned(scene, engine, n) for n in (_FEW, last))
            print(
                f"| {name} | {engine} | {few:.2f} | {many:.1f} | {many / few:.0f} | {size:.1f} | "
                f"{read:.2f} |",
                flush=True,
            )


def _scene(moving: Sequence[str], last: int) -> bpy.types.Scene:
    """Blender's own cube, below the water; its camera moves, and what is named."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    objects = [scene.camera]
    cube = bpy.data.objects["Cube"]
    if "lamps" in moving:
        for number in range(2):
            light = bpy.data.lights.new("torch", "SPOT")
            lamp = bpy.data.objects.new("torch", light)
            scene.collection.objects.link(lamp)
            lamp.location = (2.0 * number - 1.0, 0.0, 3.0)
            objects.append(lamp)
            for frame, power in ((1, 50.0), (last, 150.0)):
                light.energy = power
                light.keyframe_insert("energy", frame=frame)
    bpy.data.objects.remove(bpy.data.objects["Light"])
    for item in scene.objects:
        item.location.z -= 10.0
    objects += [cube] if "cube" in moving else []
    for item in objects:
        for frame, shift in ((1, 0.0), (last, 1.0)):
            item.location.x += shift
            item.keyframe_insert("location", frame=frame)
    if "water" in moving:
        water = scene.underwater
        water.water = "constituents"
        for frame, amount in ((1, 0.5), (last, 1.5)):
            water.chlorophyll = amount
            water.keyframe_insert("chlorophyll", frame=frame)
    return scene


def _planned(scene: bpy.types.Scene, engine: str, frames: int) -> tuple[float, float, float]:
    """Return seconds of planning and writing, size of the manifest in MB, seconds of reading."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "plan.json")
        arguments = ["--engine", engine, "--frames", f"1-{frames}", "--out", folder]
        job = command_line.job(command_line.parse(arguments))
        before = time.process_time()
        manifest = planning.plan_job(scene, lambda: stored_settings.stored_settings(scene), job)
        write_manifest(path, manifest)
        planned = time.process_time()
        read_manifest(path)
        read = time.process_time()
        return planned - before, path.stat().st_size / 1e6, read - planned
