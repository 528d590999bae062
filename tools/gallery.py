"""Render what the gallery compares: engines, a turntable of Jerlov types, a night dive.

    python3 dev.py run tools/gallery.py engines       docs/pictures/engines.jpg
    python3 dev.py run tools/gallery.py turntable     docs/pictures/jerlov_types.webp
    python3 dev.py run tools/gallery.py ports         docs/pictures/ports.jpg
    python3 dev.py run tools/gallery.py night         docs/pictures/night_dive.webp
    python3 dev.py run tools/gallery.py glow          docs/pictures/fluorescence.jpg
    python3 dev.py run tools/gallery.py swell         docs/pictures/swell.webp
    python3 dev.py run tools/gallery.py silt          docs/pictures/silt.jpg

Passes are kept in out/gallery: a job that was stopped goes on.
"""

from __future__ import annotations

import importlib
import math
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import bpy
import make_pictures
import night_dive
import numpy as np
import silt_scene
import swell_scene
from PIL import Image, ImageDraw

ROOT = Path(__file__).resolve().parent.parent
OUT, PICTURES = ROOT / "out" / "gallery", ROOT / "docs" / "pictures"
TYPES = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C")
EACH = 5
FRAMES, RATE, SHOWN = EACH * len(TYPES), 6, 3
LIGHT = ("--illuminant", "clear-sky", "--irradiance", "above", "--sky", "clear")
ENGINES = {
    "eevee": ("--engine", "eevee", "--bands", "6", "--samples", "16"),
    "cycles": ("--engine", "cycles", "--bands", "6", "--samples", "32"),
}
SIDE_BY_SIDE = (
    *LIGHT, "--water", "jerlov:IB", "--surface", "flat", "--sun-zenith", "30",
    "--sun-azimuth", "100", "--white-balance", "depth", "--tone", "nikon-d7000",
    "--resolution", "480", "270",
)  # fmt: skip
TURNED = (
    *LIGHT, "--engine", "eevee", "--mode", "realtime", "--bands", "6", "--surface", "flat",
    "--sun-zenith", "30", "--sun-azimuth", "120", "--white-balance", "daylight",
    "--tone", "nikon-d7000", "--resolution", "360", "203", "--samples", "8",
)  # fmt: skip
BY_NIGHT = (
    "--water", "jerlov:IB", "--sunlight", "0", "--surface", "flat",
    "--white-balance", "daylight", "--tone", "nikon-d7000", "--exposure", "10.5",
    "--resolution", "320", "180", "--bands", "6",
)  # fmt: skip
NIGHT = {
    "eevee": ("--engine", "eevee", "--mode", "realtime", "--samples", "8"),
    "cycles": ("--engine", "cycles", "--samples", "32"),
}
PORTS = {
    "no port": (),
    "flat port": ("--housing", "flat"),
    "dome": ("--housing", "dome", "--dome-forward", "10"),
}
GLOWING = {"blue LED, 450 nm": "none", "behind a yellow filter": "long-pass:500,15"}
GAZE = (0.1, 0.0, -4.8)
CORALS = {"brain": "coral-green", "staghorn": "coral-cyan", "small table": "coral-red"}
AT_NIGHT = (
    "--water", "jerlov:IB", "--sunlight", "0", "--surface", "none", "--white-balance", "daylight",
    "--engine", "eevee", "--bands", "12", "--resolution", "400", "267", "--samples", "8",
)  # fmt: skip
IN_SWELL = (
    *LIGHT, "--engine", "eevee", "--mode", "realtime", "--water", "jerlov:IB", "--bands", "6",
    "--sun-zenith", "40", "--sun-azimuth", "200", "--raised-waves", "--whitecaps",
    "--tone", "nikon-d7000", "--resolution", "320", "180", "--samples", "4",
    *(word for option in swell_scene.OPTIONS.items() for word in option),
)  # fmt: skip
IN_SILT = (
    *LIGHT, "--engine", "eevee", "--mode", "realtime", "--water", "jerlov:IB", "--surface", "flat",
    "--sun-zenith", "30", "--sun-azimuth", "100", "--white-balance", "depth",
    "--tone", "nikon-d7000", "--resolution", "400", "267", "--bands", "6", "--samples", "16",
)  # fmt: skip
SILT = {"by day": (), "by a torch": ("--sunlight", "0", "--white-balance", "daylight")}
NEAR, WIDE = (0.15, -1.35, -4.45), 80.0
DEPTH, EYE, TARGET = 5.0, (0.1, -2.4, -4.25), (0.25, 0.0, -4.68)


