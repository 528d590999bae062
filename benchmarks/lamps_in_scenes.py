"""Lamps in EEVEE's water against Cycles: lights of vehicles, torches, a strobe, a wreck by night.

``python3 dev.py run -m benchmarks lamps_in_scenes`` writes docs/measured/lamps.md, lamps.jpg. In
turbid water photons are traced in the same rooms as well. Takes more than an hour; what Cycles and
photons find is kept.
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
from ..scene.engines.cycles_settings import MOST_BOUNCES
from ..scene.seen import lamps
from ..scene.seen.lamps import plan_lamps
from ..scene.water import lamp_rigs
from ..settings import render_plan
from ..uw_spectral.lamps.lamp_shadow import SIDE
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
_PHOTONS = (600_000, 400)  # from the lamps, in each of ten batches and bands; rays of a block
_CUT = math.radians(1.5)  # of the peak of the phase function
_TURBID = ("II", "3C")
_SAMPLES = {"I": 256, "IB": 1024, "II": 3072, "3C": 3072}
_ABOVE_SAND = 1.2
# Middles and sizes in m, seen from the camera, and colours.
_SAND = (0.5, 0.42, 0.3)
_BALL, _BALL_RADIUS, _RED = (0.6, 3.2, -0.5), 0.6, (0.6, 0.08, 0.05)
_BOX, _BOX_SIZE, _WHITE = (-1.3, 4.2, -0.7), 1.0, (0.8, 0.8, 0.8)
_FISH, _FISH_AXES, _GREY = (0.1, 4.4, 0.0), (0.42, 0.14, 0.21), (0.3, 0.3, 0.35)
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
    """A place by Cycles, twice, by EEVEE and by photons: band radiances, and their colours."""

    place: LitPlace
    halves: NDArray[np.float64]
    photons: NDArray[np.float64] | None
    eevee: NDArray[np.float64]
    open_water: NDArray[np.bool_]
    develop: Callable[[NDArray[np.float64]], NDArray[np.float64]]

    @property
    def against_cycles(self) -> Comparison:
        """EEVEE against Cycles."""
        return self._against(np.stack([_blocks(half) for half in self.halves]))

    @property
    def against_photons(self) -> Comparison:
        """EEVEE against photons."""
        return self._against(self._photon_halves())

    @property
    def cycles_against_photons(self) -> Comparison:
        """Cycles against photons."""
        cycles = _blocks(self.halves.mean(axis=0))
        return replace(self.against_photons, blocks=cycles)

    @property
    def thrown_back(self) -> float:
        """Share of the light that met a thing."""
        assert self.photons is not None, "photons were not traced"
        by_kind = self.photons.sum(axis=(0, 1, 2, -1))
        return float(by_kind[1:].sum() / by_kind.sum())

    def _photon_halves(self) -> NDArray[np.float64]:
        assert self.photons is not None, "photons were not traced"
        whole = self.photons.sum(axis=-2)
        return np.stack([whole[..., first::2].mean(axis=-1) for first in range(2)])

    def _against(self, halves: NDArray[np.float64]) -> Comparison:
        known = _blocks(self.open_water[..., None].astype(float))[..., 0] == 1.0
        return Comparison(_blocks(self.eevee), halves, known, self.develop)


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


def _for_photons(*, fish: bool = False) -> _lamp_room.Room:
    ellipsoids, colours = [(*_BALL, *(_BALL_RADIUS,) * 3)], [_SAND, _RED]
    if fish:
        ellipsoids.append((*_FISH, *_FISH_AXES))
        colours.append(_GREY)
    boxes = [(*_BOX, *(_BOX_SIZE / 2.0,) * 3)]
    things = np.array(ellipsoids), np.array(boxes), np.array([*colours, _WHITE])
    return _lamp_room.Room(-_ABOVE_SAND, *things)


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


def _vehicle(beside: float) -> Callable[[], bpy.types.Object]:
    def build() -> bpy.types.Object:
        camera = sand_room()
        for side in (-1.0, 1.0):
            turned = math.atan2(side * beside, 5.0)
            add_lamp((side * beside, 0.0, 0.3), (_TOWARDS, 0.0, turned))
        return camera

    return build


def _torch_in_view() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((0.9, 5.0, 0.5), (_TOWARDS, 0.0, 0.75 * math.pi), 3000.0, 50.0)
    return camera


def _strobe() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((2.2, 1.0, 0.8), (_TOWARDS - 0.4, 0.0, math.radians(45)), 20000.0, 100.0)
    return camera


def _behind_a_fish() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((0.0, 5.2, 0.1), (_TOWARDS, 0.0, math.pi), 8000.0, 90.0)
    _sphere(_FISH, _FISH_AXES, _GREY)
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
    room = _for_photons()
    found = [
        LitPlace(f"vehicle, lamps {beside:g} m beside, {water}", _vehicle(beside), water, room=room)
        for beside, water in ((0.3, "I"), (0.3, "3C"), (1.0, "I"), (1.0, "II"), (1.0, "3C"))
    ]
    found += [
        LitPlace("torch in view, II", _torch_in_view, "II", room=room),
        LitPlace("strobe at 45°, II", _strobe, "II", room=room),
        LitPlace("lamp behind a fish, II", _behind_a_fish, "II", room=_for_photons(fish=True)),
        LitPlace("vehicle and sun, IB", _vehicle(1.0), "IB", sunlight=0.05),
        LitPlace("wreck by night, IB", _wreck(folder), "IB"),
    ]
    return [replace(place, samples=_SAMPLES[place.water]) for place in found]


def by_photons(place: LitPlace, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Band radiances of blocks by what the light met, shape (h, w, n, 4, BATCHES)."""
    assert place.room is not None, "photons know only rooms"
    plan = place.plan(1)
    scale = 2.0 * math.tan(_FIELD_OF_VIEW / 2.0) / WIDTH
    view = _lamp_room.View(HEIGHT // _BLOCK, WIDTH // _BLOCK, _BLOCK * scale)
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


def measure(place: LitPlace, keep: Path) -> Result:
    """Render a place by Cycles, unless that is kept, and by EEVEE."""
    camera = place.open()
    scene = bpy.context.scene
    kept = keep / f"{place.name.replace(' ', '_')}_{place.samples}.npy"
    if not kept.exists():
        found = place.by_cycles(camera, _SEEDS)
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, found)
    photons = None
    if place.room is not None and place.water in _TURBID:
        traced = kept.with_name(f"{place.name.replace(' ', '_')}_photons_{_PHOTONS[0]}.npy")
        if not traced.exists():
            with replacing(traced) as temporary, temporary.open("wb") as file:
                np.save(file, by_photons(place, camera))
        photons = np.load(traced)
    plan, depth = place.plan(1), -camera.matrix_world.translation.z
    develop = plan.reduction(depth, lamps.lamplight(scene, camera, plan)).apply
    surroundings = np.isinf(place.distance(camera))
    return Result(place, np.load(kept), photons, place.by_eevee(camera), surroundings, develop)


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


