"""The Monte Carlo against published problems, and the closed form against the Monte Carlo."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.surface.refraction import (
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from ..uw_spectral.transfer.radiance_field import upwelling_irradiance
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import parse_phase
from .canonical_problems import INDEX, canonical_values, phase_of
from .closed_form.closed_form import ClosedForm, solve_closed_form
from .closed_form.light_field import light_field_of
from .monte_carlo import MonteCarloResult, simulate

PHASES = ("hg:0.8", "fournier-forand:1.10,0.0183")


WATERS = ("I", "IA", "IB", "II", "3C")


WAVELENGTHS = (450.0, 550.0)


FLOORS = (0.0, 0.2)


CAMERA, FLOOR_DEPTH, DEPTHS = 5.0, 8.0, (1.0, 3.0, 5.0, 7.5)


# Irradiance of the closed form → that of the Monte Carlo, and how it is computed.
QUANTITIES = {
    "Ed": ("Ed", lambda water, y: water.field.Ed(y)),
    "Eu, two streams": ("Eu", lambda water, y: water.field.Eu(y)),
    "Eu, integrated": ("Eu", lambda water, y: upwelling_irradiance(water.radiance, y)),
}


IRRADIANCE_PHOTONS = 2_000_000


DEEPEST_TAU = 5.0


PUBLISHED_PHOTONS = 20_000_000


@dataclass(frozen=True)
class Canonical:
    """One number of a canonical problem: published, found, and the tolerance."""

    problem: int
    case: int
    tau: float
    quantity: str
    published: float
    variation: float
    found: float
    error: float

    @property
    def tolerance(self) -> float:
        """Of the relative difference: max(3 CV, 1 %), 5 % for Lu."""
        return max(3 * self.variation, 0.05 if self.quantity == "Lu" else 0.01)

    @property
    def difference(self) -> float:
        """Relative difference from the published mean."""
        return self.found / self.published - 1


def canonical(problem: int, case: int, photons: int, engine: str = "auto") -> list[Canonical]:
    """Solve a canonical problem of Mobley et al. (1993) down to τ = 5."""
    b = 0.25 if case == 1 else 9.0
    published = canonical_values(problem, case)
    published = [row for row in published if row.depth * (1 + b) <= DEEPEST_TAU + 1e-9]
    depths = sorted({row.depth for row in published})
    floor = (4.0, 0.5) if problem == 6 else ()
    result = simulate(
        _column([500.0], (1.0, b), 60.0, 0.5, *floor),
        parse_phase(phase_of(problem)).for_bands([b]),
        depths,
        views=[(depth, (0.0, 0.0, -1.0)) for depth in depths],
        photons=photons,
        cone=5.0,
        engine=engine,
    )
    rows = []
    for row in published:
        estimate = getattr(result.total, "L" if row.quantity == "Lu" else row.quantity)
        at = depths.index(row.depth)
        found, error = estimate.mean[at, 0], estimate.error[at, 0] / row.mean
        printed = row.quantity, row.mean, row.scatter
        rows.append(Canonical(problem, case, row.depth * (1 + b), *printed, found, error))
    return rows


def _column(
    wavelengths: Sequence[float], ab: Sequence[ArrayLike], zenith: float, E_air: float,
    floor_depth: float = math.inf, floor_reflectance: float = 0.0,
) -> WaterColumn:  # fmt: skip
    """Under a flat surface, a sun in a black sky; ``ab`` are absorption and scattering."""
    entering = 1 - float(fresnel_reflectance(math.cos(math.radians(zenith)), INDEX))
    a, b, one = (np.broadcast_to(x, len(wavelengths)).astype(float) for x in (*ab, 1.0))
    return WaterColumn(
        bands=Bands(np.array(wavelengths), one),
        absorption=a,
        scattering=b,
        sun_irradiance=E_air * entering * one,
        sun_cosine=float(in_water_cosine(zenith, INDEX)),
        sun_direction=sun_travel_direction(zenith, 0.0, INDEX),
        sky_radiance=0.0 * one,
        floor_depth=floor_depth,
        floor_reflectance=floor_reflectance * one,
        surface="flat",
        refractive_index=INDEX,
    )


def _case(water: str, phase_name: str, r: float) -> tuple[WaterColumn, BandPhase, ClosedForm]:
    """Water over a floor at 8 m, and its closed form for the camera."""
    iops = Water.jerlov(water)
    a, b = iops.a(WAVELENGTHS), iops.b(WAVELENGTHS)
    column = _column(WAVELENGTHS, (a, b), 30.0, 1.0, FLOOR_DEPTH, r)
    phase = parse_phase(phase_name).for_bands(b)
    field = light_field_of(column, phase)
    return column, phase, solve_closed_form(field, phase, CAMERA, column.sun_direction)


def irradiances(photons: int, threads: int = 1) -> list[dict]:
    """Compare the irradiances of the closed form with the Monte Carlo, one row per number.

    A row has truth, value, and the standard error of the truth.
    """
    rows = []
    for water, phase_name, r in itertools.product(WATERS, PHASES, FLOORS):
        column, phase, closed = _case(water, phase_name, r)
        result = simulate(column, phase, DEPTHS, photons=photons, threads=threads)
        rows += [
            {"water": water, "phase": phase_name, "r": r, "quantity": quantity, "depth": depth}
            | row
            for quantity, (name, value) in QUANTITIES.items()
            for i, depth in enumerate(DEPTHS)
            for row in _rows(result, name, i, value(closed, depth))
        ]
    return rows


def _rows(result: MonteCarloResult, name: str, i: int, values: np.ndarray) -> list[dict]:
    estimate = getattr(result.total, name)
    return [
        {"truth": truth, "error": error, "value": value}
        for truth, error, value in zip(estimate.mean[i], estimate.error[i], values, strict=True)
    ]


def differences(rows: list[dict]) -> np.ndarray:
    """Relative differences of the closed form; no row is left out."""
    return np.array([abs(row["value"] / row["truth"] - 1) for row in rows])
