"""EEVEE as an engine: in band passes, and all bands at once."""

from __future__ import annotations

import contextlib
import functools
import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layers import parse_layers
from ..uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from . import eevee_settings, moving_surface, realtime, scene_water, waterline
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .eevee_layers import EeveeLayers
from .exr_output import write_float_exr
from .render_plan import RenderPlan
from .shade import Kept
from .temporary import render_settings
from .water_body import WaterExtent

_FEW_PIXELS = 8


@contextlib.contextmanager
def eevee_bands(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    depth: float,
    *,
    froxels: int | None = None,
    eyes: Sequence[tuple[float, ...]] = (),
) -> Iterator[BandEngine]:
    """Water for EEVEE, three bands a pass, while the block runs.

    EEVEE keeps half floats, so each band is scaled to the radiance of a white
    surface before the camera, and back when the pass is written.
    """
    passes = band_passes_of(plan)
    layers = _layers(scene, camera, plan, eyes, by_band=True)
    water_of = _waters(scene, camera, eyes)

    def water_at(now: RenderPlan, camera_depth: float) -> realtime.RealtimeWater:
        every = np.ones((3, len(now.bands)))
        water = water_of(now, camera_depth, every)
        return water if layers is None else water.with_layers(layers.drawn, every)

    def scale_of(now: RenderPlan, camera_depth: float) -> np.ndarray:
        light = now.viewpoint(camera_depth, lamplight=now.lamplight(scene, camera)).light
        white = light / np.pi
        return np.maximum(white, np.finfo(np.float32).tiny)

    gains = 1.0 / scale_of(plan, depth)[list(passes[0])]
    first_pass = water_at(plan, depth).of_triple(passes[0], gains)
    with _eevee(scene, camera, first_pass, extent, plan.settings.samples, froxels) as notes:

        def frame(now: RenderPlan, camera_depth: float, _: Weights | None = None) -> RenderPass:
            water, scale = water_at(now, camera_depth), scale_of(now, camera_depth)

            def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                white = scale[[*indices, *[indices[-1]] * (3 - len(indices))]]
                now_seen = water.of_triple(indices, 1.0 / white)
                if layers is None:
                    write_rgb_exr(path, _drawn(scene, camera, now_seen, path) * white)
                    return None
                realtime.set_values(scene, now_seen)
                image, found = layers.render(
                    scene, camera, path, indices, white, np.diag(white),
                    is_first=indices == passes[0],
                )  # fmt: skip
                write_rgb_exr(path, image * white)
                return found

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
    weights: Weights | None = None,
    eyes: Sequence[tuple[float, ...]] = (),
) -> Iterator[BandEngine]:
    """Water for EEVEE, all bands in one pass that is the picture already.

    What is too much for one shader takes more passes, whose sum is the picture.
    """
    passes = picture_passes_of(plan)
    layers = _layers(scene, camera, plan, eyes, by_band=False)
    if layers is not None and layers.subtracts and len(passes) > 1:
        raise InputError(
            f"layers: B_single and B_multiple of shafts of light, in real time, take at most "
            f"{plan.most_bands} bands, not {len(plan.bands)}; take fewer, "
            f"--no-shafts or --mode bands, or leave those layers (and B) out"
        )
    count = len(passes[0])
    waters = _waters(scene, camera, eyes)

    def water_of(
        now: RenderPlan, camera_depth: float, given: Weights | None
    ) -> realtime.RealtimeWater:
        if given is None:
            given = now.reduction(camera_depth, now.lamplight(scene, camera)).weights
        return waters(now, camera_depth, given)

    def layered(
        now: RenderPlan, camera_depth: float, given: Weights | None
    ) -> tuple[realtime.RealtimeWater, Weights, Weights]:
        """Return water, radiance of its layers per number drawn, and picture to sensor."""
        water = water_of(now, camera_depth, given)
        if layers is None:
            return water, np.ones(3), np.eye(3)
        response = now.response(camera_depth)
        light = now.viewpoint(camera_depth, lamplight=now.lamplight(scene, camera)).light
        white = np.maximum(np.abs(response @ light) / np.pi, np.finfo(np.float32).tiny)
        back = response @ np.linalg.pinv(water.seen)
        return water.with_layers(layers.drawn, response / white[:, None]), white, back

    first, samples = (
        layered(plan, depth, weights)[0].of_bands(passes[0], count),
        plan.settings.samples,
    )
    with _eevee(scene, camera, first, extent, samples, froxels) as notes:

        def frame(now: RenderPlan, camera_depth: float, given: Weights | None = None) -> RenderPass:
            water, white, back = layered(now, camera_depth, given)

            def drawn_apart(
                part: realtime.RealtimeWater, path: Path, indices: tuple[int, ...]
            ) -> tuple[NDArray[np.float32], FrameLayers | None]:
                if layers is None:
                    return _drawn(scene, camera, part, path), None
                realtime.set_values(scene, part)
                return layers.render(
                    scene, camera, path, indices, white, back, is_first=indices == passes[0]
                )

            def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                part = water.of_bands(indices, count)
                if len(passes) == 1:
                    image, found = drawn_apart(part, path, indices)
                else:
                    # EEVEE cuts what is below zero, and other parts may be above.
                    negative = _drawn(scene, camera, part.of_sign(-1.0), path)
                    positive, found = drawn_apart(part.of_sign(1.0), path, indices)
                    image = positive - negative
                write_rgb_exr(path, image)
                return found

            return render

        yield BandEngine(passes, notes, frame)


