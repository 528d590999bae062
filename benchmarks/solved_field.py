"""The light field solved by discrete ordinates, and the closed form, against another solver.

    python3 dev.py run -m benchmarks solved_field

writes docs/measured/solved_field.md; the tests use the same random cases.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.closed_form.closed_form import solve_closed_form
from ..uw_spectral.closed_form.light_field import solve_light_field
from ..uw_spectral.surface.refraction import sun_travel_direction
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.sky import Sky
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from . import path_radiance_table

CASES = 200
STREAMS = (8, 16, 24, 48)
REFERENCE_STREAMS = 64
FROM_SUN = 10.0
"""Angle to the sun in degrees from which on radiances are compared."""

RINGS = (0.3, 1.0, 2.0, 3.0, 5.0, 10.0, 12.0, 15.0)
"""Angles to the sun in degrees of the rings on which its aureole is compared."""
RING_STREAMS = 128

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
    truth = path_radiance_table.reference(
        case.a, case.b, case.mu_s, case.floor, case.reflectance, phase, REFERENCE_STREAMS
    )
    bands = phase.for_bands([case.b])
    light = solve_light_field(
        case.a, case.b, bands.chi1, bands.chi2, 1.0, case.mu_s, r=case.reflectance, y_f=case.floor
    )
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


def _accuracy() -> str:
    found: dict[str, list[NDArray[np.float64]]] = {"L": [], "Ed": [], "Eu": []}
    for case in cases(CASES):
        for name, values in errors(case, *STREAMS).items():
            found[name].append(values)
    all_errors = {name: 100 * np.concatenate(values) for name, values in found.items()}
    lines = ["| model | " + " | ".join(f"{n}, median/95 %/worst" for n in found) + " |",
             "|---" * (1 + len(found)) + "|"]  # fmt: skip
    for place, model in enumerate([*(f"{n} streams" for n in STREAMS), "closed form"]):
        cells = [
            "/".join(f"{np.quantile(values[:, place], q):.2g}" for q in (0.5, 0.95, 1.0))
            for values in all_errors.values()
        ]
        lines.append(f"| {model} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _aureole() -> str:
    worst = dict.fromkeys((24, 32), np.zeros(len(RINGS)))
    for water, nm, zenith in itertools.product(("IB", "II", "3C"), (480.0, 560.0), (10, 30, 60)):
        kind, bands = Water.jerlov(water), np.array([nm])
        a, b = kind.a(bands), kind.b(bands)
        phase = parse_phase("mixture").for_bands(b, molecular_scattering(bands))
        sun = sun_travel_direction(zenith, 0, 1.34)
        w = _rings(sun)
        true, *fields = (
            solve_discrete_ordinates([OpticalLayer(math.inf, a, b, phase)], [1.0], sun, streams=n)
            for n in (RING_STREAMS, *worst)
        )
        for y, (n, field) in itertools.product((1.0, 5.0, 15.0), zip(worst, fields, strict=True)):
            error = field.radiance(y, w).mean(axis=1) / true.radiance(y, w).mean(axis=1) - 1
            worst[n] = np.maximum(worst[n], 100 * np.abs(error[:, 0]))
    lines = ["| streams | " + " | ".join(f"{angle:g}°" for angle in RINGS) + " |",
             "|---" * (1 + len(RINGS)) + "|"]  # fmt: skip
    for n, errors in worst.items():
        lines.append(f"| {n} | " + " | ".join(f"{error:.2g}" for error in errors) + " |")
    return "\n".join(lines)


def _rings(sun: tuple[float, float, float]) -> tuple[NDArray[np.float64], ...]:
    """View directions, eight on each ring, of shape (rings, 8)."""
    to_sun, angle = -np.array(sun), np.radians(RINGS)[:, None, None]
    across = np.cross(to_sun, (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    turn = 2.0 * math.pi * (np.arange(8)[:, None] + 0.5) / 8
    aside = np.cos(turn) * across + np.sin(turn) * np.cross(to_sun, across)
    return tuple(np.moveaxis(np.cos(angle) * to_sun + np.sin(angle) * aside, -1, 0))


def _cost() -> str:
    nm = np.linspace(410.0, 690.0, 8)
    water = Water.jerlov("II")
    b = water.b(nm)
    layer = OpticalLayer(
        9.0, water.a(nm), b, parse_phase("mixture").for_bands(b, molecular_scattering(nm))
    )
    w = np.random.default_rng(0).normal(size=(3, 1152))
    rays = tuple(w / np.linalg.norm(w, axis=0))
    depths = np.random.default_rng(1).uniform(0.0, 9.0, 1152)
    grid = np.linspace(0.1, 8.9, 24), np.linspace(-0.99, 0.99, 48), np.linspace(0, math.pi, 32)
    lines = ["| streams | solve, ms | grid, ms | radiance at 1152 rays, ms |", "|---|---|---|---|"]
    for streams in STREAMS:
        times = []
        for _ in range(3):
            start = time.process_time()
            field = solve_discrete_ordinates(
                [layer], np.ones(8), sun_travel_direction(30, 0), refractive_index=1.34,
                sky=Sky.standard("clear", np.ones(8), sun_travel_direction(30, 0, 1.0)),
                floor_reflectance=0.2, streams=streams,
            )  # fmt: skip
            solved = time.process_time()
            field.scattered_on_grid(*grid)
            filled = time.process_time()
            field.scattered(depths, rays)
            times.append((solved - start, filled - solved, time.process_time() - filled))
        cells = " | ".join(f"{1e3 * each:.0f}" for each in np.min(times, axis=0))
        lines.append(f"| {streams} | {cells} |")
    return "\n".join(lines)


def main(_: list[str]) -> None:
    """Measure everything and write docs/measured/solved_field.md."""
    text = f"""# The light field, solved

