"""Renders the band passes of a frame, each whole on disk before the next begins."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectral_image import read_exr
from .exr_output import write_float_exr
from .pass_values import PassValues


@dataclass(frozen=True)
class RenderedPass:
    """A pass on disk; ``seconds`` is None where it was there before."""

    path: Path
    bands: tuple[int, ...]
    seconds: float | None


def render_passes(
    scene: bpy.types.Scene,
    layer: bpy.types.ViewLayer,
    values: PassValues,
    passes: Sequence[tuple[int, ...]],
    folder: Path,
    *,
    resume: bool,
    report: Callable[[RenderedPass], None],
) -> list[RenderedPass]:
    """Render every pass of the current frame.

    Parameters
    ----------
    scene : Scene
        The scene with its water and camera, under the settings of the engine.
    layer : ViewLayer
        The layer that is rendered.
    values : PassValues
        What differs by band.
    passes : sequence of tuples
        The bands of each pass.
    folder : Path
        Where the passes go, ``pass_00.exr`` and so on.
    resume : bool
        Keep passes that are there and whole; render damaged ones again.
    report : callable
        Called after each pass.
    """
    folder.mkdir(parents=True, exist_ok=True)
    done = []
    for number, bands in enumerate(passes):
        path = folder / f"pass_{number:02d}.exr"
        seconds = None
        if not (resume and is_whole(path, scene)):
            values.apply(layer, bands)
            values.refresh(scene)
            start = time.perf_counter()
            write_float_exr(scene, path)
            seconds = time.perf_counter() - start
        done.append(RenderedPass(path, bands, seconds))
        report(done[-1])
    return done


def is_whole(path: Path, scene: bpy.types.Scene) -> bool:
    """Whether a pass can be read to its end and has the size of the render."""
    if not path.exists():
        return False
    try:
        pixels, _ = read_exr(path)
    except InputError:
        return False
    render = scene.render
    scale = render.resolution_percentage / 100
    width, height = int(render.resolution_x * scale), int(render.resolution_y * scale)
    return pixels.shape[:2] == (height, width)
