"""What each option of the water costs, for the choice of what a scene requires.

    python3 dev.py run -m benchmarks option_costs

writes data/costs.csv: CPU times of one more sample of EEVEE, as ratios to the scene
without water in the same run, and of a pass of Cycles. Shadow maps are left out of the
ratios: without a GPU they take many times as long as all the rest. Takes some minutes.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..quality.costs import COLUMNS, COSTED, USUAL
from ..quality.terms import Options, settings_of, with_and_without
from ..scene import (
    eevee_settings,
    engines,
    exr_output,
    moving_surface,
    realtime,
    render_plan,
    settings,
)
from ..scene.water_body import floor_plane, water_extent
from . import grey_scene

_DEPTH = 5.0
_FEW, _SOME, _MANY = 3, 9, 33  # bands
_RESOLUTION = (480, 270)
_SAMPLES, _REPEATS = 10, 2
_CYCLES_SAMPLES = 32
_SHADOW = 0.01  # m, that of the water's sun
_HEADER = """\
# Cost of a sample of a frame of EEVEE against the same scene without water, by the options.
# source: CPU times by `python3 dev.py run -m benchmarks option_costs`, {width} x {height}, EEVEE on
# the software rasteriser of a two-core machine; the least of {repeats} runs;
# shadow maps are left out of the ratios. A flat surface costs nothing that can be told
# from the scatter of the runs, and has no column: without it, {some} bands cost {without:.4g}
# 1: with the term. cycles 1: a pass in Cycles, of one band. bands 0: no water,
# where ratio holds the CPU time per megapixel and sample, s
# licence: GPL-3.0-or-later. status: measured, on a CPU; read the ratios
# SPDX-License-Identifier: GPL-3.0-or-later
"""


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the table."""
    argparse.ArgumentParser(prog="option_costs").parse_args(arguments)
    plain, shadowed = plain_seconds()
    print(f"plain {plain:.3f} s per megapixel and sample, {shadowed:.3f} s with shadow maps")
    rows = []
    for bands, options in configurations():
        rows.append((0, bands, *_terms(options), 0, water_seconds(bands, options) / plain))
        print(*(f"{value:.4g}" for value in rows[-1]), flush=True)
    rows.append((1, _FEW, *_terms(USUAL), 0, cycles_seconds() / plain))
    rows += [(*[0] * (len(COLUMNS) - 2), maps, s) for maps, s in enumerate((plain, shadowed))]
    without = water_seconds(_SOME, frozenset()) / plain
    header = _HEADER.format(
        width=_RESOLUTION[0], height=_RESOLUTION[1], repeats=_REPEATS, some=_SOME, without=without
    )
    lines = [",".join(COLUMNS), *(",".join(f"{value:.4g}" for value in row) for row in rows)]
    table = Path(__file__).resolve().parent.parent / "data" / "costs.csv"
    table.write_text(header + "\n".join(lines) + "\n", encoding="utf-8")


def configurations() -> list[tuple[int, Options]]:
    """Return bands and terms to measure: more and fewer bands, and each term alone."""
    found = [(bands, USUAL) for bands in (_FEW, _SOME, _MANY)]
    found += [(_SOME, o) for term in COSTED for o in with_and_without(term, USUAL)]
    return list(dict.fromkeys(found))


def _terms(options: Options) -> list[int]:
    return [int(term.name in options) for term in COSTED]


def plain_seconds() -> tuple[float, float]:
    """Return what a sample takes without water, without shadow maps and with them."""
    camera, plan = _plan(_FEW, USUAL)
    scene = bpy.context.scene
    extent = water_extent(scene, plan.column, _DEPTH)
    floor = floor_plane(extent, bpy.data.materials.new("plain floor"))
    floor.location.z = -plan.column.floor_depth
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.shadow_maximum_resolution = _SHADOW
    for item in (floor, bpy.data.objects.new("sun", lamp)):
        scene.collection.objects.link(item)
    with eevee_settings.realtime_settings(scene, camera, samples=1, water=None):
        return _seconds(shadows=False), _seconds(shadows=True)


def water_seconds(bands: int, options: Options) -> float:
    """Return what a sample takes with some water."""
    camera, plan = _plan(bands, options)
    scene = bpy.context.scene
    water = plan.realtime(scene, _DEPTH, plan.reduction(_DEPTH).weights)
    water = moving_surface.with_waves(scene, plan, water)
    realtime.add_realtime(scene, water, water_extent(scene, plan.column, _DEPTH))
    with eevee_settings.realtime_settings(scene, camera, samples=1, water=water):
        return _seconds(shadows=False)


def _plan(bands: int, options: Options) -> tuple[bpy.types.Object, render_plan.RenderPlan]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    camera = grey_scene.build_scene(_DEPTH, *_RESOLUTION)
    return camera, render_plan.make_plan(
        settings.SceneSettings(
            **settings_of(options)
            | {
                "bands": bands,
                "floor_depth": _DEPTH + grey_scene.ABOVE_FLOOR,
            }
        )
    )


def _seconds(*, shadows: bool) -> float:
    """CPU time of one more sample, s per megapixel."""
    scene = bpy.context.scene
    scene.eevee.use_shadows = shadows
    samples = 1 if shadows else _SAMPLES

    with tempfile.TemporaryDirectory() as folder:

        def frame(count: int) -> float:
            scene.eevee.taa_render_samples = count
            start = time.process_time()
            exr_output.write_float_exr(scene, Path(folder) / "a.exr")
            return time.process_time() - start

        frame(1)  # compiles
        few, many = (min(frame(n) for _ in range(_REPEATS)) for n in (1, 1 + samples))
    return (many - few) / samples / _megapixels()


def cycles_seconds() -> float:
    """Return CPU seconds per megapixel and sample of a pass of Cycles."""
    camera, plan = _plan(_FEW, USUAL)
    scene = bpy.context.scene
    extent = water_extent(scene, plan.column, _DEPTH)
    with (
        engines.cycles_bands(scene, camera, plan, extent, seed=0, denoise=False) as engine,
        tempfile.TemporaryDirectory() as folder,
    ):
        times = []
        for samples in (1, 1, 1 + _CYCLES_SAMPLES):
            scene.cycles.samples = samples
            start = time.process_time()
            engine.frame(plan, _DEPTH)(engine.passes[0], Path(folder) / "a.exr")
            times.append(time.process_time() - start)
    return (times[2] - times[1]) / _CYCLES_SAMPLES / _megapixels()


def _megapixels() -> float:
    return _RESOLUTION[0] * _RESOLUTION[1] / 1e6
