"""Render the film of two minutes: a reef by day, dusk, a torch, other cameras, a swell, a wreck.

    python3 dev.py run tools/film.py [--rate 24] [--size 960 540] [--samples 16] [--shots day dusk]
    python3 dev.py run tools/film.py --sheet …      the middle of each shot alone

All of it is EEVEE in real time, by ``render_bands.py``; out/film/film.mp4 and a sheet of its
shots, docs/pictures/film.jpg if it has all. Frames are kept in out/film: a job that was stopped
goes on.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import make_pictures
import night_dive
import swell_scene
from PIL import Image, ImageDraw

ROOT = Path(__file__).resolve().parent.parent
OUT, SHEET = ROOT / "out" / "film", ROOT / "docs" / "pictures" / "film.jpg"
COLUMNS = 4
_REEF_SECONDS = 76
_KEYS = 19
# Camera and what it looks at, a pair for each quarter of the time over the reef, m.
_EYE = ((0.0, -1.6, -4.75), (0.1, -0.15, -4.95), (0.9, 1.0, -5.15), (0.3, 1.5, -5.3),
        (-0.55, 1.75, -5.45))  # fmt: skip
_LOOKS = ((0.05, 8.0, -5.5), (0.05, 7.0, -5.4), (-1.3, 5.2, -5.5), (-1.7, 4.2, -5.6),
          (-1.75, 3.4, -5.6))  # fmt: skip
_SUN = ((0, 30.0, 1.0, 0.0), (30, 30.0, 1.0, 0.0), (46, 74.0, 1.0, -2.0), (54, 75.0, 2e-3, -4.0))
"""Second, the sun's zenith angle in degrees, the fraction of sun and sky, and the stops that an
exposure for the place stays behind: by itself it would make day of dusk."""
_LAMP_ON = 54
_REALTIME = ("--engine", "eevee", "--mode", "realtime", "--resume", "--tone", "nikon-d7000")
_SEA = (
    *("--illuminant", "clear-sky", "--irradiance", "above", "--sky", "clear"),
    *("--water", "jerlov:IB", "--bands", "6", "--surface", "waves"),
)
_REEF = (*_SEA, "--wind", "3", "--sun-azimuth", "100", "--white-balance", "depth")
_SENSORS = (
    "ARRI D21", "Canon EOS 5D Mark II", "Nikon D7000", "Sony ILCE-7M3", "Fuji Eterna 500",
    "cie1931",
)  # fmt: skip
_EACH = 4


@dataclass(frozen=True)
class Shot:
    """A part of the film.

    Parameters
    ----------
    scene : str
        One of :data:`SCENES`.
    start, end : float
        Of the scene's time, s.
    options : sequence of str
        Of ``render_bands.py``, besides those of all.
    caption : str
    """

    scene: str
    start: float
    end: float
    options: Sequence[str]
    caption: str


SHOTS = {
    "day": Shot("reef", 0, 30, (*_REEF, "--exposure", "auto"), "Jerlov IB, by day"),
    "dusk": Shot("reef", 30, 54, (*_REEF, "--exposure", "auto"), "the sun goes down"),
    "torch": Shot(
        "lit_reef", 54, 76, (*_REEF, "--white-balance", "daylight", "--exposure", "5.5"), "a torch"
    ),
    **{
        f"sensor_{number}": Shot(
            "reef", 12 + _EACH * number, 12 + _EACH * (number + 1),
            (*_REEF, "--exposure", "auto", "--sensor", sensor), sensor,
        )
        for number, sensor in enumerate(_SENSORS)
    },
    "swell": Shot(
        "swell", 0, swell_scene.SECONDS,
        (*_SEA, "--sun-zenith", "40", "--sun-azimuth", "200", "--raised-waves", "--whitecaps",
         *(word for option in swell_scene.OPTIONS.items() for word in option)),
        "half under water",
    ),
    "wreck": Shot(
        "wreck", 0, night_dive.SECONDS,
        ("--water", "jerlov:IB", "--sunlight", "0", "--surface", "flat", "--bands", "6",
         "--white-balance", "daylight", "--exposure", "10.5"),
        "a wreck by two lamps and a torch",
    ),
}  # fmt: skip


def reef(path: Path, rate: int, *, lit: bool = False) -> None:
    """Build the reef with a camera that glides and a sun that sets, and store it."""
    scene = make_pictures.start()
    package = "underwater_spectral"
    importlib.import_module(f"{package}.examples.scenes").build_scene("reef", detail="panel")
    cameras = importlib.import_module(f"{package}.examples.parts.cameras")
    scene.render.fps, scene.frame_start, scene.frame_end = rate, 1, rate * _REEF_SECONDS
    for item in scene.objects:
        item.hide_render = item.name.startswith(("ColorChecker", "Checker strut", "Dive lamp"))
    eye = scene.camera = cameras.camera("Film", _EYE[0], _LOOKS[0], 22.0)
    for step in range(_KEYS + 1):
        fraction, before = step / _KEYS, eye.rotation_euler.copy()
        cameras.aim(eye, night_dive.along(_EYE, fraction), night_dive.along(_LOOKS, fraction))
        eye.rotation_euler = eye.matrix_world.to_euler("XYZ", before)
        for channel in ("location", "rotation_euler"):
            eye.keyframe_insert(channel, frame=1 + fraction * rate * _REEF_SECONDS)
    water = scene.underwater
    for second, *values in _SUN:
        named = zip(("sun_zenith", "sunlight", "exposure_compensation"), values, strict=True)
        for name, value in list(named)[: 2 if lit else 3]:
            setattr(water, name, value)
            water.keyframe_insert(name, frame=1 + rate * second)
    if lit:
        rigs = importlib.import_module(f"{package}.scene.water.lamp_rigs")
        for item in rigs.add_rig(scene, "torch", eye):
            power = item.data.energy
            for second, share in ((_LAMP_ON, 0.0), (_LAMP_ON + 1, 1.0)):
                item.data.energy = share * power
                item.data.keyframe_insert("energy", frame=1 + rate * second)
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True)


SCENES = {
    "reef": reef,
    "lit_reef": functools.partial(reef, lit=True),
    "swell": swell_scene.build,
    "wreck": night_dive.build,
}


def render(name: str, chosen: argparse.Namespace) -> list[Path]:
    """Render what is missing of a shot; return its frames."""
    shot, folder = SHOTS[name], OUT / f"{chosen.rate}"
    scene = folder / f"{shot.scene}.blend"
    if not scene.exists():
        SCENES[shot.scene](scene, chosen.rate)
    first, last = (round(second * chosen.rate) for second in (shot.start, shot.end))
    if chosen.sheet:
        first = (first + last) // 2
        last = first + 1
    command = [sys.executable, ROOT / "render_bands.py", scene, *_REALTIME, *shot.options]
    command += ["--resolution", *chosen.size, "--samples", chosen.samples]
    command += ["--frames", f"{first + 1}-{last}", "--out", folder / name]
    subprocess.run(list(map(str, command)), check=True)
    return [folder / name / f"{frame:04d}.png" for frame in range(first + 1, last + 1)]


def captioned(file: Path, caption: str) -> Image.Image:
    """Read a frame and write its caption into the corner."""
    picture = Image.open(file).convert("RGB")
    size = max(picture.height // 18, 9)
    place = size // 2, picture.height - 3 * size // 2
    ImageDraw.Draw(picture).text(place, caption, "white", font_size=size)
    return picture


def write(frames: Sequence[Image.Image], rate: int) -> None:
    """Write the film with Blender's own encoder."""
    stills = OUT / f"{rate}" / "stills"
    stills.mkdir(parents=True, exist_ok=True)
    for number, picture in enumerate(frames):
        picture.save(stills / f"{number:05d}.png")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    strips = scene.sequence_editor_create().strips
    strip = strips.new_image("film", str(stills / "00000.png"), channel=1, frame_start=1)
    for number in range(1, len(frames)):
        strip.elements.append(f"{number:05d}.png")
    strip.frame_final_duration = scene.frame_end = len(frames)
    scene.view_settings.view_transform = "Standard"
    render = scene.render
    render.fps, render.resolution_percentage = rate, 100
    render.resolution_x, render.resolution_y = frames[0].size
    render.image_settings.media_type, render.filepath = "VIDEO", str(OUT / "film.mp4")
    render.ffmpeg.format, render.ffmpeg.codec = "MPEG4", "H264"
    render.use_file_extension = False
    bpy.ops.render.render(animation=True)


def sheet(shots: Sequence[Sequence[Image.Image]]) -> Image.Image:
    """Put the middle frames of shots side by side."""
    shown = [frames[len(frames) // 2] for frames in shots]
    width, height = shown[0].size
    whole = Image.new("RGB", (COLUMNS * width, -(-len(shown) // COLUMNS) * height))
    for number, picture in enumerate(shown):
        row, column = divmod(number, COLUMNS)
        whole.paste(picture, (column * width, row * height))
    return whole


def main() -> None:
    """Render the shots, and write film and sheet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=int, default=24, help="frames per second")
    parser.add_argument("--size", type=int, nargs=2, default=(960, 540))
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--shots", nargs="+", choices=SHOTS, default=list(SHOTS))
    parser.add_argument("--sheet", action="store_true", help="only the middle of each shot")
    chosen = parser.parse_args()
    shots = [
        [captioned(file, SHOTS[name].caption) for file in render(name, chosen)]
        for name in chosen.shots
    ]
    sheet(shots).save(SHEET if chosen.shots == list(SHOTS) else OUT / SHEET.name, quality=84)
    if not chosen.sheet:
        write([frame for frames in shots for frame in frames], chosen.rate)


if __name__ == "__main__":
    main()
