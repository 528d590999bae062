"""Every way to draw the grey scene, against the Cycles reference.

As it ships: default phase function, clear sky; once as the papers have it.
``python3 dev.py run -m benchmarks realtime_accuracy`` writes
docs/realtime_accuracy.md and docs/realtime_accuracy.png.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import engines, render_plan, water_body
from ..uw_spectral.baselines.monzon import path_radiance_Monzon2024_corrected
from ..uw_spectral.spectra.colour_rendering import (
    delta_e_CIE2000_images,
    srgb_encode,
    srgb_rmse,
)
from ..uw_spectral.spectra.spectral_image import read_exr, replacing
from . import baselines, grey_scene

WIDTH, HEIGHT, OVERSAMPLING = 90, 54, 3
_BLOCK = 9
_EEVEE_SAMPLES = 16


@dataclass(frozen=True, eq=False)
class Result:
    """Pictures of one combination by method, as scene-linear RGB within the display's range."""

    water: str
    depth: float
    light: grey_scene.Light
    reference: NDArray[np.float64]
    noise: float
    delta_e_noise: float
    pictures: dict[str, NDArray[np.float64]]

    @property
    def title(self) -> str:
        """Water and depth, and the light where it is not the default."""
        other = "" if self.light == grey_scene.CLEAR else f", {self.light.title}"
        return f"{self.water} {self.depth:g} m{other}"

    def rmse(self, method: str) -> float:
        """RMSE in sRGB with the variance of the reference taken off."""
        squared = srgb_rmse(self.pictures[method], self.reference) ** 2 - self.noise**2
        return math.sqrt(max(squared, 0.0))

    def delta_e(self, method: str) -> float:
        """Mean ΔE2000 over blocks of pixels."""
        return _delta_e(self.pictures[method], self.reference)

    def save(self, path: Path) -> None:
        """Keep the result in a file; :meth:`load` reads it."""
        pictures = {f"picture {name}": image for name, image in self.pictures.items()}
        facts = np.array([self.depth, self.noise, self.delta_e_noise])
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(
                file, water=self.water, facts=facts, reference=self.reference, **pictures
            )

    @classmethod
    def load(cls, path: Path, light: grey_scene.Light) -> Result:
        """Read what :meth:`save` wrote."""
        with np.load(path) as kept:
            pictures = {k[8:]: kept[k] for k in kept.files if k.startswith("picture ")}
            depth, noise, delta_e_noise = (float(x) for x in kept["facts"])
            reference = kept["reference"]
            return cls(str(kept["water"]), depth, light, reference, noise, delta_e_noise, pictures)


def measure(water: str, depth: float, light: grey_scene.Light, samples: int, bands: int) -> Result:
    """Render one combination by every method."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(depth, WIDTH, HEIGHT)
    plan = grey_scene.plan_for(water, depth, bands, light)
    develop = plan.reduction(depth).apply
    halves = [
        _displayable(develop(grey_scene.cycles_image(plan, camera, samples, seed)))
        for seed in (1, 2)
    ]
    hits = grey_scene.trace(plan.column.sun_direction, WIDTH, HEIGHT, OVERSAMPLING)
    closed = grey_scene.closed_form_image(
        plan.column, plan.phase, depth, WIDTH, HEIGHT, OVERSAMPLING
    )
    three = baselines.rgb_plan(plan.settings)
    pictures = {
        **_eevee(plan, camera, depth),
        "closed form, numpy": develop(closed),
        **{
            name: develop(_pixels(baselines.paper_image(plan, hits, depth, form)))
            for name, form in baselines.PAPER_FORMS.items()
        },
        "paper, corrected, RGB": baselines.as_rgb(
            three,
            depth,
            _pixels(baselines.paper_image(three, hits, depth, path_radiance_Monzon2024_corrected)),
        ),
        "fog, RGB": baselines.as_rgb(
            three, depth, _pixels(baselines.fog_image(three, hits, depth))
        ),
    }
    return Result(
        water,
        depth,
        light,
        (halves[0] + halves[1]) / 2,
        srgb_rmse(*halves) / 2,
        _delta_e(*halves) / 2,
        {name: _displayable(picture) for name, picture in pictures.items()},
    )


def redraw(result: Result, bands: int) -> Result:
    """Draw EEVEE's pictures again, against the same reference."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(result.depth, WIDTH, HEIGHT)
    plan = grey_scene.plan_for(result.water, result.depth, bands, result.light)
    drawn = _eevee(plan, camera, result.depth)
    shown = {name: _displayable(picture) for name, picture in drawn.items()}
    return replace(result, pictures={**shown, **result.pictures, **shown})


def _eevee(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, depth: float
) -> dict[str, NDArray[np.float64]]:
    shafts, bare = (
        replace(plan, settings=replace(plan.settings, **change))
        for change in ({"shafts": True}, {"diffuse_shadows": False})
    )
    return {
        "EEVEE, real time": _realtime(plan, camera, depth),
        "EEVEE, real time, shafts": _realtime(shafts, camera, depth),
        "EEVEE, real time, no diffuse shadows": _realtime(bare, camera, depth),
        "EEVEE, bands": plan.reduction(depth).apply(_bands(plan, camera, depth)),
    }


