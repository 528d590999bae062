"""EEVEE as an engine: in band passes, and all bands at once."""

from __future__ import annotations

import contextlib
import functools
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...quality import methods
from ...settings.render_plan import RenderPlan
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ...uw_spectral.transfer.channels import channels_of, channels_of_bands
from ..readers import cameras, waterline
from ..temporary import held, render_settings
from ..terms import limits
from ..terms.view_from_air import AirTerm
from ..terms.waves import WaveTerm
from ..water import realtime, scene_water
from ..water.frame_water import RealtimeWater
from ..water.occlusion import Cache
from ..water.water_body import WaterExtent
from . import eevee_settings, planar_picture
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .eevee_frames import EeveeFrames
from .eevee_layers import depth_map, layers_of
from .exr_output import write_float_exr

type Pixels = NDArray[np.floating]

_FEW_PIXELS = 8
_DARKEST = 1e-20  # of the brightest: what is multiplied stays in single precision


class _Bands:
    """A frame of band passes.

    EEVEE keeps half floats, so each band is scaled to the radiance of a white surface before the
    camera, and back when the pass is written.
    """

    def __init__(self, frames: EeveeFrames, now: RenderPlan, depth: float) -> None:
        self._water = frames.water(now, depth)
        self._scale = _scale(frames.white_light(now, depth) / np.pi)

    def drawn(self, indices: tuple[int, ...]) -> tuple[RealtimeWater, NDArray[np.float64]]:
        """Return the water of a pass, and what its channels are multiplied with."""
        bands = self._water.column.bands
        channels = channels_of_bands(bands, indices, 1.0 / self._scale[list(indices)])
        repeated = [*indices, *[indices[-1]] * (3 - len(indices))]
        return self._water.in_channels(channels), self._scale[repeated]

    def picture(self, image: NDArray[np.float32], white: NDArray[np.float64], _: object) -> Pixels:
        """Return the bands."""
        return image * white


class _Picture:
    """A frame whose pass is the picture already.

    Drawn are the responses of the sensor, over those to a white surface before the camera: they
    are not negative, where colours out of gamut are, and EEVEE cuts what is.
    """

    def __init__(self, frames: EeveeFrames, now: RenderPlan, depth: float) -> None:
        response = now.response(depth)
        self._white = _scale(np.abs(response @ frames.white_light(now, depth)) / np.pi)
        channels = channels_of(now.bands, response / self._white[:, None])
        self._water = replace(frames.water(now, depth).in_channels(channels), pictures=True)
        self._weights = functools.partial(frames.weights, now, depth)

    def drawn(self, _: tuple[int, ...]) -> tuple[RealtimeWater, NDArray[np.float64]]:
        """Return the water, and what its channels are multiplied with to be the sensor's."""
        return self._water, self._white

    def picture(self, image: NDArray[np.float32], _: object, given: Weights | None) -> Pixels:
        """Return the picture in its colours."""
        weights = np.asarray(self._weights() if given is None else given)
        to_picture = weights @ np.linalg.pinv(self._water.channels.weights)
        return image @ to_picture.T.astype(np.float32)


