"""Scenes of other people's models under water: EEVEE against converged Cycles.

    python3 dev.py run -m benchmarks foreign_scenes OUT
    python3 dev.py run -m benchmarks foreign_pictures OUT [--only NAME ...] [--samples N]

The scenes are those that ``foreign_scenes`` left in OUT. Cycles' pictures are rendered with two
seeds and kept there; they are rendered anew only where they are missing. OUT/pair_NAME.png has
EEVEE above Cycles, OUT/foreign_scenes.md the table, OUT/foreign_scenes.jpg all pairs.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.seen import cameras
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr, replacing, write_png
from . import grey_scene
from ._drawing import drawing
from .materials import settings as water_of_materials

_WIDTH, _HEIGHT, _BLOCK = 240, 135, 3
_EEVEE_SAMPLES = 32


@dataclass(frozen=True)
class Row:
    """What was found of a scene: colour differences over blocks of pixels, and their noise."""

    scene: str
    mean: float
    high: float
    worst: float
    noise: float


def main(arguments: Sequence[str]) -> None:
    """Render, compare and print."""
    parser = argparse.ArgumentParser(prog="foreign_pictures", description=__doc__)
    parser.add_argument("out", type=Path, help="the folder that foreign_scenes filled")
    parser.add_argument("--only", nargs="+", default=[], help="names of scenes")
    parser.add_argument("--samples", type=int, default=64, help="of Cycles, each of two times")
    parser.add_argument("--reference", action="store_true", help="only render what is missing")
    options = parser.parse_args(arguments)
    names = options.only or sorted(path.stem for path in options.out.glob("*.json"))
    rows = []
    for name in names:
        try:
            halves = _reference(options.out, name, options.samples)
            if options.reference:
                continue
            picture = _eevee(options.out, name)
        except InputError as error:
            parser.exit(2, f"foreign_pictures: {name}: {error}\n")
        row = _compared(name, picture, halves)
        both = np.concatenate([picture, halves.mean(axis=0)]).astype(np.float32)
        write_png(options.out / f"pair_{name}.png", both)
        np.save(options.out / f"eevee_{name}.npy", picture.astype(np.float32))
        rows.append(row)
        print(
            f"{row.scene:12s} mean {row.mean:5.2f}  95 % {row.high:5.2f}  worst {row.worst:5.1f}  "
            f"noise {row.noise:4.2f}",
            flush=True,
        )


def _settings(samples: int) -> SceneSettings:
    """Return the water of all scenes, over the seabed that they have."""
    return replace(water_of_materials(samples), floor_depth=0.0, floor_reflectance="0.2")


def _open(out: Path, name: str) -> bpy.types.Object:
    """Open a scene, and return its camera."""
    path = out / f"{name}.blend"
    if not path.is_file():
        raise InputError(f"there is no {path}; foreign_scenes builds it")
    bpy.ops.wm.open_mainfile(filepath=str(path.absolute()))
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = _WIDTH, _HEIGHT, 100
    scene.cycles.pixel_filter_type = "BOX"
    return scene.camera


def _reference(out: Path, name: str, samples: int) -> NDArray[np.float64]:
    """Return Cycles' pictures with two seeds, shape (2, h, w, 3)."""
    path = out / f"cycles_{name}.npz"
    if path.exists():
        with np.load(path) as kept:
            return kept["halves"]
    camera = _open(out, name)
    plan = render_plan.make_plan(_settings(samples))
    depth = cameras.camera_depth(camera, plan.column.floor_depth)
    develop = plan.reduction(depth).apply
    halves = [develop(grey_scene.cycles_image(plan, camera, samples, seed)) for seed in (1, 2)]
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, halves=np.stack(halves))
    return np.stack(halves)


def _eevee(out: Path, name: str) -> NDArray[np.float64]:
    _open(out, name)
    with tempfile.TemporaryDirectory() as folder, drawing(_settings(_EEVEE_SAMPLES)) as drawn:
        for note in drawn.notes:
            print("  note:", note)
        drawn.picture(Path(folder, "a.exr"), _EEVEE_SAMPLES)
        return read_exr(Path(folder, "a.exr"))[0].astype(np.float64)


def _compared(name: str, picture: NDArray[np.float64], halves: NDArray[np.float64]) -> Row:
    seen, truth, one, other = (
        grey_scene.blocks(image, _BLOCK) for image in (picture, halves.mean(axis=0), *halves)
    )
    delta = delta_e_CIE2000_images(seen, truth)
    noise = delta_e_CIE2000_images(one, other) / 2.0
    high = np.percentile(delta, 95)
    return Row(name, float(delta.mean()), float(high), float(delta.max()), float(noise.mean()))
