"""Cycles as an engine: the reference, up to three bands a pass."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...quality.methods import REFERENCE, Device
from ...settings.render_plan import RenderPlan
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ..readers import moving_surface, waterline
from ..terms.cycles_frames import CyclesFrames
from ..water import excited_water
from ..water.occlusion import Cache
from ..water.water_body import WaterExtent
from . import cycles_layers, cycles_settings, denoising_guides
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .exr_output import write_float_exr
from .split_passes import draw_apart, shared_parts


def cycles_bands(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    *,
    seed: int,
    guides: bool = False,
    cache: Cache | None = None,
) -> contextlib.AbstractContextManager[BandEngine]:
    """Water for the Cycles reference while the block runs.

    With ``guides``, a pass has albedo and normal for a denoiser beside it. InputError if layers are
    wanted of a camera in the air.
    """
    frames = CyclesFrames(scene, camera, extent, (), cache or Cache(of_job=True))
    return _opened(frames, plan, seed, guides=guides, device="cpu")


@contextlib.contextmanager
def _opened(
    frames: CyclesFrames, plan: RenderPlan, seed: int, *, guides: bool, device: Device
) -> Iterator[BandEngine]:
    scene, camera, chosen, above = frames.scene, frames.camera, plan.settings, frames.above(plan)
    wanted = cycles_layers.wanted_of(plan, above=above)
    notes = frames.add(plan)
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
                camera.data.clip_start = waterline.first_distance(camera, clip_start, split=split)

                # Glass and water bend it across.
                scene.render.use_border = of_region and not split

                def bend(both: NDArray[np.float32]) -> NDArray[np.float32]:
                    index = now.column.refractive_index
                    return waterline.joined(scene, camera, both, both, index, raised)

                def draw_bands(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                    excited: NDArray[np.float32] | float = 0.0
                    if excited_water.volumes(scene):
                        with excited_water.alone(scene, layer, values, now, indices):
                            write_float_exr(scene, path)
                        excited = read_exr(path)[0]
                    values.apply(layer, indices)
                    values.refresh(scene)
                    found = None
                    if wanted or guides:
                        image, found = cycles_layers.CyclesLayers(wanted, now, guides).render(
                            scene, camera, path, indices, excited,
                            is_first=indices[0] == plan.passes[0][0],
                        )  # fmt: skip
                        write_rgb_exr(path, image)
                    else:
                        write_float_exr(scene, path)
                        if excited_water.volumes(scene):
                            write_rgb_exr(path, read_exr(path)[0] + excited)
                    if split:
                        write_rgb_exr(path, bend(read_exr(path)[0]))
                        found = denoising_guides.bent(found, bend) if found else None
                    return found

                def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                    shared = shared_parts(indices, now.passes)
                    if len(shared) == 1:
                        return draw_bands(indices, path)
                    return draw_apart(shared, path, draw_bands)

                return render

            def draw(part_seed: int, samples: int) -> None:
                scene.cycles.seed, scene.cycles.samples = part_seed, samples

            depth = functools.partial(cycles_layers.depth_map, scene)
            yield BandEngine(plan.passes, notes, frame, depth, draw)
    finally:
        frames.remove()


def _open(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> contextlib.AbstractContextManager[BandEngine]:
    cache = opening.cache or Cache(of_job=True)
    frames = CyclesFrames(scene, camera, opening.extent, opening.eyes, cache)
    return _opened(frames, opening.plan, opening.seed, guides=opening.guides, device=opening.device)


BANDS = Engine(REFERENCE, _open, lambda plan: plan.passes)
"""Cycles, in band passes."""