def _photon_row(result: Result) -> str:
    cycles = result.cycles_against_photons
    off = np.median(np.abs(cycles.backscatter()[0]))
    return (
        f"{result.against_photons.row()} | {100 * cycles.brightness:+.0f} % "
        f"| {100 * off:.0f} % | {100 * result.thrown_back:.0f} %"
    )


def report(results: Sequence[Result], seconds: dict[int, float]) -> str:
    """Return the page."""
    rows = "\n".join(f"| {r.place.name} | {r.against_cycles.row()} |" for r in results)
    turbid = [r for r in results if r.photons is not None]
    photons = "\n".join(f"| {r.place.name} | {_photon_row(r)} |" for r in turbid)
    plain = seconds[0]
    costs = "\n".join(f"| {n} | {s:.2f} | {s / plain:.2f} |" for n, s in seconds.items())
    down, across = (_BLOCK * n for n in _COARSER)
    samples = ", ".join(f"{count} in {water}" for water, count in _SAMPLES.items())
    return f"""# Lamps in EEVEE's water

Written by `python3 dev.py run -m benchmarks lamps_in_scenes`.

How it is done is in [physics.md](../physics.md#lamps); the formulas alone are measured against
photons in [lamp_light.md](lamp_light.md).

## Against Cycles
Default phase function, flat surface, {BANDS} bands, CIE 1931, night (or sun and sky at a
twentieth), {_DEPTH:g} m deep over sand; {WIDTH} × {HEIGHT} pixels, exposed for the lamps; LEDs of
measured spectrum; two seeds of samples each: {samples}. ΔE2000 of blocks of {_BLOCK} × {_BLOCK}
pixels: mean, 95 %, worst, and the fraction of it that is Cycles' noise; the mean and its noise in
blocks of {across} × {down} pixels; the brightness of the picture. Then open water alone, per block
of {_BLOCK} × {_BLOCK} and band: median, 95 % and worst relative error, and the standard error of
Cycles in it.

{_HEAD} |
|{"---|" * 10}
{rows}

## Against photons
The same scenes, {_PHOTONS} photons in each block and band (`benchmarks/_lamp_room.py`), likewise;
then Cycles against them: brightness, median error of open water; and the fraction of the
picture's light that an object has reflected.

{_HEAD} | Cycles, bright | Cycles, water | reflected |
|{"---|" * 13}
{photons}

Wanted were a mean of 2, and backscatter within 5 % in the median and 15 % for 95 %. In clear water
(I, IB) the mean is met, and backscatter too, but for its 95 % beside the sun.

In II and 3C most of what the water takes away of blue and green is scattered, often many times, and
neither reference knows blocks of {_BLOCK} × {_BLOCK} well enough to tell: their own noise is half
of the ΔE2000 or more. Much of the light comes in rare, very bright samples. Cycles' pictures are as
bright as photons' within 5 %, but single blocks of open water differ by 14 to 26 % in the median.
Bounces are not the limit: Cycles follows {MOST_BOUNCES}, photons are followed over 400. In the
coarse blocks the vehicle with lamps 1 m beside in II and the strobe differ from photons by about
the noise of these.

What objects reflect is up to three fifths of the light: sand lights the water over it, ball and
box. {COUNT} lamps stand for it ([physics.md](../physics.md#lamps)); many more would
bring up to a tenth more of it. Nothing keeps their light away.

Missed are the torch that shines across the view (the dark water on the side away from its beam is
up to several times too bright: light is bent there and back), the lamp right behind a fish (no glow
comes round an object), and 3C, which is a little dark. Objects keep a lamp's light from the water
behind them by a map of {SIDE} × {SIDE} distances, the same for light that was scattered more often,
which in truth finds its way round them.

## Seconds of a frame
CPU seconds on the software rasteriser, {WIDTH} × {HEIGHT}, the less of two, sun on, shaders
compiled; {COUNT} lamps more stand for what objects reflect wherever there is one.

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
            results[-1].against_cycles.row(),
            f"{time.perf_counter() - start:.0f} s",
            flush=True,
        )
    page = report(results, seconds_of_frames())
    with replacing(options.docs / "lamps.md") as temporary:
        temporary.write_text(page)
    with replacing(options.docs / "lamps.jpg") as temporary:
        picture_sheet(results, temporary)
