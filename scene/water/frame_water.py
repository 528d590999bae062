"""The water of a frame as EEVEE draws it: its light, projected, and the numbers of its nodes."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field

import numpy as np
from numpy.typing import NDArray

from ...node_groups import (
    realtime_adjacency,
    realtime_clouds,
    realtime_occlusion,
    realtime_values,
    realtime_volume,
)
from ...node_groups.realtime_values import Numbers, Shape
from ...uw_spectral.clouds.cloud_numbers import CloudNumbers
from ...uw_spectral.clouds.solved_cloud import Cloud, cloud_numbers, lamplight_on
from ...uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ...uw_spectral.occlusion.adjacency import Adjacency, adjacency
from ...uw_spectral.occlusion.visibility_buffer import VisibilityBuffer
from ...uw_spectral.surface.wave_patterns import WavePatterns, least_pattern
from ...uw_spectral.transfer.above_water import light_in_air
from ...uw_spectral.transfer.band_spectra import OcclusionSpectrum
from ...uw_spectral.transfer.channel_pixel import along_rays
from ...uw_spectral.transfer.channel_tables import ChannelTables
from ...uw_spectral.transfer.channels import Channels, channels_of
from ...uw_spectral.transfer.foam_light import foam_light
from ...uw_spectral.transfer.pixel_parts import COLOURS
from ...uw_spectral.transfer.projection import project
from ...uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, TABLE_STREAMS, tabulate
from ...uw_spectral.transfer.solved_field import SolvedField
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from ...uw_spectral.water.phase_functions import HenyeyGreenstein
from ..readers.frame_inputs import FrameInputs
from .frame_numbers import in_air_numbers, lamp_numbers, view_numbers, wave_numbers
from .particles import SceneParticles

FLOOR = ""
"""Key of the added floor's reflectance; no material has an empty name."""
# Shafts end where the clearest band keeps 2 % of its light, or soon after the scene does.
_SHAFT_OPTICAL_DEPTH = 4.0
LONGEST_SHAFT = 200.0
_WHITE = 0.6  # colour of a white closure in the sunlight at the camera
_DARKEST = 1e-30  # sunlight that is held in single precision, and that nobody sees
_ROUNDING = 1e-9  # of weights that are not negative
_SIDES = 4
# Share by which the volume may dim what is behind it; below, the rounding of its
# transmittance costs more light than that (8 to 14 % at 0.003, 4 to 6 % at 0.02).
_SHAFT_OPACITY = 0.02


@dataclass(frozen=True)
class ShaftRange:
    """Reach of the froxel volume in m, and the factor that makes it thin."""

    end: float
    scale: float


