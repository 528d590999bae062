"""Simple water columns for the tests: every band alike."""

from __future__ import annotations

import numpy as np
from underwater_spectral.node_groups.water_volume import ScatteringLobe
from underwater_spectral.scene.water.cycles_phase import CyclesPhase, cycles_phase
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn


def grey_column(a: float, b: float, **changes) -> WaterColumn:
    bands = Bands.uniform(3)
    values = {
        "sun_irradiance": 1.0,
        "sun_cosine": 1.0,
        "sun_direction": np.array([0.0, 0.0, -1.0]),
        "sky_radiance": 0.0,
        "floor_depth": np.inf,
        "floor_reflectance": 0.0,
        "surface": "none",
        "refractive_index": 1.0,
    }
    return WaterColumn(bands, np.full(3, a), np.full(3, b), **(values | changes))


def layers_of(column: WaterColumn, lobes, fractions=(1.0,)) -> list[CyclesPhase]:
    """Return these lobes for the first layer, and the phase functions of those below."""
    first = CyclesPhase(lobes, tuple(np.full(3, fraction) for fraction in fractions))
    return [first, *(cycles_phase(layer.phase) for layer in column.below)]


def henyey_greenstein(g: float) -> tuple[ScatteringLobe, ...]:
    return (ScatteringLobe("HENYEY_GREENSTEIN", g),)
