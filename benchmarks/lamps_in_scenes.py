"""Lamps in EEVEE's water against photons and Cycles: torches, strobes, vehicles, a wreck by night.

``python3 dev.py run -m benchmarks lamps_in_scenes`` writes docs/measured/lamps.md, lamps.jpg. Takes
more than an hour; what photons and Cycles find is kept.
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

from ..scene import stored_settings
from ..scene.seen import lamps
from ..scene.seen.lamps import plan_lamps
from ..scene.water import lamp_rigs
from ..settings import render_plan
from ..uw_spectral.lamps.thrown_back import COUNT
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.water.phase import BandPhase
from . import _lamp_photons, _lamp_room, grey_scene
from ._shade_scenes import BANDS, HEIGHT, WIDTH, Place, matt

_BLOCK = 3
_COARSER = (3, 4)  # blocks
_SEEDS = (1, 2)
_DEPTH = 15.0
_FIELD_OF_VIEW = math.radians(70)
_PHOTONS = (400_000, 400)  # from the lamps, in each of ten batches and bands; rays of a block
_CUT = math.radians(3.0)  # of the peak of the phase function
_BLUR = (0.2, 0.05)
_SAMPLES = 256  # of Cycles, in IB
_ABOVE_SAND = 1.2
# Middles and sizes in m, seen from the camera, and colours.
_SAND = (0.5, 0.42, 0.3)
_BALL, _BALL_RADIUS, _RED = (0.6, 3.2, -0.5), 0.6, (0.6, 0.08, 0.05)
_BOX, _BOX_SIZE, _WHITE = (-1.3, 4.2, -0.7), 1.0, (0.8, 0.8, 0.8)
_FISH, _FISH_AXES, _GREY = (0.1, 4.4, 0.0), (0.42, 0.14, 0.21), (0.3, 0.3, 0.35)
_NET_AT, _NET_REACH, _MESH, _CORD = 4.4, 0.9, 0.3, 0.02
_TOWARDS = math.pi / 2  # a lamp that is turned so about x shines along y
_HEAD = "| scene | mean | 95 % | worst | noise | coarse | noise | bright | backscatter | noise"
_COUNTS = (0, 1, 4, 16, 32)
_ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class LitPlace(Place):
    """A place with lamps.

    Parameters
    ----------
    sunlight : float
        Factor on sun and sky.
    room : Room, optional
        The same for photons.
    """

    sunlight: float = 0.0
    room: _lamp_room.Room | None = None

    def plan(self, samples: int, **changes: object) -> render_plan.RenderPlan:
        """Resolve it; ``changes`` are other settings."""
        return super().plan(samples, **({"sunlight": self.sunlight} | changes))


@dataclass(frozen=True, eq=False)
class Result:
    """A place by its reference, twice, in blocks, and by EEVEE: radiances, and their colours."""

    place: LitPlace
    halves: NDArray[np.float64]
    eevee: NDArray[np.float64]
    open_water: NDArray[np.bool_]
    develop: Callable[[NDArray[np.float64]], NDArray[np.float64]]

    @property
    def compared(self) -> Comparison:
        """EEVEE against the reference."""
        known = _blocks(self.open_water[..., None].astype(float))[..., 0] == 1.0
        return Comparison(_blocks(self.eevee), self.halves, known, self.develop)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Band radiances of the blocks of a picture beside two halves of a reference."""

    blocks: NDArray[np.float64]
    halves: NDArray[np.float64]
    open_water: NDArray[np.bool_]
    develop: Callable[[NDArray[np.float64]], NDArray[np.float64]]

    def delta_e(self, coarser: Sequence[int] = (1, 1)) -> tuple[NDArray, NDArray]:
        """ΔE2000 by so many blocks together, and what of it the reference's own noise makes."""
        one, first, second = (_together(x, coarser) for x in (self.blocks, *self.halves))
        error = self._delta_e(one, (first + second) / 2.0)
        return error, self._delta_e(first, second) / 2.0

    @property
    def brightness(self) -> float:
        """Of the picture over that of the reference, less 1."""
        return float(self.blocks.mean() / self.halves.mean() - 1.0)

    def backscatter(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Relative error of open water by block and band, and the reference's standard error."""
        first, second = self.halves
        truth, known = (first + second) / 2.0, self.open_water
        doubt = np.abs(first - second) / (2.0 * truth)
        return (self.blocks / truth - 1.0)[known].ravel(), doubt[known].ravel()

    def row(self) -> str:
        """Write it as cells of a table."""
        (error, noise), (coarse, coarse_noise) = self.delta_e(), self.delta_e(_COARSER)
        off, doubt = self.backscatter()
        water = " | "
        if len(off):
            size = np.abs(off)
            water = (
                f"{100 * np.median(size):.0f} / {100 * np.quantile(size, 0.95):.0f} / "
                f"{100 * size.max():.0f} % | {100 * np.median(doubt):.0f} %"
            )
        return (
            f"{error.mean():.2f} | {np.quantile(error, 0.95):.2f} | {error.max():.2f} "
            f"| {noise.mean():.2f} | {coarse.mean():.2f} | {coarse_noise.mean():.2f} "
            f"| {100 * self.brightness:+.0f} % | {water}"
        )

    def _delta_e(self, *pictures: NDArray[np.float64]) -> NDArray[np.float64]:
        return delta_e_CIE2000_images(*(np.clip(self.develop(x), 0.0, 1.0) for x in pictures))


def _blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(image, _BLOCK)


def _together(blocks: NDArray[np.float64], sizes: Sequence[int]) -> NDArray[np.float64]:
    rows, columns, bands = blocks.shape
    down, across = sizes
    shape = (rows // down, down, columns // across, across, bands)
    return blocks.reshape(shape).mean(axis=(1, 3))


def sand_room() -> bpy.types.Object:
    """Make sand, a ball, a box and open water, seen from 1.2 m above the sand."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler.x = (0.0, 0.0, -_DEPTH), _TOWARDS
    camera.data.angle = _FIELD_OF_VIEW
    scene.collection.objects.link(camera)
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 20.0, -_DEPTH - _ABOVE_SAND))
    bpy.context.object.data.materials.append(matt(_SAND))
    _sphere(_BALL, (_BALL_RADIUS,) * 3, _RED)
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_cube_add(size=_BOX_SIZE, location=_seen(_BOX))
    bpy.context.object.data.materials.append(matt(_WHITE))
    return camera


def _seen(place: Sequence[float]) -> Vector:
    return Vector(place) - Vector((0.0, 0.0, _DEPTH))


def _sphere(place: Sequence[float], axes: Sequence[float], colour: Sequence[float]) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, location=_seen(place))
    bpy.context.object.scale = axes
    bpy.context.object.data.materials.append(matt(colour))


def _for_photons(*, fish: bool = False, net: bool = False) -> _lamp_room.Room:
    ellipsoids, colours = [(*_BALL, *(_BALL_RADIUS,) * 3)], [_SAND, _RED]
    if fish:
        ellipsoids.append((*_FISH, *_FISH_AXES))
        colours.append(_GREY)
    boxes, of_boxes = [(*_BOX, *(_BOX_SIZE / 2.0,) * 3)], [_WHITE]
    if net:
        cords = [(*middle, *half) for middle, half in _cords()]
        boxes, of_boxes = boxes + cords, of_boxes + [_GREY] * len(cords)
    things = np.array(ellipsoids), np.array(boxes), np.array([*colours, *of_boxes])
    return _lamp_room.Room(-_ABOVE_SAND, *things)


def _cords() -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Middles and half sizes of the cords of a net."""
    places = np.arange(-_NET_REACH, _NET_REACH + _MESH / 2.0, _MESH)
    upright = [((x, _NET_AT, 0.0), (_CORD, _CORD, _NET_REACH)) for x in places]
    return upright + [((0.0, _NET_AT, z), (_NET_REACH, _CORD, _CORD)) for z in places]


def add_lamp(
    place: Sequence[float], turn: Sequence[float], lumens: float = 8000.0, cone: float = 70.0
) -> None:
    """Add a spot of a cone in degrees at a place seen from the camera, turned from down."""
    light = bpy.data.lights.new("Lamp", "SPOT")
    light.spot_size, light.spot_blend = math.radians(cone), 0.4
    light.energy, light.shadow_soft_size = lumens, 0.03
    chosen = light.underwater
    chosen.spectrum, chosen.unit = "led", "lm"
    item = bpy.data.objects.new("Lamp", light)
    item.location = _seen(place)
    item.rotation_euler = turn
    bpy.context.scene.collection.objects.link(item)


def _vehicle() -> bpy.types.Object:
    """Fill a file with two lamps beside the camera and two above it that shine outwards."""
    camera = sand_room()
    for side in (-1.0, 1.0):
        add_lamp((side, 0.0, -0.2), (_TOWARDS, 0.0, math.atan2(side, 5.0)))
        add_lamp((side * 0.5, 0.0, 0.6), (_TOWARDS - 0.15, 0.0, -side * 0.3))
    return camera


def _torch(
    place: Sequence[float], turned: float, lumens: float = 3000.0
) -> Callable[[], bpy.types.Object]:
    def build() -> bpy.types.Object:
        camera = sand_room()
        add_lamp(place, (_TOWARDS, 0.0, turned), lumens, 50.0)
        return camera

    return build


def _strobes() -> bpy.types.Object:
    camera = sand_room()
    for side in (-1.0, 1.0):
        add_lamp((side * 1.2, 0.3, 0.5), (_TOWARDS - 0.25, 0.0, side * 0.4), 20000.0, 100.0)
    return camera


def _behind_a_fish() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((0.0, 5.2, 0.1), (_TOWARDS, 0.0, math.pi), 8000.0, 90.0)
    _sphere(_FISH, _FISH_AXES, _GREY)
    return camera


def _behind_a_net() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((0.05, 5.2, 0.1), (_TOWARDS, 0.0, math.pi), 8000.0, 90.0)
    for middle, half in _cords():
        bpy.ops.mesh.primitive_cube_add(size=2.0, location=_seen(middle))
        bpy.context.object.scale = half
        bpy.context.object.data.materials.append(matt(_GREY))
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


_SCENES: tuple[tuple[str, Callable[[], bpy.types.Object], Sequence[str]], ...] = (
    ("torch across", _torch((0.9, 5.0, 0.5), 0.75 * math.pi), ("I", "II")),
    ("torch along", _torch((0.25, 0.0, -0.1), 0.0, 8000.0), ("II",)),
    ("torch against", _torch((-0.5, 6.0, 0.4), math.pi + 0.15), ("II",)),
    ("strobe pair", _strobes, ("II",)),
    ("vehicle with four lamps", _vehicle, ("I",)),
)


def places(folder: Path) -> list[LitPlace]:
    """Return the places."""
    room, with_fish = _for_photons(), _for_photons(fish=True)
    found = [
        LitPlace(f"{name}, {water}", build, water, room=room)
        for name, build, waters in _SCENES
        for water in waters
    ]
    found += [
        LitPlace(f"lamp behind a fish, {water}", _behind_a_fish, water, room=with_fish)
        for water in ("I", "II")
    ]
    net = _for_photons(net=True)
    found.append(LitPlace("lamp behind a net, I", _behind_a_net, "I", room=net))
    by_cycles = [
        LitPlace("vehicle and sun, IB", _vehicle, "IB", sunlight=0.05),
        LitPlace("wreck by night, IB", _wreck(folder), "IB"),
    ]
    return found + [replace(place, samples=_SAMPLES) for place in by_cycles]


def by_photons(place: LitPlace, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Band radiances of blocks by what the light met, shape (h, w, n, 4, BATCHES)."""
    assert place.room is not None, "photons know only rooms"
    plan = place.plan(1)
    scale = 2.0 * math.tan(_FIELD_OF_VIEW / 2.0) / WIDTH
    view = _lamp_room.View(HEIGHT // _BLOCK, WIDTH // _BLOCK, _BLOCK * scale, _BLUR)
    lamps = [
        replace(lamp, position=tuple(Vector(lamp.position) - camera.matrix_world.translation))
        for lamp in plan_lamps(bpy.context.scene, plan).lamps
    ]
    reflectance = np.clip(place.room.colours @ uplift_basis(plan.bands).T, 0.0, 1.0)
    found = []
    for band in range(len(plan.bands)):
        one = BandPhase(plan.phase.components, plan.phase.weights[:, band : band + 1])
        phase, kept = _lamp_room.cut(_lamp_photons.tables_of(one), _CUT)
        water = float(plan.column.absorption[band]), kept * float(plan.column.scattering[band])
        light = _lamp_room.traced(
            view, lamps, water, phase, place.room, reflectance[:, band], band, _PHOTONS
        )
        found.append(light * lamps[0].intensity[band])
    return np.stack(found, axis=2)


def _halves(place: LitPlace, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Return the blocks of the place's reference, twice."""
    if place.room is None:
        return np.stack([_blocks(image) for image in place.by_cycles(camera, _SEEDS)])
    whole = by_photons(place, camera).sum(axis=-2)
    return np.stack([whole[..., first::2].mean(axis=-1) for first in range(2)])


def measure(place: LitPlace, keep: Path) -> Result:
    """Draw a place by EEVEE, and by its reference unless that is kept."""
    camera = place.open()
    scene = bpy.context.scene
    kept = keep / f"{place.name.replace(' ', '_')}.npy"
    if not kept.exists():
        found = _halves(place, camera)
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, found)
    plan, depth = place.plan(1), -camera.matrix_world.translation.z
    develop = plan.reduction(depth, lamps.lamplight(scene, camera, plan)).apply
    surroundings = np.isinf(place.distance(camera))
    return Result(place, np.load(kept), place.by_eevee(camera), surroundings, develop)


def seconds_of_frames() -> dict[int, float]:
    """CPU seconds of a frame in EEVEE by the number of lamps, after one that compiles."""
    found = {}
    for count in _COUNTS:
        place = LitPlace("cost", sand_room, "II", sunlight=1.0)
        camera = place.open()
        for index in range(count):
            add_lamp((0.2 * index - 0.7, 0.0, 0.3), (_TOWARDS, 0.0, 0.0))
        bpy.context.view_layer.update()
        found[count] = min(place.seconds(camera, time.process_time) for _ in range(2))
        print(count, found[count], flush=True)
    return found


def report(results: Sequence[Result], seconds: dict[int, float]) -> str:
    """Return the page."""
    rows = "\n".join(f"| {r.place.name} | {r.compared.row()} |" for r in results)
    plain = seconds[0]
    costs = "\n".join(f"| {n} | {s:.2f} | {s / plain:.2f} |" for n, s in seconds.items())
    down, across = (_BLOCK * n for n in _COARSER)
    return f"""# Lamps in EEVEE's water

Written by `python3 dev.py run -m benchmarks lamps_in_scenes`.

How it is done is in [physics.md](../physics.md#lamps); the formulas alone are measured against
photons in [lamp_light.md](lamp_light.md).

## Against photons and Cycles
Default phase function, flat surface, {BANDS} bands, CIE 1931, night (or sun and sky at a
twentieth), {_DEPTH:g} m deep over sand; {WIDTH} × {HEIGHT} pixels, exposed for the lamps; LEDs of
measured spectrum. The reference are photons from the lamps, {10 * _PHOTONS[0] / 1e6:g} million for
each band (`benchmarks/_lamp_room.py`; the peak of the phase function cut off at
{math.degrees(_CUT):g}°, light scattered more than once blurred by {_BLUR[0]:g} m and more), of the
last two scenes Cycles with two seeds of {_SAMPLES} samples. ΔE2000 of blocks of {_BLOCK} × {_BLOCK}
pixels: mean, 95 %, worst, and the fraction of it that is the reference's noise; the mean and its
noise in blocks of {across} × {down} pixels; the brightness of the picture. Then open water alone,
per block of {_BLOCK} × {_BLOCK} and band: median, 95 % and worst relative error, and the standard
error of the reference in it.

{_HEAD} |
|{"---|" * 10}
{rows}

Wanted were a mean of 2, with noise below 0.7, and backscatter within 5 % in the median and 15 % for
95 %.

In clear water, with the torch across the view, most of it is right down to a ten-thousandth of
the brightest block; sand in the ball's shadow is up to 1.8 times too bright, as what is scattered
on things from the side has no shadows, sand right under the ball a third of what it is, and a block
at the lamp has a share of its beam by the pixel filter (the worst). The fish in II has light round
it, but a third too little at its sides and up to 60 % too much right behind.

## Seconds of a frame
CPU seconds on the software rasteriser, {WIDTH} × {HEIGHT}, the less of two, sun on, shaders
compiled; {COUNT} lamps more stand for what objects reflect wherever there is one,
with {COUNT} parts each.

| lamps | CPU s | over none |
|---|---|---|
{costs}

![Cycles, EEVEE](lamps.jpg)
"""


def picture_sheet(results: Sequence[Result], path: Path) -> None:
    """Draw the reference and EEVEE in blocks and EEVEE as it is, a row per place."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(results), 3, figsize=(6.4, 1.3 * len(results)), squeeze=False)
    for row, result in zip(axes, results, strict=True):
        images = (result.halves.mean(axis=0), _blocks(result.eevee), result.eevee)
        row[0].set_ylabel(result.place.name.replace(", ", ",\n"), fontsize=6)
        for axis, image in zip(row, images, strict=True):
            axis.imshow(srgb_encode(np.clip(result.develop(image), 0.0, 1.0)))
            axis.set(xticks=[], yticks=[])
    for axis, title in zip(axes[0], ("reference", "EEVEE in blocks", "EEVEE"), strict=True):
        axis.set_title(title, fontsize=8)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=70, pil_kwargs={"quality": 75})
    plt.close(figure)


def main(arguments: Sequence[str]) -> None:
    """Measure every place and write the page."""
    parser = argparse.ArgumentParser(prog="lamps_in_scenes")
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs" / "measured")
    parser.add_argument("--keep", type=Path, default=_ROOT / "out" / "lamps")
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    results = []
    for place in places(options.keep):
        start = time.perf_counter()
        results.append(measure(place, options.keep))
        print(
            place.name,
            results[-1].compared.row(),
            f"{time.perf_counter() - start:.0f} s",
            flush=True,
        )
    page = report(results, seconds_of_frames())
    with replacing(options.docs / "lamps.md") as temporary:
        temporary.write_text(page)
    with replacing(options.docs / "lamps.jpg") as temporary:
        picture_sheet(results, temporary)
