"""EEVEE in water of several layers against the solution, per pixel.

    python3 dev.py run -m benchmarks layered_water

writes docs/measured/layered_water.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..tests.node_groups import realtime_probe as probe
from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.transfer.discrete_ordinates import STREAMS
from ._solved_cases import FROM_SUN, Case, layered_cases

_CASES = 24
_TURNS = (0.0, 88.0, 150.0)
_EDGE = 1.0  # degrees from the edge of Snell's window
_DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "measured" / "layered_water.md"

Errors = list[NDArray[np.float64]]


def main(arguments: Sequence[str]) -> None:
    """Render, compare, and write the document."""
    argparse.ArgumentParser(prog="layered_water").parse_args(arguments)
    found: dict[str, Errors] = {"open water": [], "level square": [], "one layer instead": []}
    worst: list[tuple[float, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for case in layered_cases(_CASES):
            # Another number of layers is another set of nodes.
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            water, square = _rendered(case, Path(folder) / "picture.exr")
            found["open water"].append(water)
            found["level square"].append(square)
            found["one layer instead"].append(_mixed(case))
            worst.append((float(np.quantile(water, 0.95)), case.name))
            print(f"{np.median(water):.2%} {worst[-1][0]:.2%} {case.name}", flush=True)
    with replacing(_DOCUMENT) as path:
        path.write_text(_document(found, sorted(worst, reverse=True)[:1]), encoding="utf-8")


def _rendered(case: Case, path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Errors in open water all around, and on a level square below the camera."""
    field = case.field
    white = np.maximum(field.Ed(case.depth) / math.pi, 1e-30)
    weights = np.diag(1.0 / white)
    water, squares = [], []
    room = min(case.column.floor_depth - case.depth, 2.0 / float(field.extinction.min()))
    for turn in (case.turn, *_TURNS):
        square = None if turn > 60.0 else probe.level_square(turn, 0.5 * room, room)
        view = probe.View(case.depth, turn, square=square, clip=(0.01, 1000.0))
        errors = probe.errors_of_solved(case.column, case.phase, view, weights, path, case.lit)
        water.append(errors[0])
        squares.append(errors[1])
    return np.concatenate(water), np.concatenate(squares)


def _mixed(case: Case) -> NDArray[np.float64]:
    """Errors of one layer with the mean coefficients of the water above the camera."""
    one = dataclasses.replace(case, column=case.column.mixed_above(case.depth))
    found = []
    for turn in (case.turn, *_TURNS):
        w = probe.View(case.depth, turn).rays()
        far = w @ -case.column.sun_direction < math.cos(math.radians(FROM_SUN))
        rays = [w[far][:, axis] for axis in range(3)]
        wanted, seen = (x.field.radiance(case.depth, rays)[:, case.lit] for x in (case, one))
        found.append(np.abs(seen / wanted - 1.0).ravel())
    return np.concatenate(found)


def _document(found: dict[str, Errors], worst: Sequence[tuple[float, str]]) -> str:
    rows = [
        f"| {name} | {100 * np.median(e):.2g} | {100 * np.quantile(e, 0.95):.2g} "
        f"| {100 * np.quantile(e, 0.999):.2g} | {100 * e.max():.2g} |"
        for name, e in ((name, np.concatenate(parts)) for name, parts in found.items())
    ]
    cases = "\n".join(f"- {100 * error:.2g} %: {name}" for error, name in worst)
    return f"""# Water in layers, in EEVEE

Written by `python3 dev.py run -m benchmarks layered_water`.

{_CASES} random cases: two to four Jerlov types upon each other, sun at 0 to 80°, camera at 1 to
20 m, with a floor and without, under a surface (clear, overcast) and none; views down, level, up
and tilted. Relative errors in % against the discrete ordinates ({STREAMS} streams) without
tables, beyond {FROM_SUN:g}° from the sun and {_EDGE:g}° from the edge of Snell's window. *One
layer instead* has the mean coefficients above the camera.

| what | median | 95 % | 99.9 % | worst |
|---|---|---|---|---|
{chr(10).join(rows)}

The case with the largest 95 % in open water:

{cases}

A border is sharp in the solution; for level rays it is smeared over the first slices beside it:
in a clear layer between turbid ones, in a band that is nearly dark, they may be **many times too
bright**.
"""
