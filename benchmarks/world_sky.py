"""Worlds that light the water: what they bring against integrals, and EEVEE against Cycles."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines, world_picture
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..tests.scene import skies
from ..tests.uw_spectral.transfer.sky_pictures import KNOWN_SKIES
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr
from ..uw_spectral.transfer.sky_picture import SkyPicture
from . import grey_scene
from ._places import camera_at
from .runner import Ask, Page, Target, table

_DEPTH, _BLOCK = 4.0, 6
_SETTINGS = SceneSettings(
    water="jerlov:IB", bands=6, surface="flat", floor_depth=8.0, floor_reflectance="0.3",
    sky_picture="world",
)  # fmt: skip
_ELEVATIONS = {"Sky Texture, sun at 45°": 45.0, "Sky Texture, sun at 12°": 12.0}


def _scene(name: str, folder: Path) -> bpy.types.Object:
    """Fill a new file with a world and a camera that sees half of Snell's window."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    if name in KNOWN_SKIES:
        skies.with_picture(scene, KNOWN_SKIES[name], folder / f"{name}.exr")
    else:
        texture = skies.world(scene, "ShaderNodeTexSky")
        texture.sun_elevation, texture.sun_rotation = math.radians(_ELEVATIONS[name]), 3.5
        skies.strength(scene).default_value = 0.15
    turned = (math.radians(110.0), 0.0, 0.5)
    scene.camera = camera_at((0.0, 0.0, -_DEPTH), turned, math.radians(125.0))
    scene.render.resolution_x, scene.render.resolution_y = 48, 36
    scene.cycles.pixel_filter_type = "BOX"
    return scene.camera


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


def _realtime(plan: render_plan.RenderPlan, camera: bpy.types.Object) -> NDArray[np.float64]:
    plan = replace(plan, settings=replace(plan.settings, samples=16))
    extent = water_body.water_extent(bpy.context.scene, plan.column, _DEPTH)
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(bpy.context.scene, camera, plan, extent, _DEPTH) as engine,
    ):
        path = Path(folder, "frame.exr")
        engine.frame(plan, _DEPTH)(engine.passes[0], path)
        return read_exr(path)[0][..., :3].astype(np.float64)


def _apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    seen = [np.clip(grey_scene.blocks(x, _BLOCK), 0.0, 1.0) for x in (one, other)]
    return delta_e_CIE2000_images(*seen)


def _cells(differences: NDArray[np.float64]) -> str:
    middle, high = np.quantile(differences, [0.5, 0.95])
    return f"{middle:.2f}/{high:.2f}/{differences.max():.2f}"


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
            seeds = [grey_scene.cycles_image(plan, camera, ask.samples, seed) for seed in (1, 2)]
            one, other = (image @ weights for image in seeds)
            bands = _apart(
                grey_scene.eevee_image(plan, camera, _DEPTH) @ weights, (one + other) / 2
            )
            realtime = _apart(_realtime(plan, camera), (one + other) / 2)
        rows.append([name, *energy, *map(_cells, (bands, realtime, _apart(one, other) / 2))])
        medians += [float(np.median(x)) for x in (bands, realtime)]
        highest += [float(np.quantile(x, 0.95)) for x in (bands, realtime)]
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
