"""The water of a frame as EEVEE draws it: its light, projected, and the numbers of its nodes."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...node_groups import realtime_values
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import Shape
from ...uw_spectral.transfer.channel_pixel import along_rays
from ...uw_spectral.transfer.channel_tables import ChannelTables
from ...uw_spectral.transfer.channels import Channels, channels_of
from ...uw_spectral.transfer.pixel_parts import COLOURS
from ...uw_spectral.transfer.projection import project
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS, tabulate
from ...uw_spectral.transfer.solved_field import SolvedField
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from ..materials.material_kinds import Kinds
from .shafts import ShaftRange, shaft_range
from .term import Term

FLOOR = ""
"""Key of the added floor's reflectance; no material has an empty name."""
_WHITE = 0.6  # colour of a white closure in the sunlight at the camera
_DARKEST = 1e-30  # sunlight that is held in single precision, and that nobody sees
_ROUNDING = 1e-9  # of weights that are not negative
_SIDES = 4


@dataclass(frozen=True, eq=False)
class FrameInputs:
    """What of a scene the light of its water depends on, in the bands of a plan."""

    #: Measured ones, shape (n,), by the names of materials.
    reflectances: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    kinds: Kinds = field(default_factory=Kinds)
    #: Depth in m of the floor that continues the scene's own seabed, infinite while there is no
    #: such seabed; None without that floor.
    seabed: float | None = None
    seabed_colour: tuple[float, float, float] = (0.5, 0.5, 0.5)  #: Linear Rec.709.
    #: Left, bottom, width and height of the picture of an orthographic camera, m.
    frame: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    terms: tuple[Term, ...] = ()


@dataclass(frozen=True, eq=False)
class RealtimeWater:
    """The water of a frame; make it with :func:`realtime_water`.

    Its light is solved in n bands and projected into the channels that are drawn.
    """

    column: WaterColumn  #: The water, its light and its floor.
    phase: BandPhase
    depth: float  #: Of the camera, m.
    field: SolvedField
    channels: Channels  #: What is drawn.
    #: What there is in the water; the added floor's reflectance among the measured ones.
    inputs: FrameInputs
    draws_shafts: bool = False
    layers: tuple[str, ...] = ()  #: Written beside the picture.
    pictures: bool = False  #: The channels are those of a picture.
    indices_in_water: bool = True  #: Refractive indices of materials are against the water.

    def in_channels(self, channels: Channels) -> RealtimeWater:
        """Return the water in other channels, without layers."""
        return replace(self, channels=channels, layers=())

    def with_terms(self, *terms: Term) -> RealtimeWater:
        """Return the water with terms, in place of those of their kind."""
        kept = [x for x in self.inputs.terms if type(x) not in {type(term) for term in terms}]
        return replace(self, inputs=replace(self.inputs, terms=(*kept, *terms)))

    def term[T: Term](self, kind: type[T]) -> T | None:
        """Return the term of a kind, if there is one."""
        return next((term for term in self.inputs.terms if isinstance(term, kind)), None)

    @functools.cached_property
    def shape(self) -> Shape:
        """What decides the nodes."""
        column, inputs, kinds = self.column, self.inputs, self.inputs.kinds
        scale = tabulate(self.field).depth_scale
        return Shape(
            self.field.components, column.reflects, len(scale.zones), scale.slices,
            self.draws_shafts, column.sky, self.field.layered, self.layers,
            mirrors=kinds.mirrors, translucent=kinds.translucent, highlights=kinds.highlights,
            filters=kinds.filters, glows=kinds.glows, measured=len(inputs.reflectances),
            terms=tuple(shape for term in inputs.terms for shape in term.shapes(self)),
        )  # fmt: skip

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
        return self.pictures and not self.layers and bool(positive)

    @functools.cached_property
    def projected(self) -> ChannelTables:
        """Light of the water in the channels."""
        return self._project(self.channels, measured=list(self.inputs.reflectances.values()))

    @functools.cached_property
    def exciting(self) -> ChannelTables:
        """Light of the water as what it excites absorbs it; its first colour is white."""
        white = np.zeros((len(self.column.bands), len(COLOURS)))
        white[:, 0] = 1.0
        return self._project(Channels(self.excitation, white, white), emissions=())

    def _project(self, channels: Channels, **others: Any) -> ChannelTables:  # noqa: ANN401
        given: dict[str, Any] = {}
        for term in self.inputs.terms:
            given |= term.projection()
        level = self.column.skylight.level
        return project(self.field, channels, self.depth, level, **given | others)

    @functools.cached_property
    def excitation(self) -> NDArray[np.float64]:
        """Weights of bands by which there is other light of theirs, (3, n), or (0, n)."""
        bands = self.column.bands
        found = (term.excitation(bands) for term in self.inputs.terms)
        return np.concatenate([np.zeros((0, len(bands))), *found])

    @property
    def floating(self) -> float:
        """Mean size of what floats in the water, m; 0 if nothing does."""
        return max((term.floating for term in self.inputs.terms), default=0.0)

    @functools.cached_property
    def shafts(self) -> ShaftRange | None:
        """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
        if not self.draws_shafts:
            return None
        clearest = float(self.column.attenuation.min())
        return shaft_range(self.projected, self.field.sun, self.depth, clearest)

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
        single = {
            **dict(zip(realtime_values.SUN_IN_AIR, self.column.skylight.sun, strict=True)),
            realtime_values.CAMERA_DEPTH: self.depth,
            **dict(zip(realtime_values.FRAME, self.inputs.frame, strict=True)),
            realtime_values.INDEX: self.column.refractive_index,
            realtime_values.SUN_GAIN: self.sun_gain,
            realtime_values.SHAFT_END: self.shafts.end if self.shafts else 0.0,
            realtime_values.SHAFT_SCALE: self.shafts.scale if self.shafts else 0.0,
        }
        # By the mean radiance of open water around the camera.
        turns = np.pi / 2.0 * np.arange(_SIDES)
        w = np.cos(turns), np.sin(turns), 0.0 * turns
        depth = min(max(self.depth, 0.0), self.field.floor_depth)
        level = self.field.radiance(depth, w).mean(axis=0)
        through = self.channels.mean(self.channels.reflectance.T, level)
        channels = dict(zip(realtime_values.FILTERS, np.clip(through, 0.0, 1.0), strict=True))
        if "reflectance" in self.layers:
            columns = self.channels.project(self.channels.reflectance.T)
            channels |= dict(zip(realtime_values.REFLECTANCE, columns, strict=True))
        found = realtime_values.of_light(self.projected, tuple(self.field.sun))
        found |= Numbers(channels, single)
        for term in self.inputs.terms:
            found |= term.numbers(self)
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
    """Return the water of a frame, and of a camera at a depth, m.

    ``weights`` are what the channels have per unit radiance of each band, (3, n); ``solved`` is the
    light of the column, if it has been solved already; with ``shafts`` single scattering is drawn
    by the froxel volume, with shadows.
    """
    inputs = inputs or FrameInputs()
    if shafts:
        column.require_one_layer("shafts of light know")
    field = solved or column.solved_field(phase, TABLE_STREAMS)
    if math.isfinite(column.floor_depth) and inputs.seabed is None:
        reflectances = {**inputs.reflectances, FLOOR: column.floor_reflectance}
        inputs = replace(inputs, reflectances=reflectances)
    channels = channels_of(column.bands, weights)
    return RealtimeWater(column, phase, camera_depth, field, channels, inputs, shafts)
