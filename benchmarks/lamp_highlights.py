"""Highlights of lamps at night: balls of metal, plastic, a coat and glass, EEVEE against Cycles.

    python3 dev.py run -m benchmarks lamp_highlights OUT [--samples N] [--only WORD ...]

Cycles' pictures are kept in OUT. Of each ball: its light over that in Cycles by band, the same of
all bands without the light of the water around it, and the mean CIE2000 of blocks of its pixels;
and what a frame costs by the number of lamps.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import stored_settings
from ..scene.seen import lamps
from ..settings import render_plan
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import replacing, write_png
from . import grey_scene
from ._material_kinds import _principled, _shader
from ._shade_scenes import Place, look_at

_DEPTH, _AWAY, _RADIUS, _PITCH = 15.0, 2.5, 0.3, 0.68
_WIDTH, _HEIGHT, _COLUMNS, _BLOCK = 144, 96, 3, 2
_FINER = 2  # pixels of Cycles' pictures
_SEEDS = (1, 2)
_GOLD = (0.9, 0.6, 0.2)
_BALLS = {
    "metal .1": _principled(Base_Color=_GOLD, Metallic=1.0, Roughness=0.1),
    "metal .3": _principled(Base_Color=_GOLD, Metallic=1.0, Roughness=0.3),
    "metal .6": _principled(Base_Color=_GOLD, Metallic=1.0, Roughness=0.6),
    "plastic": _principled(Base_Color=(0.02, 0.02, 0.02), Roughness=0.2),
    "coated": _principled(
        Base_Color=(0.3, 0.03, 0.02), Roughness=0.6, Coat_Weight=1.0, Coat_Roughness=0.1
    ),
    "glass": _shader("BsdfGlass", Roughness=0.1, IOR=1.5),
}
_LAMPS = {"beside": (0.25, 0.0, 0.25), "aside": (2.2, 1.2, 0.9)}
_SAMPLES = {"I": 32, "II": 64, "3C": 192}


@dataclass(frozen=True)
class Balls(Place):
    """Balls in two rows, in open water at night."""

    def plan(self, samples: int, **changes: object) -> render_plan.RenderPlan:
        """Resolve it; ``changes`` are other settings."""
        return super().plan(samples, **({"sunlight": 0.0} | changes))

    def open(self) -> bpy.types.Object:
        """Build it in an empty file; return the camera."""
        camera = super().open()
        _set_size(1)
        return camera


def _set_size(finer: int) -> None:
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = _WIDTH * finer, _HEIGHT * finer
    bpy.context.view_layer.update()


def _middle(number: int) -> tuple[float, float, float]:
    row, column = divmod(number, _COLUMNS)
    return (column - 1.0) * _PITCH, _AWAY, (0.5 - row) * _PITCH - _DEPTH


def lamp(place: Sequence[float], towards: Sequence[float] = (0.0, _AWAY, 0.0)) -> None:
    """Add a spot, places as seen from the camera."""
    light = bpy.data.lights.new("Lamp", "SPOT")
    light.spot_size, light.spot_blend = math.radians(80.0), 0.4
    light.energy, light.shadow_soft_size = 300.0, 0.03
    item = look_at(
        tuple(np.add(place, (0.0, 0.0, -_DEPTH))), tuple(np.add(towards, (0.0, 0.0, -_DEPTH)))
    )
    turned = item.rotation_euler.copy()
    bpy.data.objects.remove(item)
    shining = bpy.data.objects.new("Lamp", light)
    shining.location, shining.rotation_euler = np.add(place, (0.0, 0.0, -_DEPTH)), turned
    bpy.context.scene.collection.objects.link(shining)


def _balls(places: Sequence[Sequence[float]]) -> Callable[[], bpy.types.Object]:
    def build() -> bpy.types.Object:
        for number, make in enumerate(_BALLS.values()):
            bpy.ops.mesh.primitive_uv_sphere_add(
                segments=96, ring_count=48, radius=_RADIUS, location=_middle(number)
            )
            bpy.ops.object.shade_smooth()
            bpy.context.object.data.materials.append(make())
        for place in places:
            lamp(place)
        return look_at((0.0, 0.0, -_DEPTH), (0.0, 1.0, -_DEPTH), math.radians(52.0))

    return build


def _masks() -> list[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Pixels within each ball, and those around it."""
    scale = 2.0 * math.tan(math.radians(52.0) / 2.0) / _WIDTH
    x = (np.arange(_WIDTH) + 0.5 - _WIDTH / 2.0) * scale
    z = (_HEIGHT / 2.0 - np.arange(_HEIGHT) - 0.5) * scale
    w = np.stack(np.broadcast_arrays(x[None], 1.0, z[:, None]), axis=-1)
    w = w / np.linalg.norm(w, axis=-1, keepdims=True)
    found = []
    for number in range(len(_BALLS)):
        middle = np.add(_middle(number), (0.0, 0.0, _DEPTH))
        off = np.linalg.norm(np.cross(w, middle), axis=-1)
        ring = (off > 1.03 * _RADIUS) & (off < 1.12 * _RADIUS)
        found.append((off < 0.97 * _RADIUS, ring))
    return found


