"""What it takes to plan long shots, and what a worker costs beside plain Cycles.

Blender's own cube under water, keyframed over the shot, is planned; CPU time of the process, what
is read once is read before. Then a scene is rendered in turn by ``bpy.ops.render.render`` alone,
dry and with the water of each pass in it, and by a worker, which also claims each pass, looks
whether it is there, reads what was rendered and writes it with its stamp. Of the repetitions the
least median counts. The start is that of a process of its own, without its passes.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import bpy

from ..jobs import command_line, planning, work
from ..jobs.frame_plans import FramePlans
from ..jobs.manifest import Manifest
from ..jobs.manifest_files import read_manifest, write_manifest
from ..jobs.tasks import Part
from ..scene import stored_settings
from ..scene.engines import cycles_settings, engines, exr_output
from ..scene.water.water_body import WaterExtent
from ..settings.render_plan import make_plan
from ..settings.scene_settings import SceneSettings
from ._scenery import sized
from .runner import ROOT, Ask, Page, table

_FEW = 100
_CASES: dict[str, tuple[str, ...]] = {
    "the camera": (),
    "camera, cube and two lamps": ("cube", "lamps"),
    "camera and chlorophyll": ("water",),
    "camera, cube, two lamps and chlorophyll": ("cube", "lamps", "water"),
}
_FRAMES, _BANDS = 2, 8
_PASSES = _FRAMES * _BANDS
_SAMPLES = 4
_SIZE = (80, 45)
_KINDS = {"dry": "Cycles alone, dry", "water": "Cycles alone, in water", "worker": "a worker"}

Seconds = tuple[float, float]
"""CPU time of the process, and of the clock."""


def _shot(moving: Sequence[str], last: int) -> bpy.types.Scene:
    """Blender's own cube, below the water; its camera moves, and what is named."""
    scene = _scene()
    objects = [scene.camera]
    if "lamps" in moving:
        for number in range(2):
            light = bpy.data.lights.new("torch", "SPOT")
            lamp = bpy.data.objects.new("torch", light)
            scene.collection.objects.link(lamp)
            lamp.location = (2.0 * number - 1.0, 0.0, -7.0)
            objects.append(lamp)
            for frame, power in ((1, 50.0), (last, 150.0)):
                light.energy = power
                light.keyframe_insert("energy", frame=frame)
    bpy.data.objects.remove(bpy.data.objects["Light"])
    objects += [bpy.data.objects["Cube"]] if "cube" in moving else []
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


def _rendered(kind: str) -> list[Seconds]:
    """Render a new scene, and return what each pass took; what comes before is the first's."""
    scene = _scene()
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["--frames", f"1-{_FRAMES}", "--samples", str(_SAMPLES), "--out", folder]
        job = command_line.job(command_line.parse(arguments))
        chosen = SceneSettings(samples=_SAMPLES, bands=_BANDS)
        if kind == "dry":
            steps = _dry(scene, chosen, Path(folder, "pass.exr"))
        else:
            manifest = planning.plan_job(scene, lambda: chosen, job)
            tasks = Part().tasks(manifest)
            steps = work.render(scene, manifest, tasks, FramePlans(manifest), lambda _: None)
            if kind == "water":
                steps = _wet(scene, chosen, manifest, Path(folder, "pass.exr"))
        return list(_timed(steps))


def _timed(steps: Iterator[object]) -> Iterator[Seconds]:
    before = time.process_time(), time.perf_counter()
    for _ in steps:
        yield time.process_time() - before[0], time.perf_counter() - before[1]
        before = time.process_time(), time.perf_counter()


def _scene() -> bpy.types.Scene:
    """Blender's own cube, below the water."""
    bpy.ops.wm.read_factory_settings()
    for item in bpy.context.scene.objects:
        item.location.z -= 10.0
    return sized(_SIZE)


def _dry(scene: bpy.types.Scene, chosen: SceneSettings, path: Path) -> Iterator[None]:
    with cycles_settings.reference_settings(
        scene, scene.camera, samples=chosen.samples, seed=0, bounces=chosen.bounces,
        device="cpu",
    ):  # fmt: skip
        for _ in range(_PASSES):
            exr_output.write_float_exr(scene, path)
            yield


