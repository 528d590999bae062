"""Clouds of bubbles: EEVEE against Cycles, photons, costs, and what is below breakers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..scene.water import new_clouds
from ..settings.render_plan import make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.clouds.matter import BUBBLES
from . import clouds, grey_scene
from ._scenery import new_file
from .clouds import BY_LAMP, COMPARED, PHOTONS, Case
from .runner import Ask, Page, Target, table

_CASES = (
    Case("jerlov:II", 1.0, constituent=BUBBLES),
    Case("jerlov:II", 3.0, constituent=BUBBLES),
    Case("jerlov:IB", 3.0, constituent=BUBBLES),
    Case("jerlov:IB", 10.0, constituent=BUBBLES),
    Case("jerlov:IB", 3.0, watts=400.0, sunlight=0.0, constituent=BUBBLES),
)
_AMOUNTS = (0.5, 2.0, 5.0, 10.0)
_COUNTS = (0, 1, 3, 10)
_PLUME_SIZE = (96, 54)


def plume_row(concentration: float, samples: int) -> list[str]:
    """Compare a plume right below a flat surface, seen from 5 m below it, with Cycles."""
    scene = new_file(_PLUME_SIZE)
    camera = clouds.build(Case("jerlov:IB", 0.0, look=120.0, floor=False))
    camera.data.angle = math.radians(75.0)
    item = new_clouds.add_blob(scene, BUBBLES)
    item.location, item.scale = (0.0, 6.5, -0.2), (1.2, 1.2, 0.4)
    item.underwater.concentration = concentration
    plan = make_plan(SceneSettings(water="jerlov:IB", bands=3, surface="flat", sun_zenith=40.0))
    eevee = grey_scene.eevee_image(plan, camera)
    cycles = grey_scene.cycles_image(plan, camera, samples, 1)
    green = cycles[..., 1]
    open_water = float(np.median(green[-12:]))
    bright = green > 0.5 * float(np.quantile(green, 0.99))
    rows, columns = np.nonzero(bright)
    away = np.hypot(
        (rows - rows.mean()) / max(float(np.ptp(rows)), 1.0),
        (columns - columns.mean()) / max(float(np.ptp(columns)), 1.0),
    )
    middle = tuple(x[away < 0.25] for x in (rows, columns))
    ratios = [f"{eevee[..., 1][x].mean() / green[x].mean():.2f}" for x in (bright, middle)]
    return [f"{concentration:g}", f"{green[bright].mean() / open_water:.0f}", *ratios]


def measure(ask: Ask) -> Mapping[str, object]:
    """Trace, render and time."""
    compared, worst = clouds.compared_rows(_CASES, {2: "bubbles.png"}, ask)
    later = {n: clouds.seconds_of_frames(n, constituent=BUBBLES)[1] for n in _COUNTS[: ask.costs]}

    def litres(heads: tuple[str, ...], rows: list[list[str]]) -> list[str]:
        return table(["l/m³" if head == "g/m³" else head for head in heads], rows)

    return {
        "photons": litres(PHOTONS, [clouds.photons_row(x, BUBBLES) for x in _AMOUNTS]),
        "lamps": litres(BY_LAMP, [clouds.lamp_row(x, BUBBLES) for x in _AMOUNTS]),
        "compared": litres(COMPARED, compared), "worst": worst,
        "seconds": ", ".join(f"{n}: {x:.1f}" for n, x in later.items()),
        "plumes": table(("l/m³", "over open water", "EEVEE / Cycles", "middle"),
                        [plume_row(x, ask.samples) for x in (1.0, 3.0, 10.0, 30.0)[: ask.plumes]]),
    }  # fmt: skip


PAGE = Page(
    "Bubbles",
    """
How they are drawn: [physics](../physics.md#bubbles). Their optics, by the Lorenz-Mie series against
the literature, are in `tests/validation/test_bubbles.py`: b 1.25 1/m of a litre of air in a m³
without diffraction, g 0.676, bb/b 0.0301, at all wavelengths. Cycles draws Henyey-Greenstein's
phase function of the same mean cosine: a blob of an optical depth of 2 in a beam 22° from the
vertical is then .87 as bright level, 1.5 seen down, .74 up and 1.5 towards the sun.

## The closed form of EEVEE against photons
As for [silt](clouds.md#the-light-of-a-blob-against-photons), in a beam and in light from all sides:

{photons}

By a lamp 3 m away:

{lamps}

Along its light it is **too bright**: bubbles throw little straight back.

## EEVEE against Cycles
As for [silt](clouds.md#eevee-against-cycles): ΔE2000 of blocks.

{compared}

![EEVEE, Cycles](bubbles.png)

*By day, type IB, 3 l/m³: EEVEE, and Cycles with its noise.*

## What they cost
CPU seconds as for [silt](clouds.md#what-they-cost), by clouds, later pictures: {seconds}.

## Below breakers
At 5/10/15 m/s whitecaps cover 0.09/0.99/3.93 % (Monahan & O'Muircheartaigh 1980), the top metre has
0.1/1.1/4.3 l/m³ (arXiv:1906.11202, 2019), half axes of plumes are 0.31/0.40/0.40 m (Kalvoda et al.
2003), the optical depth below a m² of foam seconds later is 9.6.

Elsewhere hardly any are seen: 2 m down the void fraction stays below 10^−4.5 up to 27 m/s (Czerski
et al. 2022), b .4 1/m. A plume right below a flat surface, IB, sun at 40°, seen from 5 m below: its
light at 550 nm over open water, and EEVEE over Cycles, all of it and its middle.

{plumes}

They are not put there by themselves: six blobs below the largest whitecaps hold two thirds to three
quarters of the foam within 15 m, but cost more than four times the picture, hang half a metre below
the crests, and stay where foam runs on. *Add Bubble Plumes* puts a few at a frame, with 8 l/m³ at
most: more is hardly brighter, and EEVEE draws it with **a dark middle**.
""",
    (Target("mean ΔE2000 by day, worst case", "worst", 3.0),),
    {"samples": 384, "cases": 99, "costs": 99, "plumes": 99},
)
