"""Things mirrored in the water surface, seen from below: EEVEE against Cycles.

    python3 dev.py run -m benchmarks mirrored [--samples N] [--case K]

writes docs/measured/mirrored.md and docs/measured/mirrored.jpg.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.engines.band_engine import BandEngine
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr
from . import grey_scene
from ._against_cycles import Pair, run, write_sheet
from ._shade_scenes import matt

TARGET = 2.0
_WIDTH, _HEIGHT, _BLOCK = 120, 66, 6
_BANDS, _FLOOR, _DEPTH = 3, 8.0, 1.5
_SAMPLES = 8

Place = tuple[float, float, float]


def _coat(colour: Place, *, smooth: bool = True) -> None:
    item = bpy.context.object
    if smooth:
        item.data.shade_smooth()
    item.data.materials.append(matt(colour))


def _ball(place: Place, size: Place, colour: Place, turn: float = 0.0) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=place, segments=64, ring_count=32)
    bpy.context.object.scale = size
    bpy.context.object.rotation_euler.z = turn
    _coat(colour)


def _limb(place: Place, radius: float, length: float, tilt: float, colour: Place) -> None:
    bpy.ops.mesh.primitive_cylinder_add(
        radius=radius, depth=length, location=place, vertices=48, rotation=(0.0, tilt, 0.0)
    )
    _coat(colour)
    for face in bpy.context.object.data.polygons:
        face.use_smooth = len(face.vertices) == 4


def _posts() -> None:
    _limb((-1.0, 4.0, -2.2), 0.15, 3.2, 0.0, (0.5, 0.3, 0.15))
    _limb((0.6, 3.5, -3.0), 0.12, 8.0, 0.0, (0.6, 0.6, 0.6))
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(2.0, 5.0, -0.5))
    _coat((0.7, 0.7, 0.1), smooth=False)


def _diver() -> None:
    suit, skin, level = (0.06, 0.06, 0.07), (0.55, 0.35, 0.25), math.pi / 2
    _limb((0.0, 3.2, -0.8), 0.2, 0.8, level, suit)
    _ball((0.62, 3.2, -0.72), (0.14, 0.13, 0.16), skin)
    _limb((-0.1, 3.2, -0.52), 0.1, 0.6, level, (0.75, 0.6, 0.05))
    for side in (-0.12, 0.12):
        _limb((-0.8, 3.2 + side, -0.85), 0.08, 0.85, level + 0.1, suit)
        _ball((-1.4, 3.2 + side, -0.9), (0.28, 0.1, 0.03), (0.1, 0.3, 0.7))


def _hull(turn: float) -> Callable[[], None]:
    def add() -> None:
        _ball((0.2, 4.2, 0.0), (1.7, 0.65, 0.5), (0.6, 0.15, 0.1), math.radians(turn))

    return add


@dataclass(frozen=True)
class Case:
    """A scene under a surface: what is there, how far the camera looks up, and the wind."""

    title: str
    things: Callable[[], None]
    up: float = 10.0
    wind: float | None = None

    def plan(self, *, mirrored: bool = True, samples: int = _SAMPLES) -> render_plan.RenderPlan:
        """Return what is rendered."""
        return render_plan.make_plan(
            SceneSettings(
                water="jerlov:IB",
                phase="hg:0.9",
                illuminant="clear-sky",
                sky="clear",
                bands=_BANDS,
                surface="flat" if self.wind is None else "waves",
                wind_speed=self.wind or 0.0,
                sun_zenith=35.0,
                sun_azimuth=60.0,
                floor_depth=_FLOOR,
                floor_reflectance="0.3",
                samples=samples,
                mirrored_things=mirrored,
            )
        )


CASES = (
    Case("posts, flat", _posts),
    Case("diver, flat", _diver, up=15.0),
    Case("hull from abeam, flat", _hull(0.0)),
    Case("hull at 45°, flat", _hull(45.0)),
    Case("hull from ahead, flat", _hull(90.0)),
    Case("posts, wind 5 m/s", _posts, wind=5.0),
    Case("diver, wind 5 m/s", _diver, up=15.0, wind=5.0),
    Case("hull at 45°, wind 5 m/s", _hull(45.0), wind=5.0),
)


def build(case: Case) -> bpy.types.Object:
    """Fill an empty file with the things of a case; return the camera."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = _WIDTH, _HEIGHT
    scene.render.resolution_percentage = 100
    scene.cycles.pixel_filter_type = "BOX"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, -_DEPTH)
    camera.rotation_euler = (math.radians(90.0 + case.up), 0.0, 0.0)
    camera.data.angle = math.radians(75.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    case.things()
    bpy.context.view_layer.update()
    return camera


@dataclass(frozen=True, eq=False)
class Found:
    """Pictures of a case, scene-linear, what they differ by, and CPU seconds of a picture."""

    cycles: NDArray[np.float64]
    eevee: NDArray[np.float64]
    without: float
    bands: float
    realtime: float
    worst: float
    noise: float
    seconds: tuple[float, float]


def measure(case: Case, samples: int) -> Found:
    """Render a case."""
    camera, plan = build(case), case.plan()
    scene = bpy.context.scene
    extent = water_body.water_extent(scene, plan.column, _DEPTH)
    develop = plan.reduction(_DEPTH).apply

    def drawn(engine: BandEngine, now: render_plan.RenderPlan) -> NDArray[np.float64]:
        return develop(grey_scene.band_image(engine, now, _DEPTH))

    pictures, seconds = [], []
    for mirrored in (False, True):
        now = case.plan(mirrored=mirrored)
        with engines.eevee_bands(scene, camera, now, extent, _DEPTH) as engine:
            pictures.append(drawn(engine, now))
            start = time.process_time()
            drawn(engine, now)  # the shaders are compiled, the light is solved
            seconds.append(time.process_time() - start)
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(scene, camera, plan, extent, _DEPTH) as engine,
    ):
        path = Path(folder, "picture.exr")
        engine.frame(plan, _DEPTH)(engine.passes[0], path)
        realtime = read_exr(path)[0].astype(np.float64)
    halves = []
    slow = replace(plan, settings=replace(plan.settings, samples=samples))
    for seed in (1, 2):
        with engines.cycles_bands(scene, camera, slow, extent, seed=seed) as engine:
            halves.append(drawn(engine, slow))
    cycles = (halves[0] + halves[1]) / 2
    without, bands, fast = (_delta_e(x, cycles) for x in (*pictures, realtime))
    return Found(
        cycles, pictures[1], float(without.mean()), float(bands.mean()), float(fast.mean()),
        float(np.quantile(bands, 0.95)), float(_delta_e(*halves).mean()) / 2,
        (seconds[0], seconds[1]),
    )  # fmt: skip


