"""Time from a change in the panel to the viewport's inputs, without new nodes.

    python3 dev.py run -m benchmarks panel_update

Milliseconds of CPU time of this thread, median and worst of the repetitions
after one warm-up, for a scene of one object.
"""

from __future__ import annotations

import statistics
import time
import warnings

import bpy

from .. import registration
from ..scene import live, stored_settings
from ..uw_spectral.errors import DataWarning

TARGET = 20.0
_REPETITIONS = 8
_CHANGES: dict[str, tuple[object, ...]] = {
    "water": ("jerlov:IB", "jerlov:II", "jerlov:III", "jerlov:1C", "jerlov:5C"),
    "scattering_factor": (1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9),
    "sensor": ("cie1931", "ARRI D21", "Nikon D7000"),
    "sun_zenith": (31.0, 32.0, 33.0, 34.0, 35.0, 36.0, 37.0, 38.0, 39.0),
    "floor_depth": (9.0, 9.1, 9.2, 9.3, 9.4, 9.5, 9.6, 9.7, 9.8),
}


def main(_: list[str]) -> None:
    """Print a table of the times."""
    warnings.simplefilter("ignore", DataWarning)
    bpy.ops.wm.read_factory_settings(use_empty=False)
    if hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.unregister()
    registration.register()
    scene = bpy.context.scene
    scene.underwater.surface = "flat"
    scene.underwater.floor_depth = 8.9
    bpy.ops.underwater.submerge(depth=5.0)
    live.add(scene)
    nodes = sum(len(group.nodes) for group in bpy.data.node_groups)
    print(f"| change | median ms | worst ms | target {TARGET:g} ms |\n|---|---|---|---|")
    for name, values in _CHANGES.items():
        setattr(scene.underwater, name, values[-1])
        times = [_milliseconds(scene, name, values[i % len(values)]) for i in range(_REPETITIONS)]
        _print_row(name, times)
    times = []
    for _ in range(_REPETITIONS):
        scene.camera.location.z += 0.1
        start = time.thread_time()
        bpy.context.view_layer.update()
        times.append(1e3 * (time.thread_time() - start))
    _print_row("camera moves", times)
    built = sum(len(group.nodes) for group in bpy.data.node_groups) - nodes
    print(f"\nnodes built: {built}; problem: {live.problem(scene) or 'none'}")


def _milliseconds(scene: bpy.types.Scene, name: str, value: object) -> float:
    start = time.thread_time()
    setattr(scene.underwater, name, value)
    return 1e3 * (time.thread_time() - start)


def _print_row(name: str, times: list[float]) -> None:
    median, worst = statistics.median(times), max(times)
    print(f"| {name} | {median:.1f} | {worst:.1f} | {'met' if median < TARGET else 'missed'} |")
