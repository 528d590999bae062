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
from .. import contents
from ..materials import band_colors, fluorescence
from ..readers import cameras, clouds, mirrored_eye, waterline
from ..readers.lamps import plan_lamps
from ..readers.surroundings import Ground
from ..water import (
    cloud_volumes,
    continued_seabed,
    cycles_water,
    deep_cameras,
    inelastic_layers,
    moving_surface,
    particles,
    scene_water,
    volume_stack,
)
from ..water.cycles_phase import cycles_phases
from ..water.occlusion import Cache
from ..water.pass_values import PassValues
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
    lamps = plan_lamps(scene, plan)
    chosen, wanted = plan.settings, parse_layers(plan.settings.layers)
    above = moving_surface.may_be_over(camera, chosen, eyes)
    if above and wanted:
        raise InputError(waterline.NO_LAYERS)
    cache, continues = cache or Cache(of_job=True), continued_seabed.may_continue(scene, plan)

    def ground_of(now: RenderPlan) -> Ground | None:
        return cache.look(scene, camera, now.column, eyes).ground if continues else None

    ground_of(plan)  # before the water is there
    notes = cycles_water.add_water(
        scene, plan.column, cycles_phases(plan), extent, lamps, above=above,
        dry=mirrored_eye.may_rise(scene, len(eyes)), own_seabed=continues,
        indices_in_water=chosen.indices_in_water, raised=chosen.raised_waves,
        foam=chosen.whitecaps,
    )  # fmt: skip
    notes += [note for phase in cycles_phases(plan) for note in phase.notes]
    notes += cloud_volumes.add_clouds(scene, plan)
    notes += fluorescence.unseen(contents.materials(scene), "Cycles")
    if wanted and clouds.objects_of(scene):
        notes.append(cloud_volumes.LAYERS)
    notes += [*continued_seabed.notes(plan, cache.looked), *cache.notes]
    notes += moving_surface.limits(camera, chosen, eyes, eevee=False)
    more = inelastic_layers.MOST_ABOVE if chosen.inelastic else 0
    places = [cameras.eye_of(camera), *eyes]
    notes += volume_stack.notes(scene, places, more)
    notes += deep_cameras.notes(plan.column, [-place[2] for place in places])
    try:
        with cycles_settings.reference_settings(
            scene, camera, samples=chosen.samples, seed=seed, bounces=chosen.bounces, device=device
        ) as layer:
            clip_start, of_region = camera.data.clip_start, scene.render.use_border

            def frame(now: RenderPlan, _: float, __: Weights | None = None) -> RenderPass:
                ground = ground_of(now)
                seabed = continued_seabed.depth_of(ground) if continues else None
                cycles_water.place(scene, now.column, seabed)
                cycles_water.shape_lamps(scene, plan_lamps(scene, now))
                now = continued_seabed.over(now, ground)
                eye = cameras.eye_of(camera)
                moving_surface.move_surface(scene, now, eye)
                floating = particles.particles_of(now.settings, now.column)
                particles.bring(scene, floating, lambda m: band_colors.insert([m]))
                values = PassValues.of_plan(now, scene)
                values = values.with_values(cloud_volumes.values(scene, now))
                values = values.with_values(
                    inelastic_layers.bring(
                        scene, now.emission(), now.column.floor_depth, extent, -eye[2]
                    )
                )
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
