"""Random cases of the light field by discrete ordinates, and the closed form, by another solver."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import PhaseFunction
from ..uw_spectral.water.phase_functions import parse_phase
from . import discrete_ordinates_reference
from .closed_form.closed_form import solve_closed_form
from .closed_form.light_field import TwoStreamWater, solve_light_field

REFERENCE_STREAMS = 64


FROM_SUN = 10.0
"""Angle to the sun in degrees from which on radiances are compared."""


_SEED = 2


_PHASES = ("hg:0.8", "hg:0.924", "hg:0.95", "fournier-forand:1.10,0.0183", "petzold")


_WATERS = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")


_AZIMUTHS = (0.3, 1.4, 2.9)


_ELEVATIONS = 6


_FAINT = 1e-6  # of the sun's irradiance; below, errors are relative to this


@dataclass(frozen=True)
class Case:
    """One band of a water over a floor, and a camera; the surface is index-matched."""

    phase: str
    a: float
    b: float
    y: float
    mu_s: float
    floor: float
    reflectance: float

    @property
    def sun(self) -> tuple[float, float, float]:
        """Direction that the sunlight travels to."""
        return math.sqrt(1.0 - self.mu_s**2), 0.0, -self.mu_s


def cases(count: int) -> Iterator[Case]:
    """Random Jerlov waters, wavelengths, phase functions, depths, suns and floors."""
    random = np.random.default_rng(_SEED)
    for _ in range(count):
        water, nm = Water.jerlov(str(random.choice(_WATERS))), random.uniform(400, 700)
        y = math.exp(random.uniform(math.log(0.2), math.log(30.0)))
        yield Case(
            str(random.choice(_PHASES)), float(water.a([nm])[0]), float(water.b([nm])[0]), y,
            random.uniform(0.2, 0.999), y + random.uniform(1.0, 10.0),
            float(random.choice([0.0, 0.3])),
        )  # fmt: skip


def solve(case: Case, streams: int) -> SolvedField:
    """Solve a case by the project's discrete ordinates."""
    a, b = np.array([case.a]), np.array([case.b])
    layer = OpticalLayer(case.floor, a, b, parse_phase(case.phase).for_bands(b))
    return solve_discrete_ordinates(
        [layer], [1.0], case.sun, floor_reflectance=case.reflectance, streams=streams
    )


def errors(case: Case, *streams: int) -> dict[str, NDArray[np.float64]]:
    """Relative errors against PythonicDISORT by quantity, shape (values, models).

    The models are the solved field with numbers of streams, and the closed form last.
    """
    phase = parse_phase(case.phase)
    assert isinstance(phase, PhaseFunction), "the same in all bands"
    truth = discrete_ordinates_reference.reference(
        case.a, case.b, case.mu_s, case.floor, case.reflectance, phase, REFERENCE_STREAMS
    )
    bands = phase.for_bands([case.b])
    water = TwoStreamWater(case.a, case.b, bands.chi1, bands.chi2)
    light = solve_light_field(water, 1.0, case.mu_s, r=case.reflectance, y_f=case.floor)
    closed = solve_closed_form(light, bands, case.y, case.sun)
    fields = [solve(case, count) for count in streams]
    found = {
        name: np.array(
            [[float(np.squeeze(getattr(model, name)(case.y))) for model in (*fields, light)]]
        )
        for name in ("Ed", "Eu")
    }
    wanted = {name: float(np.squeeze(getattr(truth, name)(case.y))) for name in found}
    result = {
        name: np.abs(found[name] - wanted[name]) / max(wanted[name], _FAINT) for name in found
    }
    radiance = []
    random = np.random.default_rng(_SEED)
    for w_y in random.choice(truth.mu, _ELEVATIONS, replace=False):
        across = math.sqrt(1 - w_y**2)
        w = (-across * np.cos(_AZIMUTHS), -across * np.sin(_AZIMUTHS), np.full(3, -w_y))
        from_sun = np.degrees(np.arccos(np.clip(-np.array(case.sun) @ np.array(w), -1, 1)))
        seen = [field.radiance(case.y, w)[:, 0] for field in fields]
        seen.append(closed.radiance(case.y, tuple(part[:, None] for part in w))[:, 0])
        error = np.abs(np.array(seen) / truth.L([case.y], w_y, _AZIMUTHS)[0] - 1)
        radiance.append(error.T[from_sun > FROM_SUN])
    return result | {"L": np.concatenate(radiance)}
