"""Shade in EEVEE's water against Cycles: a slab, a box, and the example scenes.

``python3 dev.py run -m benchmarks shade`` writes docs/shade.md and docs/shade.jpg.
"""

from __future__ import annotations

import argparse
import runpy
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.surroundings import PROBES, VOXELS, look_around
from ..uw_spectral.shade.probes import RAYS, cast
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing
from . import grey_scene
from ._shade_scenes import BANDS, HEIGHT, WIDTH, Place, box, of_file, slab

FORMS: dict[str, dict[str, object]] = {
    "no shade": {"diffuse_shadows": False, "scene_floor": False},
    "floor of the scene": {"diffuse_shadows": False, "scene_floor": True},
    "shade without that floor": {"diffuse_shadows": True, "scene_floor": False},
    "shade": {"diffuse_shadows": True, "scene_floor": True},
}
_BLOCK = 3
_SEEDS = (1, 2)
_SHADED = 0.5  # of a block: from then on it counts as shaded
_ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True, eq=False)
class Result:
    """Pictures of a place, linear RGB: two of Cycles, and EEVEE's by name."""

    place: Place
    halves: NDArray[np.float64]
    shaded: NDArray[np.bool_]
    pictures: dict[str, NDArray[np.float64]]
    seconds: dict[str, float]

    @property
    def reference(self) -> NDArray[np.float64]:
        """Mean of Cycles' pictures."""
        return self.halves.mean(axis=0)

    @property
    def in_shade(self) -> NDArray[np.bool_]:
        """Blocks that are mostly in shade."""
        return _blocks(self.shaded[..., None].astype(float))[..., 0] > _SHADED

    def delta_e(self, name: str) -> NDArray[np.float64]:
        """ΔE2000 by block."""
        return _delta_e(self.pictures[name], self.reference)

    @property
    def noise(self) -> NDArray[np.float64]:
        """What ΔE2000 the reference's own noise makes, by block."""
        return _delta_e(*self.halves) / 2.0


def _blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(image, _BLOCK)


def _delta_e(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return delta_e_CIE2000_images(*(_blocks(np.clip(x, 0.0, 1.0)) for x in (one, other)))


def places(folder: Path) -> list[Place]:
    """Return the places; the example scenes are built if they are not in the folder."""
    build = runpy.run_path(str(_ROOT / "examples" / "build_scene.py"))["main"]
    found = [Place("slab", slab, samples=512), Place("box", box, samples=1024)]
    for name, samples in (("reef", 512), ("wreck", 1024), ("cave", 2048)):
        file = folder / f"{name}.blend"
        if not file.exists():
            build([name, str(file), "--detail", "draft"])
        found.append(Place(name, of_file(file), samples=samples))
    return found


def measure(place: Place, keep: Path) -> Result:
    """Render a place by Cycles, unless that is kept, and by EEVEE."""
    camera = place.open()
    kept = keep / f"{place.name}_{place.samples}.npy"
    if not kept.exists():
        found = place.by_cycles(camera, _SEEDS)
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, found)
    develop = place.plan(1).reduction(-camera.matrix_world.translation.z).apply
    halves = np.stack([develop(image) for image in np.load(kept)])
    pictures = {name: develop(place.by_eevee(camera, **form)) for name, form in FORMS.items()}
    return Result(place, halves, place.shaded(camera), pictures, _seconds(place, camera))


def _seconds(place: Place, camera: bpy.types.Object) -> dict[str, float]:
    """Seconds of the steps that make a shade, of 8 bands, on the clock."""
    from ..scene import shade

    plan, depth = place.plan(1, bands=8), -camera.matrix_world.translation.z
    field, weights = plan.solved_field(), np.ones((3, len(plan.bands)))
    clearest, marks = float(plan.column.attenuation.min()), [time.perf_counter()]
    around = look_around(bpy.context.scene, camera, clearest)
    found = around.under_things()
    marks.append(time.perf_counter())
    if found is not None:
        cast(*found, -np.asarray(field.sun), around.eyes, around.coarse)
    marks.append(time.perf_counter())
    shade.table_of(around, plan.bands, field, weights, depth)
    marks.append(time.perf_counter())
    surfaces, rays, everything = np.diff(marks)
    return {"surfaces": surfaces, "rays": rays, "all": surfaces + everything}


