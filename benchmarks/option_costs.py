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
from typing import Any

import bpy

from ..quality.costs import COLUMNS, COSTED, TYPICAL
from ..quality.methods import DRAWN, METHODS, REALTIME, REFERENCE, Method
from ..quality.terms import Options, settings_of, with_and_without
from ..scene.engines import engines
from ..scene.readers import cameras
from ..scene.water.water_body import floor_plane, water_extent
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from . import grey_scene
from ._drawing import Drawing, drawing
from ._scenery import new_file
from .runner import ROOT

_DEPTH = 5.0
_BANDS = 3  # one pass
_RESOLUTION = (480, 270)
_SAMPLES, _REPEATS = 10, 2
_CYCLES_SAMPLES = 32
_SHADOW = 0.01  # m, that of the water's sun
_HEADER = """\
# Cost of a sample of a pass of EEVEE against the same scene without water, by the options.
# source: CPU times by `python3 dev.py run -m benchmarks option_costs`, {width} x {height}, EEVEE on
# the software rasteriser of a two-core machine; the least of {repeats} runs;
# shadow maps are left out of the ratios. A flat surface costs nothing that can be told
# from the scatter of the runs, and has no column: without it, real time costs {without:.4g}
# method: 1 real time, all bands in one pass; 2 a pass of three bands; 3 a pass of Cycles;
# 0 no water, where ratio holds the CPU time per megapixel and sample, s. 1: with the term
# licence: GPL-3.0-or-later. status: measured, on a CPU; read the ratios
# SPDX-License-Identifier: GPL-3.0-or-later
"""


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the table."""
    argparse.ArgumentParser(prog="option_costs").parse_args(arguments)
    plain, shadowed = plain_seconds()
    print(f"plain {plain:.3f} s per megapixel and sample, {shadowed:.3f} s with shadow maps")
    rows = []
    for method, options in configurations():
        ratio = water_seconds(method, options) / plain
        rows.append((_number(method), *_terms(options), 0, ratio))
        print(*(f"{value:.4g}" for value in rows[-1]), flush=True)
    rows.append((_number(REFERENCE), *_terms(TYPICAL), 0, cycles_seconds() / plain))
    rows += [(*[0] * (len(COLUMNS) - 2), maps, s) for maps, s in enumerate((plain, shadowed))]
    without = water_seconds(REALTIME, frozenset()) / plain
    width, height = _RESOLUTION
    header = _HEADER.format(width=width, height=height, repeats=_REPEATS, without=without)
    lines = [",".join(COLUMNS), *(",".join(f"{value:.4g}" for value in row) for row in rows)]
    (ROOT / "data" / "costs.csv").write_text(header + "\n".join(lines) + "\n", encoding="utf-8")


def configurations() -> list[tuple[Method, Options]]:
    """Return methods and terms to measure: the usual ones, and with each term alone."""
    options = [TYPICAL, *(o for term in COSTED for o in with_and_without(term, TYPICAL))]
    return [(method, o) for method in DRAWN for o in dict.fromkeys(options)]


def _number(method: Method) -> int:
    return list(METHODS).index(method.name) + 1


def _terms(options: Options) -> list[int]:
    return [int(term.name in options) for term in COSTED]


def plain_seconds() -> tuple[float, float]:
    """Return what a sample takes without water, without shadow maps and with them."""
    settings = _scene(TYPICAL)
    scene = bpy.context.scene
    column = render_plan.make_plan(settings).column
    floor = floor_plane(water_extent(scene, column, _DEPTH), bpy.data.materials.new("plain floor"))
    floor.location.z = -column.floor_depth
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.shadow_maximum_resolution = _SHADOW
    for item in (floor, bpy.data.objects.new("sun", lamp)):
        scene.collection.objects.link(item)
    with drawing(None) as plain:
        return _seconds(plain, shadows=False), _seconds(plain, shadows=True)


def water_seconds(method: Method, options: Options) -> float:
    """Return what a sample of a pass takes with some water."""
    assert not method.traced, "measured by itself"
    with drawing(_scene(options), method.mode) as water:
        return _seconds(water, shadows=False)


def _scene(options: Options) -> SceneSettings:
    """Build the scene, and return the settings of its water."""
    new_file()
    grey_scene.build_scene(_DEPTH, *_RESOLUTION)
    chosen: dict[str, Any] = settings_of(options)
    floor_depth = _DEPTH + grey_scene.ABOVE_FLOOR
    return SceneSettings(**chosen | {"bands": _BANDS, "floor_depth": floor_depth})


def _seconds(drawn: Drawing, *, shadows: bool) -> float:
    """CPU time of one more sample, s per megapixel."""
    drawn.scene.eevee.use_shadows = shadows
    samples = 1 if shadows else _SAMPLES
    drawn.seconds(1)  # compiles
    few, many = (min(drawn.seconds(n) for _ in range(_REPEATS)) for n in (1, 1 + samples))
    return (many - few) / samples / _megapixels()


def cycles_seconds() -> float:
    """Return CPU seconds per megapixel and sample of a pass of Cycles."""
    plan = render_plan.make_plan(_scene(TYPICAL))
    scene, camera = bpy.context.scene, cameras.find_camera(bpy.context.scene, None)
    extent = water_extent(scene, plan.column, _DEPTH)
    with (
        engines.cycles_bands(scene, camera, plan, extent, seed=0) as engine,
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
