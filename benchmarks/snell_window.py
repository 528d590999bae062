"""Snell's window from below: EEVEE and Cycles against the closed form, by zenith angle.

    python3 dev.py run -m benchmarks snell_window [--samples N]

writes docs/snell_window.md. The camera looks straight up at a flat surface
under a uniform sky; outside the window the water is mirrored.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import engines, render_plan, settings, water_body
from ..uw_spectral.transfer.pixel import UndisturbedWater
from . import grey_scene

DEPTH, FLOOR = 5.0, 12.0
WATERS = ("jerlov:IB", "jerlov:3C")
_PIXELS = 72
_FIELD = math.radians(140.0)
_RINGS = np.array([0.0, 15.0, 30.0, 40.0, 45.0, 47.0, 49.5, 52.0, 55.0, 60.0, 65.0])
_EEVEE_SAMPLES = 16


def directions(oversampling: int = 1) -> NDArray[np.float64]:
    """Unit directions of the pixels of a camera that looks up, shape (h, w, 3)."""
    n = _PIXELS * oversampling
    along = (np.arange(n) + 0.5 - n / 2) * (2.0 * math.tan(_FIELD / 2) / n)
    right, up = np.meshgrid(along, -along)
    w = np.stack([right, up, np.ones_like(right)], axis=-1)
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def closed_form(plan: render_plan.RenderPlan, oversampling: int = 4) -> NDArray[np.float64]:
    """Radiance of every pixel, shape (h, w, n)."""
    w = tuple(np.moveaxis(directions(oversampling), -1, 0)[..., None])
    water, column = plan.viewpoint(DEPTH).path_radiance, plan.column
    seen = UndisturbedWater(water, column.skylight, column.refractive_index)
    return grey_scene.blocks(seen.radiance(DEPTH, w), oversampling)


def _camera() -> bpy.types.Object:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -DEPTH), (math.pi, 0.0, 0.0)
    camera.data.angle = _FIELD
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = _PIXELS
    scene.cycles.pixel_filter_type = "BOX"
    return camera


def measure(name: str, samples: int) -> tuple[list[str], list[list[float]]]:
    """Return the columns of the table of one water, and its rows, one per ring."""
    plan = render_plan.make_plan(
        settings.SceneSettings(
            water=name,
            phase="hg:0.8",
            bands=3,
            surface="flat",
            sky_radiance=0.1,
            floor_depth=FLOOR,
            floor_reflectance="0.3",
            sun_zenith=50.0,
        )
    )
    camera = _camera()
    wanted = closed_form(plan)
    seeds = [grey_scene.cycles_image(plan, camera, samples, seed) for seed in (1, 2)]
    scene = bpy.context.scene
    few = replace(plan, settings=replace(plan.settings, samples=_EEVEE_SAMPLES))
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.eevee_bands(scene, camera, few, extent, DEPTH) as engine:
        eevee = grey_scene.band_image(engine, few, DEPTH)
    angle = np.degrees(np.arccos(directions()[..., 2]))
    sun = plan.column.sun_direction
    away = np.degrees(np.arccos(np.clip(directions() @ -sun, -1.0, 1.0))) > 8.0
    rows = []
    for first, last in itertools.pairwise(_RINGS):
        ring = (angle >= first) & (angle < last) & away
        form, drawn = wanted[ring].mean(axis=0), eevee[ring].mean(axis=0)
        first_half, second_half = (image[ring].mean(axis=0) for image in seeds)
        traced = (first_half + second_half) / 2
        noise = np.abs(first_half - second_half) / 2 / traced
        worst = int(np.argmax(np.abs(drawn / form - 1)))
        rows.append([
            first, last, float(form.mean()),
            100 * float(drawn[worst] / form[worst] - 1),
            100 * float((form / traced - 1).mean()),
            100 * float((drawn / traced - 1).mean()),
            100 * float(noise.mean()),
            float((traced / plan.column.refractive_index**2 / plan.column.sky_radiance).max()),
        ])  # fmt: skip
    heads = [
        "zenith angle", "closed form", "EEVEE / closed form - 1, worst band",
        "closed form / Cycles - 1", "EEVEE / Cycles - 1", "noise of Cycles", "L / (n² L_sky), most",
    ]  # fmt: skip
    return heads, rows


def main(arguments: Sequence[str]) -> None:
    """Measure the waters and write the report."""
    parser = argparse.ArgumentParser(prog="snell_window")
    parser.add_argument("--samples", type=int, default=256)
    options = parser.parse_args(arguments)
    lines = [
        "# Snell's window",
        "",
        f"From {DEPTH:g} m under a flat surface (n = 1.34, window of 96.54°), a uniform sky of 0.1",
        f"per steradian of the sunlight, sun at 50°, floor at {FLOOR:g} m, HG 0.8, three bands.",
        f"Cycles: two images of {options.samples} samples; its noise is half their difference.",
        "Pixels within 8° of the sun's direction in water are left out. The last column: radiance",
        "without the water's own light is at most 1 (no energy gained); scattering adds to it.",
        "",
    ]
    for name in WATERS:
        heads, rows = measure(name, options.samples)
        lines += [f"## {name}", "", f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
        for first, last, form, *percents, gain in rows:
            cells = " | ".join(f"{p:+.1f} %" for p in percents[:-1])
            lines.append(
                f"| {first:g}-{last:g}° | {form:.4f} | {cells} | {percents[-1]:.1f} % "
                f"| {gain:.2f} |"
            )
        lines.append("")
        print("\n".join(lines[-len(rows) - 4 :]), flush=True)
    lines += ["Repeat: `python3 dev.py run -m benchmarks snell_window`", ""]
    docs = Path(__file__).resolve().parent.parent / "docs"
    (docs / "snell_window.md").write_text("\n".join(lines), encoding="utf-8")