def _wet(
    scene: bpy.types.Scene, chosen: SceneSettings, manifest: Manifest, path: Path
) -> Iterator[None]:
    plan = make_plan(chosen)
    with engines.cycles_bands(
        scene, scene.camera, plan, WaterExtent(*manifest.output.extent), seed=0
    ) as engine:
        for view in manifest.views:
            scene.frame_set(view.frame)
            render = engine.frame(plan, view.depth)
            for bands in engine.passes:
                render(bands, path)
                yield


def _start(kind: str) -> Seconds:
    """Return what a process takes besides its passes, of the median each."""
    command = [sys.executable, "-m", "benchmarks", "split_jobs", kind]
    begun, clock = os.times(), time.perf_counter()
    ended = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    now, elapsed = os.times(), time.perf_counter() - clock
    spent = now.children_user + now.children_system - begun.children_user - begun.children_system
    passes = json.loads(ended.stdout.splitlines()[-1])
    cpu, wall = (len(passes) * statistics.median(each) for each in zip(*passes, strict=True))
    return spent - cpu, elapsed - wall


def main(arguments: Sequence[str]) -> None:
    """Render one kind in this process, and print what each pass took."""
    print(json.dumps(_rendered(arguments[0])))


def measure(ask: Ask) -> Mapping[str, object]:
    """Plan and render."""
    plans = []
    for name, moving in _CASES.items():
        scene = _shot(moving, ask.frames)
        for engine in ("eevee", "cycles"):
            _planned(scene, engine, 2)
            few, _, _ = _planned(scene, engine, _FEW)
            many, size, read = _planned(scene, engine, ask.frames)
            numbers = (f"{few:.2f}", f"{many:.1f}", f"{size:.1f}", f"{read:.2f}")
            plans.append([name, engine, *numbers])
    runs = [{kind: _rendered(kind) for kind in _KINDS} for _ in range(ask.repeats)]
    passes, starts = [], []
    for kind, name in _KINDS.items():
        cpu, clock = (
            min(statistics.median(each[i] for each in run[kind][1:]) for run in runs)
            for i in (0, 1)
        )
        first = min(run[kind][0][0] for run in runs)
        passes.append([name, *(f"{1e3 * x:.0f}" for x in (cpu, clock, first))])
        starts.append(min(_start(kind)[0] for _ in range(ask.repeats)))
    return {
        "plans": table(("what moves", "engine", "100 frames", f"{ask.frames} frames", "MB", "read"),
                       plans),
        "passes": table(("a pass", "CPU ms", "ms", "first, CPU ms"), passes),
        "dry": starts[0], "water": starts[1], "worker": starts[2],
    }  # fmt: skip


PAGE = Page(
    "Jobs that split",
    """
What they are: [jobs that split](../pipeline.md#jobs-that-split).

## What it costs
CPU seconds to plan, on two shared cores:

{plans}

Under waves or with Raman light keyframed water took half as long again, each frame with a wind of
its own 0.015 s more, optimised bands about 0.1 s for every depth and water. `--status` of 70 000
passes took 3.5 s.

A worker beside Cycles alone: a cube, 80 × 45 pixels, 4 samples, 16 passes:

{passes}

A process takes {dry:.1f} CPU s besides its passes dry, {water:.1f} in water, {worker:.1f} as a
worker. Claim, stamp and the second file take some 2 ms of a pass, optics and plan 1.5 s at the
start.

## Bit by bit
Tests compare every picture of cut and uncut jobs: other processes, two workers, one that was
killed, a dive cut at every frame (both engines, waves, optimised bands, Raman light). Three rules
keep them equal:

- A worker puts the water into the scene as it is at the first frame of the job.
- All parts have the same number of samples, rounded up: Cycles draws other numbers after a change.
- EEVEE's first picture of a process with a volume (`--shafts`) differs by up to 3 % in the darkest
  channel, why is not known: each worker first renders a few pixels for nothing. On a busy machine
  it **may still differ** (1 of 6 did): the first sample alone, 2.2 % with 1 sample, 0.3 % with 8.
  Without a volume any order gave the same bits.
""",
    settings={"frames": 10_000, "repeats": 3},
)
