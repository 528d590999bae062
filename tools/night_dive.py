"""A night dive of ten seconds: a vehicle's two lamps swim to a wreck that a torch shines out of.

``tools/gallery.py night`` renders it. The scene is the example wreck; the camera carries two lamps
of an ROV through the breach in her side, and in the hold a torch moves across the view and turns
towards it.
"""

from __future__ import annotations

import importlib
import math
from pathlib import Path

import bpy
import make_pictures
import numpy as np
from PIL import Image, ImageDraw

RATE, SECONDS = 24, 10
FRAMES = RATE * SECONDS
SHOWN = tuple(range(1, FRAMES + 1, FRAMES // 12))
BESIDE = SHOWN[::3]
"""Frames that Cycles draws too."""
_KEYS = 12
_LENS = 22.0
# In the ship's space, from the breach: camera and what it looks at, torch and what it shines at.
_EYE = ((2.6, 8.6, 1.6), (1.6, 6.6, 0.9), (0.6, 4.8, 0.5), (0.2, 3.4, 0.3))
_LOOKS = ((-1.6, -1.0, -0.2), (-1.2, -1.4, -0.4), (-1.0, -2.0, -0.5), (-2.6, -2.0, -0.6))
_TORCH = ((2.2, -1.0, 0.2), (1.0, -0.6, 0.4), (-0.6, -0.6, 0.2), (-2.4, -0.4, 0.0))
_SHINES = ((-3.0, -2.2, -0.8), (-2.5, 1.0, 0.0), (0.5, 6.0, 0.6), (2.5, 2.5, 0.2))
_LUMENS, _CONE = 3000.0, 40.0


def along(places: tuple[tuple[float, ...], ...], fraction: float) -> np.ndarray:
    """Place on a smooth way through places (Catmull and Rom), for fractions of 0 to 1."""
    known = np.array([places[0], *places, places[-1]], float)
    whole, t = divmod(fraction * (len(places) - 1), 1.0)
    if whole == len(places) - 1:
        return known[-1]
    p, q, r, s = known[int(whole) : int(whole) + 4]
    bend = (2 * p - 5 * q + 4 * r - s) * t**2 + (3 * q - p - 3 * r + s) * t**3
    return q + ((r - p) * t + bend) / 2


def build(path: Path, rate: int = RATE) -> None:
    """Build the wreck with the camera and its lamps and the torch under way, and store it."""
    scene = make_pictures.start()
    package = "underwater_spectral"
    importlib.import_module(f"{package}.examples.scenes").build_scene("wreck", detail="draft")
    cameras = importlib.import_module(f"{package}.examples.parts.cameras")
    rigs = importlib.import_module(f"{package}.scene.water.lamp_rigs")
    hull = importlib.import_module(f"{package}.examples.wreck.hull")
    world = importlib.import_module(f"{package}.examples.wreck.layout").world
    x, z = hull.BREACH

    def at(places: tuple[tuple[float, ...], ...], fraction: float) -> np.ndarray:
        return world(np.add(along(places, fraction), (x, 0.0, z)))

    scene.render.fps, scene.frame_start, scene.frame_end = rate, 1, rate * SECONDS
    eye = scene.camera = cameras.camera("Dive", at(_EYE, 0.0), at(_LOOKS, 0.0), _LENS)
    rigs.add_rig(scene, "rov2", eye)
    torch = rigs.add_lamp(scene, "Torch", _LUMENS, "")
    torch.data.type, torch.data.spot_size, torch.data.spot_blend = "SPOT", math.radians(_CONE), 0.35
    for step in range(_KEYS + 1):
        fraction = step / _KEYS
        for item, places, targets in ((eye, _EYE, _LOOKS), (torch, _TORCH, _SHINES)):
            before = item.rotation_euler.copy()
            cameras.aim(item, at(places, fraction), at(targets, fraction))
            item.rotation_euler = item.matrix_world.to_euler("XYZ", before)
            for channel in ("location", "rotation_euler"):
                item.keyframe_insert(channel, frame=1 + fraction * (rate * SECONDS - 1))
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True)


def sheet(eevee: Path, cycles: Path) -> Image.Image:
    """Put the frames side by side, those of Cycles under EEVEE's."""
    found = {}
    for row, (frames, folder) in enumerate(((SHOWN, eevee), (BESIDE, cycles))):
        for frame in frames:
            found[row, frame] = Image.open(folder / f"{frame:04d}.png").convert("RGB")
    width, height = found[0, SHOWN[0]].size
    columns = len(BESIDE)
    whole = Image.new("RGB", (columns * width, 4 * height))
    for (row, frame), picture in found.items():
        column, down = divmod(SHOWN.index(frame), len(SHOWN) // columns)
        place = column * width, (3 * row + down) * height
        name = f"{(frame - 1) / RATE:.1f} s{', Cycles' if row else ''}"
        ImageDraw.Draw(picture).text((6, 4), name, "white", font_size=14)
        whole.paste(picture, place)
    return whole