def seconds_of_frames() -> dict[int, float]:
    """CPU seconds of a frame in EEVEE by the number of lamps, after one that compiles."""
    found = {}
    for count in (0, 1, 4):
        places = [(0.25 - 0.2 * k, 0.0, 0.25) for k in range(count)]
        place = Balls("cost", _balls(places), "II")
        camera = place.open()
        found[count] = min(place.seconds(camera, time.process_time) for _ in range(2))
        print(count, "lamps", round(found[count], 3), "CPU s", flush=True)
    return found


def main(arguments: Sequence[str]) -> None:
    """Render, compare and print."""
    parser = argparse.ArgumentParser(prog="lamp_highlights", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="+", default=[], help='names, as "beside I"')
    parser.add_argument("--samples", type=float, default=1.0, help="times the usual")
    parser.add_argument("--cost", action="store_true")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    masks = _masks()
    for water in _SAMPLES:
        for where, at in _LAMPS.items():
            name = f"{where} {water}"
            if options.only and name not in options.only:
                continue
            samples = int(_SAMPLES[water] * options.samples)
            place = Balls(name, _balls([at]), water, samples=samples)
            camera = place.open()
            kept = options.out / f"{where}_{water}_{samples}.npy"
            if not kept.exists():
                start = time.perf_counter()
                _set_size(_FINER)
                halves = place.by_cycles(camera, _SEEDS)
                _set_size(1)
                print(f"Cycles {time.perf_counter() - start:.0f} s", flush=True)
                with replacing(kept) as temporary, temporary.open("wb") as file:
                    np.save(file, halves)
            halves = np.stack([grey_scene.blocks(half, _FINER) for half in np.load(kept)])
            plan = place.plan(1)
            lit = lamps.lamplight(bpy.context.scene, camera, plan)
            develop = plan.reduction(_DEPTH, lit).apply
            eevee = place.by_eevee(camera)
            shown = [np.clip(develop(x), 0.0, 1.0) for x in (halves.mean(axis=0), eevee, *halves)]
            blocks = [grey_scene.blocks(x, _BLOCK) for x in shown]
            error = delta_e_CIE2000_images(*blocks[:2])
            noise = delta_e_CIE2000_images(*blocks[2:]) / 2.0
            sheet = np.concatenate(shown[:2]).astype(np.float32)
            write_png(options.out / f"{where}_{water}.png", sheet)
            for ball, (mask, ring) in zip(_BALLS, masks, strict=True):
                inside = grey_scene.blocks(mask[..., None].astype(float), _BLOCK)[..., 0] > 0.999
                cycles = halves.mean(axis=0)
                truth = cycles[mask].sum(axis=0)
                ratio = eevee[mask].sum(axis=0) / truth
                ours, theirs = (
                    x[mask].sum() - np.median(x[ring], axis=0).sum() * mask.sum()
                    for x in (eevee, cycles)
                )
                spread = np.abs(halves[0][mask].sum(axis=0) / truth - 1.0)
                print(
                    f"{name:12s} {ball:9s} energy {ratio.round(3)} (noise {spread.max():.3f}), "
                    f"beyond the water around it {ours / theirs:.3f}, "
                    f"dE {error[inside].mean():5.2f} (noise {noise[inside].mean():.2f})",
                    flush=True,
                )
    if options.cost:
        seconds_of_frames()