def render(scene: Path, out: Path, *options: str) -> None:
    """Render a scene, or go on with it."""
    command = [sys.executable, ROOT / "render_bands.py", scene, *options, "--out", out, "--resume"]
    subprocess.run(list(map(str, command)), check=True)


def labelled(path: Path, text: str, size: int = 16) -> Image.Image:
    """Return a picture with its name in a corner."""
    picture = Image.open(path).convert("RGB")
    ImageDraw.Draw(picture).text((8, 6), text, "white", font_size=size)
    return picture


def write_beside(name: str, pictures: Sequence[Image.Image], quality: int = 86) -> None:
    """Write pictures beside each other."""
    sheet = Image.fromarray(np.concatenate([np.asarray(x) for x in pictures], axis=1))
    sheet.save(PICTURES / name, quality=quality)


def engines() -> None:
    """Write the corals of the turntable as both engines draw them."""
    scene = turntable_scene()
    sides = []
    for name, options in ENGINES.items():
        render(scene, OUT / name, *SIDE_BY_SIDE, *options, "--frames", str(SHOWN))
        sides.append(Image.open(OUT / name / f"{SHOWN:04d}.png").convert("RGB"))
    write_beside("engines.jpg", sides)


def build_turntable(path: Path) -> None:
    """Build corals that turn once on sand, with a chart beside them that does not."""
    scene = make_pictures.start()
    growth, materials, shapes, cameras = make_pictures.grown()
    chart = importlib.import_module("underwater_spectral.examples.reef.color_checker")
    turning = bpy.data.objects.new("Turntable", None)
    turning.location.z = -DEPTH
    scene.collection.objects.link(turning)
    objects = [
        (growth.meshes("brain")[0], (-0.35, -0.25, 0.1), 0.62),
        (growth.meshes("staghorn")[0], (0.4, 0.15, -0.02), 0.95),
        (growth.meshes("fan")[1], (-0.15, 0.42, -0.02), 0.9),
        (growth.meshes("sponge")[0], (0.15, -0.45, -0.02), 0.8),
        (growth.meshes("small table")[1], (-0.62, 0.3, -0.02), 0.8),
    ]
    for mesh, place, scale in objects:
        item = shapes.place(mesh, scene.collection, place, scale=scale)
        item.parent = turning
    board = chart.color_checker(materials)
    shapes.place(board, scene.collection, (1.12, -0.35, 0.05 - DEPTH))
    make_pictures.sand(materials, DEPTH)
    for frame in range(1, FRAMES + 1):
        turning.rotation_euler.z = 2.0 * math.pi * (frame - 1) / FRAMES
        turning.keyframe_insert("rotation_euler", index=2, frame=frame)
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.camera = cameras.camera("Turntable", EYE, TARGET, 33.0)
    make_pictures.store(path)


def turntable_scene() -> Path:
    """Return the stored turntable, built if there is none."""
    scene = OUT / "turntable.blend"
    if not scene.exists():
        build_turntable(scene)
    return scene


def turntable() -> None:
    """Write one turn of the corals in eight waters, five frames each."""
    scene = turntable_scene()
    pictures = []
    for number, water in enumerate(TYPES):
        first = EACH * number + 1
        frames, out = f"{first}-{first + EACH - 1}", OUT / f"jerlov_{water}"
        render(scene, out, *TURNED, "--water", f"jerlov:{water}", "--frames", frames)
        for frame in range(first, first + EACH):
            pictures.append(labelled(out / f"{frame:04d}.png", f"Jerlov {water}"))
    pictures[0].save(
        PICTURES / "jerlov_types.webp", save_all=True, append_images=pictures[1:],
        duration=round(1000 / RATE), loop=0, quality=86, method=6,
    )  # fmt: skip


def ports() -> None:
    """Write the corals near by without a port, through a flat one and through a dome."""
    scene = OUT / "ports.blend"
    if not scene.exists():
        build_turntable(OUT / "turntable.blend")
        camera = bpy.context.scene.camera
        camera.location, camera.data.angle = NEAR, math.radians(WIDE)
        make_pictures.store(scene)
    pictures = []
    for name, options in PORTS.items():
        out = OUT / f"port_{name}"
        render(scene, out, *TURNED, *options, "--water", "jerlov:IB", "--frames", str(SHOWN))
        pictures.append(labelled(out / f"{SHOWN:04d}.png", name))
    write_beside("ports.jpg", pictures, 84)


