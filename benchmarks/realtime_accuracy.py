"""Every way to draw the grey scene, against the Cycles reference.

As it ships: default phase function, clear sky; once as the papers have it.
``python3 dev.py run -m benchmarks realtime_accuracy`` writes
docs/measured/realtime_accuracy.md and docs/measured/realtime_accuracy.jpg.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.water import water_body
from ..settings import render_plan
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import read_exr, replacing
from ..validation.colour_errors import srgb_rmse
from ..validation.monzon import path_radiance_Monzon2024_corrected
from . import baselines, grey_scene
from ._outside import MET, MISSED, PARTLY

WIDTH, HEIGHT, OVERSAMPLING = 90, 54, 3
_SQUARE, _BLOCK = 3, 9
_EEVEE_SAMPLES = 16
_SHIPPED = "EEVEE, real time"
_SEEN = 0.8  # ΔE2000 that half of all observers see, ISO/TR 28642:2016


@dataclass(frozen=True, eq=False)
class Result:
    """Pictures of one combination by method, as scene-linear RGB.

    ``halves`` are two references of independent noise, shape (2, h, w, 3).
    Squares of pixels are averaged before they are clipped to the display's range and
    encoded: clipping and the display's curve move the mean of noise.
    """

    water: str
    depth: float
    light: grey_scene.Light
    halves: NDArray[np.float64]
    pictures: dict[str, NDArray[np.float64]]

    @property
    def reference(self) -> NDArray[np.float64]:
        """Mean of the halves, shape (h, w, 3)."""
        return self.halves.mean(axis=0)

    @property
    def title(self) -> str:
        """Water and depth, and the light where it is not the default."""
        other = "" if self.light == grey_scene.CLEAR else f", {self.light.title}"
        return f"{self.water} {self.depth:g} m{other}"

    def rmse(self, method: str) -> float:
        """RMSE in sRGB of squares of pixels, with the variance of the reference taken off."""
        found = srgb_rmse(*(_squares(x) for x in (self.pictures[method], self.reference)))
        return _without(found, self.rmse_noise())

    def rmse_noise(self) -> float:
        """RMSE in sRGB that the reference's noise makes."""
        return srgb_rmse(*(_squares(half) for half in self.halves)) / 2

    def delta_e(self, method: str) -> float:
        """Root mean square ΔE2000 of blocks, with that of the reference's noise taken off."""
        return _without(_rms(self.delta_e_blocks(method)), self.delta_e_noise())

    def delta_e_noise(self) -> float:
        """Root mean square ΔE2000 of blocks that the reference's noise makes."""
        return _rms(self.delta_e_noise_blocks())

    def delta_e_blocks(self, method: str) -> NDArray[np.float64]:
        """ΔE2000 of blocks of pixels; the noise of the reference is in it."""
        return _delta_e(self.pictures[method], self.reference)

    def delta_e_noise_blocks(self) -> NDArray[np.float64]:
        """ΔE2000 of blocks that the reference's noise makes."""
        return _delta_e(*self.halves) / 2

    def save(self, path: Path) -> None:
        """Keep the result in a file; :meth:`load` reads it."""
        pictures = {f"picture {name}": image for name, image in self.pictures.items()}
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(
                file, water=self.water, depth=self.depth, halves=self.halves, **pictures
            )

    @classmethod
    def load(cls, path: Path, light: grey_scene.Light) -> Result:
        """Read what :meth:`save` wrote."""
        with np.load(path) as kept:
            pictures = {k[8:]: kept[k] for k in kept.files if k.startswith("picture ")}
            return cls(str(kept["water"]), float(kept["depth"]), light, kept["halves"], pictures)


def measure(water: str, depth: float, light: grey_scene.Light, samples: int, bands: int) -> Result:
    """Render one combination by every method."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(depth, WIDTH, HEIGHT)
    plan = grey_scene.plan_for(water, depth, bands, light)
    develop = plan.reduction(depth).apply
    halves = [develop(grey_scene.cycles_image(plan, camera, samples, seed)) for seed in (1, 2)]
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
    return Result(water, depth, light, np.stack(halves), pictures)


def redraw(result: Result, bands: int) -> Result:
    """Draw EEVEE's pictures again, against the same reference."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(result.depth, WIDTH, HEIGHT)
    plan = grey_scene.plan_for(result.water, result.depth, bands, result.light)
    return replace(result, pictures=result.pictures | _eevee(plan, camera, result.depth))


def _eevee(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, depth: float
) -> dict[str, NDArray[np.float64]]:
    shafts, bare = (
        replace(plan, settings=replace(plan.settings, **change))
        for change in ({"shafts": True}, {"diffuse_shadows": False})
    )
    return {
        _SHIPPED: _realtime(plan, camera, depth),
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


def _squares(picture: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(picture, _SQUARE)


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(values**2)))


def _without(found: float, noise: float) -> float:
    return math.sqrt(max(found**2 - noise**2, 0.0))


def _delta_e(picture: NDArray[np.float64], reference: NDArray[np.float64]) -> NDArray[np.float64]:
    blocks = [np.clip(grey_scene.blocks(x, _BLOCK), 0.0, 1.0) for x in (picture, reference)]
    return delta_e_CIE2000_images(*blocks)


