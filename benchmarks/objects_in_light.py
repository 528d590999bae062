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
from mathutils import Vector
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from . import grey_scene
from ._shade_scenes import matt

_WIDTH, _HEIGHT = 32, 18
_DEPTH, _FLOOR, _BANDS = 5.0, 14.0, 3
_INNER = 0.8  # of the ball's radius
_EEVEE_SAMPLES = 16


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
        camera = _ball(math.radians(angle), distance)
        inner = _inner(math.radians(angle), camera)
        plans = (_plan(water, samples) for samples in (options.samples, _EEVEE_SAMPLES))
        cycles, eevee = (
            _image(plan, camera, by_cycles=k == 0)[inner] for k, plan in enumerate(plans)
        )
        right = cycles.mean(axis=0)
        error = cycles.std(axis=0) / math.sqrt(len(cycles)) / right
        ratio = eevee.mean(axis=0) / right
        off.append(np.abs(ratio - 1.0))
        cells = (" / ".join(f"{x:.2f}" for x in values) for values in (ratio, error))
        print(f"| {water} | {angle:g}° | {distance:g} m | {' | '.join(cells)} |", flush=True)
    print(
        f"\nmedian {np.median(off):.1%}, 95 % {np.quantile(off, 0.95):.1%}, worst {np.max(off):.1%}"
    )


def _plan(water: str, samples: int) -> render_plan.RenderPlan:
    return render_plan.make_plan(
        SceneSettings(
            water=f"jerlov:{water}", bands=_BANDS, surface="flat", sky="clear", sun_zenith=30.0,
            sun_azimuth=60.0, samples=samples, floor_depth=_FLOOR, floor_reflectance="0.3",
        )
    )  # fmt: skip


def _ball(angle: float, distance: float) -> bpy.types.Object:
    """Fill an empty file with a black ball straight ahead; return the camera."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=64, ring_count=32, radius=distance * math.sin(angle),
        location=(0.0, distance, -_DEPTH),
    )  # fmt: skip
    bpy.context.object.data.materials.append(matt((0.0, 0.0, 0.0)))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, -_DEPTH)
    camera.rotation_euler = Vector((0.0, 1.0, 0.0)).to_track_quat("-Z", "Y").to_euler()
    camera.data.angle = min(5.0 * angle, math.radians(100.0))
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = _WIDTH, _HEIGHT
    scene.render.resolution_percentage = 100
    scene.cycles.pixel_filter_type = "BOX"
    bpy.context.view_layer.update()
    return camera


def _inner(angle: float, camera: bpy.types.Object) -> NDArray[np.bool_]:
    """Pixels well inside the ball."""
    edge = math.tan(camera.data.angle / 2.0)
    x = ((np.arange(_WIDTH) + 0.5) / _WIDTH * 2.0 - 1.0) * edge
    y = ((np.arange(_HEIGHT) + 0.5) / _HEIGHT * 2.0 - 1.0) * edge * _HEIGHT / _WIDTH
    return np.hypot(*np.meshgrid(x, y)) < _INNER * math.tan(angle)


def _image(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, *, by_cycles: bool
) -> NDArray[np.float64]:
    scene = bpy.context.scene
    extent = water_body.water_extent(scene, plan.column, _DEPTH)
    if by_cycles:
        with engines.cycles_bands(scene, camera, plan, extent, seed=1) as engine:
            return grey_scene.band_image(engine, plan, _DEPTH)
    with engines.eevee_bands(scene, camera, plan, extent, _DEPTH) as engine:
        return grey_scene.band_image(engine, plan, _DEPTH)
