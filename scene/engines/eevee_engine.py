"""EEVEE as an engine: in band passes, and all bands at once."""

from __future__ import annotations

import contextlib
import functools
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...quality import methods
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.imaging.layers import parse_layers
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ...uw_spectral.transfer.channels import channels_of, channels_of_bands
from ..readers import cameras, enclosed_places, lamps, waterline
from ..temporary import held, render_settings
from ..water import continued_seabed, frame_water, moving_surface, realtime, scene_water
from ..water.eevee_water import Eye, eevee_water
from ..water.occlusion import Cache
from ..water.water_body import WaterExtent
from . import eevee_settings, planar_picture
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .eevee_layers import EeveeLayers, depth_map
from .exr_output import write_float_exr
from .planar_picture import PlanarPictures

_FEW_PIXELS = 8
_DARKEST = 1e-20  # of the brightest: what is multiplied stays in single precision


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
    cache: Cache | None = None,
) -> Iterator[BandEngine]:
    """Water for EEVEE, three bands a pass, while the block runs.

    EEVEE keeps half floats, so each band is scaled to the radiance of a white
    surface before the camera, and back when the pass is written.
    """
    passes = band_passes_of(plan)
    layers = _layers(scene, camera, plan, eyes, by_band=True)
    cache = cache or Cache(of_job=True)
    mirrored = PlanarPictures(scene, camera, cache)
    water_of = _waters(scene, camera, eyes, cache, mirrored)
    drawn = () if layers is None else layers.drawn

    def scale_of(now: RenderPlan, camera_depth: float) -> np.ndarray:
        water = water_of(now, camera_depth)
        return _scale(_white_light(scene, camera, now, camera_depth, water) / np.pi)

    def part_of(
        water: frame_water.RealtimeWater, indices: tuple[int, ...], scale: np.ndarray
    ) -> frame_water.RealtimeWater:
        bands = water.column.bands
        channels = channels_of_bands(bands, indices, 1.0 / scale[list(indices)])
        return water.in_channels(channels, drawn)

    first_pass = part_of(water_of(plan, depth), passes[0], scale_of(plan, depth))
    with _eevee(scene, camera, first_pass, extent, plan.settings.samples, froxels) as notes:
        notes += _limits(scene, camera, plan, eyes, cache, first_pass)

        def frame(now: RenderPlan, camera_depth: float, _: Weights | None = None) -> RenderPass:
            water, scale = water_of(now, camera_depth), scale_of(now, camera_depth)

            def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                white = scale[[*indices, *[indices[-1]] * (3 - len(indices))]]
                seen = part_of(water, indices, scale)
                mirrored.show(now, seen)
                if layers is None:
                    write_rgb_exr(path, _drawn(scene, camera, seen, path) * white)
                    return None
                realtime.set_values(scene, seen)
                image, found = layers.render(
                    scene, camera, path, indices, white, np.diag(white),
                    is_first=indices == passes[0],
                )  # fmt: skip
                write_rgb_exr(path, image * white)
                return found

            return render

        yield BandEngine(passes, notes, frame, lambda path: depth_map(scene, path))


@contextlib.contextmanager
def eevee_realtime(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    extent: WaterExtent,
    depth: float,
    *,
    froxels: int | None = None,
    eyes: Sequence[tuple[float, ...]] = (),
    cache: Cache | None = None,
) -> Iterator[BandEngine]:
    """Water for EEVEE, all bands in one pass that is the picture already.

    Drawn are the responses of the sensor, over those to a white surface before the camera: they
    are not negative, where colours out of gamut are, and EEVEE cuts what is.
    """
    layers = _layers(scene, camera, plan, eyes, by_band=False)
    cache = cache or Cache(of_job=True)
    mirrored = PlanarPictures(scene, camera, cache)
    waters = _waters(scene, camera, eyes, cache, mirrored)
    drawn = () if layers is None else layers.drawn

    def water_of(
        now: RenderPlan, camera_depth: float
    ) -> tuple[frame_water.RealtimeWater, NDArray[np.float64]]:
        """Return water, and the sensor's response per number drawn."""
        response = now.response(camera_depth)
        water = waters(now, camera_depth)
        light = _white_light(scene, camera, now, camera_depth, water)
        white = _scale(np.abs(response @ light) / np.pi)
        channels = channels_of(now.bands, response / white[:, None])
        return replace(water.in_channels(channels, drawn), pictures=True), white

    first, samples = water_of(plan, depth)[0], plan.settings.samples
    with _eevee(scene, camera, first, extent, samples, froxels) as notes:
        notes += _limits(scene, camera, plan, eyes, cache, first)

        def frame(now: RenderPlan, camera_depth: float, given: Weights | None = None) -> RenderPass:
            water, white = water_of(now, camera_depth)
            if given is None:
                given = now.reduction(camera_depth, lamps.lamplight(scene, camera, now)).weights
            to_picture = np.asarray(given) @ np.linalg.pinv(water.channels.weights)

            def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                mirrored.show(now, water)
                if layers is None:
                    image, found = _drawn(scene, camera, water, path), None
                else:
                    realtime.set_values(scene, water)
                    image, found = layers.render(
                        scene, camera, path, indices, white, np.diag(white), is_first=True
                    )
                write_rgb_exr(path, image @ to_picture.T.astype(np.float32))
                return found

            return render

        yield BandEngine(picture_passes_of(plan), notes, frame, lambda path: depth_map(scene, path))