def _clear(results: Sequence[Result]) -> list[Result]:
    return [result for result in results if result.light == grey_scene.CLEAR]


def quiet(results: Sequence[Result]) -> list[Result]:
    """Return the pictures under a clear sky whose reference's noise does not show."""
    return [r for r in _clear(results) if np.quantile(r.delta_e_noise_blocks(), 0.95) <= _SEEN]


def verdict(results: Sequence[Result]) -> str:
    """Say how far EEVEE is off under a clear sky, and whether it shows."""
    clear, still = _clear(results), quiet(results)
    rmse, delta_e = (
        {r.title: f(r, _SHIPPED) for r in clear} for f in (Result.rmse, Result.delta_e)
    )
    printed = [r.delta_e("paper, printed") for r in clear]
    blocks = np.stack([r.delta_e_blocks(_SHIPPED) for r in still])
    noise = np.stack([r.delta_e_noise_blocks() for r in still])
    share = float(np.mean(blocks <= _SEEN))
    middle, worst = float(np.median(list(delta_e.values()))), max(delta_e, key=delta_e.__getitem__)
    judged = MET if delta_e[worst] <= _SEEN else PARTLY if middle <= _SEEN else MISSED
    dullest = max(rmse, key=rmse.__getitem__)
    sentences = (
        f"Verdict, {judged}: EEVEE as it ships is off by ΔE2000 {middle:.2f} in the median of the",
        f"{len(clear)} pictures under a clear sky and {delta_e[worst]:.2f} at worst ({worst});",
        f"{_SEEN:g} is what half of all observers see (ISO/TR 28642:2016). The sRGB RMSE is",
        f"{np.median(list(rmse.values())):.3f} and {rmse[dullest]:.3f} ({dullest}); the paper's",
        f"formula as printed has ΔE2000 {np.median(printed):.1f} and {max(printed):.1f}. Block by",
        f"block, where the noise does not show ({', '.join(r.title for r in still)}), it is off by",
        f"{np.median(blocks):.2f} in the median, {np.quantile(blocks, 0.95):.2f} at 95 % and",
        f"{blocks.max():.2f} at worst; {100 * share:.0f} % are within {_SEEN:g}. The noise of the",
        f"reference is in these three; alone it makes {np.median(noise):.2f},",
        f"{np.quantile(noise, 0.95):.2f} and {noise.max():.2f}.",
    )
    return _paragraph(sentences)


def _paragraph(sentences: Sequence[str]) -> str:
    return textwrap.fill(" ".join(sentences), 100, break_on_hyphens=False)


def _table(results: Sequence[Result]) -> list[str]:
    """Tabulate the errors under a clear sky by method; tails are of blocks that show no noise."""
    clear, still = _clear(results), quiet(results)
    lines = [
        "| method | sRGB RMSE, mean | worst | ΔE2000, mean | worst | blocks: median | 95 % | worst "
        f"| up to {_SEEN:g} |",
        "|---" * 9 + "|",
    ]
    for method in still[0].pictures:
        rmse, delta_e = ([f(r, method) for r in clear] for f in (Result.rmse, Result.delta_e))
        blocks = np.stack([r.delta_e_blocks(method) for r in still])
        lines.append(
            f"| {method} | {np.mean(rmse):.3f} | {max(rmse):.3f} | {np.mean(delta_e):.3f} "
            f"| {max(delta_e):.3f} | {np.median(blocks):.2f} | {np.quantile(blocks, 0.95):.2f} "
            f"| {blocks.max():.2f} | {100 * np.mean(blocks <= _SEEN):.0f} % |"
        )
    return [*lines, ""]


def report(results: Sequence[Result], samples: int, bands: int) -> str:
    """Return the tables as Markdown."""
    scene = (
        f"The grey scene in {', '.join(r.title for r in _clear(results))}, {bands} bands, clear",
        f"sky, sun at 30°, no surface; pictures of {WIDTH} × {HEIGHT} against two Cycles images of",
        f"{samples} samples, their noise taken off the squares but not off single blocks. sRGB",
        f"RMSE of squares of {_SQUARE} × {_SQUARE} pixels, ΔE2000 of blocks of {_BLOCK} ×",
        f"{_BLOCK}. The",
        "paper's forms get the Kd of Solonenko & Mobley (2015). EEVEE's worst blocks are the",
        "sphere's shadow on the floor and the water above the sphere ([shade.md](shade.md)).",
    )
    lines = [
        "# Real time against the reference",
        "",
        _paragraph(scene),
        "",
        verdict(results),
        "",
    ]
    lines += _table(results)
    lines += ["![Every method, every combination](realtime_accuracy.jpg)", ""]
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
    figure.savefig(path, dpi=90, pil_kwargs={"quality": 90})


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
    docs = Path(__file__).resolve().parent.parent / "docs" / "measured"
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
    picture_sheet(results, docs / "realtime_accuracy.jpg")
    text = report(results, options.samples, options.bands)
    (docs / "realtime_accuracy.md").write_text(text, encoding="utf-8")