def _delta_e(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    blocks = (grey_scene.blocks(picture, _BLOCK) for picture in (one, other))
    return delta_e_CIE2000_images(*blocks)


_TEXT = """# Things mirrored in the surface

Cycles traces what the surface mirrors; EEVEE draws it in a second picture, from the mirror image
of the camera, and follows rays that waves turn in a few steps. Jerlov IB (HG 0.9), clear sky, sun
at 35°, camera at {depth:g} m. Cycles: two pictures of {samples} samples, noise half their
difference. ΔE2000 of {block} × {block} of {width} × {height} pixels; CPU seconds of one pass.

| scene | without | bands | real time | bands, 95 % | noise | seconds |
|---|---|---|---|---|---|---|
{rows}

**The largest mean of the scenes measured is {worst:.1f}; the target is {target:g} or less in
each: {verdict}.**

![Cycles above, EEVEE below](mirrored.jpg)

Not drawn: [limits](../limits.md#surface).

Repeat: `python3 dev.py run -m benchmarks mirrored`
"""


def report(found: dict[Case, Found], samples: int) -> str:
    """Return the page."""
    rows = [
        f"| {case.title} | {x.without:.1f} | {x.bands:.1f} | {x.realtime:.1f} | {x.worst:.1f} "
        f"| {x.noise:.1f} | {x.seconds[0]:.1f}, {x.seconds[1]:.1f} |"
        for case, x in found.items()
    ]
    worst = max(max(x.bands, x.realtime) for x in found.values())
    return _TEXT.format(
        depth=_DEPTH, samples=samples, block=_BLOCK,
        width=_WIDTH, height=_HEIGHT, rows="\n".join(rows), worst=worst, target=TARGET,
        verdict="met" if worst <= TARGET else "missed",
    )  # fmt: skip


def _write(found: dict[Case, Found], samples: int, docs: Path) -> None:
    pairs = [Pair(case.title, x.cycles, x.eevee) for case, x in found.items()]
    across = len(pairs) // 2
    write_sheet([*pairs[::2], *pairs[1::2]], across, (10.0, 6.6), docs / "mirrored.jpg")
    (docs / "mirrored.md").write_text(report(found, samples), encoding="utf-8")


def main(arguments: Sequence[str]) -> None:
    """Measure the scenes and write the page."""

    def numbers(x: Found) -> tuple[float, ...]:
        return x.without, x.bands, x.realtime, x.worst, x.noise, *x.seconds

    run("mirrored", CASES, measure, numbers, _write, arguments, samples=128)
