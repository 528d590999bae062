"""Numbers of a frame's water beside its tables: of the air, a view from it, waves, lamps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...node_groups import realtime_lamps, realtime_values
from ...uw_spectral.surface.wave_patterns import LAYERS, WavePatterns
from ...uw_spectral.transfer.above_water import LightInAir, flattened_sun
from ...uw_spectral.transfer.channels import Channels
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from ..readers.frame_inputs import ViewFromAir
from ..readers.lamps import SceneLamps

# Intensity of the lamps that cast shadows: what they add to the sun's light on an object is this
# fraction of what the lamps themselves do. Fainter ones drown in the rounding of single precision.
_FAINT_FRACTION, _FAINTEST, _BRIGHTEST = 1e-3, 2e-5, 2e-3


def in_air_numbers(channels: Channels, light: LightInAir) -> dict[str, NDArray[np.float64]]:
    """Return sun and sky in the air, on colours and alone, and light that colours emit."""
    found = {
        realtime_values.SUN_LEVEL: channels.project(light.sun),
        realtime_values.SKY_LEVEL: channels.project(light.level),
    }
    for names, columns in (
        (realtime_values.SUN_ABOVE, channels.project_colours(light.sun)),
        (realtime_values.SKY_ABOVE, channels.project_colours(light.sky)),
        (realtime_values.WATER_ABOVE, channels.project_colours(light.leaving)),
        (realtime_values.GLOW_ABOVE, channels.project(channels.emission.T).T),
    ):
        found |= dict(zip(names, columns.T, strict=True))
    return found


def view_numbers(view: ViewFromAir, column: WaterColumn) -> dict[str, float]:
    """Return what the node groups know of a view from the air."""
    index = column.refractive_index if column.reflects else 1.0
    sun = column.sun_direction.tolist()
    if view.in_air:
        sun = flattened_sun(sun, view.towards, index).tolist()
    return {
        realtime_values.IN_AIR: float(view.in_air),
        realtime_values.RAY_INDEX: index,
        **dict(zip(realtime_values.CAMERA, view.camera, strict=True)),
        **dict(zip(realtime_values.DRAWN_SUN, sun, strict=True)),
    }


def wave_numbers(waves: WavePatterns, strength: float) -> dict[str, float]:
    """Return what the nodes need to look up the images of waves, by name."""
    depths, raised = waves.layers.depths, waves.raised
    far = {}
    if raised is not None:
        far = {
            realtime_values.WAVES_FAR_PER_METRE: 1 / raised.far.tile,
            realtime_values.WAVES_FAR_HALF_CELL: 0.5 / len(raised.far.elevation),
            realtime_values.WAVES_HIGHEST: raised.highest,
        }
        if raised.foam is not None:
            far |= {
                realtime_values.FOAM_FIRST: raised.foam.first,
                realtime_values.FOAM_PER_CROWDING: raised.foam.per_crowding,
            }
    return far | {
        realtime_values.WAVES_PER_METRE: 1 / waves.layers.tile,
        realtime_values.WAVES_HALF_CELL: 0.5 / len(waves.slope_x),
        realtime_values.WAVES_LOG_DEPTH: math.log(depths[0]),
        realtime_values.WAVES_PER_LOG: (LAYERS - 1) / math.log(depths[-1] / depths[0]),
        realtime_values.CAUSTIC_STRENGTH: strength,
    }


def lamp_numbers(
    lamps: SceneLamps, column: WaterColumn, phase: BandPhase, depth: float
) -> dict[str, float]:
    """Return the numbers of lamps in water of a depth that are the same in every band."""
    sun = float(np.mean(column.Ed(depth, phase)))
    brightest = max(float(np.mean(lamp.intensity)) for lamp in lamps.lamps)
    sunlit = bool(np.any(column.sun_irradiance > 0))
    code = min(max(_FAINT_FRACTION * brightest / sun, _FAINTEST), _BRIGHTEST) if sun > 0 else 1.0
    return dict(zip(realtime_lamps.NUMBERS, (float(sunlit), code), strict=True))
