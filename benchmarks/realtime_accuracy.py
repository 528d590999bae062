"""Every way to draw the grey scene, against the Cycles reference."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..settings import render_plan
from ..uw_spectral.spectra.colour_rendering import srgb_encode
from ..validation.colour_errors import srgb_rmse
from ..validation.monzon import path_radiance_Monzon2024_corrected
from . import baselines, grey_scene
from ._places import Compared, realtime, sheet
from ._scenery import new_file
from .runner import Ask, Page, Target, spread, table

WIDTH, HEIGHT, OVERSAMPLING = 90, 54, 3
_SQUARE, _BLOCK = 3, 9
_EEVEE_SAMPLES = 16
_SHIPPED = "EEVEE, real time"
_SEEN = 0.8  # ΔE2000 that half of all observers see, ISO/TR 28642:2016


@dataclass(frozen=True, eq=False)
class Result(Compared):
    """Pictures of one combination by method, as scene-linear RGB.

    Squares of pixels are averaged before they are clipped to the display's range and encoded:
    clipping and the display's curve move the mean of noise.
    """

    title: str = ""

    def rmse(self, method: str) -> float:
        """RMSE in sRGB of squares of pixels, with the variance of the reference taken off."""
        found, noise = (
            srgb_rmse(*(grey_scene.blocks(x, _SQUARE) for x in pair))
            for pair in ((self.pictures[method], self.reference), self.halves)
        )
        return _without(found, noise / 2)

    def rms_delta_e(self, method: str) -> float:
        """Root mean square ΔE2000 of blocks, with that of the reference's noise taken off."""
        return _without(_rms(self.delta_e(method)), _rms(self.noise))


def drawn(water: str, depth: float, ask: Ask) -> Result:
    """Render one combination by every method."""
    new_file()
    camera = grey_scene.build_scene(depth, WIDTH, HEIGHT)
    plan = grey_scene.plan_for(water, depth, ask.bands)
    develop = plan.reduction(depth).apply
    title = f"{water} {depth:g} m"
    halves = ask.kept(title, lambda: grey_scene.cycles_images(plan, camera, ask.samples))
    hits = grey_scene.trace(plan.column.sun_direction, WIDTH, HEIGHT, OVERSAMPLING)
    numpy = (plan.column, plan.phase, depth, (WIDTH, HEIGHT), OVERSAMPLING)
    three = baselines.rgb_plan(plan.settings)
    by_formula = {
        name: develop(_pixels(baselines.paper_image(plan, hits, depth, form)))
        for name, form in baselines.PAPER_FORMS.items()
    }
    in_rgb = {
        "paper, corrected, RGB":
            baselines.paper_image(three, hits, depth, path_radiance_Monzon2024_corrected),
        "fog, RGB": baselines.fog_image(three, hits, depth),
    }  # fmt: skip
    pictures = {
        **_eevee(plan, camera, depth),
        "solved, numpy": develop(grey_scene.solved_image(*numpy)),
        "closed form, numpy": develop(grey_scene.closed_form_image(*numpy)),
        **by_formula,
        **{name: baselines.as_rgb(three, depth, _pixels(x)) for name, x in in_rgb.items()},
    }
    return Result(np.stack([develop(x) for x in halves]), pictures, _BLOCK, title=title)


def _eevee(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, depth: float
) -> dict[str, NDArray[np.float64]]:
    plan = replace(plan, settings=replace(plan.settings, samples=_EEVEE_SAMPLES))
    shafts, bare = (
        replace(plan, settings=replace(plan.settings, **change))
        for change in ({"shafts": True}, {"diffuse_shadows": False})
    )
    return {
        _SHIPPED: realtime(plan),
        "EEVEE, real time, shafts": realtime(shafts),
        "EEVEE, real time, no diffuse shadows": realtime(bare),
        "EEVEE, bands": plan.reduction(depth).apply(grey_scene.eevee_image(plan, camera)),
    }


def _pixels(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(rays, OVERSAMPLING)


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(values**2)))


def _without(found: float, noise: float) -> float:
    return math.sqrt(max(found**2 - noise**2, 0.0))


def measure(ask: Ask) -> Mapping[str, object]:
    """Render the combinations; tails are of those whose reference's noise does not show."""
    results = [drawn(*each, ask) for each in grey_scene.COMBINATIONS[: ask.cases]]
    pictures = {
        x.title: [srgb_encode(p) for p in (x.reference, *x.pictures.values())] for x in results
    }
    titles = ["Cycles", *results[0].pictures]
    sheet(ask.shown("realtime_accuracy.jpg"), pictures, [t.replace(", ", ",\n") for t in titles])
    still = [r for r in results if np.quantile(r.noise, 0.95) <= _SEEN]
    rows = []
    for method in results[0].pictures:
        rmse, off = ([of(r, method) for r in results] for of in (Result.rmse, Result.rms_delta_e))
        blocks = np.stack([r.delta_e(method) for r in still or results])
        numbers = (np.mean(rmse), max(rmse), np.mean(off), max(off))
        rows.append([method, *(f"{x:.3f}" for x in numbers), *spread(blocks).split("/"),
                     f"{100 * np.mean(blocks <= _SEEN):.0f} %"])  # fmt: skip
    off = {r.title: r.rms_delta_e(_SHIPPED) for r in results}
    worst = max(off, key=off.__getitem__)
    heads = ("method", "sRGB RMSE, mean", "worst", "ΔE2000, mean", "worst", "blocks: median",
             "95 %", "worst", "up to 0.8")  # fmt: skip
    return {
        "rows": table(heads, rows),
        "middle": float(np.median(list(off.values()))),
        "worst": off[worst],
        "where": worst,
        "still": ", ".join(r.title for r in still),
        "noise": spread([r.noise for r in still or results]).replace("/", ", "),
    }


PAGE = Page(
    "Real time against the reference",
    """
The grey scene, a sphere over a grey floor, in 3C 3 m, 3C 9 m, I 5 m, IA 9 m, IB 5 m, II 3 m, 8
bands, clear sky, sun at 30°, no surface; pictures of 90 × 54 against two Cycles images of {samples}
samples, their noise taken off the squares but not off single blocks. sRGB RMSE of squares of 3 × 3
pixels, ΔE2000 of blocks of 9 × 9. The paper's forms get the Kd of Solonenko & Mobley (2015).
EEVEE's worst blocks are the sphere's shadow on the floor and the water above the sphere
([occlusion.md](occlusion.md)).

EEVEE as it ships is off by ΔE2000 {middle:.2f} in the median of the pictures and {worst:.2f} at
worst ({where}); 0.8 is what half of all observers see (ISO/TR 28642:2016). Blocks are those of
{still}, where the reference's noise does not show: alone it makes {noise} in the median, at 95 %
and at worst.

{rows}

The occlusion that EEVEE draws is too bright in the **far red**: in IB it equals the tables to 0.1 %
without it, and is 2 % (531 nm), 17 % (606 nm) and 38 % (681 nm) brighter with it.

![Every method, every combination](realtime_accuracy.jpg)
""",
    (
        Target("ΔE2000 of EEVEE, median of the pictures", "middle", 0.8),
        Target("ΔE2000 of EEVEE, worst picture", "worst", 0.8),
    ),
    {"samples": 160, "bands": 8, "cases": 99},
)
