"""Enclosed places in EEVEE against denoised Cycles."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import bpy
import numpy as np

from ..scene.engines import engines
from ..scene.engines.band_engine import Opening
from ..scene.water import water_body
from ..settings.scene_settings import BANDS
from ..uw_spectral.spectra.colour_rendering import luminance, srgb_encode
from . import _enclosed_scenes as scenes
from . import grey_scene
from ._denoised import denoised
from ._places import Array, Compared, Place, sheet
from ._scenery import depth_of
from .runner import Ask, Page, Target, table

_SIZE, _BLOCK = (96, 54), 3
_GREY = 0.18  # mean luminance of a picture that is exposed for its place
_NAMES = {
    **{f"house {room}": partial(scenes.house, room) for room in "ABC"},
    "cabin": scenes.cabin, "pipe": scenes.pipe, "grotto": scenes.grotto, "shed": scenes.shed,
    "container": scenes.container, "vault": scenes.vault, "hold": scenes.hold,
}  # fmt: skip


def places(samples: int) -> list[Place]:
    """Return the places."""
    return [
        Place(name, build, samples=samples, size=_SIZE, drawn=32) for name, build in _NAMES.items()
    ]


def by_cycles(place: Place, camera: bpy.types.Object) -> Array:
    """Linear RGB of two seeds, denoised, shape (2, h, w, 3)."""
    scene, plan, depth = bpy.context.scene, place.plan(place.samples), depth_of(camera)
    weights = plan.reduction(depth).weights
    extent = water_body.water_extent(scene, plan.column, depth)
    found = []
    for seed in (1, 2):
        opening = Opening(
            plan, extent, depth, weights, seed=seed, guides=True, froxels=None, device="cpu"
        )
        with engines.engine_of("cycles", BANDS).open(scene, camera, opening) as engine:
            found.append(denoised(engine, plan, depth, weights))
    return np.stack(found)


def compared(place: Place, ask: Ask, **changes: object) -> Compared:
    """Render a place by both; Cycles, unless it is kept."""
    camera = place.open()
    halves = ask.kept(f"{place.name} {place.samples}", partial(by_cycles, place, camera))
    drawn = (
        place.plan(place.drawn, **changes)
        .reduction(depth_of(camera))
        .apply(place.by_eevee(camera, **changes))
    )
    gain = _GREY / luminance(halves).mean()
    return Compared(gain * halves, {"bands": gain * drawn}, _BLOCK)


def measure(ask: Ask) -> Mapping[str, object]:
    """Compare what both make of the places."""
    rows, pictures, errors, off_mean, blocks_ratio = [], {}, [], [], []
    for place in places(ask.samples)[: ask.places]:
        got = compared(place, ask)
        drawn, off = got.pictures["bands"], got.delta_e("bands")
        means = drawn.mean(axis=(0, 1)) / got.reference.mean(axis=(0, 1))
        bright = [grey_scene.blocks(x, _BLOCK)[..., 1] for x in (drawn, got.reference)]
        ratio = np.quantile(bright[0] / bright[1], (0.05, 0.5, 0.95, 1.0))
        errors.append(float(off.mean()))
        off_mean.append(float(np.abs(means - 1.0).max()))
        blocks_ratio.append(float(ratio[-1]))
        rows.append([
            place.name, f"{off.mean():.2f}", f"{np.quantile(off, 0.95):.2f}",
            f"{got.noise.mean():.2f}", *(f"{x:.2f}" for x in means), *(f"{x:.2f}" for x in ratio),
        ])  # fmt: skip
        print(*rows[-1], sep=" | ", flush=True)
        pictures[place.name] = [srgb_encode(np.clip(x, 0.0, 1.0)) for x in (got.reference, drawn)]
    sheet(ask.shown("enclosed_places.jpg"), pictures, ("Cycles", "EEVEE"), across=2)
    heads = ("place", "mean ΔE", "95 %", "noise", "red", "green", "blue", "5 %", "50 %", "95 %",
             "most")  # fmt: skip
    return {
        "rows": table(heads, rows), "mean": max(errors), "off": max(off_mean),
        "most": max(blocks_ratio),
    }  # fmt: skip


PAGE = Page(
    "Enclosed places",
    """
A house of three rooms with walls of .2 m (two windows, two doors, a hole in the roof), a steel
cabin with portholes, a pipe without thickness, a hollow rock with a mouth and a chimney, a shed of
planks, a turned container with an open leaf of its door, a vault on piers with an eye, a tilted
ship's hold with two hatches (`benchmarks/_enclosed_scenes.py`). Jerlov IB, sand at 9 m, flat
surface, clear sky, sun at 30°, 3 bands, 96 × 54; the camera is inside. EEVEE (32 samples) against
denoised Cycles ({samples} samples, two seeds), both exposed for the place; ΔE2000 of blocks of
3 × 3 pixels, *noise* of Cycles in it; means of the channels, and quantiles of green of the blocks,
EEVEE over Cycles.

{rows}

When they were first drawn, before anything was mended for them, the means were 3.1, 5.0, 3.7, 2.6,
9.4, 4.8, 5.1, 5.0, 4.1 and 5.4; with light on patches that face six axes, mixed, for those of 49
directions they were 2.3, 2.9, 2.9, 2.7, 5.4, 4.8, 3.4, 4.9, 3.4 and 4.0: oblique walls had the
light of others; with one spectrum for the light of paths 2.3, 2.9, 2.8, 2.6, 4.9, 3.8, 3.4, 3.9,
2.6 and 3.5. Five places on a ray for three give the pipe 4.6. Without edges of solids, where two
faces meet, house A had 2.8.

![Cycles and EEVEE, in the order of the table](enclosed_places.jpg)
""",
    (
        Target("mean ΔE2000, worst place", "mean", 3.0),
        Target("how far a channel's mean is off, worst place", "off", 0.15),
        Target("green of a block over Cycles, most", "most", 2.0),
    ),
    {"samples": 256, "places": 99},
)
