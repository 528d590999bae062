"""Shade in EEVEE's water against Cycles: places that are built here, and the example scenes.

``python3 dev.py run -m benchmarks shade`` writes docs/measured/shade.md and its pictures.
"""

from __future__ import annotations

import argparse
import itertools
import runpy
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups import realtime_shade
from ..scene.engines import engines
from ..scene.seen.surroundings import PROBES, look_around
from ..scene.water import water_body
from ..uw_spectral.shade.probes import RAYS
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing
from . import grey_scene
from ._shade_moving import HEADER, SAMPLES, SIZE, full_frame, moving
from ._shade_openness import Openness, openness
from ._shade_scenes import (
    BANDS,
    HEIGHT,
    WIDTH,
    Place,
    box,
    canyon,
    car,
    jetty,
    of_file,
    slab,
    tunnel,
)  # fmt: skip
from ._shade_swim import Swum, swim

FORMS: dict[str, dict[str, object]] = {
    "no shade": {"diffuse_shadows": False, "scene_floor": False},
    "shade": {"diffuse_shadows": True, "scene_floor": True},
}
_BLOCK = 3
_SEEDS = (1, 2)
_SHADED = 0.5  # of a block: from then on it counts as shaded
_COST_SIZE, _COST_SAMPLES = (192, 108), 8
_ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True, eq=False)
class Result:
    """Pictures of a place, linear RGB: two of Cycles, and EEVEE's by name."""

    place: Place
    halves: NDArray[np.float64]
    shaded: NDArray[np.bool_]
    pictures: dict[str, NDArray[np.float64]]
    open_share: list[Openness]
    cost: FrameCost | None

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
    for inside in (True, False):
        where = "inside" if inside else "outside"
        found += [
            Place(f"tunnel, {where}", tunnel(inside=inside), samples=2048),
            Place(f"jetty, {where}", jetty(inside=inside), "3C", samples=4096),
            Place(f"car, {where}", car(inside=inside), "II", samples=2048),
            Place(f"canyon, {where}", canyon(inside=inside), samples=2048),
        ]
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
    cost = None if place.name in ("slab", "box") else frame_cost(place, camera)
    return Result(
        place, halves, place.shaded(camera), pictures, _openness(place, camera), cost,
    )  # fmt: skip


@dataclass(frozen=True)
class FrameCost:
    """Seconds of a frame without and with shade, and bytes of the table's image."""

    without: float
    shaded: float
    texels: int


def frame_cost(place: Place, camera: bpy.types.Object) -> FrameCost:
    """Render frames with and without shade in turn; the least seconds of each."""
    scene, least = bpy.context.scene, {}
    scene.render.resolution_x, scene.render.resolution_y = _COST_SIZE
    depth, size = -camera.matrix_world.translation.z, 0
    with tempfile.TemporaryDirectory() as folder:
        for _, name in itertools.product(range(2), ("no shade", "shade")):
            plan = place.plan(_COST_SAMPLES, bands=8, **FORMS[name])
            extent = water_body.water_extent(scene, plan.column, depth)
            with engines.eevee_realtime(scene, camera, plan, extent, depth) as engine:
                render = engine.frame(plan, depth)
                for _ in range(3):
                    start = time.perf_counter()
                    render(engine.passes[0], Path(folder, "frame.exr"))
                    least.setdefault(name, []).append(time.perf_counter() - start)
                images = [i for i in bpy.data.images if i.name.startswith(realtime_shade.NAME)]
                size = max([size, *(16 * i.size[0] * i.size[1] for i in images)])
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    return FrameCost(min(least["no shade"]), min(least["shade"]), size)


def _openness(place: Place, camera: bpy.types.Object) -> list[Openness]:
    plan = place.plan(1)
    around = look_around(bpy.context.scene, camera, float(plan.column.attenuation.min()))
    return openness(around, -np.asarray(plan.solved_field().sun))


def _row(result: Result) -> str:
    error, shaded, noise = result.delta_e("shade"), result.in_shade, result.noise
    values = (
        result.delta_e("no shade").mean(), error.mean(), np.quantile(error, 0.95),
        error[shaded].mean(), noise.mean(),
    )  # fmt: skip
    bright = result.pictures["shade"].mean() / result.reference.mean() - 1.0
    cells = " | ".join(f"{value:.2f}" for value in values)
    return f"| {result.place.name} | {cells} | {100 * bright:+.0f} |"


