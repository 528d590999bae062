"""EEVEE in water of several layers against the solution, per pixel."""

from __future__ import annotations

import dataclasses
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..tests.node_groups import realtime_probe as probe
from ..validation.solved_cases import FROM_SUN, Case, layered_cases
from .runner import Ask, Page, table

_TURNS = (0.0, 88.0, 150.0)

Errors = list[NDArray[np.float64]]


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


def measure(ask: Ask) -> Mapping[str, object]:
    """Render the cases."""
    found: dict[str, Errors] = {"open water": [], "level square": [], "one layer instead": []}
    worst: list[tuple[float, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for case in layered_cases(ask.cases):
            # Another number of layers is another set of nodes.
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            errors = *_rendered(case, Path(folder) / "picture.exr"), _mixed(case)
            for parts, error in zip(found.values(), errors, strict=True):
                parts.append(error)
            worst.append((float(np.quantile(errors[0], 0.95)), case.name))
    rows = [
        [name, *(f"{100 * x:.2g}" for x in
                 np.quantile(np.concatenate(parts), (0.5, 0.95, 0.999, 1.0)))]
        for name, parts in found.items()
    ]  # fmt: skip
    off, name = max(worst)
    return {"rows": table(("what", "median", "95 %", "99.9 %", "worst"), rows),
            "worst": f"{100 * off:.2g} %: {name}"}  # fmt: skip


PAGE = Page(
    "Water in layers, in EEVEE",
    """
{cases} random cases: two to four Jerlov types upon each other, sun at 0 to 80°, camera at 1 to 20
m, with a floor and without, under a surface (clear, overcast) and none; views down, level, up and
tilted. Relative errors in % against the discrete ordinates (32 streams) without tables, beyond 10°
from the sun and 1° from the edge of Snell's window. *One layer instead* has the mean coefficients
above the camera.

{rows}

The case with the largest 95 % in open water:

- {worst}

A border is sharp in the solution; for level rays it is smeared over the first slices beside it: in
a clear layer between turbid ones, in a band that is nearly dark, they may be **many times too
bright**.
""",
    settings={"cases": 24},
)
