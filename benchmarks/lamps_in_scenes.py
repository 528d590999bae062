"""Lamps in EEVEE's water against paths of light and Cycles: torches, strobes, vehicles, a wreck."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..scene.readers.lamps import plan_lamps
from ..uw_spectral.spectra.colour_rendering import srgb_encode
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.water.phase import BandPhase
from ..validation import lamp_photons, lamp_room
from . import grey_scene
from ._lamp_scenes import FIELD_OF_VIEW, LitPlace, add_lamp, places, sand_room
from ._places import HEIGHT, WIDTH, Compared, sheet
from .runner import Ask, Page, Target, joined, spread, table

_COUNTS = (0, 1, 4, 16, 32)
BLOCK, COARSER = 3, (3, 4)  # pixels; blocks
CUT = math.radians(3.0)  # of the peak of the phase function


def _blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(image, BLOCK)


VIEW = lamp_room.View(
    HEIGHT // BLOCK, WIDTH // BLOCK, BLOCK * 2.0 * math.tan(FIELD_OF_VIEW / 2.0) / WIDTH
)
SEEN = "water", "sand", "ball", "box", "before it"


def by_paths(place: LitPlace, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Band radiances of blocks, shape (h, w, n, BATCHES)."""
    assert place.room is not None, "paths know only rooms"
    plan = place.plan(1)
    lamps = [
        replace(lamp, position=tuple(Vector(lamp.position) - camera.matrix_world.translation))
        for lamp in plan_lamps(bpy.context.scene, plan).lamps
    ]
    reflectance = np.clip(place.room.colours @ uplift_basis(plan.bands).T, 0.0, 1.0)
    found = []
    for band in range(len(plan.bands)):
        one = BandPhase(plan.phase.components, plan.phase.weights[:, band : band + 1])
        phase, kept = lamp_room.cut(lamp_photons.tables_of(one), CUT)
        water = float(plan.column.absorption[band]), kept * float(plan.column.scattering[band])
        light = lamp_room.traced(
            VIEW, lamps, water, phase, place.room, reflectance[:, band], band, place.paths
        )
        found.append(light * lamps[0].intensity[band])
    return np.stack(found, axis=2)


