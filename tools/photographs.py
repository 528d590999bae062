"""Photographs of the example scenes: what the listing and the gallery show.

Rendered by ``render_bands.py`` in Cycles, and denoised. Passes are kept in
``out/photographs``: a job that was stopped goes on. ``tools/make_pictures.py`` calls this.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "photographs"
PACKAGE = "underwater_spectral"
_CYCLES = ("--engine", "cycles", "--band-placement", "optimised")
_ALL = (
    *("--illuminant", "clear-sky", "--irradiance", "above", "--sky", "clear"),
    *("--tone", "nikon-d7000", "--exposure", "auto-picture"),
)
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Photograph:
    """A picture of an example scene.

    Parameters
    ----------
    scene : str
        One of ``examples.scenes.SCENES``.
    eye, target : tuple of float
        Where the camera is, and what it looks at, m.
    lens : float
        Its focal length on a sensor 36 mm wide, mm.
    size : tuple of int
        Pixels.
    samples : int
    bands : int
    options : sequence of str
        Of ``render_bands.py``, besides those of all pictures.
    rig : str
        Lamps that hang on the camera; empty for none.
    hidden : sequence of str
        How the names of objects begin that are left out.
    raised : float
        How far everything is lifted, m.
    """

    scene: str
    eye: Point
    target: Point
    lens: float
    size: tuple[int, int]
    samples: int
    bands: int
    options: Sequence[str]
    rig: str = ""
    hidden: Sequence[str] = ()
    raised: float = 0.0


_CHART = ("ColorChecker", "Checker strut", "Dive lamp")
_FULL = (1920, 1080)
PHOTOGRAPHS = {
    "featured": Photograph(
        "reef", (0.0, -0.15, -4.95), (0.05, 8.0, -5.35), 22.0, _FULL, 8, 6,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "3", "--white-balance", "depth"),
         *("--sun-zenith", "30", "--sun-azimuth", "90")),
        hidden=_CHART,
    ),
    "reef": Photograph(
        "reef", (1.15, 1.4, -5.3), (-1.7, 4.3, -5.5), 24.0, _FULL, 4, 3,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "3", "--white-balance", "depth"),
         *("--sun-zenith", "30", "--sun-azimuth", "100")),
        hidden=_CHART,
    ),
    "window": Photograph(
        "reef", (-0.75, 3.9, -5.75), (-0.45, 6.4, -3.6), 16.0, _FULL, 4, 3,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "2"),
         *("--white-balance", "daylight", "--sun-zenith", "30", "--sun-azimuth", "-90"),
         *("--exposure-compensation", "0.8")),
    ),
    "wreck": Photograph(
        "wreck", (-3.7, 0.9, -18.5), (-2.9, 8.1, -21.0), 16.0, _FULL, 4, 3,
        (*("--water", "jerlov:IB", "--surface", "flat", "--sunlight", "1e-4"),
         *("--white-balance", "daylight", "--contrast", "medium-high")),
        rig="rov2",
    ),
    "wreck_day": Photograph(
        "wreck", (-13.3, -2.0, -10.3), (-3.4, 4.2, -6.9), 14.0, _FULL, 3, 3,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "3"),
         *("--white-balance", "daylight", "--sun-zenith", "35", "--sun-azimuth", "155"),
         *("--exposure-compensation", "0.2")),
        raised=10.0,
    ),
    "pool": Photograph(
        "pool", (0.3, -0.6, -1.2), (-0.15, 6.0, -1.75), 22.0, _FULL, 4, 3,
        (*("--water", "jerlov:I", "--surface", "waves", "--wind", "2", "--white-balance", "depth"),
         *("--sun-zenith", "30", "--sun-azimuth", "70")),
    ),
    "coastal": Photograph(
        "reef", (-0.55, 1.75, -5.45), (-1.75, 3.4, -5.6), 24.0, _FULL, 6, 3,
        (*("--water", "jerlov:1C", "--surface", "waves", "--wind", "3", "--white-balance", "depth"),
         *("--sun-zenith", "30", "--sun-azimuth", "100")),
        hidden=_CHART,
    ),
    "cave": Photograph(
        "cave", (-1.6, -4.6, -13.6), (1.0, 2.0, -11.0), 15.0, _FULL, 4, 3,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "2", "--sun-zenith", "15"),
         *("--sun-azimuth", "60", "--white-balance", "daylight"),
         *("--exposure-compensation", "0.5")),
    ),
    "above": Photograph(
        "reef", (0.3, -3.2, 2.2), (0.3, 3.2, -2.6), 20.0, _FULL, 4, 3,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "2"),
         *("--sun-zenith", "30", "--sun-azimuth", "80", "--floor-depth", "3.8"),
         *("--white-balance", "daylight", "--floor-reflectance", "0.3"),
         *("--exposure-compensation", "0.5")),
        hidden=_CHART,
        raised=3.2,
    ),
    "waterline": Photograph(
        "reef", (0.0, -0.6, 0.0), (0.0, 8.0, -2.3), 15.0, _FULL, 4, 3,
        (*("--water", "jerlov:IB", "--surface", "waves", "--wind", "2"),
         *("--sun-zenith", "35", "--sun-azimuth", "80", "--floor-depth", "3.8"),
         *("--white-balance", "daylight", "--floor-reflectance", "0.3"),
         *("--exposure-compensation", "0.4")),
        hidden=_CHART,
        raised=3.2,
    ),
}  # fmt: skip


def build(name: str, path: Path) -> None:
    """Build the scene of a photograph and store it."""
    photograph = PHOTOGRAPHS[name]
    scenes = importlib.import_module(f"{PACKAGE}.examples.scenes")
    cameras = importlib.import_module(f"{PACKAGE}.examples.parts.cameras")
    rigs = importlib.import_module(f"{PACKAGE}.scene.water.lamp_rigs")
    scenes.build_scene(photograph.scene)
    scene = bpy.context.scene
    for item in scene.objects:
        if item.parent is None:
            item.location.z += photograph.raised
        item.hide_render = item.name.startswith(tuple(photograph.hidden))
    scene.camera = cameras.camera(name, photograph.eye, photograph.target, photograph.lens)
    bpy.context.view_layer.update()
    if photograph.rig:
        rigs.add_rig(scene, photograph.rig)
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True)


def render(name: str, start: Callable[[], object]) -> Path:
    """Render a photograph, or go on with it; return the path of its PNG.

    Parameters
    ----------
    name : str
        One of :data:`PHOTOGRAPHS`.
    start : callable
        Registers the extension in an empty file.
    """
    photograph = PHOTOGRAPHS[name]
    folder = OUT / name
    scene = folder.with_suffix(".blend")
    if not scene.exists():
        start()
        build(name, scene)
    size = tuple(map(str, photograph.size))
    options = [*_ALL, *_CYCLES, *photograph.options, "--samples", str(photograph.samples)]
    options += ["--bands", str(photograph.bands)]
    options += ["--resolution", *size, "--resume"]
    command = [sys.executable, ROOT / "render_bands.py", scene, *options, "--out", folder]
    subprocess.run(list(map(str, command)), check=True)
    return folder / "0001.png"
