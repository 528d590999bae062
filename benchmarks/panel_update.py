"""Time from a change in the panel to the viewport's inputs, without new nodes.

    python3 dev.py run -m benchmarks panel_update [PATH.blend] [--no-lamps]

Milliseconds of CPU time of this thread, median and worst of the repetitions after one
warm-up, of Blender's new file or of a scene: in haste, as while a slider moves, and
when it has come to rest, with all bands and the occlusion.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Sequence
from pathlib import Path

import bpy

from .. import registration
from ..scene import stored_settings
from ..scene.viewport import live, problems
from ..ui import live_updates
from .runner import markdown, table

_HASTY, _WHOLE = 40.0, 500.0  # ms, aimed at
_REPETITIONS = 8
_CHANGES: dict[str, tuple[object, ...]] = {
    "water": ("jerlov:IB", "jerlov:II", "jerlov:III", "jerlov:1C", "jerlov:5C"),
    "scattering_factor": (1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9),
    "sensor": ("cie1931", "ARRI D21", "Nikon D7000"),
    "sun_zenith": (31.0, 32.0, 33.0, 34.0, 35.0, 36.0, 37.0, 38.0, 39.0),
    "floor_depth": (9.0, 9.1, 9.2, 9.3, 9.4, 9.5, 9.6, 9.7, 9.8),
}


def main(arguments: Sequence[str]) -> None:
    """Print a table of the times."""
    parser = argparse.ArgumentParser(prog="panel_update", description=__doc__.splitlines()[0])
    parser.add_argument("blend", type=Path, nargs="?")
    parser.add_argument("--no-lamps", action="store_true")
    options = parser.parse_args(arguments)
    if options.blend:
        bpy.ops.wm.open_mainfile(filepath=str(options.blend.absolute()))
    else:
        bpy.ops.wm.read_factory_settings(use_empty=False)
    if options.no_lamps:
        bpy.data.batch_remove([item for item in bpy.data.objects if item.type == "LIGHT"])
    if hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.unregister()
    registration.register()
    scene = bpy.context.scene
    scene.underwater.surface = "flat"
    if not options.blend:
        scene.underwater.floor_depth = 8.9
        bpy.ops.underwater.submerge(depth=5.0)
    live.add(scene)
    nodes = sum(len(group.nodes) for group in bpy.data.node_groups)
    rows = []
    for name, values in _CHANGES.items():
        wanted = [values[i % len(values)] for i in range(-1, _REPETITIONS)]
        hasty, whole = (
            [_milliseconds(scene, name, value, hasty=h) for value in wanted] for h in (True, False)
        )
        rows.append(_row(name, hasty[1:], whole[1:]))
    built = sum(len(group.nodes) for group in bpy.data.node_groups) - nodes
    heads = ("change", "in haste, ms", "worst", "at rest, ms", "worst", f"≤ {_HASTY:g}, {_WHOLE:g}")
    print(markdown(table(heads, rows)))
    print(f"\nnodes built: {built}; problem: {problems.problem(scene) or 'none'}")


def _milliseconds(scene: bpy.types.Scene, name: str, value: object, *, hasty: bool) -> float:
    with live_updates.transaction():
        setattr(scene.underwater, name, value)
        start = time.thread_time()
        live.update(scene, hasty=hasty)
        return 1e3 * (time.thread_time() - start)


def _row(name: str, hasty: list[float], whole: list[float]) -> list[str]:
    (quick, slowest), (rest, longest) = ((statistics.median(t), max(t)) for t in (hasty, whole))
    met = ", ".join("met" if t < aim else "missed" for t, aim in ((quick, _HASTY), (rest, _WHOLE)))
    return [name, *(f"{t:.0f}" for t in (quick, slowest, rest, longest)), met]
