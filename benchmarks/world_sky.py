"""Worlds that light the water: what they bring against integrals, and EEVEE against Cycles."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ..scene.engines import world_picture
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..tests.scene import skies
from ..tests.uw_spectral.transfer.sky_pictures import KNOWN_SKIES
from ..uw_spectral.transfer.sky_picture import SkyPicture
from . import grey_scene
from ._places import Compared, realtime
from ._scenery import camera_at, new_file
from .runner import Ask, Page, Target, spread, table

_DEPTH, _BLOCK = 4.0, 6
_SETTINGS = SceneSettings(
    water="jerlov:IB", bands=6, surface="flat", floor_depth=8.0, floor_reflectance="0.3",
    sky_picture="world",
)  # fmt: skip
_ELEVATIONS = {"Sky Texture, sun at 45°": 45.0, "Sky Texture, sun at 12°": 12.0}


def _scene(name: str, folder: Path) -> bpy.types.Object:
    """Fill a new file with a world and a camera that sees half of Snell's window."""
    scene = new_file((48, 36))
    if name in KNOWN_SKIES:
        skies.with_picture(scene, KNOWN_SKIES[name], folder / f"{name}.exr")
    else:
        texture = skies.world(scene, "ShaderNodeTexSky")
        texture.sun_elevation, texture.sun_rotation = math.radians(_ELEVATIONS[name]), 3.5
        skies.strength(scene).default_value = 0.15
    turned = (math.radians(110.0), 0.0, 0.5)
    return camera_at((0.0, 0.0, -_DEPTH), turned, math.radians(125.0))


def _off(name: str, path: str) -> list[str]:
    """What a world brings directly and diffusely, in % off the integrals of what it was made of."""
    if name not in KNOWN_SKIES:
        return ["", ""]
    known, found = KNOWN_SKIES[name], SkyPicture.read(path)
    pairs = (
        (found.sun_irradiance, known.sun_irradiance),
        (found.without_sun.irradiance, known.diffuse_irradiance),
    )
    return [f"{100 * np.abs(a / b - 1).max():.1f}" if b.any() else "none" for a, b in pairs]


def measure(ask: Ask) -> Mapping[str, object]:
    """Draw the worlds, and render what is seen below them."""
    rows, medians, highest = [], [], []
    for name in (*KNOWN_SKIES, *_ELEVATIONS):
        with tempfile.TemporaryDirectory() as folder:
            camera = _scene(name, Path(folder))
            chosen = world_picture.drawn(bpy.context.scene, _SETTINGS, Path(folder))
            plan = render_plan.make_plan(chosen)
            energy = _off(name, chosen.sky_picture.removeprefix("file:"))
            weights = plan.reduction(_DEPTH).weights.T
            halves = grey_scene.cycles_images(plan, camera, ask.samples) @ weights
            fast = replace(plan, settings=replace(plan.settings, samples=16))
            seen = {"bands": grey_scene.eevee_image(plan, camera) @ weights,
                    "real time": realtime(fast)}  # fmt: skip
        one, other, *drawn = (grey_scene.blocks(x, _BLOCK) for x in (*halves, *seen.values()))
        found = Compared(np.stack([one, other]), dict(zip(seen, drawn, strict=True)), 1)
        errors = [found.delta_e(by) for by in seen]
        rows.append([name, *energy, *map(spread, (*errors, found.noise))])
        medians += [float(np.median(x)) for x in errors]
        highest += [float(np.quantile(x, 0.95)) for x in errors]
    heads = ("world", "direct, % off", "diffuse, % off", "bands", "real time", "Cycles' noise")
    return {"rows": table(heads, rows), "median": max(medians), "high": max(highest)}


PAGE = Page(
    "Worlds that light the water",
    """
From 4 m in IB, flat surface, floor at 8 m: half of Snell's window, the water's mirror and the floor
at 48 × 36 pixels, 6 bands. Four pictures made by formula (clear at noon, low sun, overcast, clear
with a red tint to one side), drawn as a user's world, and Blender's Sky Texture. Direct and diffuse
light on a level plane against the integrals of the formulas, the worst channel. ΔE2000 of EEVEE
against Cycles (two images of {samples} samples), blocks of 6 × 6 pixels, median/95 %/worst.

{rows}

Doubled strength doubles the light, a world and a camera that turn together show the same
(`tests/scene/test_world_sky.py`).
""",
    (
        Target("worst median, ΔE", "median", 1.5),
        Target("worst 95 %, ΔE", "high", 1.5),
    ),
    {"samples": 384},
)