def _row(result: Result, name: str) -> str:
    error, shaded, noise = result.delta_e(name), result.in_shade, result.noise
    off = np.sqrt(np.maximum(np.mean(error**2) - np.mean(noise**2), 0.0))
    values = (
        error.mean(), np.quantile(error, 0.95), error.max(), error[shaded].mean(),
        error[~shaded].mean(), off, noise.mean(), noise[shaded].mean(),
    )  # fmt: skip
    bright = result.pictures[name].mean() / result.reference.mean() - 1.0
    cells = " | ".join(f"{value:.2f}" for value in values)
    return f"| {result.place.name} | {name} | {cells} | {100 * bright:+.0f} % |"


def report(results: Sequence[Result]) -> str:
    """Return the page."""
    rows = "\n".join(_row(result, name) for result in results for name in FORMS)
    times = "\n".join(
        f"| {r.place.name} | " + " | ".join(f"{s:.2f}" for s in r.seconds.values()) + " |"
        for r in results
    )
    return f"""# Shade in the water

Written by `python3 dev.py run -m benchmarks shade`.

How it is done is in [physics.md](physics.md#shade-between-things): up to {PROBES} probes of {RAYS}
rays each among voxels of a {VOXELS}rd of a probe's cell, around the camera, solved with the
water's own light; the real-time shaders look the result up.

## Against Cycles
Jerlov IB, default phase function, flat surface, clear sky, sun at 30°, {BANDS} bands, CIE 1931;
pictures of {WIDTH} × {HEIGHT}, exposed for the light at the camera. The slab is 8 m wide, 4 m
above sand; the box is open to one side; reef, wreck and cave are the example scenes, draft. All
have a seabed of their own. ΔE2000 of blocks of {_BLOCK} × {_BLOCK} pixels: mean, 95 %, worst, mean
of the blocks that the sun does not reach, mean of the others; root of the mean square with the
noise of Cycles taken off; and that noise itself, of all and of the shaded blocks, which is part of
the other columns. Last, the brightness of the picture.

| scene | EEVEE | mean | 95 % | worst | shaded | lit | without noise | noise | shaded | bright |
|---|---|---|---|---|---|---|---|---|---|---|
{rows}

Wanted were 1.5 in the mean of each scene and 2.5 in shaded pixels.

## Seconds to compute
On two shared cores, 8 bands, the whole once; nothing is kept from frame to frame.

| scene | surfaces | rays | all |
|---|---|---|---|
{times}

![Cycles, no shade, shade](shade.jpg)
"""


def picture_sheet(results: Sequence[Result], path: Path) -> None:
    """Draw the reference and EEVEE without and with shade, a row per place."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    names = ("no shade", "shade")
    figure, axes = plt.subplots(len(results), 3, figsize=(9, 1.75 * len(results)), squeeze=False)
    for row, result in zip(axes, results, strict=True):
        # The dark places are shown brighter, all alike.
        gain = 0.25 / max(float(result.reference.mean()), 1e-6)
        images = [result.reference, *(result.pictures[name] for name in names)]
        row[0].set_ylabel(result.place.name, fontsize=8)
        for axis, image in zip(row, images, strict=True):
            axis.imshow(srgb_encode(np.clip(gain * image, 0.0, 1.0)))
            axis.set(xticks=[], yticks=[])
    for axis, title in zip(axes[0], ("Cycles", *names), strict=True):
        axis.set_title(title, fontsize=8)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=80, pil_kwargs={"quality": 80})
    plt.close(figure)


def main(arguments: Sequence[str]) -> None:
    """Measure every place and write the page."""
    parser = argparse.ArgumentParser(prog="shade")
    parser.add_argument(
        "--keep", type=Path, default=Path("out/shade"), help="folder of scenes and references"
    )
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    results = []
    for place in places(options.keep):
        results.append(measure(place, options.keep))
        print(_row(results[-1], "shade"), flush=True)
    picture_sheet(results, _ROOT / "docs" / "shade.jpg")
    (_ROOT / "docs" / "shade.md").write_text(report(results), encoding="utf-8")