def night() -> None:
    """Write frames of a night dive as EEVEE draws them in real time, some of Cycles below."""
    scene = OUT / "night.blend"
    if not scene.exists():
        night_dive.build(scene)
    frames = {"eevee": night_dive.SHOWN, "cycles": night_dive.BESIDE}
    for name, options in NIGHT.items():
        chosen = ",".join(map(str, frames[name]))
        render(scene, OUT / f"night_{name}", *BY_NIGHT, *options, "--frames", chosen)
    picture = night_dive.sheet(OUT / "night_eevee", OUT / "night_cycles")
    picture.save(PICTURES / "night_dive.webp", quality=80, method=6)


def glow() -> None:
    """Write corals at night by a blue lamp, and the same passes behind a barrier filter."""
    scene, out = OUT / "glow.blend", OUT / "glow"
    if not scene.exists():
        build_glow(scene)
    render(scene, out, *AT_NIGHT)
    pictures = []
    for name, barrier in GLOWING.items():
        developed = OUT / f"glow_{barrier.replace(':', '_')}"
        options = ("--from", out / "job.json", "--develop", "--filter", barrier)
        command = [sys.executable, ROOT / "render_bands.py", *options, "--out", developed]
        subprocess.run(list(map(str, command)), check=True)
        pictures.append(labelled(developed / "0001.png", name))
    write_beside("fluorescence.jpg", pictures)


def swell() -> None:
    """Write ten seconds half under water, as EEVEE draws them in real time."""
    scene, out = OUT / "swell.blend", OUT / "swell"
    if not scene.exists():
        swell_scene.build(scene)
    render(scene, out, *IN_SWELL, "--frames", f"1-{swell_scene.FRAMES}")
    frames = [
        Image.open(out / f"{frame:04d}.png").convert("RGB")
        for frame in range(1, swell_scene.FRAMES + 1)
    ]
    frames[0].save(
        PICTURES / "swell.webp", save_all=True, append_images=frames[1:], quality=30, method=6,
        duration=1000 // swell_scene.RATE, loop=0,
    )  # fmt: skip


def silt() -> None:
    """Write corals and silt that has been stirred up, by day and by a torch."""
    scene = OUT / "silt.blend"
    if not scene.exists():
        silt_scene.build(scene)
    pictures = []
    for name, options in SILT.items():
        out = OUT / f"silt_{name.replace(' ', '_')}"
        render(scene, out, *IN_SILT, *options)
        pictures.append(labelled(out / "0001.png", name, 14))
    write_beside("silt.jpg", pictures, 84)


def build_glow(path: Path) -> None:
    """Build three corals that fluoresce, on sand, in the light of one blue lamp."""
    scene = make_pictures.start()
    package, stored = "underwater_spectral", "scene.stored_settings"
    importlib.import_module(f"{package}.{stored}").register()
    growth, materials, shapes, cameras = make_pictures.grown()
    places = ((-0.4, -0.3, 0.05, 0.4), (0.45, -0.4, 0.0, 1.1), (0.1, 0.45, 0.0, 0.9))
    for (kind, fluorophore), (x, y, z, scale) in zip(CORALS.items(), places, strict=True):
        mesh = growth.meshes(kind)[-1]
        item = shapes.place(mesh, scene.collection, (x, y, z - DEPTH), scale=scale)
        for material in item.data.materials:
            material.underwater.fluorophore, material.underwater.fluorescence = fluorophore, 0.3
    make_pictures.sand(materials, DEPTH)
    scene.camera = cameras.camera("Night", EYE, GAZE, 45.0)
    light = bpy.data.lights.new("Lamp", "SPOT")
    light.energy, light.spot_size, light.shadow_soft_size = 20.0, math.radians(70), 0.03
    light.underwater.spectrum = "led:450,20"
    lamp = bpy.data.objects.new("Lamp", light)
    scene.collection.objects.link(lamp)
    cameras.aim(lamp, (-0.7, -2.2, -3.7), GAZE)
    make_pictures.store(path)


if __name__ == "__main__":
    for wanted in sys.argv[1:]:
        known = (engines, turntable, night, ports, glow, swell, silt)
        {one.__name__: one for one in known}[wanted]()