def _limits(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
    cache: Cache,
    first: frame_water.RealtimeWater,
) -> list[str]:
    """Return what is not drawn as it is, a line each."""
    return [
        *continued_seabed.notes(plan, cache.looked),
        *planar_picture.notes(camera, plan, eyes),
        *planar_picture.notes_of_air(scene, camera, plan, eyes),
        *moving_surface.limits(camera, plan.settings, eyes, eevee=True),
        *enclosed_places.notes(scene, camera, first.inputs.occlusion, cache.looked),
        *cache.notes,
    ]


def _white_light(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    now: RenderPlan,
    depth: float,
    water: frame_water.RealtimeWater,
) -> NDArray[np.float64]:
    """Irradiance that makes white what is as bright as a white object that fluoresces, (n,)."""
    light = now.viewpoint(depth, lamplight=lamps.lamplight(scene, camera, now)).light
    return water.inputs.fluorescent.brightened(light, now.bands)


def _scale(white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what to divide by so that white is near 1; where there is no light, anything."""
    brightest = float(white.max())
    return np.maximum(white, _DARKEST * brightest) if brightest > 0 else np.ones_like(white)


def _drawn(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    water: frame_water.RealtimeWater,
    path: Path,
) -> NDArray[np.float32]:
    """Render a picture into a file, from either side of the waterline if the camera is there."""

    def render(now: frame_water.RealtimeWater) -> NDArray[np.float32]:
        realtime.set_values(scene, now)
        write_float_exr(scene, path)
        return read_exr(path)[0]

    raised = None if water.waves is None else water.waves.raised
    if water.inputs.above is None or not waterline.splits(scene, camera, raised):
        return render(water)
    with held([(scene.render, "use_border", False)]):  # glass and water bend it across
        air, wet = (render(water.seen_from(in_air=in_air)) for in_air in (True, False))
    index = water.column.refractive_index
    both = waterline.joined(scene, camera, air, wet, index, raised)
    write_rgb_exr(path, both)
    return both


def band_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass of three."""
    return plan.bands.packed(3)


def picture_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass that is a part of the picture: one."""
    return [tuple(range(len(plan.bands)))]


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
    if moving_surface.may_be_over(camera, plan.settings, eyes):
        raise InputError(waterline.NO_LAYERS)
    lit = bool(lamps.plan_lamps(scene, plan).lamps)
    return EeveeLayers(wanted, plan, by_band, plan.draws_shafts, lit)


def _waters(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    eyes: Sequence[tuple[float, ...]],
    cache: Cache,
    mirrored: PlanarPictures,
) -> Callable[[RenderPlan, float], frame_water.RealtimeWater]:
    """Return what computes the water of the current frame, for a plan and a depth.

    The nodes are built for the first frame's, which is not computed again to be drawn.
    """
    shows: list[tuple[bool, bool]] = []  # in the first frame, as the nodes are

    @functools.lru_cache(maxsize=1)
    def water_at(_: float, plan: RenderPlan, depth: float) -> frame_water.RealtimeWater:
        every = np.ones((3, len(plan.bands)))
        water = eevee_water(plan, scene, Eye(camera, depth, eyes), every, cache)
        water = moving_surface.with_waves(scene, plan, water)
        if not shows:
            mirrors = planar_picture.may_show(camera, plan, eyes, mirrored)
            air = planar_picture.may_show_air(scene, camera, plan, eyes, mirrored)
            shows.append((mirrors, air))
        mirrors, air = shows[0]
        place = cameras.eye_of(camera)[:3] if air else None
        return water.with_pictures(mirrored=mirrors, window_from=place)

    def water_of(plan: RenderPlan, depth: float) -> frame_water.RealtimeWater:
        return water_at(scene.frame_current_final, plan, depth)

    return water_of


@contextlib.contextmanager
def _eevee(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    water: frame_water.RealtimeWater,
    extent: WaterExtent,
    samples: int,
    froxels: int | None,
) -> Iterator[list[str]]:
    notes = [*cameras.clip_notes(camera), *realtime.add_realtime(scene, water, extent)]
    try:
        with eevee_settings.realtime_settings(
            scene, camera, samples=samples, water=water, froxels=froxels
        ):
            if water.shape.shafts:
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
        (scene.render, "use_border", False),
        (scene.eevee, "taa_render_samples", 1),
    ]
    with render_settings(scene, few), tempfile.TemporaryDirectory() as folder:
        write_float_exr(scene, Path(folder, "warm_up.exr"))


def _open_bands(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> contextlib.AbstractContextManager[BandEngine]:
    return eevee_bands(
        scene, camera, opening.plan, opening.extent, opening.depth,
        froxels=opening.froxels, eyes=opening.eyes, cache=opening.cache,
    )  # fmt: skip


def _open_realtime(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> contextlib.AbstractContextManager[BandEngine]:
    return eevee_realtime(
        scene, camera, opening.plan, opening.extent, opening.depth,
        froxels=opening.froxels, eyes=opening.eyes, cache=opening.cache,
    )  # fmt: skip


BANDS = Engine(methods.BANDS, _open_bands, band_passes_of)
"""EEVEE, three bands a pass."""
REALTIME = Engine(methods.REALTIME, _open_realtime, picture_passes_of)
"""EEVEE, the picture in one pass."""