`uw_spectral.transfer.discrete_ordinates` solves layered water with a refracting surface, sun and
sky, for all bands at once: read-outs of water in layers come from it with 16 streams, EEVEE's
tables with 24. Written by `python3 dev.py run -m benchmarks solved_field`.

## Against another solver
Relative errors in %, against PythonicDISORT ({REFERENCE_STREAMS} streams) on {CASES} random cases:
ten Jerlov types, five phase functions, sun at 2 to 78° in the water, camera at 0.2 to 30 m,
floors 1 to 10 m below it, index-matched surface, black sky; radiances more
than {FROM_SUN:g}° from the sun.

{_accuracy()}

Canonical problems of Mobley et al. (1993): [outside.md](outside.md#canonical-problems).

## Close to the sun
Delta-M takes light of the forward peak for direct: in 3C at 560 nm, 5 m, 68 % too bright at 1° and
16 % at 2°, which a factor mends (`aureole.aureole_factor`). Worst errors of means over rings in %,
against {RING_STREAMS} streams: IB, II and 3C, 480 and 560 nm, 1 to 15 m, sun at 10 to 60°.

{_aureole()}

## Limits
- A narrow peak backwards (`hg:-0.999`) rings, radiances may be below 0; `hg:0.99` and narrower
  leave ripples of some percent.
- The tables smooth level rays in clear, shallow water, and light within 10° of the sun by up to 7
  % in 3C at 5 m. Elsewhere they differ by less than 25 % of the brightest band's mean radiance
  there, in nine columns of ten by less than 10 %; nothing is promised below 1e-7 of the light
  that enters.
- A band that inelastic light outlives is up to 20 % off where the two meet.

## Cost
Eight bands, clear sky; CPU time of one process, minimum of three; the grid is 24 depths, 48
elevations, 32 azimuths.

{_cost()}
"""
    (path_radiance_table.ROOT / "docs" / "measured" / "solved_field.md").write_text(
        text, encoding="utf-8"
    )
    print(text)
