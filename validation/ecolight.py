"""Light in 24 waters by EcoLight, the code that marine opticians use, beside ours."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.refraction import sun_travel_direction
from ..uw_spectral.surface.waves import slope_variance_CoxMunk1954
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.rough_surface import WaterSurface
from ..uw_spectral.transfer.sky import Sky
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import EinsteinSmoluchowski, FournierForand

QUANTITIES = ("Kd", "E0", "R", "Lu", "Ed", "Ed_2m")
"""What is compared: at 1 m, and Ed at 2 m too."""

_FILE = Path(__file__).with_name("ecolight.csv")
_NADIR = (0.0, 0.0, -1.0)
_SUN, _WIND, _INDEX = 30.0, 5.0, 1.34
_STEP = 0.01  # m, over which EcoLight takes Kd
_STREAMS = 32

Row = Mapping[str, float]


def published(path: Path = _FILE) -> list[Row]:
    """Return what EcoLight was given and printed, a row per water and wavelength."""
    with path.open(encoding="utf-8") as file:
        lines = (line for line in file if not line.startswith("#"))
        return [{name: float(x) for name, x in row.items()} for row in csv.DictReader(lines)]


def solved(row: Row, a_factor: float = 1.0, b_factor: float = 1.0) -> dict[str, float]:
    """Return the same by the solved field; factors plant errors in a and b."""
    sun = sun_travel_direction(_SUN, 0.0, 1.0)
    surface = WaterSurface(_INDEX, float(slope_variance_CoxMunk1954(_WIND).sum()))
    enters = 1.0 - float(surface.reflectance(math.cos(math.radians(_SUN))))
    b = np.array([row["b_w"], row["b_p"]])
    particles = FournierForand.of_backscatter_Mobley2002(row["bb_p"] / row["b_p"])
    phase = BandPhase((EinsteinSmoluchowski(), particles), (b / b.sum())[:, None])
    layer = OpticalLayer(
        math.inf, np.array([a_factor * row["a"]]), np.array([b_factor * b.sum()]), phase
    )
    field = solve_discrete_ordinates(
        [layer], [row["Ed_sun"] * enters], surface.beam_below(sun.tolist()).tolist(),
        sky=Sky.standard("clear", [row["Ed_sky"]], sun.tolist()),
        surface=surface, floor_reflectance=0.0, streams=_STREAMS, modes=1,
    )  # fmt: skip
    Ed, below, deeper = (float(field.Ed(z)[0]) for z in (1.0, 1.0 + _STEP, 2.0))
    return {
        "Kd": math.log(Ed / below) / _STEP,
        "E0": float(field.scalar_irradiance(1.0)[0]),
        "R": float(field.Eu(1.0)[0]) / Ed,
        "Lu": float(field.radiance(1.0, _NADIR)[0]),
        "Ed": Ed,
        "Ed_2m": deeper,
    }


def differences(a_factor: float = 1.0, b_factor: float = 1.0) -> dict[str, NDArray[np.float64]]:
    """Return our values over EcoLight's, less one, by quantity."""
    rows = published()
    ours = [solved(row, a_factor, b_factor) for row in rows]
    return {
        name: np.array([o[name] / row[name] - 1.0 for o, row in zip(ours, rows, strict=True)])
        for name in QUANTITIES
    }