class _Eevee:
    """Puts water for EEVEE into a scene, drawn one of two ways; takes it out after the block."""

    def __init__(self, way: type[_Bands | _Picture]) -> None:
        self._way = way

    @contextlib.contextmanager
    def __call__(
        self,
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
        """Begin with the water of a plan."""
        frames = EeveeFrames(scene, camera, eyes, cache or Cache(of_job=True))
        by_band = self._way is _Bands
        passes = band_passes_of(plan) if by_band else picture_passes_of(plan)
        layers = layers_of(scene, camera, plan, eyes, by_band=by_band)
        written = () if layers is None else layers.drawn
        first, _ = self._way(frames, plan, depth).drawn(passes[0])
        with _water_in(frames, plan, replace(first, layers=written), extent, froxels) as notes:

            def frame(
                now: RenderPlan, camera_depth: float, given: Weights | None = None
            ) -> RenderPass:
                what = self._way(frames, now, camera_depth)

                def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                    water, white = what.drawn(indices)
                    water, found = replace(water, layers=written), None
                    frames.pictures.show(now, water)
                    if layers is None:
                        image = _drawn(scene, camera, water, path)
                    else:
                        realtime.set_values(scene, water)
                        image, found = layers.render(
                            scene, camera, path, indices, white, np.diag(white),
                            is_first=indices == passes[0],
                        )  # fmt: skip
                    write_rgb_exr(path, what.picture(image, white, given))
                    return found

                return render

            yield BandEngine(passes, notes, frame, lambda path: depth_map(scene, path))

    def open(
        self, scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
    ) -> contextlib.AbstractContextManager[BandEngine]:
        """Begin with what a job does."""
        return self(
            scene, camera, opening.plan, opening.extent, opening.depth,
            froxels=opening.froxels, eyes=opening.eyes, cache=opening.cache,
        )  # fmt: skip


@contextlib.contextmanager
def _water_in(
    frames: EeveeFrames,
    plan: RenderPlan,
    first: RealtimeWater,
    extent: WaterExtent,
    froxels: int | None,
) -> Iterator[list[str]]:
    """Put the water of a job's first frame into a scene while the block runs.

    Yields what is not treated, or not drawn as it is, a line each.
    """
    scene, camera, eyes = frames.scene, frames.camera, frames.eyes
    notes = [*cameras.clip_notes(camera), *realtime.add_realtime(scene, first, extent)]
    try:
        with eevee_settings.realtime_settings(
            scene, camera, samples=plan.settings.samples, water=first, froxels=froxels
        ):
            if first.shape.shafts:
                _warm_up(scene)
            notes += limits.of_eevee(scene, camera, plan, frames.cache, first, eyes)
            notes += planar_picture.notes(camera, plan, eyes, frames.pictures)
            yield notes + planar_picture.notes_of_air(scene, camera, plan, eyes)
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


def _drawn(
    scene: bpy.types.Scene, camera: bpy.types.Object, water: RealtimeWater, path: Path
) -> NDArray[np.float32]:
    """Render a picture into a file, from either side of the waterline if the camera is there."""

    def render(now: RealtimeWater) -> NDArray[np.float32]:
        realtime.set_values(scene, now)
        write_float_exr(scene, path)
        return read_exr(path)[0]

    waves, above = water.term(WaveTerm), water.term(AirTerm)
    raised = None if waves is None else waves.patterns.raised
    if above is None or not waterline.splits(scene, camera, raised):
        return render(water)
    with held([(scene.render, "use_border", False)]):  # glass and water bend it across
        air, wet = (render(water.with_terms(above.seen(in_air=in_air))) for in_air in (True, False))
    index = water.column.refractive_index
    both = waterline.joined(scene, camera, air, wet, index, raised)
    write_rgb_exr(path, both)
    return both


def _scale(white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what to divide by so that white is near 1; where there is no light, anything."""
    brightest = float(white.max())
    return np.maximum(white, _DARKEST * brightest) if brightest > 0 else np.ones_like(white)


def band_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass of three."""
    return plan.bands.packed(3)


def picture_passes_of(plan: RenderPlan) -> list[tuple[int, ...]]:
    """Return the bands of each pass that is a part of the picture: one."""
    return [tuple(range(len(plan.bands)))]


eevee_bands = _Eevee(_Bands)
"""Water for EEVEE, three bands a pass, while the block runs."""
eevee_realtime = _Eevee(_Picture)
"""Water for EEVEE, all bands in one pass that is the picture already."""
BANDS = Engine(methods.BANDS, eevee_bands.open, band_passes_of)
REALTIME = Engine(methods.REALTIME, eevee_realtime.open, picture_passes_of)
