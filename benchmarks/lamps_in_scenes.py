"""Lamps in EEVEE's water against Cycles: lights of vehicles, torches, a strobe, a wreck by night.

``python3 dev.py run -m benchmarks lamps_in_scenes`` writes docs/lamps.md and docs/lamps.jpg.
"""

from __future__ import annotations

import argparse
import math
import runpy
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..scene import lamp_rigs, render_plan, stored_settings
from ..uw_spectral.lamps.lamp_shadow import SIDE
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing
from . import grey_scene
from ._shade_scenes import BANDS, HEIGHT, WIDTH, Place, matt

_BLOCK = 3
_SEEDS = (1, 2)
_DEPTH = 15.0
_TOWARDS = math.pi / 2  # a lamp that is turned so about x shines along y
_COUNTS = (0, 1, 2, 4, 8)
_ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class LitPlace(Place):
    """A place with lamps.

    Parameters
    ----------
    sunlight : float
        Factor on sun and sky.
    """

    sunlight: float = 0.0

    def plan(self, samples: int, **changes: object) -> render_plan.RenderPlan:
        """Resolve it; ``changes`` are other settings."""
        return super().plan(samples, **({"sunlight": self.sunlight} | changes))


@dataclass(frozen=True, eq=False)
class Result:
    """A place by Cycles, twice, and by EEVEE: band radiances, and their colours."""

    place: LitPlace
    halves: NDArray[np.float64]
    eevee: NDArray[np.float64]
    open_water: NDArray[np.bool_]
    develop: Callable[[NDArray[np.float64]], NDArray[np.float64]]

    def delta_e(self) -> NDArray[np.float64]:
        """ΔE2000 by block."""
        return _delta_e(self.develop(self.eevee), self.develop(self.halves.mean(axis=0)))

    def noise(self) -> NDArray[np.float64]:
        """What ΔE2000 the reference's own noise makes, by block."""
        return _delta_e(*(self.develop(half) for half in self.halves)) / 2.0

    def backscatter(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Relative error of open water by block and band, and the standard error of Cycles'."""
        first, second = (_blocks(half) for half in self.halves)
        truth = (first + second) / 2.0
        known = _blocks(self.open_water[..., None].astype(float))[..., 0] == 1.0
        error = np.abs(_blocks(self.eevee) / truth - 1.0)
        return error[known].ravel(), (np.abs(first - second) / (2.0 * truth))[known].ravel()


def _blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(image, _BLOCK)


def _delta_e(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return delta_e_CIE2000_images(*(_blocks(np.clip(x, 0.0, 1.0)) for x in (one, other)))


def _room() -> bpy.types.Object:
    """Sand, a ball, a box and open water, seen from 1.2 m above the sand."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler.x = (0.0, 0.0, -_DEPTH), _TOWARDS
    camera.data.angle = math.radians(70)
    scene.collection.objects.link(camera)
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 20.0, -_DEPTH - 1.2))
    bpy.context.object.data.materials.append(matt((0.5, 0.42, 0.3)))
    bpy.ops.mesh.primitive_uv_sphere_add(
        radius=0.6, segments=32, ring_count=16, location=(0.6, 3.2, -_DEPTH - 0.5)
    )
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(matt((0.6, 0.08, 0.05)))
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(-1.3, 4.2, -_DEPTH - 0.7))
    bpy.context.object.data.materials.append(matt((0.8, 0.8, 0.8)))
    return camera


def _lamp(
    place: Sequence[float], turn: Sequence[float], lumens: float = 8000.0, cone: float = 70.0
) -> None:
    light = bpy.data.lights.new("Lamp", "SPOT")
    light.spot_size, light.spot_blend = math.radians(cone), 0.4
    light.energy, light.shadow_soft_size = lumens, 0.03
    chosen = light.underwater
    chosen.spectrum, chosen.unit = "led", "lm"
    item = bpy.data.objects.new("Lamp", light)
    item.location = Vector(place) - Vector((0.0, 0.0, _DEPTH))
    item.rotation_euler = turn
    bpy.context.scene.collection.objects.link(item)


def _vehicle(beside: float) -> Callable[[], bpy.types.Object]:
    def build() -> bpy.types.Object:
        camera = _room()
        for side in (-1.0, 1.0):
            turned = math.atan2(side * beside, 5.0)
            _lamp((side * beside, 0.0, 0.3), (_TOWARDS, 0.0, turned))
        return camera

    return build


def _torch_in_view() -> bpy.types.Object:
    camera = _room()
    _lamp((0.9, 5.0, 0.5), (_TOWARDS, 0.0, 0.75 * math.pi), 3000.0, 50.0)
    return camera


def _strobe() -> bpy.types.Object:
    camera = _room()
    _lamp((2.2, 1.0, 0.8), (_TOWARDS - 0.4, 0.0, math.radians(45)), 20000.0, 100.0)
    return camera


def _behind_a_fish() -> bpy.types.Object:
    camera = _room()
    _lamp((0.0, 5.2, 0.1), (_TOWARDS, 0.0, math.pi), 8000.0, 90.0)
    bpy.ops.mesh.primitive_uv_sphere_add(
        radius=0.35, segments=32, ring_count=16, location=(0.1, 4.4, -_DEPTH)
    )
    bpy.context.object.scale = (1.2, 0.4, 0.6)
    bpy.context.object.data.materials.append(matt((0.3, 0.3, 0.35)))
    return camera


def _wreck(folder: Path) -> Callable[[], bpy.types.Object]:
    file = folder / "wreck.blend"
    if not file.exists():
        build = runpy.run_path(str(_ROOT / "examples" / "build_scene.py"))["main"]
        build(["wreck", str(file), "--detail", "draft"])

    def build_it() -> bpy.types.Object:
        bpy.ops.wm.open_mainfile(filepath=str(file))
        scene = bpy.context.scene
        bpy.context.view_layer.update()
        lamp_rigs.add_rig(scene, "rov2", scene.camera)
        return scene.camera

    return build_it


def places(folder: Path) -> list[LitPlace]:
    """Return the places."""
    found = [
        LitPlace(f"vehicle, lamps {beside:g} m beside, {water}", _vehicle(beside), water)
        for beside, water in ((0.3, "I"), (0.3, "3C"), (1.0, "I"), (1.0, "II"), (1.0, "3C"))
    ]
    found += [
        LitPlace("torch in view, II", _torch_in_view, "II"),
        LitPlace("strobe at 45°, II", _strobe, "II"),
        LitPlace("lamp behind a fish, II", _behind_a_fish, "II"),
        LitPlace("vehicle and sun, IB", _vehicle(1.0), "IB", sunlight=0.05),
        LitPlace("wreck by night, IB", _wreck(folder), "IB"),
    ]
    return [replace(place, samples=1024) for place in found]


def measure(place: LitPlace, keep: Path) -> Result:
    """Render a place by Cycles, unless that is kept, and by EEVEE."""
    camera = place.open()
    scene = bpy.context.scene
    kept = keep / f"{place.name.replace(' ', '_')}_{place.samples}.npy"
    if not kept.exists():
        found = place.by_cycles(camera, _SEEDS)
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, found)
    plan, depth = place.plan(1), -camera.matrix_world.translation.z
    develop = plan.reduction(depth, plan.lamplight(scene, camera)).apply
    surroundings = np.isinf(place.distance(camera))
    return Result(place, np.load(kept), place.by_eevee(camera), surroundings, develop)


def seconds_of_frames() -> dict[int, float]:
    """CPU seconds of a frame in EEVEE by the number of lamps, after one that compiles."""
    found = {}
    for count in _COUNTS:
        place = LitPlace("cost", _room, "II", sunlight=1.0)
        camera = place.open()
        for index in range(count):
            _lamp((0.2 * index - 0.7, 0.0, 0.3), (_TOWARDS, 0.0, 0.0))
        bpy.context.view_layer.update()
        found[count] = min(place.seconds(camera, time.process_time) for _ in range(2))
        print(count, found[count], flush=True)
    return found


def _row(result: Result) -> str:
    error, noise = result.delta_e(), result.noise()
    off, doubt = result.backscatter()
    bright = result.eevee.mean() / result.halves.mean() - 1.0
    water = "| | | "
    if len(off):
        water = (
            f"| {100 * np.median(off):.0f} / {100 * np.quantile(off, 0.95):.0f} / "
            f"{100 * off.max():.0f} % | {100 * np.median(doubt):.0f} % "
        )
    return (
        f"| {result.place.name} | {error.mean():.2f} | {np.quantile(error, 0.95):.2f} "
        f"| {error.max():.2f} | {noise.mean():.2f} | {100 * bright:+.0f} % {water}|"
    )


def report(results: Sequence[Result], seconds: dict[int, float]) -> str:
    """Return the page."""
    rows = "\n".join(_row(result) for result in results)
    plain = seconds[0]
    costs = "\n".join(f"| {n} | {s:.2f} | {s / plain:.2f} |" for n, s in seconds.items())
    return f"""# Lamps in EEVEE's water

Written by `python3 dev.py run -m benchmarks lamps_in_scenes`.

How it is done is in [physics.md](physics.md#lamps); the formulas alone are measured against
photons in [lamp_light.md](lamp_light.md).

## Against Cycles
Default phase function, flat surface, {BANDS} bands, CIE 1931, night (or sun and sky at a
twentieth), {_DEPTH:g} m deep over sand; {WIDTH} × {HEIGHT} pixels, exposed for the lamps; LEDs of
measured spectrum. ΔE2000 of blocks of {_BLOCK} × {_BLOCK} pixels: mean, 95 %, worst, and the share
of it that is Cycles' noise; the brightness of the picture. Then open water alone, per block and
band: median, 95 % and worst relative error, and the standard error of Cycles in it.

| scene | mean | 95 % | worst | noise | bright | backscatter | noise |
|---|---|---|---|---|---|---|---|
{rows}

Wanted were a mean of 2, and backscatter within 5 % in the median and 15 % for 95 %. Cycles has
the light that sand and things throw back; EEVEE's lamps light each thing and the water by
themselves.

In clear water (I, IB) they agree. In II and 3C nine tenths and more of what the water takes away is
scattered, often many times; pictures in the light of lamps beside the camera are as bright as by
Cycles within a fifth. The dark water on the side away from a beam that crosses the view is the
hardest: light is bent there and back. Things keep a lamp's light from the water behind them by a
map of {SIDE} × {SIDE} distances, the same for light that was scattered more often, which in truth
finds its way round them.

## Seconds of a frame
CPU seconds on the software rasteriser, {WIDTH} × {HEIGHT}, the less of two, sun on, shaders
compiled.

| lamps | CPU s | over none |
|---|---|---|
{costs}

![Cycles, EEVEE](lamps.jpg)
"""


def picture_sheet(results: Sequence[Result], path: Path) -> None:
    """Draw Cycles and EEVEE, a row per place."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(results), 2, figsize=(6.4, 1.8 * len(results)), squeeze=False)
    for row, result in zip(axes, results, strict=True):
        images = (result.halves.mean(axis=0), result.eevee)
        row[0].set_ylabel(result.place.name.replace(", ", ",\n"), fontsize=7)
        for axis, image in zip(row, images, strict=True):
            axis.imshow(srgb_encode(np.clip(result.develop(image), 0.0, 1.0)))
            axis.set(xticks=[], yticks=[])
    for axis, title in zip(axes[0], ("Cycles", "EEVEE"), strict=True):
        axis.set_title(title, fontsize=8)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=80, pil_kwargs={"quality": 80})
    plt.close(figure)


def main(arguments: Sequence[str]) -> None:
    """Measure every place and write the page."""
    parser = argparse.ArgumentParser(prog="lamps_in_scenes")
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs")
    parser.add_argument("--keep", type=Path, default=_ROOT / "out" / "lamps")
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    results = []
    for place in places(options.keep):
        start = time.perf_counter()
        results.append(measure(place, options.keep))
        print(_row(results[-1]), f"{time.perf_counter() - start:.0f} s", flush=True)
    page = report(results, seconds_of_frames())
    with replacing(options.docs / "lamps.md") as temporary:
        temporary.write_text(page)
    with replacing(options.docs / "lamps.jpg") as temporary:
        picture_sheet(results, temporary)
