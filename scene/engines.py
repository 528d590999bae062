"""The engines that can render a frame: each puts water into a scene and takes it out."""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from . import (
    cycles_settings,
    cycles_water,
    eevee_settings,
    inelastic_layers,
    moving_surface,
    realtime,
    scene_water,
)
from .exr_output import write_float_exr
from .render_plan import RenderPlan
from .water_body import WaterExtent

RenderPass = Callable[[tuple[int, ...], Path], None]
"""Renders the bands of one pass into a float EXR."""


@dataclass(frozen=True)
class BandEngine:
    """Water in a scene, ready to be rendered.

    ``passes`` are the bands of each pass; ``frame(plan, depth)`` readies the
    current frame, whose plan may have other values than the first one, for a
    camera at a depth in m and returns what renders a pass.
    """

    passes: list[tuple[int, ...]]
    notes: list[str]
    frame: Callable[[RenderPlan, float], RenderPass]


@contextlib.contextmanager
def cycles_bands(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    *,
    seed: int,
    denoise: bool,
) -> Iterator[BandEngine]:
    """Water for the Cycles reference while the block runs."""
    notes = cycles_water.add_water(scene, plan.column, plan.cycles_phases, extent)
    light = plan.inelastic
    layers = None if light is None else inelastic_layers.add_layers(scene, light, extent)
    chosen = plan.settings
    try:
        with cycles_settings.reference_settings(
            scene,
            camera,
            samples=chosen.samples,
            seed=seed,
            denoise=denoise,
            bounces=chosen.bounces,
        ) as layer:

            def frame(now: RenderPlan, _: float) -> RenderPass:
                cycles_water.place(scene, now.column)
                moving_surface.move_surface(scene, now)
                values = now.pass_values(scene)
                if layers is not None and now.inelastic is not None:
                    values = values.with_values(inelastic_layers.emission(now.inelastic, layers))

                def render(indices: tuple[int, ...], path: Path) -> None:
                    values.apply(layer, indices)
                    values.refresh(scene)
                    write_float_exr(scene, path)

                return render

            yield BandEngine(plan.passes, notes, frame)
    finally:
        scene_water.remove(scene)


@contextlib.contextmanager
def eevee_bands(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    depth: float,
    *,
    froxels: int | None = None,
) -> Iterator[BandEngine]:
    """Water for EEVEE, three bands a pass, while the block runs.

    EEVEE keeps half floats, so each band is scaled to the radiance of a white
    surface at the camera's depth, and back when the pass is written.
    """
    passes = plan.bands.packed(3)

    water_of = _waters(scene, lambda now, _: np.ones((3, len(now.bands))))

    def scale_of(now: RenderPlan, camera_depth: float) -> np.ndarray:
        white = now.column.Ed(camera_depth, now.phase) / np.pi
        return np.maximum(white, np.finfo(np.float32).tiny)

    gains = 1.0 / scale_of(plan, depth)[list(passes[0])]
    first_pass = water_of(plan, depth).of_triple(passes[0], gains)
    with _eevee(scene, camera, first_pass, extent, plan.settings.samples, froxels) as notes:

        def frame(now: RenderPlan, camera_depth: float) -> RenderPass:
            water, scale = water_of(now, camera_depth), scale_of(now, camera_depth)

            def render(indices: tuple[int, ...], path: Path) -> None:
                white = scale[[*indices, *[indices[-1]] * (3 - len(indices))]]
                realtime.set_values(scene, water.of_triple(indices, 1.0 / white))
                write_float_exr(scene, path)
                write_rgb_exr(path, read_exr(path)[0] * white)

            return render

        yield BandEngine(passes, notes, frame)


@contextlib.contextmanager
def eevee_realtime(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    depth: float,
    *,
    froxels: int | None = None,
) -> Iterator[BandEngine]:
    """Water for EEVEE, all bands in one pass that is the picture already.

    What is too much for one shader takes more passes, whose sum is the picture.
    """
    count = math.ceil(len(plan.bands) / math.ceil(len(plan.bands) / plan.most_bands))
    passes = plan.bands.packed(count)

    water_of = _waters(scene, lambda now, at: now.reduction(at).weights)
    first, samples = water_of(plan, depth).of_bands(passes[0], count), plan.settings.samples
    with _eevee(scene, camera, first, extent, samples, froxels) as notes:

        def frame(now: RenderPlan, camera_depth: float) -> RenderPass:
            water = water_of(now, camera_depth)

            def drawn(part: realtime.RealtimeWater, path: Path) -> NDArray[np.float32]:
                realtime.set_values(scene, part)
                write_float_exr(scene, path)
                return read_exr(path)[0]

            def render(indices: tuple[int, ...], path: Path) -> None:
                part = water.of_bands(indices, count)
                if len(passes) == 1:
                    drawn(part, path)
                    return
                # EEVEE cuts what is below zero, and other parts may be above.
                positive, negative = (drawn(part.of_sign(sign), path) for sign in (1.0, -1.0))
                write_rgb_exr(path, positive - negative)

            return render

        yield BandEngine(passes, notes, frame)


def _waters(
    scene: bpy.types.Scene,
    weights_of: Callable[[RenderPlan, float], NDArray[np.float64]],
) -> Callable[[RenderPlan, float], realtime.RealtimeWater]:
    """Return what computes the water of the current frame, for a plan and a depth.

    The nodes are built for the first frame's, which is not computed again to be drawn.
    """

    @functools.lru_cache(maxsize=1)
    def water_at(_: float, plan: RenderPlan, depth: float) -> realtime.RealtimeWater:
        water = plan.realtime(scene, depth, weights_of(plan, depth))
        return moving_surface.with_waves(scene, plan, water)

    return lambda plan, depth: water_at(scene.frame_current_final, plan, depth)


@contextlib.contextmanager
def _eevee(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    water: realtime.RealtimeWater,
    extent: WaterExtent,
    samples: int,
    froxels: int | None,
) -> Iterator[list[str]]:
    notes = realtime.add_realtime(scene, water, extent)
    try:
        with eevee_settings.realtime_settings(
            scene, camera, samples=samples, water=water, froxels=froxels
        ):
            yield notes
    finally:
        scene_water.remove(scene)
