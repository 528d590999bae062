"""Water put before dry pictures: against renders of the same scenes in it, and how fast."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.applied_pictures import AppliedSettings, PictureFilter
from ..datasets.camera import PinholeCamera
from ..datasets.cameras_and_rigs import CameraRig, RigLamp
from ..datasets.picture_codes import read_codes, read_rgb, srgb_codes
from ..scene.readers.pinhole import pinhole_of
from ..uw_spectral.imaging import Description, SurfaceDescription, WaterDescription
from ..uw_spectral.spectra.spectral_image import read_exr, write_codes
from ._places import Array, Compared, Place, delta_e, sheet
from ._scenery import ball, block, camera_at, ground
from .runner import Ask, Page, Target, least_seconds, table

SIZE, FIELD, DEPTH, FLOOR = (80, 45), 70.0, 5.0, 7.5
PITCH = -10.0
_SUN_IN_WATER = math.asin(math.sin(math.radians(30.0)) / 1.34)
_SAMPLES, _BANDS, _SAND, _DRY_SAMPLES, _BLOCK = 256, 9, 0.5, 256, 5
_NEAR, _FAR = 1.0, 12.0  # m, of the floor of pictures that are timed
_FULL_HD = PinholeCamera.from_field_of_view(1920, 1080, FIELD)
_RIG = CameraRig(
    "two lamps",
    tuple(RigLamp(2000.0, "lm", "led", (x, 0.1, 0.0), (-0.2 * x, 0.0, -1.0), 90.0)
          for x in (-0.4, 0.4)),
)  # fmt: skip


def _camera() -> bpy.types.Object:
    tilt = (math.radians(90.0 + PITCH), 0.0, 0.0)
    return camera_at((0.0, 0.0, -DEPTH), tilt, math.radians(FIELD))


def open_floor() -> bpy.types.Object:
    """Boxes and balls that stand apart on sand; return the camera."""
    ground(-FLOOR, (_SAND,) * 3)
    for x, y, size, colour in (
        (-1.4, 4.0, 0.7, (0.7, 0.1, 0.08)), (0.4, 5.5, 0.9, (0.15, 0.5, 0.12)),
        (2.6, 7.5, 1.2, (0.75, 0.65, 0.1)), (-4.0, 10.0, 1.5, (0.2, 0.25, 0.7)),
    ):  # fmt: skip
        block(f"box {x:g}", (x, y, -FLOOR + size / 4), (size, size, size / 2), colour, 30.0 * x)
    ball((1.5, 3.6, -FLOOR + 0.3), 0.3, (0.8, 0.8, 0.8))
    return _camera()


def clutter() -> bpy.types.Object:
    """Walls and a roof, which keep light off; return the camera."""
    ground(-FLOOR, (_SAND,) * 3)
    block("left", (-2.0, 6.0, -FLOOR + 1.5), (0.4, 5.0, 3.0), (0.6, 0.3, 0.2))
    block("right", (2.0, 6.0, -FLOOR + 1.5), (0.4, 5.0, 3.0), (0.3, 0.4, 0.6))
    block("roof", (0.0, 7.0, -FLOOR + 3.1), (5.0, 2.5, 0.2), (0.5, 0.5, 0.5))
    return _camera()


PLACES = tuple(
    Place(f"{name}, {water}", build, water, samples=_SAMPLES, drawn=32, size=SIZE,
          settings={"bands": _BANDS, "floor_depth": FLOOR, "floor_reflectance": f"{_SAND:g}"})
    for name, build in (("open", open_floor), ("clutter", clutter))
    for water in (("IB", "II", "3C") if name == "open" else ("IB",))
)  # fmt: skip


def dry(azimuth: float, samples: int = _DRY_SAMPLES) -> Array:
    """Render the open scene in the air, where white that faces upwards is 1: (h, w, 3).

    Under a white sky and a white sun, refracted as in the water, which gives half of the light.
    """
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("white")
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.energy, lamp.angle = 0.5 * math.pi / math.cos(_SUN_IN_WATER), 0.0
    sun = bpy.data.objects.new("sun", lamp)
    sun.rotation_euler = (0.0, _SUN_IN_WATER, math.radians(azimuth) + math.pi)
    scene.collection.objects.link(sun)
    scene.render.engine, scene.cycles.samples = "CYCLES", samples
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder, "dry.exr"))
        bpy.ops.render.render(write_still=True)
        return read_exr(Path(folder, "dry.exr"))[0][..., :3].astype(np.float64)


def applied(place: Place, camera: bpy.types.Object, picture: Array) -> NDArray[np.float32]:
    """Put the water of a place before its dry picture, with the depth of its scene."""
    scene, taken = bpy.context.scene, pinhole_of(bpy.context.scene, camera)
    graph, eye = bpy.context.evaluated_depsgraph_get(), camera.matrix_world.translation
    to_world = np.array(camera.matrix_world.to_3x3()) * (1.0, -1.0, -1.0)

    def planar(w: Array) -> float:
        """Depth along the axis, 0 where nothing is."""
        found, where, *_ = scene.ray_cast(graph, eye, to_world @ w)
        return (where - eye).length * w[2] if found else 0.0

    depth = np.apply_along_axis(planar, -1, taken.rays())
    settings = AppliedSettings(place.plan(1).description, depth=DEPTH, pitch=PITCH)
    return PictureFilter(settings).picture(picture, depth, taken)


def _beer_lambert(rgb: NDArray[np.uint8], depth: Array) -> NDArray[np.uint8]:
    """What filters usually are: three coefficients, e^(-c z) and a veil, in numpy."""
    c, veil = np.array([0.5, 0.12, 0.08], np.float32), np.array([0.0, 0.1, 0.2], np.float32)
    linear = (rgb.astype(np.float32) / 255.0) ** 2.2
    left = np.exp(-depth.astype(np.float32)[..., None] * c)
    seen = linear * left + veil * (1.0 - left)
    return (255.0 * np.clip(seen, 0.0, 1.0) ** (1.0 / 2.2)).astype(np.uint8)


def _speed() -> tuple[list[list[str]], float]:
    height, width = _FULL_HD.height, _FULL_HD.width
    rgb = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
    depth = np.linspace(_FAR, _NEAR, height)[:, None] * np.ones((1, width))
    sea = Description(WaterDescription("jerlov:IB"), surface=SurfaceDescription("flat"))
    base = least_seconds(lambda: _beer_lambert(rgb, depth))
    rows, first = [["e^(-c z) and a veil, three coefficients", "", f"{1 / base:.1f}", "1"]], 0.0
    for name, settings in (
        ("clear water", AppliedSettings(sea)),
        ("with noise", AppliedSettings(sea, iso=400.0)),
        ("with blur", AppliedSettings(sea, blur=True)),
        ("with two lamps", AppliedSettings(sea, rig=_RIG)),
    ):
        start = time.process_time()
        water = PictureFilter(settings)

        def work(water: PictureFilter = water) -> object:
            found = water.picture(rgb, depth, _FULL_HD)
            return srgb_codes(np.moveaxis(found, -1, 0))

        work()
        prepared, taken = time.process_time() - start, least_seconds(work)
        first = first or taken
        rows.append([name, f"{prepared:.0f}", f"{1 / taken:.2g}", f"{taken / base:.2g}"])
    return rows, 1.0 / first


def _files() -> float:
    """Seconds that a Full HD picture, its depth and what is written take as PNG."""
    y, x = np.mgrid[: _FULL_HD.height, : _FULL_HD.width]
    smooth = np.stack([x // 8, y // 5, (x + y) // 12], axis=-1).astype(np.uint8)
    with tempfile.TemporaryDirectory() as folder:
        rgb, depth = Path(folder, "rgb.png"), Path(folder, "depth.png")
        write_codes(rgb, smooth)
        write_codes(depth, (1000 + y).astype(np.uint16))

        def work() -> None:
            write_codes(rgb, read_rgb(rgb))
            read_codes(depth)

        return least_seconds(work)


def measure(ask: Ask) -> Mapping[str, object]:
    """Render, apply and compare; then time."""
    rows, worst, pictures = [], 0.0, {}
    for place in PLACES:
        place.open()
        azimuth = place.plan(1).description.light.azimuth
        picture = ask.kept(f"{place.name} dry", partial(dry, azimuth))
        camera = place.open()
        found = applied(place, camera, picture)
        wet = ask.kept(f"{place.name} eevee", place.in_real_time)
        traced = ask.kept(f"{place.name} cycles", partial(place.by_cycles, camera))
        seen = Compared(place.develop(camera)(traced), {"filter": found, "dry": picture}, _BLOCK)
        errors = [delta_e(found, wet, _BLOCK), seen.delta_e("filter")]
        if place.build is open_floor:
            worst = max(worst, *(float(x.mean()) for x in errors))
        errors.append(seen.delta_e("dry"))
        rows.append([place.name, *(f"{x.mean():.2f}" for x in errors),
                     *(f"{np.quantile(x, 0.95):.1f}" for x in errors[:2]),
                     f"{seen.noise.mean():.2f}"])  # fmt: skip
        pictures[place.name] = [picture, found, wet, seen.reference]
    sheet(
        ask.shown("applied_pictures.jpg"), pictures, ("dry", "filter", "EEVEE", "Cycles"), size=2.6
    )
    speed, per_second = _speed()
    head = ("scene, water", "EEVEE", "Cycles", "dry", "EEVEE, 95 %", "Cycles, 95 %", "noise")
    return {
        "rows": table(head, rows),
        "speed": table(("", "once, s", "pictures/s", "of it"), speed),
        "open": worst, "seconds": 1.0 / per_second, "files": _files(),
    }  # fmt: skip


PAGE = Page(
    "Water put before pictures that exist",
    """