def report(results: Sequence[Result], swum: Swum, moves: str) -> str:
    """Return the page; ``moves`` is its section about things that move."""
    seen = []
    for at, by in itertools.product(("points", "rays"), ("voxels", "probes")):
        every = [o for r in results for o in r.open_share if (o.at, o.by) == (at, by)]
        means, most = [o.mean for o in every], max(o.most for o in every)
        seen.append(f"{at} by {by} {min(means):.3f}…{max(means):.3f}, {most:.3f}")
    costs = "; ".join(
        f"{r.place.name} {r.cost.shaded / r.cost.without:.2f}, {r.cost.texels / 2**20:.1f} MiB"
        for r in results
        if r.cost is not None
    )
    steady = "; ".join(swum.parts())
    rows = "\n".join(map(_row, results))
    return f"""# Shade in the water

Written by `python3 dev.py run -m benchmarks shade`. How it is done is in
[physics](../physics.md#shade-between-objects): up to {PROBES} probes of {RAYS} rays each.

## Against Cycles
Jerlov IB, flat surface, clear sky, sun at 30°, {BANDS} bands, {WIDTH} × {HEIGHT}; reef, wreck and
cave are the example scenes, the jetty is in 3C, the car in II. ΔE2000 of blocks of {_BLOCK} ×
{_BLOCK} pixels without shade and with it; *shaded*: where the sun does not reach; *noise*: of
Cycles, in all of them; *bright*: of the picture. Wanted were 1.5 in the mean and 2.5 in shaded
pixels.

| scene | no shade | shade | 95 % | shaded | noise | bright, % |
|---|---|---|---|---|---|---|
{rows}

{moves}
## Seconds of a frame
With shade over without it, {_COST_SIZE[0]} × {_COST_SIZE[1]}, {_COST_SAMPLES} samples, 8 bands,
software rasteriser, and the table's image: {costs}. Wanted was 1.25, **missed** in the reef.

## Visibility of the sky
Error of the fraction of directions that nothing covers, against rays at the meshes: range of the
scenes' means, worst 95 %: {"; ".join(seen)}. Wanted was 0.03; voxels are full wherever a surface
crosses them.

## A swim through the cave
Change of the shade from frame to frame, {swum.frames} frames seen by the same camera, median/95
%/worst in %: {steady}. In a job frames share their probes; *alone* is a view that knows no other
frame.

![Cycles, no shade, shade](shade.jpg)
"""


def moving_report(found: Sequence[Place], folder: Path) -> str:
    """Return the section about things that move."""
    rows = "\n".join(moving(place).row() for place in found)
    file = folder / "reef_full.blend"
    if not file.exists():
        build = runpy.run_path(str(_ROOT / "examples" / "build_scene.py"))["main"]
        build(["reef", str(file), "--detail", "full"])
    frame = full_frame(Place("reef", of_file(file)))
    ratio = frame.water.wall / frame.plain.wall
    return f"""## Things that move
Seconds on the clock / of both processors, 8 bands: the whole, then frames in which a fish of
0.19 m, a body of 1.8 m, or the camera (5 mm a frame) moves; how far the light with the body is from
what the frame is by itself. Wanted were 1 s, 0.1 s, 0.2 s, nothing, and 0.5 %.

{HEADER}
{rows}

The reef in full, 1.7 million triangles, {SIZE[0]} × {SIZE[1]} and {SAMPLES} sample, a fish moving:
EEVEE as it is takes {frame.plain} s, with water and shade {frame.water} s, {ratio:.2f} times as
long. Wanted was twice.
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
    parser.add_argument(
        "--moving", action="store_true", help="only print what things cost that move"
    )
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    found = places(options.keep)
    if options.moving:
        print(moving_report(found, options.keep))
        return
    results = []
    swum = swim(options.keep / "cave.blend")
    print("\n".join(swum.parts()), flush=True)
    for place in found:
        results.append(measure(place, options.keep))
        print(_row(results[-1]), flush=True)
    picture_sheet(results, _ROOT / "docs" / "measured" / "shade.jpg")
    moves = moving_report(found, options.keep)
    (_ROOT / "docs" / "measured" / "shade.md").write_text(
        report(results, swum, moves), encoding="utf-8"
    )
