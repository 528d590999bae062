"""Cycles as an engine: the reference, up to three bands a pass."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers, side_by_side
from ...quality.methods import REFERENCE, Device
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.imaging.layers import parse_layers
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ..readers import cameras, clouds, waterline
from ..water import cloud_volumes, moving_surface, scene_water
from ..water.cycles_frames import CyclesFrames
from ..water.occlusion import Cache
from ..water.water_body import WaterExtent
from . import cycles_layers, cycles_settings, denoising_guides
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .cycles_layers import CyclesLayers
from .exr_output import write_float_exr


@contextlib.contextmanager
def cycles_bands(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    *,
    seed: int,
    guides: bool = False,
    device: Device = "cpu",
    eyes: Sequence[tuple[float, ...]] = (),
    cache: Cache | None = None,
) -> Iterator[BandEngine]:
    """Water for the Cycles reference while the block runs.

    With ``guides``, a pass has albedo and normal for a denoiser beside it. InputError if Cycles
    finds no such device, or layers are wanted of a camera in the air.
    """
    chosen, wanted = plan.settings, parse_layers(plan.settings.layers)
    frames = CyclesFrames(scene, camera, extent, eyes, cache or Cache(of_job=True))
    above = frames.above(plan)
    if above and wanted:
        raise InputError(waterline.NO_LAYERS)
    notes = frames.add(plan)
    if wanted and clouds.objects_of(scene):
        notes.append(cloud_volumes.LAYERS)
    try:
        with cycles_settings.reference_settings(
            scene, camera, samples=chosen.samples, seed=seed, bounces=chosen.bounces, device=device
        ) as layer:
            clip_start, of_region = camera.data.clip_start, scene.render.use_border

            def frame(now: RenderPlan, _: float, __: Weights | None = None) -> RenderPass:
                values = frames.bring(now)
                raised = moving_surface.heights(scene, now.settings)
                split = above and waterline.splits(scene, camera, raised)
                # Rays begin at the glass where the waterline is on it, or at the port.
                camera.data.clip_start = (
                    waterline.PORT if split else max(clip_start, cameras.before_water(camera))
                )

                # Glass and water bend it across.
                scene.render.use_border = of_region and not split

                def bend(both: NDArray[np.float32]) -> NDArray[np.float32]:
                    index = now.column.refractive_index
                    return waterline.joined(scene, camera, both, both, index, raised)

                def draw_bands(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                    values.apply(layer, indices)
                    values.refresh(scene)
                    found = None
                    if wanted or guides:
                        image, found = CyclesLayers(wanted, now, guides).render(
                            scene, camera, path, indices, is_first=indices[0] == plan.passes[0][0]
                        )
                        write_rgb_exr(path, image)
                    else:
                        write_float_exr(scene, path)
                    if split:
                        write_rgb_exr(path, bend(read_exr(path)[0]))
                        found = denoising_guides.bent(found, bend) if found else None
                    return found

                def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                    shared = _sharing(indices, now.passes)
                    if len(shared) == 1:
                        return draw_bands(indices, path)
                    return draw_apart(shared, path, draw_bands)

                return render

            def draw(part_seed: int, samples: int) -> None:
                scene.cycles.seed, scene.cycles.samples = part_seed, samples

            def depth(path: Path) -> NDArray[np.float64]:
                return cycles_layers.depth_map(scene, path)

            yield BandEngine(plan.passes, notes, frame, depth, draw)
    finally:
        scene_water.remove(scene)


def _sharing(bands: tuple[int, ...], passes: Sequence[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Split the bands of a pass of the first frame into those that still share one."""
    parts = (tuple(band for band in bands if band in shared) for shared in passes)
    return [part for part in parts if part]


def draw_apart(
    parts: Sequence[tuple[int, ...]], path: Path, draw: RenderPass
) -> FrameLayers | None:
    """Render parts of a pass, the bands of each, by themselves and put them into one file."""
    channels, layers = [], []
    for part in parts:
        found = draw(part, path)
        layers.append(denoising_guides.without_normal(found) if found and layers else found)
        channels.append(read_exr(path)[0][..., : len(part)])
    missing = 3 - sum(map(len, parts))
    image = np.concatenate(channels, axis=-1)
    write_rgb_exr(path, np.pad(image, ((0, 0), (0, 0), (0, missing)), mode="edge"))
    there = [found for found in layers if found is not None]
    return side_by_side(there) if there else None


def _open(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> contextlib.AbstractContextManager[BandEngine]:
    return cycles_bands(
        scene, camera, opening.plan, opening.extent,
        seed=opening.seed, guides=opening.guides, device=opening.device, eyes=opening.eyes,
        cache=opening.cache,
    )  # fmt: skip


BANDS = Engine(REFERENCE, _open, lambda plan: plan.passes)
"""Cycles, in band passes."""