def _batches(place: LitPlace, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Return the blocks of the place's reference, as often as it has independent parts."""
    if place.room is None:
        return np.stack([_blocks(image) for image in place.by_cycles(camera)])
    return np.moveaxis(by_paths(place, camera), -1, 0)


def _of_seen(
    room: lamp_room.Room, blocks: NDArray[np.float64], batches: NDArray[np.float64]
) -> list[str]:
    """EEVEE over the reference by what is seen and band, of :data:`SEEN`, with its error."""
    items = lamp_room.seen_first(VIEW, room)
    box = 1 + len(room.ellipsoids)
    kinds = np.select([items == -1, items == 0, items == 1, items == box], range(4), 4)
    found = []
    for kind in range(len(SEEN)):
        there = kinds == kind
        if not there.any():
            found.append("")
            continue
        sums = batches[:, there].sum(axis=1)
        ratio = blocks[there].sum(axis=0) / sums.mean(axis=0)
        error = sums.std(axis=0, ddof=1) / math.sqrt(len(sums)) / sums.mean(axis=0)
        found.append(f"{joined(ratio)} ± {error.max():.2f}")
    return found


def seconds_of_frames(counts: Sequence[int]) -> dict[int, float]:
    """CPU seconds of a frame in EEVEE by the number of lamps, after one that compiles."""
    found = {}
    for count in counts:
        place = LitPlace("cost", sand_room, "II", settings={})
        camera = place.open()
        for index in range(count):
            add_lamp((0.2 * index - 0.7, 0.0, 0.3), (math.pi / 2.0, 0.0, 0.0))
        bpy.context.view_layer.update()
        found[count] = min(place.timed(camera, time.process_time)[1] for _ in range(2))
    return found


def measure(ask: Ask) -> Mapping[str, object]:
    """Measure every place."""
    ask.shown("lamps.jpg")  # makes the folder
    rows, seen, drawn, means = [], [], {}, []
    for place in places(ask.folder)[: ask.places]:
        camera = place.open()
        develop = place.develop(camera)
        eevee = place.by_eevee(camera)
        batches = ask.kept(place.name, lambda p=place, c=camera: _batches(p, c))
        halves = np.stack([batches[first::2].mean(axis=0) for first in range(2)])
        open_water = _blocks(np.isinf(place.distance(camera))[..., None] * 1.0)[..., 0] == 1.0
        blocks = _blocks(eevee)
        # Blocks lie together before a display clips them, for paths are noisy.
        fine, coarse = (
            Compared(develop(np.stack([grey_scene.blocks(x, n) for x in halves])),
                     {"EEVEE": develop(grey_scene.blocks(blocks, n))}, 1)
            for n in (1, COARSER)
        )  # fmt: skip
        off, far = fine.delta_e("EEVEE"), coarse.delta_e("EEVEE")
        water = 100 * np.abs(blocks / halves.mean(axis=0) - 1.0)[open_water]
        noises = fine.noise.mean(), coarse.noise.mean()
        numbers = (off.mean(), np.quantile(off, 0.95), noises[0], far.mean(), noises[1])
        rows.append([place.name, *(f"{x:.2f}" for x in numbers),
                     f"{100 * (blocks.mean() / halves.mean() - 1.0):+.0f} %",
                     f"{spread(water, '.0f')} %" if water.size else ""])  # fmt: skip
        means.append(float(far.mean()))
        if place.room is not None:
            seen.append([place.name, *_of_seen(place.room, blocks, batches)])
        images = (halves.mean(axis=0), blocks, eevee)
        drawn[place.name] = [srgb_encode(np.clip(develop(x), 0.0, 1.0)) for x in images]
        print(*rows[-1], sep=" | ", flush=True)
    sheet(ask.shown("lamps.jpg"), drawn, ("reference", "EEVEE in blocks", "EEVEE"))
    seconds = seconds_of_frames(_COUNTS[: ask.counts])
    costs = [[n, f"{x:.2f}", f"{x / seconds[0]:.2f}"] for n, x in seconds.items()]
    heads = ("scene", "mean", "95 %", "noise", "coarse", "its noise", "bright", "backscatter")
    return {
        "rows": table(heads, rows), "seen": table(("scene", *SEEN), seen), "worst": max(means),
        "costs": table(("lamps", "CPU s", "over none"), costs),
    }  # fmt: skip


PAGE = Page(
    "Lamps in EEVEE's water",
    """
How it is done is in [physics.md](../physics.md#lamps); the formulas alone are measured against
photons in [lamp_light.md](lamp_light.md).

## Against paths of light and Cycles
Default phase function, flat surface, 3 bands, night (or sun and sky at a twentieth), 15 m deep over
sand, 48 × 27 pixels. The reference are paths of light from the camera, 240 000 for each block of
3 × 3 pixels and band, in I 40 000 (`validation/lamp_room.py`; scattering by less than 3° counts as
none), of the last two scenes Cycles with two seeds of 256 samples. ΔE2000 of these blocks, and the
reference's noise in it; *coarse*: blocks of 12 × 9, in which the noise adds by squares;
*backscatter*: open water alone, median/95 %/worst relative error by block and band. Wanted: a mean
of 2.

{rows}

EEVEE over the reference by what is seen, in the three bands, with the reference's standard error in
the worst of them; *before it*: on what is before the lamp. Wanted: 0.9 to 1.1.

{seen}

Light scattered often that has to find its way round an object is up to twice too bright right
before it (ball and fish in II): what reaches a place is known as a fraction of all, and not that it
comes from aside, from where less of it is scattered on to the camera.

In I what objects throw back makes water round a hidden lamp up to 1.3 times too bright (with black
objects 1.03, third band behind the fish).

## Seconds of a frame
CPU seconds on the software rasteriser, 48 × 27, the less of two, sun on; 6 lamps more stand for
what objects reflect.

{costs}

![Reference, EEVEE in blocks, EEVEE](lamps.jpg)
""",
    (Target("mean ΔE2000 of coarse blocks, worst", "worst", 2.0),),
    {"places": 99, "counts": 99},
    ("examples",),
)