@dataclass(frozen=True, eq=False)
class RealtimeWater:
    """The water of a frame; make it with :func:`realtime_water`.

    Its light is solved in n bands and projected into the channels that are drawn.

    Attributes
    ----------
    column : WaterColumn
        The water, its light and its floor.
    phase : BandPhase
        Its phase function.
    depth : float
        Of the camera, m.
    low_stream_field : SolvedField, optional
        Of :class:`.OcclusionSpectrum`, if objects occlude.
    channels : Channels
        What is drawn.
    inputs : Snapshot
        What there is in the water; the added floor's reflectance among the measured ones.
    pictures : bool
        Whether the channels are those of a picture.
    indices_in_water : bool
        Whether refractive indices of materials are taken against the water.
    waves, contrast, strength : WavePatterns, array (KNOTS, n), float
        The moving surface: its patterns, and the strength of what they throw.
    window_from : three floats, optional
        Where the camera is, m, if it may see objects in the air through the surface.
    """

    column: WaterColumn
    phase: BandPhase
    depth: float
    field: SolvedField
    channels: Channels
    shape: Shape
    inputs: FrameInputs
    low_stream_field: SolvedField | None = None
    draws_shafts: bool = False
    around_lamps: LampWater | None = None
    particles: SceneParticles = dataclass_field(default_factory=SceneParticles)
    waves: WavePatterns | None = None
    contrast: NDArray[np.float64] | None = None
    strength: float = 0.0
    pictures: bool = False
    indices_in_water: bool = True
    window_from: Sequence[float] | None = None

    def in_channels(self, channels: Channels, layers: Sequence[str] = ()) -> RealtimeWater:
        """Return the water in other channels, with layers that are written beside the picture."""
        shape = replace(self.shape, layers=tuple(layers))
        return replace(self, channels=channels, shape=shape)

    def seen_from(self, *, in_air: bool) -> RealtimeWater:
        """Return the water for rays that all begin in the air, or all in the water."""
        assert self.inputs.above is not None, "the camera may be in the air"
        inputs = replace(self.inputs, above=replace(self.inputs.above, in_air=in_air))
        return replace(self, inputs=inputs)

    def with_pictures(
        self, *, mirrored: bool, window_from: Sequence[float] | None
    ) -> RealtimeWater:
        """Return the water whose surface may mirror a picture of objects, or show one of the air.

        Parameters
        ----------
        window_from : three floats, optional
            Where the camera is, m, if it may see objects in the air.
        """
        window = window_from is not None
        shape = replace(self.shape, planar_reflections=mirrored, window=window)
        return replace(self, shape=shape, window_from=window_from)

    def under_waves(
        self, waves: WavePatterns, contrast: NDArray[np.float64], strength: float
    ) -> RealtimeWater:
        """Return the water under waves.

        Parameters
        ----------
        waves : WavePatterns
            Of the frame.
        contrast : array, shape (KNOTS, n)
            Of the bands, its strength included.
        strength : float
            Of the caustics in the shafts; 1 is physical.
        """
        raised = waves.raised
        shape = replace(
            self.shape,
            waves=True,
            raised=raised is not None,
            foam=raised is not None and raised.foam is not None,
        )
        return replace(self, shape=shape, waves=waves, contrast=contrast, strength=strength)

    @property
    def has_floor(self) -> bool:
        """Whether a floor is added, or continues the scene's own seabed."""
        return FLOOR in self.inputs.reflectances or self.inputs.seabed is not None

    @property
    def has_native_closures(self) -> bool:
        """Whether materials keep their closures, which only add to the light of the water.

        Layers hold the light of objects, which nothing tells of a closure; and where channels are
        negative, as those of a display are, EEVEE would cut the light of the water first. Band
        passes are measurements, and EEVEE keeps the colours of closures in steps of a thousandth.
        """
        weights = self.channels.weights
        positive = weights.min() >= -_ROUNDING * np.abs(weights).max()
        return self.pictures and not self.shape.layers and bool(positive)

    @functools.cached_property
    def projected(self) -> ChannelTables:
        """Light of the water in the channels."""
        emissions = self.inputs.fluorescent.emissions_in(self.column.bands)
        return self._project(self.channels, list(self.inputs.reflectances.values()), emissions)

    def _project(
        self,
        channels: Channels,
        measured: Sequence[NDArray[np.float64]] = (),
        emissions: Sequence[NDArray[np.float64]] = (),
    ) -> ChannelTables:
        occlusion, occlusions = self.inputs.occlusion, None
        if occlusion is not None and self.low_stream_field is not None:
            occlusions = OcclusionSpectrum(
                occlusion.spectrum, occlusion.typical, self.low_stream_field
            )
        contrast = None
        if self.waves is not None and self.contrast is not None:
            contrast = functools.partial(self.waves.contrast_at, self.contrast)
        return project(
            self.field,
            channels,
            self.depth,
            self.column.skylight.level,
            measured,
            occlusions,
            contrast,
            emissions,
        )

    @functools.cached_property
    def excitation(self) -> NDArray[np.float64]:
        """Weights of bands by which fluorophores are excited, (3, n), or (0, n)."""
        return self.inputs.fluorescent.excitation_in(self.column.bands)

    @functools.cached_property
    def exciting(self) -> ChannelTables:
        """Light of the water as fluorophores absorb it; its first colour is white."""
        white = np.zeros((len(self.column.bands), len(COLOURS)))
        white[:, 0] = 1.0
        return self._project(Channels(self.excitation, white, white))

    @property
    def adjacency(self) -> Adjacency:
        """What objects in view do to light that is scattered forward."""
        assert self.inputs.buffer is not None
        return self.adjacency_of(self.inputs.buffer)

    def adjacency_of(self, buffer: VisibilityBuffer) -> Adjacency:
        """Return the same for another view."""
        occlusion = self.inputs.occlusion
        assert occlusion is not None
        floor = self.inputs.seabed_colour
        if FLOOR in self.inputs.reflectances:
            floor = len(COLOURS) + list(self.inputs.reflectances).index(FLOOR)
        return adjacency(buffer, self.projected, self.field.sun, occlusion, floor)

    def _level_light(self) -> NDArray[np.float64]:
        """Mean radiance of open water around the camera, shape (n,)."""
        turns = np.pi / 2.0 * np.arange(_SIDES)
        w = np.cos(turns), np.sin(turns), 0.0 * turns
        return self.field.radiance(min(max(self.depth, 0.0), self.field.floor_depth), w).mean(
            axis=0
        )

    @functools.cached_property
    def shafts(self) -> ShaftRange | None:
        """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
        return _shaft_range(self) if self.draws_shafts else None

    @functools.cached_property
    def sun_gain(self) -> float:
        """What the light of the drawn sun is multiplied with.

        EEVEE keeps the colours of closures in steps of a thousandth, and lobes that have no colour
        of their own are at most 1: a white object in the sunlight at the camera shall be so near
        to 1 that brighter places have room.
        """
        along = along_rays(self.projected, self.field.sun, [np.zeros((1, 1))] * 3)
        y = np.full((1, 1), min(max(self.depth, 0.0), self.field.floor_depth))
        white = sum(along.sunlight(y, 0.0 * y, k) for k in COLOURS)
        brightest = float(np.max(white))
        return _WHITE / max(brightest, _DARKEST) if brightest > 0 else 1.0

    @functools.cached_property
    def numbers(self) -> Numbers:
        """What the node groups need besides tables and images."""
        column, shape = self.column, self.shape
        found = realtime_values.of_light(self.projected, tuple(self.field.sun))
        channels, single = dict(found.channels), dict(found.single)
        single |= dict(zip(realtime_values.SUN_IN_AIR, column.skylight.sun, strict=True))
        single |= {
            realtime_values.CAMERA_DEPTH: self.depth,
            **dict(zip(realtime_values.FRAME, self.inputs.frame, strict=True)),
            realtime_values.INDEX: column.refractive_index,
            realtime_values.SUN_GAIN: self.sun_gain,
            realtime_values.SHAFT_END: self.shafts.end if self.shafts else 0.0,
            realtime_values.SHAFT_SCALE: self.shafts.scale if self.shafts else 0.0,
        }
        through = self.channels.mean(self.channels.reflectance.T, self._level_light())
        channels |= dict(zip(realtime_values.FILTERS, np.clip(through, 0.0, 1.0), strict=True))
        if self.inputs.occlusion is not None:
            single |= realtime_occlusion.FIELDS.numbers(self.inputs.occlusion.box)
        if self.inputs.buffer is not None:
            single |= realtime_adjacency.FIELDS.numbers(self.inputs.buffer.view)
        if "reflectance" in shape.layers:
            columns = self.channels.project(self.channels.reflectance.T)
            channels |= dict(zip(realtime_values.REFLECTANCE, columns, strict=True))
        if shape.port:
            single[realtime_values.PORT] = self.inputs.port
        if shape.fluorophores:
            light = self.exciting.numbers
            named = realtime_values.EXCITING
            channels |= {name: getattr(light, key) for key, name in named.items()}
        if self.inputs.above is not None or shape.window:
            in_air = light_in_air(column, self.field)
            channels |= in_air_numbers(self.channels, in_air)
            single[realtime_values.MIRRORED_FRACTION] = float(in_air.mirrored)
            single[realtime_values.MIRRORED_SUN] = float(in_air.sun_mirrored)
        if self.inputs.above is not None:
            single |= view_numbers(self.inputs.above, column)
        if shape.window:
            single[realtime_values.THROUGH] = 0.0
        if self.around_lamps is not None:
            single |= lamp_numbers(self.inputs.lamps, column, self.phase, self.depth)
        if self.waves is not None and self.contrast is not None:
            # Where light falls from the brightest to nothing, no band may fall below it.
            single[realtime_values.LEAST_PATTERN] = least_pattern(self.contrast)
            single |= wave_numbers(self.waves, self.strength)
            single |= {
                realtime_values.GLITTER: column.glitter * bool(self.waves.slope_x.any()),
                realtime_values.GLITTER_WIDTH: self.waves.glitter_width(column.refractive_index),
            }
        if shape.foam:
            foam = foam_light(column)
            channels |= {
                realtime_values.FOAM_BELOW: self.channels.project(foam.below),
                realtime_values.FOAM_IN_SUN: self.channels.project(foam.sun),
                realtime_values.FOAM_IN_SKY: self.channels.project(foam.sky),
            }
        return Numbers(channels, single)

    @property
    def cloud_size(self) -> float:
        """Mean size of the clouds, m; 0 without."""
        sizes = [cloud.blob.size for cloud, _ in (*self.inputs.clouds, *self.inputs.grids)]
        return float(np.mean(sizes)) if sizes else 0.0

    @property
    def clouds(self) -> list[CloudNumbers]:
        """Numbers of the clouds that are blobs."""
        return self._numbers_of(self.inputs.clouds)

    @property
    def grids(self) -> list[CloudNumbers]:
        """Numbers of those that have grids."""
        return self._numbers_of(self.inputs.grids)

    def _numbers_of(self, clouds: Sequence[tuple[Cloud, float]]) -> list[CloudNumbers]:
        lamps, found = self.inputs.lamps.lamps, []
        phases = realtime_clouds.kinds(self.shape.floating)
        for cloud, away in clouds:
            lit = None
            if self.around_lamps is not None:
                lit = lamplight_on(cloud, lamps, self.around_lamps)
            numbers = cloud_numbers(cloud, self.field, self.channels, away, lit, lamps)
            found.append(replace(numbers, kind=float(phases.index(cloud.matter.phase))))
        return found


def realtime_water(
    column: WaterColumn,
    phase: BandPhase,
    camera_depth: float,
    weights: NDArray[np.float64],
    *,
    solved: SolvedField | None = None,
    shafts: bool = False,
    inputs: FrameInputs | None = None,
) -> RealtimeWater:
    """Return the water of a frame.

    Parameters
    ----------
    column : WaterColumn
        The water, its light and its floor.
    phase : BandPhase
        Its phase function.
    camera_depth : float
        Depth of the camera, m.
    weights : array, shape (3, n)
        What the channels have per unit radiance of each band.
    solved : SolvedField, optional
        Light of the column, if it has been solved already.
    shafts : bool
        Whether single scattering is drawn by the froxel volume, with shadows; from the air it is
        not.
    inputs : Snapshot, optional
        What there is in the water; nothing by default.
    """
    inputs = inputs or FrameInputs()
    lamps, shafts = inputs.lamps, shafts and inputs.above is None
    if shafts:
        column.require_one_layer("shafts of light know")
    field = solved or column.solved_field(phase, TABLE_STREAMS)
    if math.isfinite(column.floor_depth) and inputs.seabed is None:
        inputs = replace(
            inputs, reflectances={**inputs.reflectances, FLOOR: column.floor_reflectance}
        )
    scale = tabulate(field).depth_scale
    shape = Shape(
        field.components, column.reflects, len(scale.zones), scale.slices, shafts,
        sky=column.sky, layered=field.layered, occlusion=inputs.occlusion is not None,
        adjacency=inputs.buffer is not None, lamps=len(lamps.all), virtual=len(lamps.virtual),
        lamp_components=phase.components if lamps.lamps else (), lamps_in_air=lamps.from_air,
        facets=inputs.kinds.facets if lamps.lamps else 0,
        above=inputs.above is not None, mirrors=inputs.kinds.mirrors,
        translucent=inputs.kinds.translucent, filters=inputs.kinds.filters,
        glows=inputs.kinds.glows, highlights=inputs.kinds.highlights,
        measured=len(inputs.reflectances), port=inputs.port > 0.0,
        fluorophores=len(inputs.fluorescent.fluorophores),
        fluorescent=tuple(inputs.fluorescent.materials),
        clouds=tuple(cloud.matter.phase for cloud, _ in inputs.clouds),
        grids=tuple(cloud.matter.phase for cloud, _ in inputs.grids),
    )  # fmt: skip
    around_lamps = lamps.around
    if lamps.lamps and around_lamps is None:
        around_lamps = _around_lamps(column, phase, camera_depth)
    low_stream_field = column.solved_field(phase, OCCLUSION_STREAMS) if shape.occlusion else None
    return RealtimeWater(
        column, phase, camera_depth, field, channels_of(column.bands, weights), shape, inputs,
        low_stream_field, shafts, around_lamps,
    )  # fmt: skip


def _around_lamps(column: WaterColumn, phase: BandPhase, depth: float) -> LampWater:
    """Return the water of a depth as the light of lamps meets it."""
    here = column.layer_at(depth, phase)
    alike = here.phase.components == phase.components
    return lamp_water(here.absorption, here.scattering, here.phase if alike else phase)


def _shaft_range(water: RealtimeWater) -> ShaftRange:
    """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
    clearest = float(water.column.attenuation.min())
    end = min(_SHAFT_OPTICAL_DEPTH / max(clearest, 1e-6), LONGEST_SHAFT)
    angles = np.radians(np.linspace(5.0, 175.0, 35))
    sun = np.asarray(water.field.sun, dtype=np.float64)
    across = np.cross(sun, [1.0, 0.0, 0.0] if abs(sun[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    w = list((-np.cos(angles)[:, None] * sun + np.sin(angles)[:, None] * across).T[..., None])
    ray = along_rays(water.projected, water.field.sun, w)
    y_o = np.full((len(angles), 1), max(water.depth, 0.0))
    y_e = np.maximum(y_o - w[2] * end, 0.0)
    P = np.where(w[2] > 0, np.minimum(end, y_o / np.maximum(w[2], 1e-6)), end)
    seen = np.maximum(ray.single_scattering(y_o, y_e, w, P), 0.0).max(axis=1)
    phase = HenyeyGreenstein(realtime_volume.ANISOTROPY)
    opacity = float((seen / phase(np.cos(angles))).max())
    return ShaftRange(end, _SHAFT_OPACITY / max(opacity, 1e-12))
