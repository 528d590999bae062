"""What a worker costs beside plain Cycles, pass by pass and at its start, in one run.

    python3 dev.py run -m benchmarks worker_overhead [--samples N ...] [--resolution W H]

The same scene is rendered in turn by ``bpy.ops.render.render`` alone, dry and with the water of
each pass in it, and by a worker, which also claims each pass, looks whether it is there, reads what
was rendered and writes it with its stamp. All with the settings of the reference and persistent
data, the same bands in the same order. Of the repetitions the least median counts. The start
is that of a process of its own: its seconds without those of its passes.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

import bpy

from ..jobs import command_line, planning, work
from ..jobs.frame_plans import FramePlans
from ..jobs.manifest import Manifest
from ..scene.engines import cycles_settings, engines, exr_output
from ..settings.render_plan import make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import DataWarning

_ROOT = Path(__file__).resolve().parents[1]
_FRAMES, _BANDS = 2, 8
_PASSES = _FRAMES * _BANDS
_KINDS = ("dry", "water", "worker")
_NAMES = ("Cycles alone, dry", "Cycles alone, in water", "a worker")

Seconds = tuple[float, float]
"""CPU time of the process, and of the clock."""


def main(arguments: Sequence[str]) -> None:
    """Print tables of the passes and of the start."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, nargs="+", default=[4])
    parser.add_argument("--resolution", type=int, nargs=2, default=(80, 45))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--alone", choices=_KINDS, help="only this, in this process")
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore", DataWarning)
    if options.alone:
        print(json.dumps(_rendered(options.alone, options.samples[0], options.resolution)))
        return
    print("| a pass | samples | CPU ms | ms | first, CPU ms |\n|---|---|---|---|---|")
    for samples in options.samples:
        runs = [
            [_rendered(kind, samples, options.resolution) for kind in _KINDS]
            for _ in range(options.repeats)
        ]
        for name, *of_kind in zip(_NAMES, *runs, strict=True):
            cpu, clock = (
                min(statistics.median(each[i] for each in run[1:]) for run in of_kind)
                for i in (0, 1)
            )
            first = min(run[0][0] for run in of_kind)
            print(
                f"| {name} | {samples} | {1e3 * cpu:.0f} | {1e3 * clock:.0f} | {1e3 * first:.0f} |"
            )
    print("\n| a process, besides its passes | CPU s | s |\n|---|---|---|")
    for kind, name in zip(_KINDS, _NAMES, strict=True):
        starts = [_start(kind, options.resolution) for _ in range(options.repeats)]
        cpu, clock = (min(each[i] for each in starts) for i in (0, 1))
        print(f"| {name} | {cpu:.1f} | {clock:.1f} |")


def _rendered(kind: str, samples: int, resolution: Sequence[int]) -> list[Seconds]:
    """Render a new scene, and return what each pass took; what comes before is the first's."""
    scene = _scene(resolution)
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["--frames", f"1-{_FRAMES}", "--samples", str(samples), "--out", folder]
        job = command_line.job(command_line.parse(arguments))
        chosen = SceneSettings(samples=samples, bands=_BANDS)
        if kind == "dry":
            steps = _dry(scene, chosen, Path(folder, "pass.exr"))
        else:
            manifest = planning.plan_job(scene, lambda: chosen, job)
            steps = _worker(scene, manifest)
            if kind == "water":
                steps = _wet(scene, chosen, manifest, Path(folder, "pass.exr"))
        return list(_timed(steps))


def _timed(steps: Iterator[object]) -> Iterator[Seconds]:
    before = time.process_time(), time.perf_counter()
    for _ in steps:
        now = time.process_time(), time.perf_counter()
        yield now[0] - before[0], now[1] - before[1]
        before = time.process_time(), time.perf_counter()


def _scene(resolution: Sequence[int]) -> bpy.types.Scene:
    """Blender's own cube, below the water."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    for item in scene.objects:
        item.location.z -= 10.0
    scene.render.resolution_x, scene.render.resolution_y = resolution
    scene.render.resolution_percentage = 100
    return scene


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
        scene, scene.camera, plan, planning.extent_of(manifest), seed=0
    ) as engine:
        for view in manifest.views:
            scene.frame_set(view.frame)
            render = engine.frame(plan, view.depth)
            for bands in engine.passes:
                render(bands, path)
                yield


def _worker(scene: bpy.types.Scene, manifest: Manifest) -> Iterator[object]:
    return work.render(
        scene, manifest, work.Part().tasks(manifest), FramePlans(manifest), lambda _: None
    )


def _start(kind: str, resolution: Sequence[int]) -> Seconds:
    """Return what a process takes besides its passes, of the median each."""
    command = [sys.executable, "-m", "benchmarks", "worker_overhead", "--samples", "4"]
    command += ["--resolution", *map(str, resolution), "--alone", kind]
    begun, clock = os.times(), time.perf_counter()
    ended = subprocess.run(command, cwd=_ROOT, check=True, capture_output=True, text=True)
    now, elapsed = os.times(), time.perf_counter() - clock
    spent = now.children_user + now.children_system - begun.children_user - begun.children_system
    passes = json.loads(ended.stdout.splitlines()[-1])
    cpu, wall = (len(passes) * statistics.median(each) for each in zip(*passes, strict=True))
    return spent - cpu, elapsed - wall
