"""The canonical problems of C. D. Mobley et al., Appl. Opt. 32, 7484 (1993), solved.

Solved as the paper poses them; problem 4 leaves the atmosphere to each model, here it is
SPECTRL2's clear sky.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass

import numpy as np

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.spectrum import DATA_DIRECTORY
from ..uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from ..uw_spectral.surface.waves import slope_variance_CoxMunk1954
from ..uw_spectral.transfer.discrete_ordinates import (
    Emission,
    OpticalLayer,
    solve_discrete_ordinates,
)
from ..uw_spectral.transfer.inelastic_emission import inelastic_emission
from ..uw_spectral.transfer.rough_surface import WaterSurface
from ..uw_spectral.transfer.sky import BLACK, Sky
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.water.inelastic_processes import InelasticProcess
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import PetzoldAverage, Rayleigh, parse_phase
from .closed_form.internal_reflectance import diffuse_internal_reflectance
from .closed_form.light_field import LightField, TwoStreamWater, solve_light_field
from .sunlight import entering, sky_fraction

INDEX = 1.34
GREEN = Bands(np.array([500.0]), np.array([10.0]))
STREAMS = 32
WIND = 7.23
"""Of problem 5, m/s."""
PROBLEMS = ((1, 1), (1, 2), (2, 1), (2, 2), (3, 1), (4, 2), (5, 2), (6, 1), (7, 1))
"""Problem and case; case 1 absorbs (w0 = 0.2), case 2 scatters (w0 = 0.9)."""
LAYERS = np.arange(1.0, 71.0)
"""Lower ends of the layers that stand for the water of problem 3, m."""
RAMAN_BANDS = Bands(np.array([417.0]), np.ones(1)), Bands(np.array([486.0]), np.ones(1))
_NADIR = (0.0, 0.0, -1.0)


def phase_of(problem: int) -> str:
    """Phase function of problems 1, 2, 4, 5 and 6."""
    return "rayleigh" if problem == 1 else "petzold"


@dataclass(frozen=True)
class Published:
    """One published number: mean of the models that the paper compares, and deviation over it.

    ``depth`` is in m; ``quantity`` is ``Ed``, ``Eu``, ``Eou`` (upwelling scalar irradiance) or
    ``Lu`` (seen straight down).
    """

    depth: float
    quantity: str
    mean: float
    scatter: float

    def found(self, field: SolvedField) -> float:
        """Return the same of a solved field."""
        if self.quantity == "Lu":
            return float(field.radiance(self.depth, _NADIR)[0])
        if self.quantity == "Eou":
            _, up = field.stream_modes([self.depth], 1)
            return float(2.0 * math.pi * up[0, 0, 0] @ field.weights)
        return float(getattr(field, self.quantity)(self.depth)[0])


def canonical_values(problem: int, case: int) -> list[Published]:
    """Return what Tables 5 and 6 of the paper print of one problem."""
    with (DATA_DIRECTORY / "mobley1993_canonical.csv").open(encoding="utf-8") as file:
        return [
            Published(
                float(row["depth_m"]),
                row["quantity"],
                float(row["mean_of_models"]),
                float(row["std_over_mean"]),
            )
            for row in csv.DictReader(line for line in file if not line.startswith("#"))
            if (row["problem"], row["case"]) == (str(problem), str(case))
        ]


def canonical_field(problem: int, case: int, streams: int = STREAMS) -> SolvedField:
    """Solve a problem, for its mean over azimuth; the light of problem 7 is Raman light."""
    if problem == 3:
        return _solved(_peak_of_chlorophyll(), streams=streams)
    if problem == 7:
        return _raman(streams)
    b = 0.25 if case == 1 else 9.0
    phase = parse_phase(phase_of(problem)).for_bands([b])
    layer = OpticalLayer(4.0 if problem == 6 else math.inf, np.ones(1), np.array([b]), phase)
    return _solved(
        [layer], zenith=80.0 if problem == 5 else 60.0, wind=WIND if problem == 5 else 0.0,
        sky=float(sky_fraction(60.0, GREEN)[0]) if problem == 4 else 0.0,
        floor=0.5 if problem == 6 else 0.0, streams=streams,
    )  # fmt: skip


def closed_form(problem: int, case: int) -> LightField:
    """Two streams of problem 1, 2 or 6."""
    b = np.array([0.25 if case == 1 else 9.0])
    phase = parse_phase(phase_of(problem)).for_bands(b)
    bottom, floor = (4.0, 0.5) if problem == 6 else (math.inf, 0.0)
    return solve_light_field(
        TwoStreamWater(1.0, b, phase.chi1, phase.chi2), 0.5 * entering(60.0, INDEX),
        float(in_water_cosine(60.0, INDEX)), R=diffuse_internal_reflectance(INDEX),
        r=floor, y_f=bottom,
    )  # fmt: skip


def _solved(
    layers: list[OpticalLayer],
    *,
    zenith: float = 60.0,
    wind: float = 0.0,
    sky: float = 0.0,
    floor: float = 0.0,
    sun: float = 1.0,
    streams: int = STREAMS,
) -> SolvedField:
    """Solve layers below a surface; in air sun and sky, its fraction, bring cos(zenith)."""
    cosine = math.cos(math.radians(zenith))
    slopes = float(slope_variance_CoxMunk1954(wind).sum()) if wind else 0.0
    surface = WaterSurface(INDEX, slopes)
    enters = 1.0 - float(surface.reflectance(cosine))
    direct = sun * cosine * (1.0 - sky) * enters
    above = BLACK
    sun_in_air = sun_travel_direction(zenith, 0.0, 1.0)
    if sky:
        above = Sky.standard("clear", [sun * cosine * sky], sun_in_air.tolist())
    return solve_discrete_ordinates(
        layers, [direct], surface.beam_below(sun_in_air.tolist()).tolist(), sky=above,
        surface=surface, floor_reflectance=floor, streams=streams, modes=1,
    )  # fmt: skip


def _peak_of_chlorophyll() -> list[OpticalLayer]:
    """Water of problem 3: its Eqs. (6) to (8), in layers that are even inside."""
    edges = np.concatenate([[0.0], LAYERS])
    layers = []
    for top, bottom in zip(edges, LAYERS, strict=False):
        from_peak = ((top + bottom) / 2.0 - 17.0) / 9.0
        C = 0.2 + 144.0 / (9.0 * math.sqrt(2.0 * math.pi)) * math.exp(-(from_peak**2) / 2.0)
        a, b_w, b_p = 0.0257 + 0.04 * C**0.602, 0.0029, 0.33 * C**0.620
        fractions = np.array([[b_w], [b_p]]) / (b_w + b_p)
        phase = BandPhase((Rayleigh(), PetzoldAverage()), fractions)
        end = math.inf if bottom == LAYERS[-1] else bottom
        layers.append(OpticalLayer(end, np.array([a]), np.array([b_w + b_p]), phase))
    return layers


def _raman(streams: int) -> SolvedField:
    """Problem 7: every scattering at 417 nm shifts to 486 nm, its power with it."""

    def pure(a: float, b: float, emission: Emission | None = None) -> list[OpticalLayer]:
        return [
            OpticalLayer(
                math.inf,
                np.array([a]),
                np.array([b]),
                parse_phase("rayleigh").for_bands([b]),
                emission,
            )
        ]

    exciting = _solved(pure(0.0156, 0.0063), streams=streams)
    excitation, emission = RAMAN_BANDS
    keeps_power = emission.centres / excitation.centres
    process = InelasticProcess("raman", np.array([0.0063]), keeps_power[:, None], Rayleigh())
    emitted = inelastic_emission([process], exciting, excitation, emission)
    return _solved(pure(0.0188, 0.0032, emitted), sun=0.0, streams=streams)
