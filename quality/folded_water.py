"""Water without objects as EEVEE looks it up, from one depth: its light, folded into channels."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.solved_cloud import Cloud
from ..uw_spectral.imaging.band_selection import FittedViewpoint
from ..uw_spectral.imaging.excitation import Excitation
from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.wave_patterns import WavePatterns, least_pattern
from ..uw_spectral.transfer.band_spectra import OcclusionSpectra
from ..uw_spectral.transfer.channel_tables import SPECTRA, ChannelTables
from ..uw_spectral.transfer.channels import Channels, channels_of
from ..uw_spectral.transfer.projection import project
from ..uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, TABLE_STREAMS
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.sunlit_water import SunlitWater
from ..uw_spectral.transfer.water_column import WaterColumn

Array = NDArray[np.float64]
Changes = tuple[tuple[str, object], ...]
"""Fields of the water column, instead of its own."""
PLAIN, OCCLUDED, CHANGED = "plain", "shaded", "changed wavelength"
"""Which light: all, what objects occlude of it, or with light of changed wavelength."""


@dataclass(frozen=True, eq=False)
class Optics:
    """Water and camera on some bands.

    The depth of ``view`` is replaced by that of the rays; ``excitation`` changes the wavelength of
    light; ``waves`` are the moving surface, where the column has waves; ``caustics`` is the
    strength of the sunlight's pattern under them; ``clouds`` are on the same bands.
    """

    view: Viewpoint
    excitation: Excitation | None = None
    waves: WavePatterns | None = None
    caustics: float = 1.0
    clouds: tuple[Cloud, ...] = ()


@dataclass(frozen=True, eq=False)
class FoldedWater:
    """Folded light, what it is folded from, and its waves.

    Sunlight does not fall below the ``least`` of their pattern.
    """

    view: Viewpoint
    channels: Channels
    field: SolvedField
    light: ChannelTables
    waves: WavePatterns | None
    least: float

    def developed(self, seen: Operand) -> Array:
        """Return the colours of channels, which are the sensor's, shape (..., 3)."""
        reduction = self.view.reduction
        return np.asarray(seen) @ (reduction.weights @ np.linalg.pinv(reduction.response)).T


# Views from one depth have the same.
@functools.lru_cache(maxsize=8)
def folded_water(
    optics: Optics, depth: float, changes: Changes, dark: bool, light: str
) -> FoldedWater:
    """The water without objects, as EEVEE looks it up; what is to be left out is dark."""
    view = _view(optics.view, depth, dict(changes))
    column, phase, bands = _lit(view.column, dark=dark), view.phase, view.column.bands
    emission = occlusions = contrast = None
    if light == CHANGED and optics.excitation is not None:
        exciting = replace(optics.excitation.column, **dict(changes))
        excitation = replace(optics.excitation, column=_lit(exciting, dark=dark))
        emission = excitation.emission(bands, TABLE_STREAMS)
    field = column.solved_field(phase, TABLE_STREAMS, emission)
    if light == OCCLUDED:
        straight = column.solved_field(phase, OCCLUSION_STREAMS)
        occlusions = OcclusionSpectra(
            np.zeros((SPECTRA, len(bands))), np.ones((1, len(bands))), straight
        )
    waves, least = optics.waves if view.column.surface == "waves" else None, 0.0
    if waves is not None:
        above = column.mixed_above(view.depth).solved_field(phase, TABLE_STREAMS)
        knots = optics.caustics * waves.contrast(SunlitWater(above))
        contrast, least = functools.partial(waves.contrast_at, knots), least_pattern(knots)
    channels = channels_of(bands, view.reduction.response)
    floor = [view.column.floor_reflectance]
    projected = project(
        field, channels, view.depth, column.skylight.level, floor, occlusions, contrast
    )
    return FoldedWater(view, channels, field, projected, waves, least)


def _lit(column: WaterColumn, *, dark: bool) -> WaterColumn:
    """The water to solve: its waves are flat on average, and so solved once with the flat one."""
    floor = {"floor_reflectance": 0.0} if dark else {}
    calm = {"surface": "flat"} if column.reflects else {}
    return replace(column, **floor, **calm)


def _view(view: Viewpoint, depth: float, changed: Mapping[str, object]) -> Viewpoint:
    column = replace(view.column, **changed)
    changes: dict[str, object] = {"column": column, "depth": min(depth, column.floor_depth)}
    if isinstance(view, FittedViewpoint):
        changes["reference"] = _view(view.reference, depth, changed)
    return replace(view, **changes)