`uw-spectral apply`, or `PictureFilter`, is given a dry picture and its depth: 80 × 45, Cycles,
under a white sun and sky, in which white that faces upwards is 1. The same scenes are rendered in
the water, by EEVEE in real time and by Cycles ({samples} samples, {bands} bands). Camera at 5 m,
10° down, grey floor at 7.5 m, flat surface, clear sky, sun at 30°. ΔE2000 of blocks of 5 × 5
pixels; *dry*: of the picture without water; *noise*: half of what two pictures of Cycles, of which
its column has the mean, differ.

{rows}

![dry, filter, EEVEE, Cycles](applied_pictures.jpg)

*Clutter* has walls and a roof. What keeps light off is in the dry picture, but there half of the
light is the sun's; the filter lights all that is seen by Ed of its depth.

## Full HD on one core
Pictures of noise, in memory, 8-bit codes in and out, time of the processor; *of it*: over
three coefficients in numpy. *Once*: what a camera and a water take before the first picture,
with that picture.

{speed}

Reading and writing PNG takes {files:.2f} s a picture besides (PNG of smooth pictures).
""",
    (
        Target("mean ΔE2000 in the open, worst water and engine", "open", 3.0),
        Target("seconds a Full HD picture in clear water", "seconds", 0.2),
    ),
    {"samples": _SAMPLES, "bands": _BANDS},
)
