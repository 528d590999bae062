"""Lamps in EEVEE's water against photons and Cycles: torches, strobes, vehicles, a wreck by night.

``python3 dev.py run -m benchmarks lamps_in_scenes`` writes docs/measured/lamps.md, lamps.jpg. Takes
more than an hour; what photons and Cycles find is kept. ``--only NAME`` measures scenes whose names
begin so, and keeps the rows of the others.
"""

from __future__ import annotations

import argparse
import math
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
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.water.phase import BandPhase
from . import _lamp_photons, _lamp_room, grey_scene
from ._lamp_page import BLOCK, BLUR, COARSER, CUT, Page, picture_sheet
from ._lamp_scenes import FIELD_OF_VIEW, LitPlace, add_lamp, places, sand_room
from ._shade_scenes import HEIGHT, WIDTH

_SEEDS = (1, 2)
_RAYS = 400  # of a block
_COUNTS = (0, 1, 4, 16, 32)
_ROOT = Path(__file__).resolve().parent.parent


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

    @property
    def pictures(self) -> list[NDArray[np.float64]]:
        """The reference and EEVEE in blocks, and EEVEE, in sRGB of 0 to 1."""
        images = self.halves.mean(axis=0), _blocks(self.eevee), self.eevee
        return [srgb_encode(np.clip(self.develop(image), 0.0, 1.0)) for image in images]


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
        (error, noise), (coarse, _) = self.delta_e(), self.delta_e(COARSER)
        off, _ = self.backscatter()
        water = ""
        if len(off):
            size = np.abs(off)
            water = (
                f"{100 * np.median(size):.0f}/{100 * np.quantile(size, 0.95):.0f} / "
                f"{100 * size.max():.0f} %"
            )
        return (
            f"{error.mean():.2f} | {np.quantile(error, 0.95):.2f} | {noise.mean():.2f} "
            f"| {coarse.mean():.2f} | {100 * self.brightness:+.0f} % | {water}"
        )

    def _delta_e(self, *pictures: NDArray[np.float64]) -> NDArray[np.float64]:
        return delta_e_CIE2000_images(*(np.clip(self.develop(x), 0.0, 1.0) for x in pictures))


def _blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(image, BLOCK)


def _together(blocks: NDArray[np.float64], sizes: Sequence[int]) -> NDArray[np.float64]:
    rows, columns, bands = blocks.shape
    down, across = sizes
    shape = (rows // down, down, columns // across, across, bands)
    return blocks.reshape(shape).mean(axis=(1, 3))


def by_photons(place: LitPlace, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Band radiances of blocks by what the light met, shape (h, w, n, 4, BATCHES)."""
    assert place.room is not None, "photons know only rooms"
    plan = place.plan(1)
    scale = 2.0 * math.tan(FIELD_OF_VIEW / 2.0) / WIDTH
    view = _lamp_room.View(HEIGHT // BLOCK, WIDTH // BLOCK, BLOCK * scale, BLUR)
    lamps = [
        replace(lamp, position=tuple(Vector(lamp.position) - camera.matrix_world.translation))
        for lamp in plan_lamps(bpy.context.scene, plan).lamps
    ]
    reflectance = np.clip(place.room.colours @ uplift_basis(plan.bands).T, 0.0, 1.0)
    found, photons = [], (place.photons, _RAYS)
    for band in range(len(plan.bands)):
        one = BandPhase(plan.phase.components, plan.phase.weights[:, band : band + 1])
        phase, kept = _lamp_room.cut(_lamp_photons.tables_of(one), CUT)
        water = float(plan.column.absorption[band]), kept * float(plan.column.scattering[band])
        light = _lamp_room.traced(
            view, lamps, water, phase, place.room, reflectance[:, band], band, photons
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
            add_lamp((0.2 * index - 0.7, 0.0, 0.3), (math.pi / 2.0, 0.0, 0.0))
        bpy.context.view_layer.update()
        found[count] = min(place.seconds(camera, time.process_time) for _ in range(2))
        print(count, found[count], flush=True)
    return found


def main(arguments: Sequence[str]) -> None:
    """Measure every place and write the page."""
    parser = argparse.ArgumentParser(prog="lamps_in_scenes")
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs" / "measured")
    parser.add_argument("--keep", type=Path, default=_ROOT / "out" / "lamps")
    parser.add_argument("--only", action="append", default=[], metavar="NAME")
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    known, only = places(options.keep), tuple(options.only)
    chosen = [place for place in known if not only or place.name.startswith(only)]
    if not chosen:
        parser.error(f"no scene {only}; there are {', '.join(place.name for place in known)}")
    rows, drawn = {}, {}
    for place in chosen:
        start = time.perf_counter()
        result = measure(place, options.keep)
        rows[place.name], drawn[place.name] = result.compared.row(), result.pictures
        print(place.name, rows[place.name], f"{time.perf_counter() - start:.0f} s", flush=True)
    names, page = [place.name for place in known], options.docs / "lamps.md"
    if only:
        before = Page.read(page)
        found = Page({**before.rows, **rows}, before.seconds)
    else:
        found = Page(rows, seconds_of_frames())
    text = found.of_places(names).text()
    picture_sheet(names, drawn, options.docs / "lamps.jpg")
    with replacing(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
