"""Scenes of other people's models under water: EEVEE against converged Cycles.

The scenes are built by :mod:`.foreign_scenes` out of public packages, into out/foreign.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from . import grey_scene
from ._places import Compared, realtime, sheet
from ._scenery import depth_of, sized
from .foreign_scenes import SCENES, built
from .materials import settings as water_of_materials
from .runner import ROOT, Ask, Page, Target, table

_WIDTH, _HEIGHT, _BLOCK = 240, 135, 3
_EEVEE_SAMPLES = 32


def _settings(samples: int) -> SceneSettings:
    """Return the water of all scenes, over the seabed that they have."""
    return replace(water_of_materials(samples), floor_depth=0.0, floor_reflectance="0.2")


def _open(out: Path, name: str) -> bpy.types.Object:
    """Open a scene, and return its camera."""
    path = out / f"{name}.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path.absolute()))
    return sized((_WIDTH, _HEIGHT)).camera


def measure(ask: Ask) -> Mapping[str, object]:
    """Build what is missing, render and compare."""
    out, rows, pictures, means, tails, packages = ROOT / "out" / "foreign", [], {}, [], [], {}
    for name in sorted(SCENES)[: ask.scenes]:
        packages |= {p["name"]: p for p in built(name, out)["packages"]}
        camera, plan = _open(out, name), render_plan.make_plan(_settings(ask.samples))
        develop = plan.reduction(depth_of(camera)).apply
        traced = functools.partial(grey_scene.cycles_images, plan, camera, ask.samples)
        halves = develop(ask.kept(name, traced))
        seen = realtime(render_plan.make_plan(_settings(_EEVEE_SAMPLES)))
        found = Compared(halves, {"real time": seen}, _BLOCK)
        off = found.delta_e("real time")
        means.append(float(off.mean()))
        tails.append(float(np.quantile(off, 0.95)))
        numbers = (means[-1], tails[-1], off.max(), found.noise.mean())
        rows.append([name, *(f"{x:.2f}" for x in numbers)])
        pictures[name] = [seen, found.reference]
    sheet(ask.shown("foreign_scenes.jpg"), pictures, ("EEVEE", "Cycles"), across=2)
    return {
        "rows": table(("scene", "mean", "95 %", "worst", "noise"), rows),
        "mean": float(np.mean(means)), "most": max(means), "tail": max(tails),
        "packages": "; ".join(
            f"{p['name']} ({p['registry']}, {p['version']}, {p['licence']})"
            for p in packages.values()
        ),
    }  # fmt: skip


PAGE = Page(
    "Other people's models",
    """
13 scenes of some 60 materials out of public packages (`benchmarks/foreign_scenes.py`) on sand at
6.5 m, in Jerlov IB (hg:0.85), flat surface, clear sky, sun at 30°. Real time (32 samples) against
Cycles (two pictures of {samples} samples, 6 bands), 240 × 135. ΔE2000 of blocks of 3 × 3 pixels;
*noise*: of Cycles, in all columns.

{rows}

![EEVEE and Cycles, in the order of the table](foreign_scenes.jpg)

## What differs
- Cut-out leaves a few pixels wide are dark in EEVEE, in plain scenes too: a leaf of 64 texels has
  0.99 of its brightness over 64 pixels, 0.86 over 16 and 0.44 over 4 (software rasteriser).
- Under cars and chairs EEVEE's occlusion is too light; on sand beside small things it is too
  strong, by a soft edge of a cell (0.3 m).
- A material that transmits has no look of glass in real time, which is said.
- Objects with two faces in one place are black or speckled in Cycles (*machines*, *furniture*,
  *clothes*).

Packages: {packages}. They have no glTF models with transmission, sheen, volume or iridescence.
""",
    (
        Target("mean ΔE2000, mean of the scenes", "mean", 1.0),
        Target("mean ΔE2000, worst scene", "most", 1.5),
        Target("95 %, worst scene", "tail", 3.0),
    ),
    {"samples": 64, "scenes": 99},
)
