"""Light that lamps excite by night, EEVEE against Cycles, in bands that no lamp shines in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial

import bpy
import numpy as np

from . import grey_scene
from ._lamp_scenes import (
    DEPTH,
    FISH,
    FISH_AXES,
    LitPlace,
    add_lamp,
    behind,
    sand_room,
    strobes,
    torch,
    vehicle,
)
from ._places import Compared
from .runner import Ask, Page, Target, spread, table

_BLOCK = 3  # pixels
_BRIGHT = 0.8  # green of 95 % of the picture is darker
_BLUE = "led:450,20"
_SETTINGS: Mapping[str, object] = {"sunlight": 0.0, "exposure": "0"}


def _point() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((-0.8, 1.0, 0.4), (0.0, 0.0, 0.0))
    bpy.data.lights["Lamp"].type = "POINT"
    return camera


_SCENES: tuple[tuple[str, Callable[[], bpy.types.Object], str, str], ...] = (
    ("point lamp", _point, "bio:chl=5,cdom=0.3", "all"),
    ("torch across", partial(torch, (0.9, 5.0, 0.5), 0.75 * math.pi), "jerlov:IB", "raman"),
    ("torch along", partial(torch, (0.25, 0.0, -0.1), 0.0, 8000.0), "bio:chl=5", "chlorophyll"),
    ("strobe pair", strobes, "bio:chl=2,cdom=0.4", "cdom"),
    ("vehicle with four lamps", vehicle, "bio:chl=0.3", "all"),
    ("behind a fish", partial(behind, (0.0, 5.2, 0.1), [(FISH, FISH_AXES)]), "bio:chl=1", "all"),
)


def _lit(build: Callable[[], bpy.types.Object]) -> bpy.types.Object:
    camera = build()
    for light in bpy.data.lights:
        light.underwater.spectrum = _BLUE
    return camera


def measure(ask: Ask) -> Mapping[str, object]:
    """Measure every scene."""
    rows, means = [], []
    for name, build, water, inelastic in _SCENES[: ask.scenes]:
        settings = {**_SETTINGS, "water": water, "inelastic": inelastic}
        place = LitPlace(name, partial(_lit, build), samples=ask.samples, settings=settings)
        camera = place.open()
        halves = ask.kept(f"{name} {ask.samples}", lambda p=place, c=camera: p.by_cycles(c))
        both, eevee = halves.mean(axis=0)[..., 1:], place.by_eevee(camera)[..., 1:]
        # Of the bands that no lamp shines in, exposed for them.
        weights = place.plan(1).reduction(DEPTH).weights.T[1:]
        gain = _BRIGHT / np.quantile((both @ weights)[..., 1], 0.95)
        found = Compared(
            gain * (halves[..., 1:] @ weights), {"EEVEE": gain * (eevee @ weights)}, _BLOCK
        )
        off = found.delta_e("EEVEE")
        ratio = grey_scene.blocks(eevee, _BLOCK) / grey_scene.blocks(both, _BLOCK)
        means.append(float(off.mean()))
        rows.append([
            name, f"{water}, {inelastic}", spread(off), f"{off.mean():.2f}",
            f"{found.noise.mean():.2f}",
            *(spread(ratio[..., band]) for band in range(ratio.shape[-1])),
        ])  # fmt: skip
        print(*rows[-1], sep=" | ", flush=True)
    heads = ("scene", "water, light", "ΔE", "mean", "noise", "middle band", "longest band")
    return {"rows": table(heads, rows), "worst": max(means)}


PAGE = Page(
    "What lamps excite, by night",
    """
Sand, a ball, a box and open water 15 m deep, lit by diodes of 450 nm alone, 48 × 27 pixels, 3
bands; of these the two that no lamp shines in, as a camera would see them that is exposed for them,
by EEVEE and by Cycles (two images of {samples} samples, a quarter of them for what is emitted).
ΔE2000 of blocks of 3 × 3 pixels, median/95 %/worst, mean, and Cycles' noise in it; EEVEE over
Cycles by block.

{rows}
""",
    (Target("mean ΔE2000, worst scene", "worst", 2.0),),
    {"scenes": 99, "samples": 128},
)
