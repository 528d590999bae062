"""Pictures through ports: EEVEE against Cycles, and what a port costs.

    python3 dev.py run -m benchmarks housing_pictures [--folder DIR]

writes docs/measured/housing_pictures.md.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import stored_settings
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr
from ._jobs import rendered_seconds
from ._layer_scenes import DEPTH, camera, empty_scene

PAGE = Path(__file__).resolve().parent.parent / "docs" / "measured" / "housing_pictures.md"
PORTS = {
    "none": (),
    "flat": ("--housing", "flat"),
    "dome, 10 mm forward": ("--housing", "dome", "--dome-forward", "10"),
}
ENGINES = {
    "real-time": ("--engine", "eevee", "--mode", "realtime"),
    "bands": ("--engine", "eevee"),
    "Cycles": ("--engine", "cycles"),
}
WATERS = ("jerlov:IB",)
_SHARED = ("--bands", "6", "--white-balance", "depth")
_SIZE, _SAMPLES = (240, 135), {"real-time": 32, "bands": 32, "Cycles": 96}
_BLOCK = 3  # pixels of a block, whose means have little noise
_FRAME, _FRAMES = (320, 180), 2


def build(path: Path) -> None:
    """Write a scene of posts and balls over sand, near and far."""
    scene = empty_scene(_SIZE)
    camera("Camera", (0.0, 0.0, -DEPTH), 78.0, math.radians(82.0))
    sand = _checked("sand", 2.0, (0.55, 0.5, 0.4), (0.35, 0.32, 0.25))
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 0.0, -DEPTH - 1.5))
    bpy.context.object.data.materials.append(sand)
    red, white = (0.7, 0.15, 0.1), (0.75, 0.75, 0.7)
    for place, radius in (
        ((-0.5, 1.1, 0.1), 0.2),
        ((0.9, 1.6, 0.3), 0.25),
        ((0.1, 0.7, -0.3), 0.1),
    ):
        x, y, z = place
        bpy.ops.mesh.primitive_uv_sphere_add(
            radius=radius, location=(x, y, z - DEPTH), segments=48, ring_count=24
        )
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(_checked(f"ball {x}", 10.0, red, white))
    for x, y in ((-1.6, 2.2), (-0.7, 3.5), (0.5, 2.6), (1.9, 3.0), (2.6, 5.0), (-2.8, 5.5)):
        bpy.ops.mesh.primitive_cylinder_add(
            radius=0.12, depth=2.4, location=(x, y, -DEPTH - 0.4), vertices=32
        )
        bpy.context.object.data.materials.append(_checked(f"post {x}", 5.0, white, (0.1, 0.1, 0.1)))
    scene.frame_end = 1 + _FRAMES
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _checked(name: str, scale: float, *colours: tuple[float, float, float]) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    kinds = ("ShaderNodeTexChecker", "ShaderNodeTexCoord", "ShaderNodeBsdfDiffuse")
    checks, place, matt = (tree.nodes.new(kind) for kind in kinds)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    checks.inputs["Scale"].default_value = scale
    for number, colour in enumerate(colours, 1):
        checks.inputs[number].default_value = (*colour, 1.0)
    tree.links.new(place.outputs["Object"], checks.inputs["Vector"])
    tree.links.new(checks.outputs["Color"], matt.inputs["Color"])
    tree.links.new(matt.outputs[0], output.inputs["Surface"])
    return material


def render(blend: Path, out: Path, *options: str) -> float:
    """Render a job and return its CPU time, s.

    Raises
    ------
    InputError
        If it fails.
    """
    return rendered_seconds(blend, out, *_SHARED, *options)


def picture(blend: Path, out: Path, engine: str, *options: str) -> NDArray[np.float64]:
    """Return a picture, linear; one that is there is read."""
    path = out / "0001.exr"
    if not path.is_file():
        size = ("--resolution", *map(str, _SIZE), "--samples", str(_SAMPLES[engine]))
        render(blend, out, *ENGINES[engine], *size, *options)
    return read_exr(path)[0].astype(np.float64)


def blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means of blocks of pixels."""
    rows, columns = (n // _BLOCK for n in image.shape[:2])
    cut = image[: rows * _BLOCK, : columns * _BLOCK]
    return cut.reshape(rows, _BLOCK, columns, _BLOCK, 3).mean(axis=(1, 3))


def agreement(blend: Path, folder: Path) -> list[str]:
    """Return rows: water, port, ΔE of both modes of EEVEE against Cycles, and Cycles' noise."""
    rows = []
    for water in WATERS:
        for port, options in PORTS.items():
            place = folder / f"{water[7:]} {port}"
            shared = ("--water", water, *options)
            seen = {name: picture(blend, place / name, name, *shared) for name in ENGINES}
            again = picture(blend, place / "again", "Cycles", *shared, "--seed", "1")
            reference = 0.5 * (seen["Cycles"] + again)
            noise = delta_e_CIE2000_images(seen["Cycles"], again).mean() / 2.0
            cells = []
            for name in ("real-time", "bands"):
                error = delta_e_CIE2000_images(seen[name], reference)
                coarse = delta_e_CIE2000_images(blocks(seen[name]), blocks(reference))
                cells.append(
                    f"{error.mean():.2f}/{np.quantile(error, 0.95):.2f} ({coarse.mean():.2f})"
                )
            rows.append(f"| {water[7:]} | {port} | {' | '.join(cells)} | {noise:.2f} |")
            print(rows[-1], flush=True)
    return rows


def costs(blend: Path, folder: Path) -> list[str]:
    """Return rows: engine, seconds of a frame without a port, and with each over that."""
    rows = []
    for engine in ("real-time", "bands"):
        options, samples = ENGINES[engine], ("--samples", "32")
        size = ("--resolution", *map(str, _FRAME))
        seconds = [
            _frame(blend, folder / f"cost {engine} {port}", *options, *size, *samples, *of_port)
            for port, of_port in PORTS.items()
        ]
        cells = [f"{value / seconds[0]:.2f}" for value in seconds[1:]]
        rows.append(f"| {engine} | {seconds[0]:.2g} | {' | '.join(cells)} |")
        print(rows[-1], flush=True)
    return rows


def _frame(blend: Path, out: Path, *options: str) -> float:
    """Return the CPU time of a frame after the first, s."""
    first, all_of_them = (
        render(blend, out / str(last), *options, "--frames", f"1-{last}")
        for last in (1, 1 + _FRAMES)
    )
    return (all_of_them - first) / _FRAMES


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(prog="housing_pictures")
    parser.add_argument("--folder", type=Path)
    chosen = parser.parse_args(arguments)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        blend = folder / "posts.blend"
        build(blend)
        rows, cost = agreement(blend, folder), costs(blend, folder)
    ports = " | ".join(list(PORTS)[1:])
    text = f"""\
# Pictures through ports

Written by `python3 dev.py run -m benchmarks housing_pictures`.

Posts and balls at .2 to 6 m, {DEPTH:g} m down, 78° in air, {_SIZE[0]} × {_SIZE[1]} pixels, six
bands. EEVEE moves a pinhole's picture band by band; Cycles traces the rays of the port
(`tests/scene/test_housed.py`).

## EEVEE against Cycles
ΔE2000, mean/95 % of pixels, in brackets the mean of blocks of {_BLOCK} × {_BLOCK}; a port adds
the difference to *none*. Target: mean 1.5.

| Jerlov | port | real-time | bands | noise |
|---|---|---|---|---|
{chr(10).join(rows)}

## What a port costs
CPU seconds of a frame without a port, {_FRAME[0]} × {_FRAME[1]}, and with one over that. Target:
1.3.

| engine | s without | {ports} |
|---|---|---|---|
{chr(10).join(cost)}
"""
    PAGE.write_text(text, encoding="utf-8")
    print(text)
