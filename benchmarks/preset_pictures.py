"""The look presets in the reef, scattered as they once were and as they are.

    python3 dev.py run -m benchmarks preset_pictures [--samples N]

writes docs/measured/preset_pictures.md and its picture. Only the phase function differs
within a pair of pictures; the presets once had Henyey-Greenstein, "Quick".
"""

from __future__ import annotations

import argparse
import ast
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..examples.scenes import build_scene
from ..scene.engines import engines
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import DEFAULT_PHASE, NO_FLOOR, SceneSettings
from ..uw_spectral.spectra.colour_rendering import (
    delta_e_CIE2000_images,
    luminance,
    srgb_encode,
)
from . import grey_scene
from ._denoised import denoised

WIDTH, HEIGHT = 192, 108
BEFORE, NOW = "hg:0.924", DEFAULT_PHASE
_ROOT = Path(__file__).resolve().parent.parent
_PRESETS = _ROOT / "presets" / "underwater_spectral" / "look"
_REEF_FLOOR = 7.0
_BANDS, _STREAMS, _BLOCK = 6, 32, 12
_VIEWS = {"up, 45°": 45.0, "level": 0.0, "down": -90.0}
"""Directions of the open water that is compared, degrees upwards, away from the sun's azimuth."""


@dataclass(frozen=True, eq=False)
class Pair:
    """A preset before and now: scene-linear RGB within the display's range, and luminances.

    ``ratio`` is the luminance of open water before over that of now, by the directions of view.
    """

    name: str
    water: str
    before: NDArray[np.float64]
    now: NDArray[np.float64]
    ratio: tuple[float, ...]

    @property
    def delta_e(self) -> float:
        """Mean ΔE2000 over blocks of pixels."""
        images = (grey_scene.blocks(x, _BLOCK) for x in (self.before, self.now))
        return float(delta_e_CIE2000_images(*images).mean())

    @property
    def brightness(self) -> float:
        """Mean luminance before over that of now."""
        return float(luminance(self.before).mean() / luminance(self.now).mean())


def preset(path: Path) -> dict[str, str | float | bool]:
    """Return the settings that a preset assigns."""
    assigned = (x for x in ast.parse(path.read_text("utf-8")).body if isinstance(x, ast.Assign))
    return {
        x.targets[0].attr: ast.literal_eval(x.value)
        for x in assigned
        if isinstance(x.targets[0], ast.Attribute) and isinstance(x.value, ast.Constant)
    }


def plan_for(path: Path, phase: str) -> render_plan.RenderPlan:
    """Return the plan of a preset with a phase function, over the floor of the reef."""
    chosen = {**preset(path), "phase": phase, "floor_depth": _REEF_FLOOR, "bands": _BANDS}
    return render_plan.make_plan(SceneSettings(**chosen))


def drawn(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, samples: int
) -> NDArray[np.float64]:
    """Render by Cycles, denoised, shape (h, w, 3)."""
    scene, depth = bpy.context.scene, -camera.matrix_world.translation.z
    plan = replace(plan, settings=replace(plan.settings, samples=samples))
    extent = water_body.water_extent(scene, plan.column, depth)
    with engines.cycles_bands(scene, camera, plan, extent, seed=1, guides=True) as engine:
        picture = denoised(engine, plan, depth, plan.reduction(depth).weights)
    return np.clip(picture, 0.0, 1.0)


def open_water(plan: render_plan.RenderPlan, depth: float) -> NDArray[np.float64]:
    """Luminance of deep open water without a floor, by the directions of view."""
    chosen = replace(plan.settings, floor_depth=NO_FLOOR)
    deep = render_plan.make_plan(chosen)
    tilt = np.radians(list(_VIEWS.values()))
    x, y, _ = deep.column.sun_direction
    azimuth = math.atan2(y, x) + math.pi / 2
    w = (np.cos(tilt) * math.cos(azimuth), np.cos(tilt) * math.sin(azimuth), np.sin(tilt))
    seen = deep.solved_field(_STREAMS).radiance(depth, w)
    return luminance(plan.reduction(depth).apply(seen))


def measure(path: Path, camera: bpy.types.Object, samples: int) -> Pair:
    """Draw a preset both ways."""
    depth = -camera.matrix_world.translation.z
    plans = [plan_for(path, phase) for phase in (BEFORE, NOW)]
    before, now = (drawn(plan, camera, samples) for plan in plans)
    dark, bright = (open_water(plan, depth) for plan in plans)
    name = path.stem.replace("_", " ")
    return Pair(name, plans[0].settings.water, before, now, tuple((dark / bright).tolist()))


def picture_sheet(pairs: Sequence[Pair], path: Path) -> None:
    """Draw the pairs, a column for each preset."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    size = (2.4 * len(pairs), 2.9)
    figure, axes = plt.subplots(2, len(pairs), figsize=size, squeeze=False)
    for column, pair in zip(axes.T, pairs, strict=True):
        column[0].set_title(f"{pair.name} ({pair.water.split(':')[1]})", fontsize=8)
        for axis, image in zip(column, (pair.before, pair.now), strict=True):
            axis.imshow(srgb_encode(image))
            axis.set(xticks=[], yticks=[])
    for axis, name in zip(
        axes[:, 0], (f"before: {BEFORE}", "now: molecules\nand particles"), strict=True
    ):
        axis.set_ylabel(name, fontsize=8)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=110, pil_kwargs={"quality": 85})
    plt.close(figure)


def report(pairs: Sequence[Pair], depth: float, samples: int) -> str:
    """Return the page as Markdown."""
    rows = "\n".join(
        f"| {p.name} | {p.water.split(':')[1]} | "
        f"{' | '.join(f'× {r:.3f}' if r < 0.1 else f'× {r:.2f}' for r in p.ratio)} | "
        f"× {p.brightness:.2f} | {p.delta_e:.1f} |"
        for p in pairs
    )
    return f"""# The look presets, before and now

Written by `python3 dev.py run -m benchmarks preset_pictures`.

The presets once scattered with `{BEFORE}`, now with `{NOW}`, molecules and particles by their
fraction; nothing else differs: Cycles, {_BANDS} bands, {samples} samples, denoised, {WIDTH} ×
{HEIGHT} pixels, the draft reef from {depth:.1f} m.

![The presets before and now](preset_pictures.jpg)

Blue hole shows it: nearly black water is deep blue. Luminance of open water there, before over
now, by discrete ordinates; that of the whole picture, and mean ΔE2000 of blocks of {_BLOCK} ×
{_BLOCK} pixels (the denoiser's blotches in it):

| preset | water | {" | ".join(_VIEWS)} | picture | ΔE2000 |
|---|---|{"---|" * len(_VIEWS)}---|---|
{rows}
"""


def main(arguments: Sequence[str]) -> None:
    """Draw every preset and write the page."""
    parser = argparse.ArgumentParser(prog="preset_pictures")
    parser.add_argument("--samples", type=int, default=16)
    options = parser.parse_args(arguments)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    build_scene("reef", 1, "draft")
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    pairs = []
    for path in sorted(_PRESETS.glob("*.py")):
        pairs.append(measure(path, scene.camera, options.samples))
        last = pairs[-1]
        print(last.name, last.ratio, last.brightness, last.delta_e, flush=True)
    docs = _ROOT / "docs" / "measured"
    picture_sheet(pairs, docs / "preset_pictures.jpg")
    depth = -scene.camera.matrix_world.translation.z
    (docs / "preset_pictures.md").write_text(report(pairs, depth, options.samples), "utf-8")
