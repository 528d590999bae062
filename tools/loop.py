"""Render six seconds over a reef that loop without a seam: docs/listing/loop.webp.

    python3 dev.py run tools/loop.py

Waves and their caustics repeat by `--wave-loop`; the camera sways, and the fish bob, once or
twice in that time. EEVEE in real time; frames are kept in out/loop: a job that was stopped goes on.
"""

from __future__ import annotations

import importlib
import math
import subprocess
import sys
from pathlib import Path

import bpy
import make_pictures
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "loop"
FRAMES, RATE = 72, 12
RAISED = 2.6
EYE, TARGET, LENS = (0.75, 1.3, -5.2), (-1.6, 4.3, -5.5), 24.0
SWAY = (0.10, 0.0, 0.04)
OPTIONS = [
    *("--engine", "eevee", "--mode", "realtime", "--band-placement", "optimised", "--bands", "4"),
    *("--water", "jerlov:IB", "--illuminant", "clear-sky", "--irradiance", "above"),
    *("--sky", "clear", "--sun-zenith", "25", "--sun-azimuth", "100"),
    *("--surface", "waves", "--wind", "3", "--wave-tile", "8", "--wave-loop", str(FRAMES / RATE)),
    *("--white-balance", "depth", "--tone", "nikon-d7000", "--exposure", "auto"),
    *("--exposure-compensation", "0.6"),
    *("--resolution", "432", "243", "--samples", "3", "--resume"),
]
_STILL = ("ColorChecker", "Checker strut", "Dive lamp", "Fusilier", "Butterflyfish")


def build(path: Path) -> None:
    """Build the reef with a camera that sways and fish that bob, and store it."""
    scene = make_pictures.start()
    package = "underwater_spectral.examples"
    importlib.import_module(f"{package}.scenes").build_scene("reef", detail="panel")
    cameras = importlib.import_module(f"{package}.parts.cameras")
    scene.render.fps, scene.frame_start, scene.frame_end = RATE, 1, FRAMES
    camera = scene.camera = cameras.camera("Loop", EYE, TARGET, LENS)
    for number, item in enumerate(scene.objects):
        if item.parent is not None:
            continue
        item.location.z += RAISED
        item.hide_render = item.name.startswith(_STILL)
        if item == camera:
            sway(item, SWAY, 1, 0.0)
        elif item.name.startswith("Anthias"):
            sway(item, (0.02, 0.01, 0.015), 2, 2.4 * number)
    make_pictures.store(path)


def sway(item: bpy.types.Object, reach: tuple[float, ...], times: int, phase: float) -> None:
    """Let an object go to and fro about its place so many times, by keyframes on every frame."""
    place = item.location.copy()
    for frame in range(1, FRAMES + 1):
        turn = 2.0 * math.pi * times * (frame - 1) / FRAMES + phase
        shift = (math.sin(turn), math.cos(turn), math.cos(turn))
        item.location = [at + r * s for at, r, s in zip(place, reach, shift, strict=True)]
        item.keyframe_insert("location", frame=frame)


def main() -> None:
    """Build, render what is missing, and write the loop."""
    scene = OUT / "scene.blend"
    if not scene.exists():
        build(scene)
    command = [sys.executable, ROOT / "render_bands.py", scene, *OPTIONS]
    command += ["--frames", f"1-{FRAMES}", *sys.argv[1:], "--out", OUT]
    subprocess.run(list(map(str, command)), check=True)
    files = [OUT / f"{frame:04d}.png" for frame in range(1, FRAMES + 1)]
    if not all(file.exists() for file in files):
        return
    pictures = [Image.open(file).convert("RGB") for file in files]
    path = ROOT / "docs" / "listing" / "loop.webp"
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=round(1000 / RATE), loop=0,
        quality=60, method=6,
    )  # fmt: skip
    print(path.relative_to(ROOT), path.stat().st_size)  # noqa: T201


if __name__ == "__main__":
    main()
