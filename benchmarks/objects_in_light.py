"""Black balls in the water: how bright EEVEE draws them, over Cycles.

    python3 dev.py run -m benchmarks objects_in_light [--waters IB 3C] [--angles 1 3 10 30]
        [--distances 2 4 8] [--samples N]

A black thing shows nothing but the water before it, and what is scattered forward past it or
blocked by it. Each line has the ratio in three bands, and the standard error of Cycles.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ._shade_scenes import HEIGHT, WIDTH, Place, ball, look_at

_DEPTH, _FLOOR = 5.0, 14.0
_INNER = 0.8  # of the ball's radius


def main(arguments: Sequence[str]) -> None:
    """Print a line for each ball, and the median and 95 % of |ratio - 1|."""
    parser = argparse.ArgumentParser(prog="objects_in_light", description=(__doc__ or "")[:80])
    parser.add_argument("--waters", nargs="+", default=["IB", "3C"], metavar="TYPE")
    parser.add_argument("--angles", type=float, nargs="+", default=[1, 3, 10, 30])
    parser.add_argument("--distances", type=float, nargs="+", default=[2, 4, 8])
    parser.add_argument("--samples", type=int, default=192)
    options = parser.parse_args(arguments)
    print(
        "| water | angular radius | distance | EEVEE over Cycles | error |\n|---|---|---|---|---|"
    )
    off = []
    for water, angle, distance in itertools.product(
        options.waters, options.angles, options.distances
    ):
        place = _place(water, math.radians(angle), distance, options.samples)
        camera = place.open()
        inner = _inner(math.radians(angle), camera)
        cycles, eevee = place.by_cycles(camera, [1])[0][inner], place.by_eevee(camera)[inner]
        right = cycles.mean(axis=0)
        error = cycles.std(axis=0) / math.sqrt(len(cycles)) / right
        ratio = eevee.mean(axis=0) / right
        off.append(np.abs(ratio - 1.0))
        cells = (" / ".join(f"{x:.2f}" for x in values) for values in (ratio, error))
        print(f"| {water} | {angle:g}° | {distance:g} m | {' | '.join(cells)} |", flush=True)
    print(
        f"\nmedian {np.median(off):.1%}, 95 % {np.quantile(off, 0.95):.1%}, worst {np.max(off):.1%}"
    )


def _place(water: str, angle: float, distance: float, samples: int) -> Place:
    """Return the place of a black ball straight ahead."""

    def build() -> bpy.types.Object:
        ball((0.0, distance, -_DEPTH), distance * math.sin(angle), (0.0, 0.0, 0.0))
        width = min(5.0 * angle, math.radians(100.0))
        return look_at((0.0, 0.0, -_DEPTH), (0.0, distance, -_DEPTH), width)

    floor = {"floor_depth": _FLOOR, "floor_reflectance": "0.3"}
    return Place("black ball", build, water, samples=samples, settings=floor)


def _inner(angle: float, camera: bpy.types.Object) -> NDArray[np.bool_]:
    """Pixels well inside the ball."""
    edge = math.tan(camera.data.angle / 2.0)
    x = ((np.arange(WIDTH) + 0.5) / WIDTH * 2.0 - 1.0) * edge
    y = ((np.arange(HEIGHT) + 0.5) / HEIGHT * 2.0 - 1.0) * edge * HEIGHT / WIDTH
    return np.hypot(*np.meshgrid(x, y)) < _INNER * math.tan(angle)