def _drawn(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    water: realtime.RealtimeWater,
    path: Path,
) -> NDArray[np.float32]:
    """Render a picture into a file, from either side of the waterline if the camera is there."""

    def render(now: realtime.RealtimeWater) -> NDArray[np.float32]:
        realtime.set_values(scene, now)
        write_float_exr(scene, path)
        return read_exr(path)[0]

    if water.above is None or not waterline.splits(scene, camera):
        return render(water)
    air, wet = (render(water.seen_from(in_air=in_air)) for in_air in (True, False))
    index = water.column.refractive_index
    both = waterline.joined(scene, camera, air, wet, index)
    write_rgb_exr(path, both)
    return both


def band_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass of three."""
    return plan.bands.packed(3)


def picture_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass that is a part of the picture."""
    count = math.ceil(len(plan.bands) / math.ceil(len(plan.bands) / plan.most_bands))
    return plan.bands.packed(count)


def _layers(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
    *,
    by_band: bool,
) -> EeveeLayers | None:
    wanted = parse_layers(plan.settings.layers)
    if not wanted:
        return None
    if waterline.above(camera, eyes):
        raise InputError(waterline.NO_LAYERS)
    return EeveeLayers(wanted, plan, by_band, plan.draws_shafts, bool(plan.lamps(scene).lamps))


def _waters(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    eyes: Sequence[tuple[float, ...]],
) -> Callable[[RenderPlan, float, Weights], realtime.RealtimeWater]:
    """Return what computes the water of the current frame, for a plan, a depth and weights.

    The nodes are built for the first frame's, which is not computed again to be drawn.
    """
    kept = Kept()

    @functools.lru_cache(maxsize=1)
    def water_at(
        _: float, plan: RenderPlan, depth: float, weights: tuple[tuple[float, ...], ...]
    ) -> realtime.RealtimeWater:
        water = plan.realtime(scene, depth, np.array(weights), camera, eyes=eyes, kept=kept)
        return moving_surface.with_waves(scene, plan, water)

    def water_of(plan: RenderPlan, depth: float, weights: Weights) -> realtime.RealtimeWater:
        rows = tuple(map(tuple, weights.tolist()))
        return water_at(scene.frame_current_final, plan, depth, rows)

    return water_of


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
            if water.shafts is not None:
                _warm_up(scene)
            yield notes
    finally:
        scene_water.remove(scene)


def _warm_up(scene: bpy.types.Scene) -> None:
    """Render a few pixels for nothing.

    The first picture of a process with a volume differs from the same picture later, by up to
    3 % (5.2.3), unless one of another size came before it.
    """
    few = [
        (scene.render, "resolution_x", _FEW_PIXELS),
        (scene.render, "resolution_y", _FEW_PIXELS),
        (scene.render, "resolution_percentage", 100),
        (scene.eevee, "taa_render_samples", 1),
    ]
    with render_settings(scene, few), tempfile.TemporaryDirectory() as folder:
        write_float_exr(scene, Path(folder, "warm_up.exr"))


def _open_bands(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> contextlib.AbstractContextManager[BandEngine]:
    return eevee_bands(
        scene, camera, opening.plan, opening.extent, opening.depth,
        froxels=opening.froxels, eyes=opening.eyes,
    )  # fmt: skip


def _open_realtime(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> contextlib.AbstractContextManager[BandEngine]:
    return eevee_realtime(
        scene, camera, opening.plan, opening.extent, opening.depth,
        froxels=opening.froxels, weights=opening.weights, eyes=opening.eyes,
    )  # fmt: skip


BANDS = Engine("eevee", "bands", _open_bands, band_passes_of, needs_gpu=True)
"""EEVEE, three bands a pass."""
REALTIME = Engine(
    "eevee", "realtime", _open_realtime, picture_passes_of, needs_gpu=True, draws_colours=True
)
"""EEVEE, the picture in one pass."""
