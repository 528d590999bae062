"""Pictures through ports: EEVEE against Cycles, and what a port costs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.spectral_image import read_exr
from ._jobs import frame_seconds, rendered_seconds
from ._layer_scenes import DEPTH
from ._places import delta_e
from ._scenery import ball, camera_at, ground, new_file, post
from .runner import Ask, Page, Target, table

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
_SHARED = ("--water", "jerlov:IB", "--bands", "6", "--white-balance", "depth")
_SIZE, _SAMPLES = (240, 135), {"real-time": 32, "bands": 32, "Cycles": 96}
_BLOCK = 3  # pixels of a block, whose means have little noise
_FRAME, _FRAMES = (320, 180), 2


def build(path: Path) -> None:
    """Write a scene of posts and balls over sand, near and far."""
    scene = new_file()
    camera_at((0.0, 0.0, -DEPTH), (math.radians(82.0), 0.0, 0.0), math.radians(78.0))
    sand = _checked("sand", 2.0, (0.55, 0.5, 0.4), (0.35, 0.32, 0.25))
    ground(-DEPTH - 1.5, sand, 60.0)
    red, white = (0.7, 0.15, 0.1), (0.75, 0.75, 0.7)
    for x, y, z, radius in ((-0.5, 1.1, 0.1, 0.2), (0.9, 1.6, 0.3, 0.25), (0.1, 0.7, -0.3, 0.1)):
        ball((x, y, z - DEPTH), radius, _checked(f"ball {x}", 10.0, red, white))
    for x, y in ((-1.6, 2.2), (-0.7, 3.5), (0.5, 2.6), (1.9, 3.0), (2.6, 5.0), (-2.8, 5.5)):
        post((x, y, -DEPTH - 0.4), 0.12, 2.4, _checked(f"post {x}", 5.0, white, (0.1, 0.1, 0.1)))
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


def picture(blend: Path, out: Path, engine: str, *options: str) -> NDArray[np.float64]:
    """Return a picture, linear; one that is there is read."""
    path = out / "0001.exr"
    if not path.is_file():
        size = ("--resolution", *map(str, _SIZE), "--samples", str(_SAMPLES[engine]))
        rendered_seconds(blend, out, *_SHARED, *ENGINES[engine], *size, *options)
    return read_exr(path)[0].astype(np.float64)


def measure(ask: Ask) -> Mapping[str, object]:
    """Render through each port."""
    folder = ask.folder
    folder.mkdir(parents=True, exist_ok=True)
    blend, rows, worst = folder / "posts.blend", [], 0.0
    build(blend)
    for port, options in PORTS.items():
        place = folder / port
        seen = {name: picture(blend, place / name, name, *options) for name in ENGINES}
        again = picture(blend, place / "again", "Cycles", *options, "--seed", "1")
        reference, cells = 0.5 * (seen["Cycles"] + again), []
        for name in ("real-time", "bands"):
            error, coarse = (delta_e(seen[name], reference, n) for n in (1, _BLOCK))
            most = np.quantile(error, 0.95)
            cells.append(f"{error.mean():.2f}/{most:.2f} ({coarse.mean():.2f})")
            worst = max(worst, float(error.mean()))
        noise = delta_e(seen["Cycles"], again, 1).mean() / 2.0
        rows.append(["IB", port, *cells, f"{noise:.2f}"])
    costs, dearest = [], 1.0
    size = ("--resolution", *map(str, _FRAME), "--samples", "32")
    for engine in ("real-time", "bands"):
        plain, *others = (
            frame_seconds(blend, folder / f"cost {engine} {port}", _FRAMES, *_SHARED,
                          *ENGINES[engine], *size, *of_port)
            for port, of_port in PORTS.items()
        )  # fmt: skip
        costs.append([engine, f"{plain:.2g}", *(f"{x / plain:.2f}" for x in others)])
        dearest = max(dearest, *(x / plain for x in others))
    return {
        "rows": table(("Jerlov", "port", "real-time", "bands", "noise"), rows),
        "costs": table(("engine", "s without", *list(PORTS)[1:]), costs),
        "worst": worst, "dearest": dearest,
    }  # fmt: skip


PAGE = Page(
    "Pictures through ports",
    """
Posts and balls at .2 to 6 m, 5 m down, 78° in air, 240 × 135 pixels, six bands. EEVEE moves a
pinhole's picture band by band; Cycles traces the rays of the port (`tests/scene/test_housed.py`).

## EEVEE against Cycles
ΔE2000, mean/95 % of pixels, in brackets the mean of blocks of 3 × 3; a port adds the difference to
*none*.

{rows}

## What a port costs
CPU seconds of a frame without a port, 320 × 180, and with one over that.

{costs}
""",
    (
        Target("mean ΔE2000, worst", "worst", 1.5),
        Target("a frame with a port over one without", "dearest", 1.3),
    ),
)