def _realtime(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, depth: float
) -> NDArray[np.float64]:
    scene = bpy.context.scene
    plan = replace(plan, settings=replace(plan.settings, samples=_EEVEE_SAMPLES))
    extent = water_body.water_extent(scene, plan.column, depth)
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(scene, camera, plan, extent, depth) as engine,
    ):
        path = Path(folder) / "picture.exr"
        engine.frame(plan, depth)(engine.passes[0], path)
        return read_exr(path)[0].astype(np.float64)


def _bands(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, depth: float
) -> NDArray[np.float64]:
    scene = bpy.context.scene
    plan = replace(plan, settings=replace(plan.settings, samples=_EEVEE_SAMPLES))
    extent = water_body.water_extent(scene, plan.column, depth)
    with engines.eevee_bands(scene, camera, plan, extent, depth) as engine:
        return grey_scene.band_image(engine, plan, depth)


def _pixels(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(rays, OVERSAMPLING)


def _displayable(picture: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.clip(picture, 0.0, 1.0)


def _delta_e(picture: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    blocks = [grey_scene.blocks(image, _BLOCK) for image in (picture, reference)]
    return float(delta_e_CIE2000_images(*blocks).mean())


def report(results: Sequence[Result], samples: int, bands: int) -> str:
    """Return the tables as Markdown."""
    methods = list(results[0].pictures)
    clear = [result.light == grey_scene.CLEAR for result in results]
    lines = [
        "# Real time against the reference",
        "",
        f"The grey scene, {bands} bands, CIE 1931, default phase function, clear sky with its",
        "spectrum, sun at 30°, no surface, floor 3 m below the camera; the last column has HG 0.8",
        f"and a black sky, as the papers. Pictures of {WIDTH} × {HEIGHT}, clipped to the display's",
        f"range. Reference: two Cycles images of {samples} samples, whose noise is taken off the",
        f"RMSE. ΔE2000 over blocks of {_BLOCK} × {_BLOCK} pixels. The paper's forms get the Kd of",
        "Solonenko & Mobley (2015), the fog the colour of the closed form.",
        "",
    ]
    for title, value in (("sRGB RMSE", Result.rmse), ("ΔE2000, mean", Result.delta_e)):
        head = " | ".join(result.title for result in results)
        lines += [
            f"## {title}",
            "",
            f"| method | {head} | mean, clear sky |",
            "|---|" + "---|" * (len(results) + 1),
        ]
        for method in methods:
            values = np.array([value(result, method) for result in results])
            cells = " | ".join(f"{v:.3f}" for v in values)
            lines.append(f"| {method} | {cells} | **{values[clear].mean():.3f}** |")
        noise = [r.noise if value is Result.rmse else r.delta_e_noise for r in results]
        cells = " | ".join(f"{v:.3f}" for v in noise)
        lines += [f"| noise of the reference | {cells} | |", ""]
    lines += ["![Every method, every combination](realtime_accuracy.png)", ""]
    lines += ["Repeat: `python3 dev.py run -m benchmarks realtime_accuracy`", ""]
    return "\n".join(lines)


def picture_sheet(results: Sequence[Result], path: Path) -> None:
    """Draw the reference and every method, a row per combination."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    methods = list(results[0].pictures)
    columns = 1 + len(methods)
    figure, axes = plt.subplots(
        len(results), columns, figsize=(1.6 * columns, 1.05 * len(results)), squeeze=False
    )
    for row, result in zip(axes, results, strict=True):
        row[0].set_ylabel(result.title.replace(", ", ",\n"), fontsize=7)
        images = [result.reference, *result.pictures.values()]
        for axis, image in zip(row, images, strict=True):
            axis.imshow(srgb_encode(image))
            axis.set(xticks=[], yticks=[])
    for axis, title in zip(axes[0], ["Cycles", *methods], strict=True):
        axis.set_title(title.replace(", ", ",\n"), fontsize=7)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=90)


def main(arguments: Sequence[str]) -> None:
    """Measure the cases of the grey scene and write the report."""
    parser = argparse.ArgumentParser(prog="realtime_accuracy")
    parser.add_argument("--samples", type=int, default=160)
    parser.add_argument("--bands", type=int, default=8)
    parser.add_argument(
        "--redraw", action="store_true", help="EEVEE's pictures again, against kept references"
    )
    parser.add_argument(
        "--keep",
        type=Path,
        default=Path("out/realtime_accuracy"),
        help="folder of finished combinations; delete it to measure again",
    )
    options = parser.parse_args(arguments)
    docs = Path(__file__).resolve().parent.parent / "docs"
    results = []
    options.keep.mkdir(parents=True, exist_ok=True)
    for water, depth, light in grey_scene.CASES:
        name = f"{water}_{depth:g}m_{light.phase.split(':')[0]}"
        kept = options.keep / f"{name}_{options.samples}_{options.bands}.npz"
        if not kept.exists():
            measure(water, depth, light, options.samples, options.bands).save(kept)
        elif options.redraw:
            redraw(Result.load(kept, light), options.bands).save(kept)
        results.append(Result.load(kept, light))
        last = results[-1]
        found = {m: (round(last.rmse(m), 4), round(last.delta_e(m), 2)) for m in last.pictures}
        print(f"{last.title}: {found}", flush=True)
    picture_sheet(results, docs / "realtime_accuracy.png")
    text = report(results, options.samples, options.bands)
    (docs / "realtime_accuracy.md").write_text(text, encoding="utf-8")
