"""Light that leaves 16 waters by HydroLight 4.2, under a sky and under a sun, beside ours."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.refraction import sun_travel_direction
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.rough_surface import WaterSurface
from ..uw_spectral.transfer.sky import UNIFORM, Sky
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import FournierForand
from .ecolight import Row, published

_FILE = Path(__file__).with_name("hydrolight.csv")
_SUN, _SURFACE = 30.0, WaterSurface(1.34)


def solved(row: Row, *, by_sun: bool, a_factor: float = 1.0, b_factor: float = 1.0) -> float:
    """Return the remote-sensing reflectance, 1/sr; factors plant errors in a and b."""
    sun = sun_travel_direction(_SUN, 0.0, 1.0).tolist()
    b = row["c"] * row["w0"]
    particles = FournierForand.of_backscatter_Mobley2002(0.0183)
    layer = OpticalLayer(
        row["depth_m"], np.array([a_factor * (row["c"] - b)]), np.array([b_factor * b]),
        BandPhase((particles,), np.ones((1, 1))),
    )  # fmt: skip
    enters = 1.0 - float(_SURFACE.reflectance(math.cos(math.radians(_SUN))))
    field = solve_discrete_ordinates(
        [layer], [enters * by_sun], _SURFACE.beam_below(sun).tolist(),
        sky=Sky.standard(UNIFORM, [float(not by_sun)], sun), surface=_SURFACE,
        floor_reflectance=row["reflectance"], streams=32, modes=1,
    )  # fmt: skip
    leaves = 1.0 - float(_SURFACE.reflectance(1.0))
    return float(field.radiance(0.0, (0.0, 0.0, -1.0))[0]) * leaves / _SURFACE.refractive_index**2


def differences(a_factor: float = 1.0, b_factor: float = 1.0) -> dict[str, NDArray[np.float64]]:
    """Return our reflectances over HydroLight's, less one, under the sky and under the sun."""
    return {
        name: np.array([
            solved(row, by_sun=by_sun, a_factor=a_factor, b_factor=b_factor) / row[name] - 1.0
            for row in published(_FILE)
        ])
        for name, by_sun in (("Rrs_sky", False), ("Rrs_sun", True))
    }  # fmt: skip
