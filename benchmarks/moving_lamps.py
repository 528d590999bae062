"""How steady EEVEE's pictures are while lamps move, and how long the update of a frame takes."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.water import metering, water_body
from ..uw_spectral.spectra.spectral_image import read_exr
from . import grey_scene
from ._lamp_scenes import LitPlace, add_lamp, sand_room
from .runner import Ask, Page, Target, spread, table

_STEP = 0.05  # m
_PLACES = ((-1.9, -0.2, 0.4), (0.5, -0.2, 0.4))  # of the lamps in the first frame, from the camera
_TURN = (1.45, 0.0, 0.0)
_SIZE, _SAMPLES = (48, 27), 16
_BANDS = 8
_BLOCK = 3
_DARK = 0.02  # of the picture's mean: blocks below are not seen
_WATER = "II"

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moved:
    """Frames in linear colours, (frames, h, w, 3), which pixels show water, seconds of updates."""

    frames: Array
    open_water: NDArray[np.bool_]
    seconds: Array

    def unsteady(self, size: int, order: int = 2) -> tuple[Array, NDArray[np.bool_]]:
        """Differences of an order of blocks over their mean, (k, h, w), and which are water.

        Noise makes them as large as second ones.
        """
        light = np.stack([grey_scene.blocks(frame, size) for frame in self.frames]).mean(axis=-1)
        water = grey_scene.blocks(self.open_water[..., None].astype(float), size)[..., 0] == 1.0
        mean = np.maximum(light.mean(axis=0), _DARK * light.mean())
        of_noise = math.sqrt(math.comb(2 * order, order) / math.comb(4, 2))
        return np.abs(np.diff(light, order, axis=0)) / mean / of_noise, water

    def cells(self) -> list[str]:
        """Pixels, blocks, blocks of water, seconds."""
        (pixels, _), (blocks, water) = self.unsteady(1), self.unsteady(_BLOCK)
        jumps, _ = self.unsteady(_BLOCK, 4)
        cells = [spread(100 * x, ".2f", (0.5, 0.95, 0.99, 1.0))
                 for x in (pixels, blocks, blocks[:, water], jumps)]  # fmt: skip
        seconds = f"{np.median(self.seconds):.3f}/{self.seconds.max():.3f}"
        return [*cells, seconds]


def moved(frames: int) -> Moved:
    """Render the frames."""
    place = LitPlace("moving lamps", sand_room, _WATER, size=_SIZE)
    camera, scene = place.open(), bpy.context.scene
    for at in _PLACES:
        add_lamp(at, _TURN)
    shining = [item for item in scene.objects if item.type == "LIGHT"]
    bpy.context.view_layer.update()
    for item in shining:
        for frame in range(frames):
            item.keyframe_insert("location", frame=frame)
            item.location.x += _STEP
    scene.frame_set(0)
    plan, depth = place.plan(_SAMPLES, bands=_BANDS), -camera.matrix_world.translation.z
    extent = water_body.water_extent(scene, plan.column, depth)
    scene.frame_set(frames // 2)
    weights = plan.reduction(depth, metering.lamplight(scene, camera, plan)).weights
    open_water = np.isinf(place.distance(camera))
    images, seconds, begun = [], [], []
    bpy.app.handlers.render_init.append(lambda *_: begun.append(time.thread_time()))
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(scene, camera, plan, extent, depth) as engine,
    ):
        for frame in range(frames):
            scene.frame_set(frame)
            begin = time.thread_time()
            render = engine.frame(plan, depth, weights)
            render(engine.passes[0], Path(folder, "frame.exr"))
            seconds.append(begun[-1] - begin)
            images.append(read_exr(Path(folder, "frame.exr"))[0][..., :3])
    # The first frame was made before.
    return Moved(np.stack(images).astype(float), open_water, np.array(seconds[1:]))


def measure(ask: Ask) -> Mapping[str, object]:
    """Render the frames."""
    found = moved(ask.frames)
    blocks, _ = found.unsteady(_BLOCK)
    heads = ("pixels", "blocks", "blocks of open water", "blocks, fourth differences", "update, s")
    return {
        "rows": table(heads, [found.cells()]), "median": 100 * float(np.median(blocks)),
        "worst": 100 * float(blocks.max()), "seconds": float(np.median(found.seconds)),
    }  # fmt: skip


PAGE = Page(
    "Lamps that move",
    """
Two spots move 5 cm a frame across the view, past a ball and a box, by night in II: {frames} frames
in EEVEE, 48 × 27 pixels. Unsteady is what a smooth curve is not: second differences of a pixel, or
of a block of 3 × 3, over its mean; fourth differences have less of what bends. Median/95 %/99
%/worst, %; CPU seconds of an update, median and worst.

{rows}

The update took .08 s on a machine less busy. Edges of Blender's own shadows and sand that the light
grazes change the most.
""",
    (
        Target("blocks, median, %", "median", 1.0),
        Target("worst block, %", "worst", 3.0),
        Target("update of a frame, s", "seconds", 0.1),
    ),
    {"frames": 24},
)
